// The mesh of a surface in a scene file: from a file or a generator, scaled, placed, turned up.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "asperity/geometry/generators.h"
#include "asperity/io/detail/scene_reader.h"
#include "asperity/io/mesh_io.h"

namespace asperity {
namespace {

const std::vector<std::string>& generator_names() {
  static const std::vector<std::string> names{"icosphere", "M_a", "M_b",   "M_c", "M_d",   "M_e",
                                              "M_f",       "M_G", "plane", "box", "random"};
  return names;
}

const std::vector<std::string>& axis_names() {
  static const std::vector<std::string> names{"x", "y", "z", "-x", "-y", "-z"};
  return names;
}

/// Reads one generator's parameters; every one that it does not take is refused by name.
class GeneratorReader {
 public:
  GeneratorReader(ObjectReader& reader, SceneContext& context) : reader_(reader), context_(context) {}

  MeshSource generate(std::string_view generator) {
    if (generator == "icosphere" || generator == "M_d") return icosphere_source();
    if (generator == "M_a") return trial_a();
    if (generator == "M_b") return trial_b();
    if (generator == "M_c") return trial_c();
    if (generator == "M_e") return cup();
    if (generator == "M_f") return strip();
    if (generator == "M_G") return displaced();
    if (generator == "plane") return plane();
    if (generator == "box") return box();
    return blob();
  }

 private:
  double length(const char* key, double fallback) {
    return reader_.quantity(key, Dimension::length, fallback, Range{1e-9, 1e9});
  }
  void only(std::initializer_list<std::string_view> taken) {
    const auto takes = [&](const std::string& key) {
      return key == "generator" || std::find(taken.begin(), taken.end(), key) != taken.end();
    };
    reader_.refuse_unless(takes, "by this generator");
  }

  MeshSource icosphere_source() {
    only({"subdivisions", "radius", "mean_edge"});
    const int subdivisions = reader_.integer("subdivisions", 4, 0, 9);
    if (reader_.has("radius") && reader_.has("mean_edge"))
      reader_.fail("mean_edge", "is given beside radius", "one of the two");
    if (!reader_.has("mean_edge")) return make([&] { return icosphere(subdivisions, length("radius", 0.04)); });
    const double edge = length("mean_edge", 0.01);
    return make([&] { return icosphere(subdivisions, icosphere_radius_for_edge(subdivisions, edge)); });
  }

  TrialMeshSettings trial_settings() {
    TrialMeshSettings settings;
    settings.columns = reader_.integer("columns", settings.columns, 1, 1000);
    settings.rows = reader_.integer("rows", settings.rows, 1, 1000);
    settings.mean_edge = length("mean_edge", settings.mean_edge);
    return settings;
  }
  double largest_fold() {
    return reader_.quantity("largest_fold", Dimension::angle, std::numbers::pi / 30.0,
                            Range{1e-3, std::numbers::pi / 4.0});
  }
  MeshSource trial_a() {
    only({"columns", "rows", "mean_edge"});
    const TrialMeshSettings settings = trial_settings();
    return make([&] { return trial_mesh_a(settings); });
  }
  MeshSource trial_b() {
    only({"columns", "rows", "mean_edge", "largest_fold"});
    const TrialMeshSettings settings = trial_settings();
    const double fold = largest_fold();
    return make([&] { return trial_mesh_b(fold, settings); });
  }
  MeshSource trial_c() {
    only({"columns", "rows", "mean_edge", "fold_angles"});
    const TrialMeshSettings settings = trial_settings();
    const std::vector<double> angles = fold_angles();
    return make([&] { return trial_mesh_c(settings, angles); });
  }

