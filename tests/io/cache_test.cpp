// What a tick remembers of surfaces makes it quick and changes no answer: every built-in scene, by every law that its
// surfaces are felt by, with a cache that is kept, dropped at random ticks, shared with another probe, or never there.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "asperity/core/rng.h"
#include "asperity/field/conversion/mesh_conversion.h"
#include "asperity/render/law_registry.h"
#include "tests/io/experiment_fixture.h"

namespace asperity::cache_test {
namespace {

bool same_bits(const ForceSample& a, const ForceSample& b) {
  const auto same = [](const Vec3& x, const Vec3& y) {
    return std::memcmp(x.data(), y.data(), 3 * sizeof(double)) == 0;
  };
  if (a.contact.places.size() != b.contact.places.size()) return false;
  for (std::size_t i = 0; i < a.contact.places.size(); ++i) {
    const Place& one = a.contact.places[i];
    const Place& other = b.contact.places[i];
    if (one.element != other.element || one.back != other.back || !same(one.at, other.at)) return false;
  }
  return same(a.wrench.force, b.wrench.force) && same(a.proxy, b.proxy) && same(a.contact.point, b.contact.point) &&
         a.flags.bits() == b.flags.bits() && a.contact.element == b.contact.element;
}

/// Ticks of a stroke that a nervous hand follows, from a little before the surface is to be met on; answers how many
/// touched, `ticks` at most.
int touch_four_ways(const Experiment& e, const std::string& name, std::uint64_t seed, int ticks) {
  Rng rng(seed);
  ProxyState kept_state;
  ProxyState dropped_state;
  ProxyState bare_state;
  ProxyState other_state;
  ProxyCache kept(e.scene);
  ProxyCache dropped;
  int drops = 0;
  int touching = 0;
  int begin = 0;
  while (e.path.pose(Seconds(begin * 1e-3)).phase != StrokePhase::contact && begin < 20000) ++begin;
  begin = std::max(0, begin - 600);
  bool same = true;
  for (int tick = begin; tick < begin + 1500 && touching < ticks && same; ++tick) {
    const StrokePose pose = e.path.pose(Seconds(tick * 1e-3));
    ProbeSample probe;
    probe.pose.position = pose.target;
    for (int k = 0; k < 3; ++k) probe.pose.position[k] += rng.uniform(-2e-5, 2e-5);
    probe.twist.linear = pose.velocity;
    probe.time = Seconds(tick * 1e-3);
    ProbeSample beside = probe;
    beside.pose.position += Vec3(1e-3, -5e-4, 7e-4);
    if (rng.below(7) == 0) {
      dropped = rng.below(2) == 0 ? ProxyCache{} : ProxyCache(e.scene);
      ++drops;
    }
    const ForceSample expected = step(e.scene, kept_state, kept, probe, Seconds(1e-3));
    step(e.scene, other_state, kept, beside, Seconds(1e-3));
    const ForceSample forgetful = step(e.scene, dropped_state, dropped, probe, Seconds(1e-3));
    same = same_bits(expected, forgetful);
    EXPECT_TRUE(same) << name << ", tick " << tick << ": a cache was dropped";
    if (tick % 5 == 0) {
      // Once in a while without any: from the same state.
      ProxyState from = bare_state;
      const bool alike = same_bits(expected, step(e.scene, from, probe, Seconds(1e-3)));
      EXPECT_TRUE(alike) << name << ", tick " << tick;
      same = same && alike;
    }
    step(e.scene, bare_state, dropped, probe, Seconds(1e-3));
    if (expected.flags.has(TickFlag::contact) || expected.flags.has(TickFlag::field_force)) ++touching;
  }
  EXPECT_GT(drops, 10) << name;
  return touching;
}

class Caches : public ExperimentTest {};

TEST_F(Caches, ChangeNoBitOfAnyAnswer) {
  int felt = 0;
  int touching = 0;
  for (const BuiltinScene& scene : builtin_scenes()) {
    if (scene.name.starts_with("implicit") && !has_mesh_voxelizer()) continue;
    const Experiment e = good(*builtin_scene_json(scene.name));
    touching += touch_four_ways(e, scene.name, 1, 300);
    ++felt;
  }
  EXPECT_GE(felt, 40);
  EXPECT_GT(touching, 200 * felt);
}

TEST_F(Caches, ChangeNoBitOfABallsAnswer) {
  // Where most is kept: on reliefs, one of them moving.
  int touching = 0;
  for (const char* name : {"M_a-H_3", "M_d-H_2", "layers", "zoom"}) {
    for (const double radius : {2e-4, 1e-3}) {
      Experiment e = good(*builtin_scene_json(name));
      SceneSettings settings = e.scene.settings();
      settings.probe_radius = radius;
      e.scene = Scene::build({e.scene.instances().begin(), e.scene.instances().end()}, settings).value();
      touching += touch_four_ways(e, std::string(name) + " by a ball", 3, 100);
    }
  }
  EXPECT_GT(touching, 500);
}

TEST_F(Caches, ChangeNoBitByAnyLaw) {
  int felt = 0;
  int touching = 0;
  for (const char* name : {"M_a-H_3", "M_d-H_2", "icosphere", "cavity", "implicit-texture", "vase"}) {
    if (std::string(name).starts_with("implicit") && !has_mesh_voxelizer()) continue;
    const Experiment e = good(*builtin_scene_json(name));
    for (const std::string& law : law_names()) {
      const Result<Experiment> by = with_law(e, *law_by_name(law));
      if (!by.ok()) continue;
      touching += touch_four_ways(*by, std::string(name) + " by " + law, 2, 120);
      ++felt;
    }
  }
  EXPECT_GE(felt, 20);
  EXPECT_GT(touching, 80 * felt);
}

}  // namespace
}  // namespace asperity::cache_test
