// What the materials of a glTF file say about touch, as a coat.

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "asperity/io/detail/scene_layers.h"
#include "asperity/io/gltf_material.h"

namespace asperity {
namespace {

/// A material's heights and normals; flat where it has none.
Result<Mesostructure> mesostructure_of(GltfMaterial material, double unit, double scale, SceneContext& context) {
  // Heights belong to the model, and are scaled with it.
  if (material.height) {
    material.height->amplitude *= scale;
    material.height->offset *= scale;
  }
  const Wrap wrap = material.height    ? material.height->texture.wrap
                    : material.normals ? material.normals->texture.wrap
                                       : Wrap::repeat;
  ASPERITY_TRY(HeightMap heights, material.height ? height_map_of(*material.height, Reconstruction::quadratic_bspline)
                                                  : HeightMap::build(std::vector<float>(16, 0.0F), 4, 4, wrap,
                                                                     Reconstruction::quadratic_bspline));
  const Vec2 tile(unit, unit);
  if (!material.normals) return Mesostructure::build(std::move(heights), tile);
  ASPERITY_TRY(const Image image, normal_image_of(*material.normals));
  ASPERITY_TRY(NormalMap normals, NormalMap::build(image, {GreenConvention::up, wrap, NormalFilter::bilinear}));
  if (material.normals->texture.wrap != wrap)
    context.note(fmt::format("glTF material \"{}\": its normals are wrapped as its heights are", material.name));
  return Mesostructure::build(std::move(heights), std::move(normals), tile);
}

/// Stiffness and friction maps of the one material of a mesh.
Result<std::shared_ptr<const MaterialMaps>> maps_of(const GltfMaterial& material, const Material& own) {
  MaterialMaps::Parts parts;
  const auto take = [&](const GltfValueMap& map, MaterialChannel channel, double unit) -> Status {
    const double black = map.stated ? map.black / unit : 0.0;
    const double white = map.stated ? map.white / unit : 1.0;
    const double scale = channel == MaterialChannel::stiffness && !map.stated ? own.stiffness : 1.0;
    // A spring of no stiffness at all is none.
    const double least = channel == MaterialChannel::stiffness ? 1e-3 * own.stiffness : 0.0;
    const double low = std::max(least, scale * std::min(black, white));
    const double high = std::max(low, scale * std::max(black, white));
    const HeightMapSettings settings{high - low, white < black ? high : low, white < black, map.texture.wrap,
                                     Reconstruction::bilinear};
    ASPERITY_TRY(HeightMap values, HeightMap::build(*map.texture.image, Channel::automatic, settings));
    parts.channels[static_cast<std::size_t>(channel)] = std::make_shared<const HeightMap>(std::move(values));
    return success();
  };
  if (material.stiffness) ASPERITY_CHECK(take(*material.stiffness, MaterialChannel::stiffness, 1.0));
  // A map of coefficients stands over the surface's own: as factors.
  if (material.friction && own.static_friction > 0.0)
    ASPERITY_CHECK(take(*material.friction, MaterialChannel::friction, own.static_friction));
  if (!material.stiffness && parts.channels[static_cast<std::size_t>(MaterialChannel::friction)] == nullptr)
    return std::shared_ptr<const MaterialMaps>();
  ASPERITY_TRY(MaterialMaps maps, MaterialMaps::build(std::move(parts)));
  return std::make_shared<const MaterialMaps>(std::move(maps));
}

}  // namespace

bool has_gltf_materials(const std::filesystem::path& path) {
  if (!is_gltf_path(path)) return false;
  const Result<GltfModel> model = read_gltf_model(path);
  return model && std::any_of(model->materials.begin(), model->materials.end(),
                              [](const GltfMaterial& material) { return material.felt(); });
}

Result<CoatSource> gltf_coat(const std::filesystem::path& path, const MeshSource& source, const TriangleMesh& mesh,
                             const Material& own, const Stitching& stitching, double scale, SceneContext& context) {
  if (context.progress) context.progress("reading the materials of the glTF file", 0.0);
  ASPERITY_TRY(const GltfModel model, read_gltf_model(path));
  ASPERITY_TRY(const std::vector<std::uint32_t> from, source_of_faces(source, mesh));
  const std::size_t count = model.materials.size();
  if (count == 0) {
    return refused_file(ErrorCode::mismatch, "has no material", path.string(),
                        "a glTF file with materials, or height_map");
  }
  if (count > std::numeric_limits<std::uint8_t>::max())
    return refused_file(ErrorCode::too_large, fmt::format("has {} materials", count), path.string(), "at most 255");
  CoatParts parts;
  for (const GltfMaterial& material : model.materials) {
    ASPERITY_TRY(Mesostructure maps,
                 in_file(mesostructure_of(material, texture_unit(mesh), scale, context), path.string()));
    parts.maps.push_back(std::make_shared<const Mesostructure>(std::move(maps)));
  }
  const bool one = parts.maps.size() == 1;
  if (!one) {
    for (const std::uint32_t triangle : from)
      parts.map_of_face.push_back(static_cast<std::uint8_t>(model.material_of_triangle[triangle]));
  }
  const auto counted = [&](const auto& have) { return std::ranges::count_if(model.materials, have); };
  const bool haptic = counted([](const GltfMaterial& material) { return material.stiffness || material.friction; }) > 0;
  if (haptic && one) {
    ASPERITY_TRY(parts.materials, maps_of(model.materials.front(), own));
    if (model.materials.front().friction && own.static_friction == 0.0)
      context.note("glTF material: its friction map is felt where the surface has a static_friction above 0");
  } else if (haptic) {
    context.note(
        fmt::format("glTF: maps of stiffness and friction are felt where a mesh has one material, and it has {}: they "
                    "are left out",
                    count));
  }
  CoatSettings settings;
  settings.mapping = Mapping::uv;
  settings.stitching = stitching;
  const auto heights = counted([](const GltfMaterial& material) { return material.height.has_value(); });
  const auto normals = counted([](const GltfMaterial& material) { return material.normals.has_value(); });
  context.note(fmt::format("coat: {} materials of the glTF file, {} with heights, {} with normals{}", count, heights,
                           normals,
                           heights == 0 ? " (felt by the law \"force-shading\"; the proxy feels the geometry)" : ""));
  if (heights > 0 && scale != 1.0)
    context.note(fmt::format("coat: heights are scaled with the model, by {:.4g}", scale));
  return CoatSource{std::move(parts), settings};
}

}  // namespace asperity