  /// Angles between the faces at M_c's ridges.
  std::vector<double> fold_angles() {
    constexpr double degree = std::numbers::pi / 180.0;
    constexpr std::size_t most = 1000;
    const char* accepted = "1 to 1000 angles, 10 to 180 degrees each (rad, or \"60 deg\")";
    const SceneJson* given = reader_.raw("fold_angles");
    std::vector<double> angles{60.0 * degree, 90.0 * degree, 120.0 * degree};
    if (given != nullptr && !given->is_array()) {
      reader_.fail_type("fold_angles", *given, accepted);
    } else if (given != nullptr && (given->empty() || given->size() > most)) {
      reader_.fail("fold_angles", fmt::format("has {} angles", given->size()), accepted);
    } else if (given != nullptr) {
      angles.clear();
      for (std::size_t i = 0; i < given->size(); ++i) {
        angles.push_back(reader_.value_of((*given)[i], reader_.place_of("fold_angles", i), Dimension::angle,
                                          Range{10.0 * degree, 180.0 * degree}));
      }
    }
    reader_.write("fold_angles", angles);
    return angles;
  }

  /// M_G: the keys of M_b, and what its geometry follows in the keys of a coat.
  MeshSource displaced() {
    only({"columns", "rows", "mean_edge", "largest_fold", "subdivisions", "mesostructure"});
    const TrialMeshSettings settings = trial_settings();
    const double fold = largest_fold();
    const int subdivisions = reader_.integer("subdivisions", 4, 0, 10);
    const auto columns = static_cast<double>(settings.columns);
    const double triangles = 2.0 * columns * settings.rows * std::exp2(2.0 * subdivisions);
    if (triangles > static_cast<double>(most_displaced_triangles)) {
      reader_.fail("subdivisions", fmt::format("makes {:.0f} triangles of M_b", triangles),
                   fmt::format("at most {} triangles", most_displaced_triangles), ErrorCode::too_large);
    }
    const SceneJson* relief = reader_.raw("mesostructure");
    reader_.require("mesostructure", "an object with the keys of a coat");
    if (reader_.failed()) return {};
    return reader_.value_or(displaced_by(*relief, trial_mesh_b(fold, settings), subdivisions), {});
  }

  Result<MeshSource> displaced_by(const SceneJson& relief, MeshSource source, int subdivisions) {
    ASPERITY_TRY(const TriangleMesh base, at_place(TriangleMesh::build(std::move(source)), reader_.place()));
    ASPERITY_TRY(const Coat coat, heights_of(relief, base));
    return displaced_mesh(base, subdivisions, [&](std::uint32_t face, const Vec3& barycentric) {
      return coat.sample(base, face, barycentric).height;
    });
  }

  Result<Coat> heights_of(const SceneJson& json, const TriangleMesh& base) {
    const std::string place = reader_.place_of("mesostructure");
    for (const char* key : {"normals", "normal_map", "green", "stitching"}) {
      if (!json.is_object() || !json.contains(key)) continue;
      return refused(ErrorCode::bad_key, "is not read by M_G, whose geometry follows the heights",
                     fmt::format("{}.{}", place, key), "no such key here");
    }
    ASPERITY_TRY(ScenePart<CoatSource> source, read_coat(json, place, base, context_));
    source.canonical.erase("normals");
    reader_.write("mesostructure", std::move(source.canonical));
    return at_place(Coat::build(base, std::move(source.value.parts), source.value.settings), place);
  }

