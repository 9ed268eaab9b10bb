// Implicit surfaces in a scene file: a mesh made into a potential, or a level set of a file.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "asperity/field/conversion/mesh_conversion.h"
#include "asperity/field/volume/material_brush.h"
#include "asperity/io/detail/scene_reader.h"
#include "asperity/io/sparse_io.h"
#include "asperity/render/law_registry.h"
#include "asperity/render/laws/magnetic.h"
#include "asperity/surface/implicit/texture.h"

namespace asperity {
namespace {

/// What the law reads of the potential besides its zero set (m): how far out, and how far in.
struct Reach {
  double outside = 0.0;
  double inside = 0.0;
};

Reach reach_of(const ImplicitFeel& feel, const DeviceProfile& device) {
  Reach reach;
  // The proxy needs the surface's neighbourhood alone; but what is compared is one potential under several laws.
  reach.outside = MagneticLaw{}.band;
  reach.outside = std::max(reach.outside, feel.law.outside().distance);
  // Laws without a proxy read the potential where the probe is: half as deep again as the device's force presses it in.
  constexpr double margin = 1.5;
  reach.inside = margin * device.max_force / feel.material.stiffness;
  return reach;
}

/// A length, or "all" for as far as the inside goes.
double read_band_inside(ObjectReader& reader, double fallback) {
  const SceneJson* value = reader.raw("band_inside");
  if (value == nullptr || *value != "all") return reader.find<double>("band_inside").value_or(fallback);
  reader.write("band_inside", "all");
  return infinity;
}

/// Voxel, resolution or budget; bands; rule.
ConversionSettings read_conversion(ObjectReader& reader, const Box& bounds, const Reach& reach) {
  ConversionSettings settings;
  const double longest = bounds.extent().maxCoeff();
  double voxel = longest / 64.0;  // of a budget nothing is known yet
  if (reader.has("voxel")) {
    settings.voxel = voxel = reader.get("voxel", 0.0);
  } else if (reader.has("budget")) {
    settings.budget_bytes = read_bytes(reader, "budget", 0);
  } else {
    settings.resolution = reader.get<std::uint32_t>("resolution");
    voxel = longest / settings.resolution;
  }
  constexpr double spare = 3.0;  // voxels that reconstruction and rounding need beyond what is read
  const double outside = reach.outside > 0.0 ? reach.outside + spare * voxel : 0.0;
  const double inside = reach.inside > 0.0 ? reach.inside + spare * voxel : 0.0;
  settings.band_outside = reader.find<double>("band_outside").value_or(outside);
  settings.band_inside = read_band_inside(reader, inside);
  reader.read_all(settings);
  settings.shell_thickness = reader.find<double>("shell_thickness").value_or(0.0);
  return settings;
}

struct Texture {
  PointHeight height;
  double highest = 0.0;     ///< bound (m)
  double wavelength = 0.0;  ///< m; 0: not stated
};

/// Noise. Nothing is read where there is no texture.
Result<Texture> read_noise(const SceneJson& json, ObjectReader& implicit) {
  ObjectReader reader(json, implicit.place_of("texture"), "implicit texture");
  const bool gaussian = reader.get<std::string>("type") == "gaussian";
  const auto amplitude = reader.get<double>("amplitude");
  const auto seed = reader.get<std::uint64_t>("seed");
  Texture texture;
  if (gaussian) {
    constexpr double cut = 3.0;  // gaussian_noise cuts its deviates there
    texture.highest = cut * amplitude;
    texture.height = gaussian_noise(amplitude, seed);
  } else {
    texture.highest = amplitude;
    texture.wavelength = reader.get<double>("wavelength");
    texture.height = gradient_noise(amplitude, texture.wavelength, seed);
  }
  ASPERITY_CHECK(reader.status());
  implicit.take("texture", std::move(reader));
  return texture;
}

Result<std::vector<MaterialBrush>> read_brushes(const SceneJson* json, ObjectReader& implicit) {
  std::vector<MaterialBrush> brushes;
  if (json == nullptr) return brushes;
  SceneJson canonical = SceneJson::array();
  for (std::size_t i = 0; i < json->size(); ++i) {
    ObjectReader reader((*json)[i], implicit.place_of("materials", i), "material brush");
    MaterialBrush brush;
    brush.centre = reader.get("centre", brush.centre);
    brush.radius = reader.get<double>("radius");
    brush.falloff = reader.get<double>("falloff");
    if (!(brush.falloff <= brush.radius))
      reader.fail("falloff", fmt::format("is {:.6g}", brush.falloff),
                  fmt::format("a number 0 to {:.4g} (m)", brush.radius));
    const auto channel = [&](const char* key, float& value) {
      if (const auto given = reader.find<double>(key)) value = static_cast<float>(*given);
    };
    channel("stiffness", brush.material.stiffness);
    channel("damping", brush.material.damping);
    channel("static_friction", brush.material.static_friction);
    channel("dynamic_friction", brush.material.dynamic_friction);
    channel("roughness", brush.material.roughness);
    ASPERITY_CHECK(reader.status());
    canonical.push_back(reader.canonical());
    brushes.push_back(brush);
  }
  implicit.write("materials", std::move(canonical));
  return brushes;
}

/// A file's potential in metres, placed as its mesh is.
void place_source(SparseSource& source, double scale, const Vec3& centre) {
  source.voxel *= scale;
  source.origin = scale * (source.origin - centre);
  source.outside *= scale;
  source.inside *= scale;
  for (SparseBlock& block : source.blocks) {
    for (float& value : block.value) value = static_cast<float>(scale * static_cast<double>(value));
  }
}

/// Bounds of the inside, by what each point within says of its surroundings: what a level set without a mesh is fitted
/// by.
Box solid_bounds(const SparseSource& source) {
  Box box;
  for (const SparseBlock& block : source.blocks) {
    for (int k = 0; k < SparseBlock::side; ++k) {
      for (int j = 0; j < SparseBlock::side; ++j) {
        for (int i = 0; i < SparseBlock::side; ++i) {
          const auto value = static_cast<double>(block.value[SparseBlock::index(i, j, k)]);
          if (value > 0.0) continue;
          const Vec3 node(SparseBlock::side * block.at[0] + i, SparseBlock::side * block.at[1] + j,
                          SparseBlock::side * block.at[2] + k);
          const Vec3 p = source.origin + source.voxel * node;
          box.include(p + Vec3::Constant(value));
          box.include(p - Vec3::Constant(value));
        }
      }
    }
  }
  return box;
}

/// Reads one implicit surface.
class ImplicitReader {
 public:
  ImplicitReader(ObjectReader& surface, ObjectReader& reader, const ImplicitFeel& feel, SceneContext& context)
      : surface_(surface), reader_(reader), feel_(feel), context_(context) {}

