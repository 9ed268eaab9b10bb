// One surface of a scene file: mesh and coat, or volume; law, material, place.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "asperity/io/detail/scene_custom.h"
#include "asperity/io/detail/scene_fine.h"
#include "asperity/io/detail/scene_layers.h"
#include "asperity/io/gltf_material.h"
#include "asperity/render/law_registry.h"
#include "asperity/surface/relief/closing.h"

namespace asperity {
namespace {

constexpr double preferred_stiffness = 1000.0;  // N/m: the papers' 1 N/mm

struct MaterialPart {
  Material material;
  FinePart fine;
};

Result<MaterialPart> read_material(ObjectReader& surface, SceneContext& context) {
  ObjectReader reader(surface.raw("material"), surface.place_of("material"), "material");
  const DeviceProfile& device = context.device;
  MaterialPart part;
  Material& material = part.material;
  material.stiffness = std::min(preferred_stiffness, device.max_stiffness);
  reader.read_all(material);
  // Sliding holds less than sticking: without a number of its own, four fifths of it.
  material.dynamic_friction = reader.get("dynamic_friction", 0.8 * material.static_friction);
  ASPERITY_TRY(part.fine, read_friction(reader, context, material));
  ASPERITY_CHECK(at_place(validate(material), reader.place()));
  if (material.stiffness > device.max_stiffness) {
    context.note(
        fmt::format("material: a stiffness of {:g} N/m is more than the {:g} N/m that {} renders without buzzing",
                    material.stiffness, device.max_stiffness, device.name));
  }
  surface.take("material", std::move(reader));
  return part;
}

/// The relief, with a note on what building it had to change. `place`: of what it is made from.
Result<Surface> build_relief(MeshSurface base, CoatSource coat, ObjectReader& surface, SceneContext& context,
                             const std::string& name, const std::string& place) {
  ReliefSettings settings;
  surface.read_all(settings);
  ASPERITY_CHECK(surface.status());
  if (context.progress) context.progress("fitting the relief", 0.0);
  ASPERITY_TRY(auto relief,
               at_place(make_relief(std::move(base), std::move(coat.parts), coat.settings, settings), place));
  if (const std::string advice = relief->report().advice(); !advice.empty())
    context.note(fmt::format("coat on \"{}\": {}", name, advice));
  return Surface(std::move(relief));
}

/// Closes a relief as the coat's `closing` says, and answers that in its canonical copy. What the closed one cannot
/// carry over is refused.
Result<SceneJson> close(Instance& instance, const SceneJson& json, const std::string& place, SceneContext& context) {
  ObjectReader reader(json, place, "closing");
  ClosingSettings settings;
  reader.read_all(settings);
  ASPERITY_CHECK(reader.status());
  const auto before = *std::get_if<std::shared_ptr<const ReliefSurface>>(&instance.surface);
  const ReliefSurface& relief = *before;
  const Coat& worn = relief.coat();
  const char* lost = worn.moves() ? "a layer that changes with time, which would have to be closed anew "
                                    "at every moment"
                     : worn.materials() != nullptr ? "maps of the material, laid by coordinates that it gives up"
                                                   : nullptr;
  if (lost != nullptr) {
    return refused(ErrorCode::mismatch, fmt::format("is baked into heights and normals, and the coat has {}", lost),
                   place, "a coat that is still and of one material, or no closing");
  }
  ASPERITY_TRY(ClosedRelief baked, at_place(close_relief(relief, settings, context.progress), place));
  ASPERITY_TRY(instance.surface, at_place(wear_closed(relief, baked), place));
  context.note(fmt::format("coat on \"{}\": {}", instance.name, baked.report.summary()));
  instance.closed_from = std::make_shared<const ClosedFrom>(ClosedFrom{before, std::move(baked)});
  return std::move(reader.canonical());
}

/// The coat that the materials of a glTF file make. `json` may be nullptr.
Result<ScenePart<CoatSource>> read_gltf_coat(const SceneJson* json, const std::string& place,
                                             const std::filesystem::path& path, const MeshSource& source,
                                             const TriangleMesh& mesh, const Material& own, double scale,
                                             SceneContext& context) {
  static const SceneJson by_default = SceneJson{{"from", "gltf"}};
  ObjectReader reader(json != nullptr ? *json : by_default, place, "coat");
  reader.write("from", "gltf");
  Stitching stitching;
  if (const SceneJson* given = reader.raw("stitching")) {
    ASPERITY_TRY(stitching, read_stitching(*given, reader.place_of("stitching"), context, reader));
  }
  ASPERITY_CHECK(reader.status());
  ASPERITY_TRY(CoatSource coat, at_place(gltf_coat(path, source, mesh, own, stitching, scale, context), place));
  return ScenePart<CoatSource>{std::move(coat), std::move(reader.canonical())};
}

/// What becomes of a normal map that a coat is given beside its heights.
void note_normal_map(const Law& law, const Coat& coat, const std::string& name, SceneContext& context) {
  NormalMapUse use = NormalMapUse::ignored;
  if (const auto* proxy = law.as<ProxyLaw>()) use = proxy->normal_map;
  if (const auto* height_field = law.as<HeightFieldLaw>()) use = height_field->normal_map;
  if (const auto* mesostructure = law.as<MesostructureLaw>()) use = mesostructure->normal_map;
  const bool flat = coat.lowest() == coat.highest();
  const bool by_itself = law.facts().coat == LawCoat::directions || law.formulation() == Formulation::literal;
  if (by_itself) return;
  const bool felt = use == NormalMapUse::felt || (use == NormalMapUse::automatic && flat);
  context.note(fmt::format("coat on \"{}\": its normal map {} by the law \"{}\"{}", name,
                           felt ? "bends the force" : "is not felt", law_name(law),
                           felt || law.facts().coat != LawCoat::moment
                               ? ""
                               : ", whose directions are the heights' own (\"normal_map\": \"felt\" in the law chooses "
                                 "otherwise)"));
}

/// What can be touched, of triangles: mesh, sides, coat, features that are geometry.
Status read_triangles(ObjectReader& reader, const Law& law, const Material& own, SceneContext& context,
                      Instance& instance, TexturePart& texture) {
  ASPERITY_TRY(MeshPart part, read_mesh_part(reader, context));
  instance.name = reader.get("name", part.name);
  const auto search = reader.get<SearchStructure>("search");
  if (context.progress) context.progress("building the search structure", 0.0);
  const SceneJson* coat_json = reader.raw("coat");
  const std::filesystem::path file =
      part.from_file ? context.resolve(reader.raw("mesh")->get<std::string>()) : std::filesystem::path();
  const bool says = coat_json != nullptr && coat_json->contains("from");
  if (says && !is_gltf_path(file)) {
    reader.fail("coat.from", "is \"gltf\", and the mesh is no glTF file", "a mesh that is one, or height_map");
    return reader.status();
  }
  const bool gltf = says || (coat_json == nullptr && !reader.has("texture") && has_gltf_materials(file));
  const MeshSource source = gltf ? part.source : MeshSource{};
  const double scale = part.scale;
  ASPERITY_TRY(TriangleMesh mesh, build_mesh(std::move(part), reader, context));
  const TextureHost host{instance.name, mesh.bounds(), &mesh, nullptr, coat_json == nullptr ? "" : "a coated mesh"};
  ASPERITY_TRY(texture, read_texture(reader, host, law, context));
  std::shared_ptr<const Mesostructure> baked;
  if (!texture.geometry.empty()) {
    ASPERITY_TRY(BakedFeatures features,
                 bake_features(mesh, texture.geometry, texture.fine.mapping, reader.place_of("texture.features")));
    mesh = std::move(features.mesh);
    baked = std::move(features.maps);
  }
  MeshSurface base(TriangleIndex::build(std::move(mesh), search));
  instance.sides = reader.get<std::optional<Sides>>("sides");
  if (!instance.sides && base.natural_sides() == Sides::both) {
    context.note(
        fmt::format("mesh \"{}\" is not closed and consistently oriented: it is touched from both sides (\"sides\" "
                    "chooses otherwise)",
                    instance.name));
  }
  if (baked != nullptr) {
    const std::string place = reader.place_of("texture.features");
    CoatSource coat;
    coat.parts.maps.push_back(std::move(baked));
    Result<Surface> relief = build_relief(std::move(base), std::move(coat), reader, context, instance.name, place);
    if (!relief) {
      if (relief.error().place != place + ".mapping") return std::move(relief).error();
      // The coat lies by coordinates that were made from the mapping, which is what the scene says.
      return refused(ErrorCode::mismatch,
                     fmt::format("is \"{}\", seen from which the surface spans no area in the plane of the features",
                                 to_string(texture.fine.mapping.settings().surface)),
                     reader.place_of("texture.mapping.surface"),
                     "another mapping (\"plane\" for a sheet) or another \"axis\" or \"origin\" of it; \"as\": "
                     "\"texture\" needs no area");
    }
    instance.surface = std::move(*relief);
    return success();
  }
  if (coat_json == nullptr && !gltf) {
    reader.refuse({"on_overlap", "shell_directions"}, "without a coat");
    instance.surface = std::make_shared<const MeshSurface>(std::move(base));
    return reader.status();
  }
  const std::string place = reader.place_of("coat");
  ASPERITY_TRY(ScenePart<CoatSource> coat,
               gltf ? read_gltf_coat(coat_json, place, file, source, base.mesh(), own, scale, context)
                    : read_coat(*coat_json, place, base.mesh(), context));
  ASPERITY_TRY(instance.surface,
               build_relief(std::move(base), std::move(coat.value), reader, context, instance.name, place));
  const Coat& worn = (*std::get_if<std::shared_ptr<const ReliefSurface>>(&instance.surface))->coat();
  if (worn.maps().has_normal_map() && (gltf || coat_json->contains("normal_map")))
    note_normal_map(law, worn, instance.name, context);
  if (coat_json != nullptr && coat_json->contains("closing")) {
    ASPERITY_TRY(coat.canonical["closing"], close(instance, (*coat_json)["closing"], place + ".closing", context));
  }
  reader.write("coat", std::move(coat.canonical));
  return success();
}

/// What can be touched, of a volume: an isosurface, from either side unless the scene says otherwise.
Status read_isosurface(ObjectReader& reader, SceneContext& context, Instance& instance) {
  ASPERITY_TRY(const VolumePart volume, read_volume_part(reader, context));
  instance.name = reader.get("name", volume.name);
  instance.sides = reader.get<std::optional<Sides>>("sides");
  ASPERITY_TRY(std::shared_ptr<const IsoSurface> surface, read_iso(reader, volume, context));
  instance.surface = std::move(surface);
  return success();
}

/// A shape's own axis `up` turned to +y before its pose.
Pose upright(const Pose& pose, std::size_t up) {
  Mat3 turn;
  turn << turned_up(Vec3::UnitX(), up), turned_up(Vec3::UnitY(), up), turned_up(Vec3::UnitZ(), up);
  return {pose.position, (pose.orientation * Quat(turn)).normalized()};
}

}  // namespace

Result<TriangleMesh> build_mesh(MeshPart part, const ObjectReader& surface, SceneContext& context) {
  const SceneJson* key = surface.raw("mesh");
  const std::string file = part.from_file ? context.resolve(key->get<std::string>()).string() : std::string();
  ASPERITY_TRY(TriangleMesh mesh, in_file(TriangleMesh::build(std::move(part.source)), file, surface.place_of("mesh")));
  for (const std::string& note : mesh.notes()) context.note(fmt::format("mesh \"{}\": {}", part.name, note));
  return mesh;
}

Result<Pose> read_pose(ObjectReader& surface) {
  ObjectReader reader(surface.raw("pose"), surface.place_of("pose"), "pose");
  Pose pose;
  pose.position = reader.get<Vec3>("position");
  if (reader.has("orientation")) {
    const auto q = reader.get<std::vector<double>>("orientation");
    pose.orientation = Quat(q[0], q[1], q[2], q[3]);
    const double norm = pose.orientation.norm();
    if (!(norm > 1e-6 && norm < 1e6)) reader.fail("orientation", "is no rotation", "a quaternion [w, x, y, z]");
    // Written and read again, an orientation keeps its bits.
    if (std::abs(norm - 1.0) > 1e-12) pose.orientation.normalize();
  } else {
    pose.orientation = read_turn(reader);
  }
  ASPERITY_CHECK(reader.status());
  const Quat& q = pose.orientation;
  SceneJson canonical = SceneJson::object();
  canonical["position"] = {pose.position.x(), pose.position.y(), pose.position.z()};
  canonical["orientation"] = {q.w(), q.x(), q.y(), q.z()};
  surface.write("pose", std::move(canonical));
  return pose;
}

Result<ScenePart<Instance>> read_surface(const SceneJson& json, const std::string& place, SceneContext& context) {
  ObjectReader reader(json, place, "surface");
  ASPERITY_CHECK(reader.status());
  Instance instance;
  ScenePart<Law> law{instance.law, law_json(instance.law)};
  if (const SceneJson* given = reader.raw("law")) {
    ASPERITY_TRY(law, read_law(*given, reader.place_of("law"), context));
  }
  instance.law = law.value;
  ASPERITY_TRY(MaterialPart material, read_material(reader, context));
  instance.material = material.material;
  TexturePart texture;
  if (reader.has("custom")) {
    ASPERITY_CHECK(read_custom(reader, instance));
    const TextureHost host{instance.name, surface_bounds(instance.surface), nullptr, nullptr, "a custom surface"};
    ASPERITY_TRY(texture, read_texture(reader, host, instance.law, context));
  } else if (reader.has("implicit") && !reader.has("parametric")) {
    // Read below.
  } else if (reader.has("parametric")) {
    ASPERITY_CHECK(read_parametric(reader, instance.law, context, instance, texture));
  } else if (reader.has("volume")) {
    ASPERITY_CHECK(read_isosurface(reader, context, instance));
  } else {
    ASPERITY_CHECK(read_triangles(reader, instance.law, instance.material, context, instance, texture));
  }
  ASPERITY_TRY(instance.world_from_object, read_pose(reader));
  if (reader.has("parametric") || reader.has("custom"))
    instance.world_from_object = upright(instance.world_from_object, read_up(reader, 2));
  ASPERITY_TRY(instance.motion, read_motion(reader));
  reader.write("law", std::move(law.canonical));
  if (reader.has("implicit") && !reader.has("custom")) {
    // Last: how far its potential is stored depends on how it is felt.
    const ImplicitFeel feel{instance.law, instance.material, instance.law.takes_ball() ? context.probe_radius : 0.0};
    ASPERITY_CHECK(read_implicit(reader, feel, context, instance));
  }
  if (iso_of(instance.surface) != nullptr) {
    const MeshSurface* made_from = base_of(instance.surface);
    const TextureHost host{instance.name, surface_bounds(instance.surface),
                           made_from == nullptr ? nullptr : &made_from->mesh(), nullptr,
                           reader.has("implicit") ? "an implicit surface" : "a volume"};
    ASPERITY_TRY(texture, read_texture(reader, host, instance.law, context));
  }
  ASPERITY_CHECK(attach_fine(reader, std::move(texture), material.fine, context, instance));
  note_friction(instance, material.fine, context);
  ASPERITY_CHECK(reader.status());
  return ScenePart<Instance>{std::move(instance), std::move(reader.canonical())};
}

}  // namespace asperity
