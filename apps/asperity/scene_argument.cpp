#include "apps/asperity/scene_argument.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "asperity/core/suggest.h"
#include "asperity/io/sparse_io.h"
#include "asperity/io/trace_file.h"
#include "asperity/io/volume_io.h"

namespace asperity::program {
namespace {

namespace fs = std::filesystem;

std::string lower_extension(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

Error unknown_scene(const std::string& scene) {
  std::vector<std::string> names;
  for (const BuiltinScene& builtin : builtin_scenes()) names.push_back(builtin.name);
  const std::string near = nearest_name(scene, names);
  return Error{
      ErrorCode::file_missing,
      fmt::format("no such file, and no built-in scene of that name{}",
                  near.empty() ? "" : fmt::format("; did you mean \"{}\"?", near)),
      scene,
      {},
      fmt::format(
          "a scene (.json), a mesh (.obj, .ply, .stl, .gltf, .glb), a level set (.vdb), a volume (.vtk, .vti, .vtr, "
          "...), or a built-in scene: {}",
          fmt::join(names, ", "))};
}

/// The first byte that is no white space; 0 when there is none.
char first_mark(const std::string& file) {
  std::ifstream stream(file, std::ios::binary);
  char c = 0;
  return stream >> std::ws && stream.get(c) ? c : '\0';
}

bool is_scene_file(const std::string& file) {
  const std::string extension = lower_extension(file);
  if (extension == ".json") return true;
  static const std::vector<std::string> others{".obj", ".ply", ".stl", ".gltf", ".glb", ".vdb"};
  if (std::find(others.begin(), others.end(), extension) != others.end()) return false;
  return first_mark(file) == '{';
}

bool is_picture_file(const std::string& file) {
  const std::string extension = lower_extension(file);
  return extension == ".png" || extension == ".jpg" || extension == ".jpeg" || extension == ".exr";
}

std::string absolute(const std::string& path) {
  return fs::absolute(path).lexically_normal().string();
}

/// A scene with one surface, of the file.
SceneText scene_of(const std::string& file, const char* kind) {
  Json surface = Json::object();
  if (is_sparse_path(file)) {
    surface["implicit"] = {{"file", absolute(file)}};
  } else {
    surface[kind] = absolute(file);
  }
  const Json made = {{"name", fs::path(file).stem().string()}, {"surfaces", Json::array({surface})}};
  return SceneText{made.dump(2, ' ', false, Json::error_handler_t::replace), ".", file};
}

/// Puts `value` at `key` of `object` when it was given. What stands in the way is left for the reader to name.
void put(Json& object, const char* key, const std::string& value) {
  if (!value.empty() && object.is_object()) object[key] = value;
}

Json& member(Json& object, const char* key) {
  if (object.is_object() && !object.contains(key)) object[key] = Json::object();
  static Json nowhere;
  return object.is_object() ? object[key] : nowhere = Json::object();
}

void drop(Json& object, const char* key) {
  if (object.is_object()) object.erase(key);
}

void change_coat(Json& surface, const SceneArgument& a) {
  const bool any =
      !(a.relief + a.height + a.tile + a.normal_map + a.channel + a.white_is + a.mapping + a.magnify).empty();
  if (!any) return;
  Json& coat = member(surface, "coat");
  if (!a.relief.empty()) {
    // What described another map does not describe this one.
    for (const char* key :
         {"channel", "white_is", "height", "height_range", "offset", "tile", "magnify", "normal_map", "green"}) {
      drop(coat, key);
    }
    if (coat.is_object()) coat["height_map"] = absolute(a.relief);
  }
  if (!a.height.empty()) drop(coat, "height_range");
  put(coat, "height", a.height);
  put(coat, "tile", a.tile);
  put(coat, "normal_map", a.normal_map.empty() ? "" : absolute(a.normal_map));
  put(coat, "channel", a.channel);
  put(coat, "white_is", a.white_is);
  put(coat, "mapping", a.mapping);
  if (!a.magnify.empty() && coat.is_object()) {
    const Result<double> number = parse_quantity(a.magnify, Dimension::ratio);
    coat["magnify"] = number ? Json(*number) : Json(a.magnify);
  }
}

/// Makes the mesh implicit, as fine as asked for; what is not named stays as the scene has it.
void change_implicit(Json& surface, const SceneArgument& a) {
  if (a.implicit.empty() || !surface.is_object()) return;
  Json& implicit = member(surface, "implicit");
  // What is felt on triangles has no potential, and the other way round.
  for (const char* key : {"search", "on_overlap", "shell_directions"}) drop(surface, key);
  for (const char* key : {"voxel", "resolution", "budget"}) drop(implicit, key);
  const bool count = a.implicit.find_first_not_of("0123456789") == std::string::npos && a.implicit.size() < 6;
  if (count) {
    implicit["resolution"] = std::stoi(a.implicit);
  } else {
    implicit["voxel"] = a.implicit;
  }
}

/// Drops what another representation needs; law and its options are the caller's.
void change_kind(Json& surface, const std::string& kind) {
  if (kind.empty() || !surface.is_object() || !surface.contains("mesh")) return;
  // The law of another representation has no meaning here.
  if (kind != "implicit" || !surface.contains("implicit")) surface.erase("law");
  if (kind == "implicit") {
    for (const char* key : {"search", "on_overlap", "shell_directions"}) surface.erase(key);
    member(surface, "implicit");
    return;
  }
  surface.erase("implicit");
  if (kind == "mesh") {
    for (const char* key : {"coat", "on_overlap", "shell_directions"}) surface.erase(key);
  }
}

void change_surface(Json& surface, const SceneArgument& a) {
  change_kind(surface, a.felt_as);
  if (a.felt_as.empty() || a.felt_as == "implicit") change_implicit(surface, a);
  put(surface, "units", a.units);
  put(surface, "fit", a.fit);
  put(surface, "up", a.up);
  put(surface, "law", a.law);
  if (!(a.stiffness + a.damping).empty()) {
    put(member(surface, "material"), "stiffness", a.stiffness);
    put(member(surface, "material"), "damping", a.damping);
  }
  if (a.felt_as != "mesh") change_coat(surface, a);
}

void change_device(Json& scene, const SceneArgument& a) {
  put(scene, "device", a.device);
  put(scene, "hand", a.hand);
  if ((a.rate + a.probe + a.probe_radius + a.unstated_radius).empty()) return;
  Json& probe = member(scene, "probe");
  put(probe, "rate", a.rate);
  put(probe, "kind", a.probe);
  if (!probe.is_object() || !probe.contains("radius")) put(probe, "radius", a.unstated_radius);
  put(probe, "radius", a.probe_radius);
}

void change_stroke(Json& scene, const SceneArgument& a, bool loops) {
  if ((a.depth + a.force + a.speed).empty() && !loops) return;
  Json& stroke = member(scene, "stroke");
  if (!a.depth.empty()) drop(stroke, "normal_force");
  if (!a.force.empty()) drop(stroke, "depth");
  put(stroke, "depth", a.depth);
  put(stroke, "normal_force", a.force);
  put(stroke, "speed", a.speed);
  const bool recorded = stroke.is_object() && stroke.contains("type") && stroke["type"] == "recorded";
  if (loops && !recorded && stroke.is_object() && !stroke.contains("back_and_forth")) stroke["back_and_forth"] = true;
}

}  // namespace

void add_scene_options(Arguments& command, SceneArgument& a) {
  command
      .option("SCENE", a.scene,
              "A scene file, a mesh (OBJ, PLY, STL, glTF), a level set (.vdb), a volume (VTK, OpenFOAM, NRRD, raw, "
              ".aspvol), or a built-in scene (asperity scenes)")
      .shows_default();
  command.option("--relief", a.relief, "Height map (PNG, JPEG, EXR) to lay on every surface").group("Relief");
  command.option("--height", a.height, "Relief from black to white: 2mm, or 10% of the mean edge").group("Relief");
  command.option("--tile", a.tile, "Width of one repeat of the map, for meshes without texture coordinates: 20mm")
      .group("Relief");
  command.option("--normal-map", a.normal_map, "Normal map that belongs to the relief").group("Relief");
  command.option("--channel", a.channel, "Channel of the heights: automatic, luminance, red, green, blue, alpha")
      .group("Relief");
  command.option("--white-is", a.white_is, "high, or deep for depth maps").group("Relief");
  command.option("--mapping", a.mapping, "auto, uv, per_face, triplanar").group("Relief");
  command.option("--magnify", a.magnify, "Factor on heights and tile, for surfaces measured in micrometres")
      .group("Relief");
  command.option("--units", a.units, "Unit of the mesh file: m, cm, mm, um, in").group("Mesh");
  command.option("--fit", a.fit, "workspace, none, or the largest side: 80mm").group("Mesh");
  command.option("--up", a.up, "The mesh's axis that points up: x, y, z, -x, -y, -z").group("Mesh");
  command
      .flag("--implicit{256}", a.implicit,
            "Feel meshes through a potential made from them: so many voxels along the longest side, or a voxel "
            "(--implicit=128, --implicit=0.4mm)")
      .group("Mesh");
  command.option("--stiffness", a.stiffness, "Of every surface: 1000, 0.5N/mm").group("Touch");
  command.option("--damping", a.damping, "Of every surface: 0.5 (N s/m)").group("Touch");
  const Argument depth = command.option("--depth", a.depth, "Lead the probe at this depth: 1mm").group("Touch");
  command.option("--force", a.force, "Press with this normal force: 1N").excludes(depth).group("Touch");
  command.option("--speed", a.speed, "Along the surface: 20mm/s").group("Touch");
  command.option("--device", a.device, "Device profile: phantom-desktop, omega.7, touch, ...").group("Touch");
  command.option("--hand", a.hand, "Hand: default, light, firm, paper (with --probe dynamic)").group("Touch");
  command.option("--rate", a.rate, "Force updates a second: 1kHz").group("Touch");
  command.option("--probe", a.probe, "ideal, or dynamic: a simulated hand that holds the device").group("Touch");
  command
      .option("--probe-radius", a.probe_radius,
              "Radius of the tip: 1mm; 0 is a point. Without: 0.5mm where every law takes a ball")
      .group("Touch");
}

Result<SceneText> find_scene(const std::string& scene) {
  std::error_code ignored;
  if (!fs::exists(scene, ignored)) {
    for (const BuiltinScene& builtin : builtin_scenes()) {
      if (edit_distance(builtin.name, scene) != 0) continue;
      ASPERITY_TRY(std::string text, builtin_scene_json(builtin.name));
      return SceneText{std::move(text), ".", builtin.name};
    }
    return unknown_scene(scene);
  }
  if (is_volume_path(scene)) return scene_of(scene, "volume");
  if (fs::is_directory(scene, ignored))
    return Error{ErrorCode::file_missing, "is a folder", scene, {}, "a scene, a mesh, a volume, or a built-in scene"};
  if (is_trace_file(scene))
    return Error{
        ErrorCode::file_unsupported, "is a trace", scene, {}, "a scene or a mesh (asperity replay plays traces)"};
  if (is_picture_file(scene)) {
    return Error{ErrorCode::file_unsupported,
                 "is a picture",
                 scene,
                 {},
                 "a scene or a mesh (--relief FILE lays a picture on it)"};
  }
  if (!is_scene_file(scene)) return scene_of(scene, "mesh");
  std::ifstream stream(scene, std::ios::binary);
  if (!stream) return Error{ErrorCode::file_missing, "cannot be read", scene, {}, "a readable file"};
  std::string text{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  return SceneText{std::move(text), fs::path(scene).parent_path().string(), scene};
}

Result<Experiment> load_scene(const SceneArgument& argument, const Progress& progress, bool loops) {
  ASPERITY_TRY(SceneText scene, find_scene(argument.scene));
  // Text that is not JSON goes to the reader as it is, which names the line.
  Json json = Json::parse(scene.text, nullptr, false);
  if (json.is_object()) {
    if (json.contains("surfaces") && json["surfaces"].is_array()) {
      for (Json& surface : json["surfaces"]) change_surface(surface, argument);
    }
    change_device(json, argument);
    change_stroke(json, argument, loops);
    if (!json.contains("name")) json["name"] = fs::path(scene.name).stem().string();
    const Json untouched = Json::parse(scene.text, nullptr, false);
    if (json != untouched) scene.text = json.dump(2, ' ', false, Json::error_handler_t::replace);
  }
  return parse_experiment(scene.text, scene.folder, scene.name, progress);
}

std::string folder_name(const std::string& scene_name) {
  std::string folder;
  for (const char c : scene_name) {
    const auto byte = static_cast<unsigned char>(c);
    const bool plain = std::isalnum(byte) != 0 || c == '-' || c == '_' || c == '.' || byte >= 0x80;
    folder += plain ? c : '_';
  }
  if (folder.empty() || folder.front() == '.') folder.insert(0, "scene");
  return folder;
}

}  // namespace asperity::program