  Status read(Instance& instance) {
    if (surface_.has("mesh")) ASPERITY_CHECK(read_mesh());
    const std::string file = reader_.find<std::string>("file").value_or("");
    const SceneJson* noise = reader_.raw("texture");
    Texture texture;
    if (noise != nullptr && coat_) reader_.refuse({"texture"}, "beside a coat, which is the texture then");
    ASPERITY_CHECK(reader_.status());
    if (noise != nullptr) {
      ASPERITY_TRY(texture, read_noise(*noise, reader_));
    }
    if (coat_) texture = {coat_height(*coat_, mesh_->mesh()), coat_->amplitude_bound()};
    if (!texture.height) reader_.refuse({"redistance"}, "without a texture or a coat");
    parts_.offset = reader_.get<double>("offset");
    parts_.reconstruction = reader_.get<CellReconstruction>("reconstruction");
    ASPERITY_TRY(const std::vector<MaterialBrush> brushes, read_brushes(reader_.raw("materials"), reader_));
    for (std::size_t i = 0; i < brushes.size() && !texture.height; ++i) {
      if (std::isnan(brushes[i].material.roughness)) continue;
      reader_.fail(fmt::format("materials[{}].roughness", i), "multiplies a texture, and there is none",
                   "a \"texture\" or a coat beside it");
    }
    ASPERITY_CHECK(reader_.status());
    ASPERITY_CHECK(file.empty() ? convert(texture.highest) : load(file));
    if (!brushes.empty()) ASPERITY_CHECK(paint(brushes));
    shortest_ = texture.wavelength;
    if (texture.height) ASPERITY_CHECK(lay_texture(texture.height));
    instance.name = surface_.get("name", name_);
    instance.sides = surface_.get<std::optional<Sides>>("sides");
    ASPERITY_CHECK(surface_.status());
    parts_.mesh = mesh_;
    ASPERITY_TRY(ImplicitSurface built, placed(ImplicitSurface::build(std::move(parts_))));
    note_limits(built, instance.sides.value_or(Sides::front));
    instance.surface = std::make_shared<const ImplicitSurface>(std::move(built));
    surface_.take("implicit", std::move(reader_));
    return success();
  }

