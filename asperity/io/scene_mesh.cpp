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

/// Reads one generator's parameters.
class GeneratorReader {
 public:
  GeneratorReader(ObjectReader& reader, SceneContext& context) : reader_(reader), context_(context) {}

  MeshSource generate(std::string_view generator) {
    if (generator == "icosphere" || generator == "M_d") return icosphere_source();
    if (generator == "M_a") return trial_mesh_a(trial_settings());
    if (generator == "M_b") return trial_b();
    if (generator == "M_c") return trial_c();
    if (generator == "M_e") return cup();
    if (generator == "M_f") return strip();
    if (generator == "M_G") return displaced();
    if (generator == "plane") return plane();
    if (generator == "box") return box_mesh(reader_.get<Vec3>("size"));
    return blob();
  }

 private:
  double number(const char* key) { return reader_.get<double>(key); }
  int whole(const char* key) { return reader_.get<int>(key); }

  MeshSource icosphere_source() {
    const int subdivisions = whole("subdivisions");
    if (!reader_.has("mean_edge")) return icosphere(subdivisions, number("radius"));
    return icosphere(subdivisions, icosphere_radius_for_edge(subdivisions, number("mean_edge")));
  }

  TrialMeshSettings trial_settings() {
    TrialMeshSettings settings;
    settings.columns = whole("columns");
    settings.rows = whole("rows");
    settings.mean_edge = number("mean_edge");
    return settings;
  }
  MeshSource trial_b() {
    const TrialMeshSettings settings = trial_settings();
    return trial_mesh_b(number("largest_fold"), settings, reader_.get<TrialBend>("bend"));
  }
  MeshSource trial_c() {
    const TrialMeshSettings settings = trial_settings();
    return trial_mesh_c(settings, reader_.get<std::vector<double>>("fold_angles"));
  }

  /// M_G: the keys of M_b, and what its geometry follows in the keys of a coat.
  MeshSource displaced() {
    const TrialMeshSettings settings = trial_settings();
    const double fold = number("largest_fold");
    const auto bend = reader_.get<TrialBend>("bend");
    const int subdivisions = whole("subdivisions");
    const auto columns = static_cast<double>(settings.columns);
    const double triangles = 2.0 * columns * settings.rows * std::exp2(2.0 * subdivisions);
    if (triangles > static_cast<double>(most_displaced_triangles)) {
      reader_.fail("subdivisions", fmt::format("makes {:.0f} triangles of M_b", triangles),
                   fmt::format("at most {} triangles", most_displaced_triangles), ErrorCode::too_large);
    }
    if (reader_.failed()) return {};
    const MeshSource base = trial_mesh_b(fold, settings, bend);
    return reader_.value_or(displaced_by(*reader_.raw("mesostructure"), base, subdivisions), {});
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
    ASPERITY_TRY(ScenePart<CoatSource> source, read_coat(json, place, base, context_, "mesostructure"));
    source.canonical.erase("normals");
    reader_.write("mesostructure", std::move(source.canonical));
    return at_place(Coat::build(base, std::move(source.value.parts), source.value.settings), place);
  }

  MeshSource cup() {
    const int rings = whole("rings");
    const double opening = number("opening");
    return trial_mesh_e(rings, opening, number("mean_edge"));
  }
  MeshSource strip() {
    const double grading = number("grading");
    const int triangles = whole("triangles");
    const int most = most_graded_triangles(grading);
    if (triangles > most)
      reader_.fail("triangles", fmt::format("is {}", triangles), fmt::format("a whole number, 1 to {}", most));
    const double edge = number("mean_edge");
    return reader_.failed() ? MeshSource{} : trial_mesh_f(triangles, edge, grading);
  }
  MeshSource plane() {
    const double width = number("width");
    const double depth = number("depth");
    if (reader_.has("triangles")) return plane_grid(width, depth, static_cast<std::uint32_t>(whole("triangles")));
    const int columns = whole("columns");
    return plane_grid(width, depth, columns, whole("rows"));
  }
  MeshSource blob() {
    const auto seed = reader_.get<std::uint64_t>("seed");
    const int subdivisions = whole("subdivisions");
    const double radius = number("radius");
    return random_closed_mesh(seed, subdivisions, radius, number("roughness"));
  }

  ObjectReader& reader_;
  SceneContext& context_;
};

Result<MeshPart> generated(const SceneJson& json, ObjectReader& surface, SceneContext& context) {
  ObjectReader reader(json, surface.place_of("mesh"), "mesh generator");
  ASPERITY_CHECK(reader.status());
  MeshPart part;
  part.name = reader.get<std::string>("generator");
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
  static constexpr std::array<const char*, 6> axes{"x", "y", "z", "-x", "-y", "-z"};
  const auto up = surface.get<std::string>("up", axes[fallback]);
  return static_cast<std::size_t>(std::find(axes.begin(), axes.end(), up) - axes.begin());
}

double read_units(ObjectReader& surface, bool from_file) {
  if (!from_file) return 1.0;
  return parse_quantity("1 " + surface.get<std::string>("units"), Dimension::length).value();
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
  return surface.get("fit", 0.0);
}

Result<MeshPart> read_mesh_part(ObjectReader& surface, SceneContext& context) {
  const SceneJson* mesh = surface.raw("mesh");
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
