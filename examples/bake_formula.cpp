// A formula becomes a relief: a wavy ball is baked onto 1,280 triangles and touched in a trough.

#include <cmath>
#include <cstdio>

#include "asperity/asperity.h"

using namespace asperity;

/// Below 0 inside, above 0 outside: radius 50 mm, waves of 0.6 mm from trough to crest.
double wavy_ball(const Vec3& p) {
  const Vec3 d = p.normalized();
  return p.norm() - 0.05 + 0.3e-3 * std::cos(30.0 * d.x()) * std::cos(30.0 * d.y());
}

Status touch() {
  ASPERITY_TRY(const auto ball, make_mesh_surface(icosphere(3, 0.05)));
  ASPERITY_TRY(const BakedRelief baked, bake_relief(ball->mesh(), wavy_ball, {.texels = 24, .highest = 2e-3}));
  std::printf("%s\n", baked.report.summary().c_str());
  ASPERITY_TRY(const auto relief, wear_baked(baked));
  ASPERITY_TRY(const Scene scene, Scene::build({{.name = "ball", .surface = relief}}));
  ProxyState state;
  ProxyCache cache;
  for (double z = 50.2e-3; z > 49.15e-3; z -= 2.5e-4) {
    const ForceSample felt = step(scene, state, cache, {.pose = {.position = {0.0, 0.0, z}}}, Seconds(1e-3));
    std::printf("%6.2f mm %8.3f N\n", 1e3 * z, felt.wrench.force.z());
  }
  return success();
}

int main() {
  const Status touched = touch();
  if (!touched) std::fprintf(stderr, "%s\n", touched.error().message().c_str());
  return touched ? 0 : 2;
}