 private:
  /// The same, an error by the key that a scene writes.
  template <class T>
  Result<T> placed(Result<T> result) const {
    if (result) return result;
    std::string& place = result.error().place;
    if (place == "implicit") place.clear();
    if (place.starts_with('[')) place.insert(0, "materials");
    return at_place(std::move(result), surface_.place_of("implicit"));
  }
  void note(const std::string& text) { context_.note(fmt::format("implicit \"{}\": {}", name_, text)); }

  /// What the law will not feel of it.
  void note_limits(const ImplicitSurface& surface, Sides sides) {
    if (feel_.law.constrains()) return;
    const double depth = context_.device.max_force / feel_.material.stiffness;
    if (surface.trusted_depth() < depth) {
      note(
          fmt::format("stored {} inside: the force of \"{}\" no longer rises from {} on, and {} presses {} deep "
                      "(band_inside; --band-inside of asperity convert)",
                      format_length(-surface.grid().inside()), law_name(feel_.law),
                      format_length(surface.trusted_depth()), context_.device.name, format_length(depth)));
    }
    if (sides == Sides::both) note(fmt::format("\"{}\" is felt from the front alone", law_name(feel_.law)));
  }

  Status read_mesh() {
    ASPERITY_TRY(MeshPart part, read_mesh_part(surface_, context_));
    name_ = part.name;
    scale_ = part.scale;
    centre_ = part.centre;
    turned_ = part.turned;
    ASPERITY_TRY(TriangleMesh mesh, build_mesh(std::move(part), surface_, context_));
    if (context_.progress) context_.progress("building the search structure", 0.0);
    mesh_ = std::make_shared<const MeshSurface>(TriangleIndex::build(std::move(mesh)));
    if (const SceneJson* json = surface_.raw("coat")) {
      const std::string place = surface_.place_of("coat");
      ASPERITY_TRY(ScenePart<CoatSource> read, read_coat(*json, place, mesh_->mesh(), context_));
      ASPERITY_TRY(Coat coat,
                   at_place(Coat::build(mesh_->mesh(), std::move(read.value.parts), read.value.settings), place));
      surface_.write("coat", std::move(read.canonical));
      coat_ = std::make_unique<Coat>(std::move(coat));
    }
    return success();
  }

  Status convert(double texture) {
    Reach reach = reach_of(feel_, context_.device);
    // A proxy's ball lies on the surface; other laws read the potential where its middle is.
    reach.outside +=
        feel_.law.constrains() ? std::max(parts_.offset, feel_.probe_radius) : parts_.offset + feel_.probe_radius;
    reach.outside += texture;
    reach.inside += texture;
    const Box& bounds = mesh_->mesh().bounds();
    const double largest = bounds.extent().maxCoeff();
    if (texture > largest && !coat_)
      reader_.fail("texture.amplitude", "reaches " + format_length(texture) + ", farther than the mesh is large",
                   "at most " + format_length(largest));
    ASPERITY_CHECK(reader_.status());
    const ConversionSettings settings = read_conversion(reader_, bounds, reach);
    ASPERITY_CHECK(reader_.status());
    ASPERITY_TRY(ConvertedMesh converted, placed(convert_mesh(mesh_->index(), settings, context_.progress)));
    const ConversionReport& report = converted.report;
    for (const std::string& text : report.notes) note(text);
    if (feel_.probe_radius > 0.0 && !feel_.law.constrains()) {
      note(fmt::format("stored {} outside, {} of that for the probe's ball: {:.1f} MB",
                       format_length(converted.grid.outside()), format_length(feel_.probe_radius),
                       1e-6 * static_cast<double>(converted.grid.memory_bytes())));
    }
    // A budget is met by a voxel, which then stands for it.
    // In one order, whether they were given or chosen.
    for (const char* key : {"budget", "band_outside", "band_inside", "inside", "shell_thickness"})
      reader_.canonical().erase(key);
    if (settings.budget_bytes > 0) reader_.write("voxel", report.voxel);
    reader_.write("band_outside", converted.grid.outside());
    const bool all = !std::isfinite(settings.band_inside);
    reader_.write("band_inside", all ? SceneJson("all") : SceneJson(-converted.grid.inside()));
    reader_.write("inside", to_string(report.rule));
    if (report.rule == InsideRule::shell) reader_.write("shell_thickness", report.shell_thickness);
    parts_.shell_thickness = report.shell_thickness;
    parts_.grid = std::make_shared<const SparseGrid>(std::move(converted.grid));
    return success();
  }

