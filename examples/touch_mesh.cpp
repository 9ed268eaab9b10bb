// A mesh from a file (OBJ, PLY, STL, glTF), touched as it is by the default law. A probe comes down on its top.
//   touch_mesh cube.obj

#include <cstdio>

#include "asperity/asperity.h"

using namespace asperity;

Status touch(const char* file) {
  ASPERITY_TRY(MeshSource source, read_mesh(file));
  ASPERITY_TRY(const auto part, make_mesh_surface(std::move(source), {.scale = 1e-3}));  // the file is in millimetres
  ASPERITY_TRY(const Scene scene, Scene::build({{.name = "part", .surface = part}}));
  const Vec3 top(part->bounds().centre().x(), part->bounds().centre().y(), part->bounds().upper.z());
  ProxyState state;
  ProxyCache cache;
  for (double height = 1e-3; height > -1.1e-3; height -= 5e-4) {
    const Vec3 probe = top + Vec3(0.0, 0.0, height);
    const ForceSample felt = step(scene, state, cache, {.pose = {.position = probe}}, Seconds(1e-3));
    std::printf("%5.1f mm %8.3f N\n", 1e3 * height, felt.wrench.force.z());
  }
  return success();
}

int main(int argc, char** argv) {
  const Status touched = touch(argc > 1 ? argv[1] : "cube.obj");
  if (!touched) std::fprintf(stderr, "%s\n", touched.error().message().c_str());
  return touched ? 0 : 2;
}
