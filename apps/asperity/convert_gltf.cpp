#include "apps/asperity/convert_gltf.h"

#include <fmt/format.h>

#include <filesystem>
#include <iostream>
#include <numbers>

#include "apps/asperity/scene_argument.h"
#include "asperity/io/gltf_material.h"

namespace asperity::program {
namespace {

bool is_mesh_path(const std::string& name) {
  const std::string extension = std::filesystem::path(name).extension().string();
  return extension == ".obj" || extension == ".ply" || extension == ".stl";
}

/// The coat as a material, and the texture coordinates that it has on the mesh.
Status dress(GltfModel& model, const TriangleMesh& mesh, const Coat& coat, const Console& console) {
  const CoatSettings& settings = coat.settings();
  if (settings.mapping == Mapping::triplanar) {
    return Error{ErrorCode::mismatch,
                 "has a coat that is projected along three axes: glTF maps lie by texture coordinates",
                 {},
                 "coat.mapping",
                 "\"uv\" or \"per_face\""};
  }
  const std::array<Vec2, 3> equilateral = {Vec2(0.0, 0.0), Vec2(1.0, 0.0), Vec2(0.5, 0.5 * std::numbers::sqrt3)};
  model.mesh.corner_uvs.clear();
  for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) {
    auto& uvs = model.mesh.corner_uvs.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec2 own = settings.mapping == Mapping::uv ? Vec2(mesh.uvs(face)[k].cast<double>()) : equilateral[k];
      uvs[k] = own.cwiseProduct(settings.repeat).cast<float>();
    }
  }
  GltfMaterial& material = model.materials.emplace_back();
  material.name = "coat";
  material.height = height_texture_of(coat.maps().heights());
  if (const NormalMap* normals = coat.maps().normals()) material.normals = normal_texture_of(*normals);
  if (!coat.layers().empty()) console.note("only the coat's first map is written; its further layers are left out");
  return success();
}

Result<GltfModel> model_of_scene(const std::string& scene, const Console& console) {
  SceneArgument argument;
  argument.scene = scene;
  ASPERITY_TRY(const Experiment experiment, load_scene(argument, console.progress()));
  for (const Instance& instance : experiment.scene.instances()) {
    const ReliefSurface* relief = relief_of(instance);
    const auto* plain = std::get_if<std::shared_ptr<const MeshSurface>>(&instance.surface);
    if (relief == nullptr && plain == nullptr) continue;
    const TriangleMesh& mesh = relief != nullptr ? relief->rest_mesh() : (*plain)->mesh();
    GltfModel model;
    const auto positions = mesh.positions();
    const auto triangles = mesh.triangles();
    model.mesh.positions.assign(positions.begin(), positions.end());
    model.mesh.triangles.assign(triangles.begin(), triangles.end());
    for (std::uint32_t face = 0; mesh.has_uvs() && face < triangles.size(); ++face)
      model.mesh.corner_uvs.push_back(mesh.uvs(face));
    if (relief != nullptr) ASPERITY_CHECK(dress(model, mesh, relief->coat(), console));
    if (experiment.scene.instances().size() > 1)
      console.note(fmt::format("\"{}\" is written, the other surfaces are left out", instance.name));
    return model;
  }
  return Error{ErrorCode::mismatch, "has no surface with a mesh", scene, {}, "a scene with a mesh or a relief"};
}

Result<GltfModel> model_of(const std::string& from, const Console& console) {
  if (is_gltf_path(from)) return read_gltf_model(from);
  if (!is_mesh_path(from)) return model_of_scene(from, console);
  GltfModel model;
  ASPERITY_TRY(model.mesh, read_mesh(from));
  return model;
}

}  // namespace

Result<int> convert_to_gltf(const std::string& from, const std::string& gltf, const Console& console) {
  Result<GltfModel> model = model_of(from, console);
  if (!model) return std::move(model).error().in_file(from);
  for (const std::string& note : model->mesh.notes) console.note(note);
  ASPERITY_CHECK(write_gltf(gltf, model->mesh, model->material_of_triangle, model->materials));
  std::error_code ignored;
  const auto bytes = static_cast<double>(std::filesystem::file_size(gltf, ignored));
  const std::size_t triangles = model->mesh.triangles.size();
  if (console.json) {
    console.print(
        Json{{"file", gltf}, {"bytes", bytes}, {"triangles", triangles}, {"materials", model->materials.size()}});
    return exit_success;
  }
  std::cout << fmt::format("{}: {:.2f} MB, {} triangles, {} materials\n", gltf, bytes * 1e-6, triangles,
                           model->materials.size());
  return exit_success;
}

}  // namespace asperity::program