  Status load(const std::string& file) {
    if (turned_) surface_.fail("up", "turns the mesh and not the .vdb file", "y beside implicit.file");
    const std::string grid = reader_.get("grid", std::string());
    ASPERITY_CHECK(reader_.status());
    ASPERITY_CHECK(surface_.status());
    const std::filesystem::path path = context_.resolve(file);
    reader_.write("file", path.string());
    ASPERITY_TRY(SparseFile read, in_file(read_sparse(path, {grid}, context_.progress), path.string()));
    if (name_.empty()) name_ = path.stem().string();
    for (const std::string& text : read.notes) note(text);
    reader_.write("grid", read.grid);
    if (mesh_ == nullptr) {
      const bool stated = surface_.has("units") || surface_.has("fit");
      const double unit = read_units(surface_, true);
      const double size = read_fit(surface_, !stated, context_);
      ASPERITY_CHECK(surface_.status());
      const Box bounds = solid_bounds(read.source);
      const double largest = bounds.empty() ? 0.0 : unit * bounds.extent().maxCoeff();
      const bool fitted = size > 0.0 && largest > 0.0;
      scale_ = unit * (fitted ? size / largest : 1.0);
      if (fitted) centre_ = bounds.centre();
      if (fitted && !stated) {
        note(fmt::format("scaled by {:.4g} to a largest side of {} (\"units\" or \"fit\" choose otherwise)", scale_,
                         format_length(size)));
      }
    } else if (read.has_faces && read.mesh_faces != mesh_->mesh().triangles().size()) {
      return Error{ErrorCode::mismatch,
                   fmt::format("was made from a mesh of {} triangles, and \"{}\" has {}", read.mesh_faces, name_,
                               mesh_->mesh().triangles().size()),
                   path.string(), reader_.place_of("file"), "the mesh that it was made from"};
    }
    place_source(read.source, scale_, centre_);
    ASPERITY_TRY(SparseGrid built, in_file(SparseGrid::build(std::move(read.source)), path.string()));
    parts_.grid = std::make_shared<const SparseGrid>(std::move(built));
    return success();
  }

  Status paint(const std::vector<MaterialBrush>& brushes) {
    const Material& own = feel_.material;
    PointMaterial point;
    point.stiffness = static_cast<float>(own.stiffness);
    point.damping = static_cast<float>(own.damping);
    point.static_friction = static_cast<float>(own.static_friction);
    point.dynamic_friction = static_cast<float>(own.dynamic_friction);
    point.roughness = 1.0F;
    ASPERITY_TRY(SparseGrid grid, placed(painted(*parts_.grid, brushes, point)));
    parts_.grid = std::make_shared<const SparseGrid>(std::move(grid));
    return success();
  }

  Status lay_texture(const PointHeight& height) {
    const auto mode = reader_.get<Redistancing>("redistance");
    ASPERITY_CHECK(reader_.status());
    if (context_.progress) context_.progress("laying the texture", 0.0);
    ASPERITY_TRY(TexturedPotential result, placed(textured(*parts_.grid, height, mode, context_.progress)));
    note(fmt::format("texture of {} to {}; {}: the potential is off a distance by at most {}, {} rms (before: {}, {})",
                     format_length(result.lowest), format_length(result.highest), to_string(mode),
                     format_length(result.largest_error), format_length(result.rms_error),
                     format_length(result.largest_error_before), format_length(result.rms_error_before)));
    if (shortest_ > 0.0 && shortest_ < 6.0 * parts_.grid->voxel()) {
      note(fmt::format("a wavelength of {} is under six voxels of {}: it is felt weaker than asked for",
                       format_length(shortest_), format_length(parts_.grid->voxel())));
    }
    parts_.untextured = parts_.grid;
    parts_.grid = std::make_shared<const SparseGrid>(std::move(result.grid));
    return success();
  }

  ObjectReader& surface_;
  ObjectReader& reader_;
  const ImplicitFeel& feel_;
  SceneContext& context_;
  std::string name_;
  std::shared_ptr<const MeshSurface> mesh_;
  std::unique_ptr<Coat> coat_;
  double scale_ = 1.0;
  Vec3 centre_ = Vec3::Zero();
  bool turned_ = false;
  double shortest_ = 0.0;  ///< wavelength of the texture (m)
  ImplicitParts parts_;
};

}  // namespace

Status read_implicit(ObjectReader& surface, const ImplicitFeel& feel, SceneContext& context, Instance& instance) {
  ObjectReader reader(*surface.raw("implicit"), surface.place_of("implicit"), "implicit");
  ASPERITY_CHECK(reader.status());
  return ImplicitReader(surface, reader, feel, context).read(instance);
}

}  // namespace asperity
