// Writes a mesh, reads it back, touches it, and checks the force: headers, libraries and what they need are all there.
// The one include comes first, so that nothing before it helps.

#include "asperity/asperity.h"

#include <cmath>
#include <cstdio>

using namespace asperity;

namespace {

Result<double> force_on_box(const char* file) {
  ASPERITY_CHECK(write_ply(file, box_mesh(Vec3(0.1, 0.1, 0.1))));
  ASPERITY_TRY(MeshSource source, read_mesh(file));
  Instance box;
  box.name = "box";
  ASPERITY_TRY(box.surface, make_mesh_surface(std::move(source)));
  box.material.stiffness = 1000.0;
  ASPERITY_TRY(const Scene scene, Scene::build({box}));
  ProxyState state;
  ProxyCache cache;
  ProbeSample probe;
  probe.pose.position = Vec3(0.01, 0.02, 0.06);
  step(scene, state, cache, probe, Seconds(1e-3));
  probe.pose.position.z() = 0.049;
  return step(scene, state, cache, probe, Seconds(1e-3)).wrench.force.z();
}

}  // namespace

int main(int argc, char** argv) {
  const Result<double> force = force_on_box(argc > 1 ? argv[1] : "box.ply");
  if (!force) {
    std::fprintf(stderr, "%s\n", force.error().message().c_str());
    return 2;
  }
  std::printf("1 mm inside a box of 1 N/mm: %.9f N\n", *force);
  return std::abs(*force - 1.0) < 1e-9 ? 0 : 1;
}