  MeshSource cup() {
    only({"rings", "opening", "mean_edge"});
    const int rings = reader_.integer("rings", 8, 1, 512);
    const double opening = reader_.quantity("opening", Dimension::angle, std::numbers::pi / 2.0, Range{0.1, 3.0});
    const double edge = length("mean_edge", 0.01);
    return make([&] { return trial_mesh_e(rings, opening, edge); });
  }
  MeshSource strip() {
    only({"triangles", "mean_edge", "grading"});
    const double grading = reader_.number("grading", 0.5, Range{0.1, 0.9});
    const int triangles = reader_.integer("triangles", 10, 1, most_graded_triangles(grading));
    const double edge = length("mean_edge", 0.01);
    return make([&] { return trial_mesh_f(triangles, edge, grading); });
  }
  MeshSource plane() {
    only({"width", "depth", "columns", "rows", "triangles"});
    const double width = length("width", 0.1);
    const double depth = length("depth", 0.1);
    if (reader_.has("triangles")) {
      reader_.refuse({"columns", "rows"}, "beside triangles");
      const int triangles = reader_.integer("triangles", 2, 2, 4'194'304);
      return make([&] { return plane_grid(width, depth, static_cast<std::uint32_t>(triangles)); });
    }
    const int columns = reader_.integer("columns", 1, 1, 2048);
    const int rows = reader_.integer("rows", 1, 1, 2048);
    return make([&] { return plane_grid(width, depth, columns, rows); });
  }
  MeshSource box() {
    only({"size"});
    const Vec3 size = reader_.lengths("size", Vec3(0.08, 0.08, 0.08));
    if (!(size.minCoeff() >= 1e-9 && size.maxCoeff() <= 1e9))
      reader_.fail("size", "is no box", "three lengths above 0 (m, or with a unit)");
    return make([&] { return box_mesh(size); });
  }
  MeshSource blob() {
    only({"seed", "subdivisions", "radius", "roughness"});
    const std::uint64_t seed = reader_.seed("seed", 1);
    const int subdivisions = reader_.integer("subdivisions", 4, 0, 8);
    const double radius = length("radius", 0.04);
    const double roughness = reader_.number("roughness", 0.2, Range{0.0, 0.9});
    return make([&] { return random_closed_mesh(seed, subdivisions, radius, roughness); });
  }

  /// Nothing is generated from parameters that were refused.
  template <class Make>
  MeshSource make(Make&& generate_mesh) {
    return reader_.failed() ? MeshSource{} : generate_mesh();
  }

  ObjectReader& reader_;
  SceneContext& context_;
};

Result<MeshPart> generated(const SceneJson& json, ObjectReader& surface, SceneContext& context) {
  ObjectReader reader(json, surface.place_of("mesh"), "mesh generator");
  reader.require("generator", "a generator's name");
  const std::size_t generator = reader.choice("generator", generator_names(), 0);
  ASPERITY_CHECK(reader.status());
  MeshPart part;
  part.name = generator_names()[generator];
  part.source = GeneratorReader(reader, context).generate(part.name);
  ASPERITY_CHECK(reader.status());
  surface.take("mesh", std::move(reader));
  return part;
}

Result<MeshPart> from_file(const std::string& file, ObjectReader& surface, SceneContext& context) {
  const std::filesystem::path path = context.resolve(file);
  if (context.progress) context.progress("reading mesh", 0.0);
  MeshPart part;
  ASPERITY_TRY(part.source, in_file(read_mesh(path), path.string(), surface.place_of("mesh")));
  part.name = path.stem().string();
  part.from_file = true;
  surface.write("mesh", path.string());
  return part;
}

/// Bounds of the vertices that triangles use and that are finite; the builder reports the others.
Box used_bounds(const MeshSource& source) {
  Box bounds;
  for (const auto& triangle : source.triangles) {
    for (const std::uint32_t corner : triangle) {
      if (corner < source.positions.size() && source.positions[corner].allFinite())
        bounds.include(source.positions[corner]);
    }
  }
  return bounds;
}

/// glTF defines its unit; the other formats leave it open.
const char* unit_of_file(const SceneJson& mesh) {
  const std::string extension = std::filesystem::path(mesh.get<std::string>()).extension().string();
  const bool metric = extension == ".gltf" || extension == ".glb" || extension == ".GLTF" || extension == ".GLB";
  return metric ? "its file is in metres" : "its file states no unit";
}

}  // namespace

void note_fit(const std::string& what, double scale, const Vec3& extent, SceneContext& context) {
  context.note(
      fmt::format("{}; scaled by {:.4g} to {} x {} x {}, the largest side being the workspace radius of {} (\"units\" "
                  "or \"fit\" choose otherwise)",
                  what, scale, format_length(extent.x()), format_length(extent.y()), format_length(extent.z()),
                  context.device.name));
}

// By signs and swaps alone, so that planes stay exactly plane.
Vec3 turned_up(const Vec3& p, std::size_t axis) {
  switch (axis) {
    case 0: return {-p.y(), p.x(), p.z()};
    case 2: return {p.x(), p.z(), -p.y()};
    case 3: return {p.y(), -p.x(), p.z()};
    case 4: return {p.x(), -p.y(), -p.z()};
    case 5: return {p.x(), -p.z(), p.y()};
    default: return p;
  }
}

std::size_t read_up(ObjectReader& surface, std::size_t fallback) {
  return surface.choice("up", axis_names(), fallback);
}

double read_units(ObjectReader& surface, bool from_file) {
  static const std::vector<std::string> names{"m", "cm", "mm", "um", "in"};
  constexpr double metres[] = {1.0, 1e-2, 1e-3, 1e-6, 0.0254};
  if (!from_file) {
    surface.refuse({"units"}, "for a generated mesh or volume, which is in metres");
    return 1.0;
  }
  return metres[surface.choice("units", names, 0)];
}

double read_fit(ObjectReader& surface, bool by_default, const SceneContext& context) {
  const double workspace = context.device.workspace_radius;
  const SceneJson* fit = surface.raw("fit");
  if (fit == nullptr) {
    surface.write("fit", by_default ? "workspace" : "none");
    return by_default ? workspace : 0.0;
  }
  if (fit->is_string() && (*fit == "workspace" || *fit == "none")) {
    surface.write("fit", *fit);
    return *fit == "workspace" ? workspace : 0.0;
  }
  if (!fit->is_number() && !fit->is_string()) {
    surface.fail_type("fit", *fit, "\"workspace\", \"none\", or a length above 0");
    return 0.0;
  }
  if (fit->is_string() && !parse_quantity(fit->get_ref<const std::string&>(), Dimension::length)) {
    surface.fail("fit", fmt::format("\"{}\" is not known", fit->get_ref<const std::string&>()),
                 "\"workspace\", \"none\", or a length above 0 (" + accepted_units(Dimension::length) + ")");
    return 0.0;
  }
  return surface.quantity("fit", Dimension::length, 0.0, Range::positive());
}

Result<MeshPart> read_mesh_part(ObjectReader& surface, SceneContext& context) {
  const SceneJson* mesh = surface.raw("mesh");
  const char* accepted = "a mesh file (OBJ, PLY, STL, glTF) or an object with a generator";
  surface.require("mesh", accepted);
  if (mesh != nullptr && !mesh->is_string() && !mesh->is_object()) surface.fail_type("mesh", *mesh, accepted);
  ASPERITY_CHECK(surface.status());
  ASPERITY_TRY(MeshPart part, mesh->is_object() ? generated(*mesh, surface, context)
                                                : from_file(mesh->get_ref<const std::string&>(), surface, context));
  const bool stated = surface.has("units") || surface.has("fit");
  const double unit = read_units(surface, part.from_file);
  const double size = read_fit(surface, part.from_file && !stated, context);
  // Generators lay open sheets in z = 0 with their touched side towards +z.
  const bool closed = part.name == "icosphere" || part.name == "M_d" || part.name == "box" || part.name == "random";
  const bool flat = !part.from_file && !closed;
  const std::size_t up = read_up(surface, flat ? 2 : 1);
  ASPERITY_CHECK(surface.status());

  const Box bounds = used_bounds(part.source);
  const double largest = bounds.empty() ? 0.0 : unit * bounds.extent().maxCoeff();
  const bool fitted = size > 0.0 && largest > 0.0;
  const double scale = fitted ? size / largest : 1.0;
  const Vec3 centre = fitted ? bounds.centre() : Vec3(Vec3::Zero());
  part.scale = unit * scale;
  part.centre = centre;
  part.turned = up != 1;
  for (Vec3& p : part.source.positions) p = turned_up((p - centre) * part.scale, up);
  if (fitted && part.from_file && !stated) {
    note_fit(fmt::format("mesh \"{}\": {}", part.name, unit_of_file(*mesh)), scale, scale * (unit * bounds.extent()),
             context);
  }
  for (const std::string& note : part.source.notes) context.note(fmt::format("mesh \"{}\": {}", part.name, note));
  part.source.notes.clear();
  return part;
}

}  // namespace asperity
