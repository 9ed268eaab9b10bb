// What can be felt of a relief: the bounds of formulation D5, measured shapes against formulas, and suggestions that
// are boundaries.

#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>

#include "asperity/field/mesostructure/generators.h"
#include "asperity/geometry/generators.h"
#include "asperity/io/image_io.h"
#include "asperity/study/renderability.h"

namespace asperity::renderability_test {
namespace {

constexpr double pi = std::numbers::pi;

TouchConditions conditions_of(const char* device) {
  TouchConditions t;
  t.device = *find_profile(device);
  t.rate = t.device.rate;
  return t;
}

/// `count` cosines of amplitude `c` along s.
HeightMap cosines(int size, int count, double c, Reconstruction reconstruction = Reconstruction::quadratic_bspline) {
  std::vector<float> heights;
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x)
      heights.push_back(static_cast<float>(c * std::cos(2.0 * pi * count * (x + 0.5) / size)));
  }
  return *HeightMap::build(std::move(heights), size, size, Wrap::repeat, reconstruction);
}

TEST(Renderability, D5NumbersOfACosine) {
  // 1 N, 0.5 mm: 0.79 N/mm at 5 mm, 3.2 N/mm at 2.5 mm, which no Phantom does.
  EXPECT_NEAR(least_stiffness(1.0, cosine_crest_radius(5e-3, 0.5e-3)), 789.57, 0.01);
  EXPECT_NEAR(least_stiffness(1.0, cosine_crest_radius(2.5e-3, 0.5e-3)), 3158.27, 0.01);
  EXPECT_NEAR(cosine_crest_radius(5e-3, 0.5e-3), 1.2665e-3, 1e-7);
  TouchConditions t = conditions_of("phantom-desktop");
  const auto faithful = [&](double wave, double stiffness) {
    t.stiffness = stiffness;
    return judge_relief(cosine_shape(wave, 0.5e-3), t).of(Criterion::fidelity).passes;
  };
  EXPECT_TRUE(faithful(5e-3, 790.0));
  EXPECT_FALSE(faithful(5e-3, 789.0));
  EXPECT_TRUE(faithful(2.5e-3, 3159.0));
  EXPECT_FALSE(faithful(2.5e-3, 3157.0));
  for (const char* phantom : {"phantom-omni", "phantom-desktop", "premium-1.5", "premium-3.0"})
    EXPECT_LT(find_profile(phantom)->max_stiffness, 3158.0) << phantom;
}

TEST(Renderability, CriteriaAreTheFormulas) {
  TouchConditions t = conditions_of("falcon");
  t.force = 2.0;
  t.speed = 0.03;
  t.stiffness = 1500.0;
  t.tip_radius = 0.4e-3;
  ReliefShape shape = cosine_shape(6e-3, 0.3e-3);
  shape.step = 1e-5;
  const Renderability r = judge_relief(shape, t);
  const double radius = 36e-6 / (4.0 * pi * pi * 0.3e-3);
  EXPECT_NEAR(r.of(Criterion::fidelity).value, 2.0 / 1500.0, 1e-15);
  EXPECT_NEAR(r.of(Criterion::fidelity).limit, radius + 0.4e-3, 2e-4 * radius);
  EXPECT_NEAR(r.of(Criterion::hand).value, 2.0 / 1500.0 + 2.0 / 400.0, 1e-15);
  EXPECT_NEAR(r.of(Criterion::sampling).value, 30e-6, 1e-15);
  EXPECT_NEAR(r.of(Criterion::sampling).limit, 0.75e-3, 1e-15);
  EXPECT_NEAR(r.of(Criterion::resolution).value, 60e-6, 1e-15);
  EXPECT_NEAR(r.of(Criterion::resolution).limit, 0.24e-3, 1e-15);
  EXPECT_NEAR(r.of(Criterion::perception).value, 0.2, 1e-15);
  EXPECT_NEAR(r.of(Criterion::perception).limit, 0.45, 1e-12);
  EXPECT_NEAR(r.of(Criterion::steps).value, 0.015, 1e-12);
  // Small forces: what is noticed at all, not a share.
  t.force = 0.1;
  EXPECT_EQ(judge_relief(shape, t).of(Criterion::perception).value, noticed_force);
}

TEST(Renderability, MeasuresACosineMap) {
  // 8 waves of 64 texels, few enough for the median to come in steps over 40 mm: lambda 5 mm, c 0.5 mm.
  const ReliefShape shape = measure_shape(cosines(512, 8, 0.5e-3), Vec2(0.04, 0.04));
  const ReliefShape exact = cosine_shape(5e-3, 0.5e-3);
  EXPECT_NEAR(shape.range(), exact.range(), 2e-3 * exact.range());
  EXPECT_NEAR(shape.wave, exact.wave, 1e-3 * exact.wave);
  EXPECT_NEAR(shape.finest_wave, exact.wave, 5e-3 * exact.wave);
  EXPECT_NEAR(shape.crests.smallest(), exact.crests.smallest(), 5e-3 * exact.crests.smallest());
  EXPECT_NEAR(shape.crests.sharpest_percent(), exact.crests.sharpest_percent(), 5e-3 * exact.crests.smallest());
  EXPECT_NEAR(shape.crests.median(), exact.crests.median(), 6e-2 * exact.crests.median());
  EXPECT_NEAR(shape.texel, 0.04 / 512, 1e-12);
  // The bend of a cosine is above half of its largest within a sixth of the wave on both sides of a crest.
  EXPECT_NEAR(exact.crests.share_sharper(2.0 * exact.crests.smallest()), 1.0 / 3.0, 1e-3);
  EXPECT_NEAR(shape.crests.share_sharper(2.0 * exact.crests.smallest()), 1.0 / 3.0, 0.02);
  EXPECT_EQ(exact.crests.share_sharper(0.99 * exact.crests.smallest()), 0.0);
  // Creases of bilinear maps by differences.
  const ReliefShape creased = measure_shape(cosines(512, 8, 0.5e-3, Reconstruction::bilinear), Vec2(0.04, 0.04));
  EXPECT_NEAR(creased.crests.smallest(), exact.crests.smallest(), 5e-3 * exact.crests.smallest());
}

TEST(Renderability, WavesOfRidgesAndGrooves) {
  MesostructureSpec ridges;
  ridges.kind = MesostructureKind::serrated;
  ridges.size = 256;
  ridges.count = 16;
  const auto map = generate_height_map(ridges, Wrap::repeat, Reconstruction::bilinear);
  // The mean run of a saw-tooth is half a ridge.
  EXPECT_NEAR(measure_shape(*map, Vec2(0.032, 0.032)).wave, 2e-3, 0.15e-3);
  // A slot of 10 texels in 200: a wave of twice its width, wherever its other end is.
  std::vector<float> slot(200 * 200, 0.0F);
  for (std::size_t y = 0; y < 200; ++y) {
    for (std::size_t x = 50; x < 60; ++x) slot[200 * y + x] = -1e-3F;
  }
  const auto cut = HeightMap::build(slot, 200, 200, Wrap::repeat, Reconstruction::bilinear);
  EXPECT_NEAR(measure_shape(*cut, Vec2(0.2, 0.2)).wave, 0.02, 1e-3);
  const auto flat = HeightMap::build(std::vector<float>(16, 0.5F), 4, 4, Wrap::repeat, Reconstruction::bilinear);
  const ReliefShape none = measure_shape(*flat, Vec2(0.01, 0.01));
  EXPECT_EQ(none.range(), 0.0);
  const Renderability answer = judge_relief(none, conditions_of("touch"));
  EXPECT_FALSE(answer.of(Criterion::perception).passes);
  EXPECT_TRUE(answer.suggestions.empty());
}

/// The map itself with other heights, or on another tile, has the shape that scaling says.
TEST(Renderability, ScalingAShapeIsScalingTheMap) {
  MesostructureSpec spec;
  spec.kind = MesostructureKind::fractal;
  spec.size = 128;
  const auto map = generate_height_map(spec, Wrap::repeat, Reconstruction::quadratic_bspline);
  MesostructureSpec higher = spec;
  higher.amplitude *= 0.3;
  const auto lowered = generate_height_map(higher, Wrap::repeat, Reconstruction::quadratic_bspline);
  const ReliefShape by_hand = measure_shape(*lowered, Vec2(0.07, 0.07));
  const ReliefShape by_rule = scaled(measure_shape(*map, Vec2(0.02, 0.02)), 0.3, 3.5);
  EXPECT_NEAR(by_hand.range(), by_rule.range(), 1e-4 * by_rule.range());
  EXPECT_NEAR(by_hand.wave, by_rule.wave, 1e-3 * by_rule.wave);
  EXPECT_NEAR(by_hand.finest_wave, by_rule.finest_wave, 1e-3 * by_rule.finest_wave);
  EXPECT_NEAR(by_hand.crests.smallest(), by_rule.crests.smallest(), 1e-3 * by_rule.crests.smallest());
  EXPECT_NEAR(by_hand.crests.sharpest_percent(), by_rule.crests.sharpest_percent(),
              1e-3 * by_rule.crests.sharpest_percent());
}

double between(double low, double high) {
  return low * std::pow(high / low, *rc::gen::inRange(0, 1001) / 1000.0);
}

/// A suggestion with one of its changes 5 % short of the boundary, towards where it came from.
RenderSuggestion short_of(RenderSuggestion suggestion, std::size_t which) {
  KnobChange& change = suggestion.changes[which];
  change.to *= change.to > change.from ? 0.95 : 1.05;
  return suggestion;
}

RC_GTEST_PROP(Renderability, SuggestionsAreBoundaries, ()) {
  const auto profiles = device_profiles();
  TouchConditions t;
  t.device = profiles[*rc::gen::inRange<std::size_t>(0, profiles.size())];
  t.hand = hand_presets()[*rc::gen::inRange<std::size_t>(0, hand_presets().size())];
  t.rate = t.device.rate;
  t.force = between(0.05, 20.0);
  t.speed = between(2e-3, 0.5);
  t.stiffness = between(50.0, 2e4);
  t.tip_radius = *rc::gen::arbitrary<bool>() ? between(1e-5, 3e-3) : 0.0;
  ReliefShape shape = cosine_shape(between(1e-4, 0.1), between(1e-6, 0.01));
  shape.step = *rc::gen::arbitrary<bool>() ? shape.range() / between(10.0, 65535.0) : 0.0;
  const Renderability before = judge_relief(shape, t);
  if (before.renderable) RC_ASSERT(before.suggestions.empty());
  for (const RenderSuggestion& suggestion : before.suggestions) {
    const ChangedTouch after = apply_suggestion(suggestion, shape, t);
    RC_ASSERT(judge_relief(after.shape, after.conditions).renderable);
    RC_ASSERT(!suggestion.text.empty());
    for (std::size_t i = 0; i < suggestion.changes.size(); ++i) {
      const ChangedTouch less = apply_suggestion(short_of(suggestion, i), shape, t);
      const bool overshoots = std::abs(std::log(suggestion.changes[i].to / suggestion.changes[i].from)) < 0.051;
      if (!overshoots) RC_ASSERT(!judge_relief(less.shape, less.conditions).renderable);
    }
  }
}

TEST(Renderability, SuggestsEveryWayThereIs) {
  // D5's 2.5 mm grating on a Phantom: stiffness alone is not on offer, the other ways are, each by its formula.
  TouchConditions t = conditions_of("phantom-desktop");
  t.hand.stiffness = 1e9;
  const ReliefShape shape = cosine_shape(2.5e-3, 0.5e-3);
  const Renderability answer = judge_relief(shape, t);
  ASSERT_FALSE(answer.renderable);
  const double radius = shape.crests.sharpest_percent();
  std::array<double, knob_count> to{};
  for (const RenderSuggestion& suggestion : answer.suggestions) {
    ASSERT_EQ(suggestion.changes.size(), 1U);
    to[static_cast<std::size_t>(suggestion.changes[0].knob)] = suggestion.changes[0].to;
  }
  EXPECT_NEAR(to[0], 1e-3 * radius / 1e-3, 6e-3 * to[0]) << "height: R grows as it falls, 1 mm are needed";
  EXPECT_NEAR(to[1], 2.5e-3 * std::sqrt(1e-3 / radius), 6e-3 * to[1]) << "width: R grows with its square";
  EXPECT_NEAR(to[2], radius * 1e3, 6e-3 * to[2]) << "force: F / k = R";
  EXPECT_EQ(to[3], 0.0) << "speed has nothing to do with it";
  EXPECT_EQ(to[4], 0.0) << "stiffer than the device";
  EXPECT_NE(answer.suggestions.front().text.find("widen its waves from 2.5 mm to 4.45 mm"), std::string::npos)
      << answer.suggestions.front().text;
}

TEST(Renderability, SeveralChangesWhereOneDoesNotHelp) {
  // Too faint for the force, and too fine for the encoder.
  TouchConditions t = conditions_of("touch");
  t.stiffness = 400.0;
  const Renderability answer = judge_relief(cosine_shape(0.5e-3, 1e-6), t);
  ASSERT_FALSE(answer.suggestions.empty());
  for (const RenderSuggestion& suggestion : answer.suggestions) EXPECT_GE(suggestion.changes.size(), 2U);
}

TEST(Renderability, DevicesInTheirOrderAtTheirOwnStiffness) {
  TouchConditions t = conditions_of("ideal");
  t.stiffness = 3300.0;
  t.hand.stiffness = 1e6;
  const auto answers = judge_on_devices(cosine_shape(2.5e-3, 0.5e-3), t);
  ASSERT_EQ(answers.size(), device_profiles().size());
  for (std::size_t i = 0; i < answers.size(); ++i) {
    EXPECT_EQ(answers[i].device.name, device_profiles()[i].name);
    EXPECT_EQ(answers[i].stiffness, std::min(3300.0, device_profiles()[i].max_stiffness));
    const bool stiff = device_profiles()[i].max_stiffness >= 3200.0;
    EXPECT_EQ(answers[i].answer.of(Criterion::fidelity).passes, stiff) << answers[i].device.name;
  }
}

TEST(Renderability, FeaturesByFormulaAndBaked) {
  FeatureSpec spec;
  spec.kind = FeatureKind::grating;
  spec.amplitude = 0.2e-3;
  spec.wavelength = Vec2(4e-3, 4e-3);
  const auto grating = SurfaceFeature::build(spec);
  ASSERT_TRUE(grating.ok());
  const auto alone = measure_shape(std::vector<SurfaceFeature>{*grating});
  EXPECT_NEAR(alone->crests.smallest(), cosine_crest_radius(4e-3, 0.2e-3), 1e-15);
  spec.direction = pi / 2.0;
  const auto other = SurfaceFeature::build(spec);
  // Two crossed gratings: crests as round as one's, twice as high.
  const auto both = measure_shape(std::vector<SurfaceFeature>{*grating, *other});
  ASSERT_TRUE(both.ok());
  EXPECT_NEAR(both->range(), 0.8e-3, 0.02e-3);
  EXPECT_NEAR(both->crests.smallest(), alone->crests.smallest(), 0.03 * alone->crests.smallest());
  EXPECT_FALSE(measure_shape(std::vector<SurfaceFeature>{}).ok());
}

/// The sheet M_a of edges of 1, and waves along its first axis.
struct Laid {
  std::shared_ptr<const TriangleMesh> mesh;
  Coat coat;
};
Laid lay(double c, double tile, int count) {
  MeshSource source = icosphere(3, 0.05);
  const auto mesh = std::make_shared<const TriangleMesh>(*TriangleMesh::build(std::move(source)));
  CoatSettings settings;
  settings.mapping = Mapping::triplanar;
  auto maps = std::make_shared<const Mesostructure>(*Mesostructure::build(cosines(256, count, c), Vec2(tile, tile)));
  return {mesh, *Coat::build(*mesh, maps, settings)};
}

TEST(Renderability, CoatsHaveTheTexelsTheyHaveOnTheMesh) {
  const Laid laid = lay(0.2e-3, 0.04, 10);
  const ReliefShape shape = measure_shape(*laid.mesh, laid.coat);
  EXPECT_NEAR(shape.wave, 4e-3, 0.02e-3);
  // Mixed projections and oblique faces change waves; most crests stay near the formula's.
  EXPECT_NEAR(shape.crests.sharpest_percent(), cosine_crest_radius(4e-3, 0.2e-3),
              0.4 * cosine_crest_radius(4e-3, 0.2e-3));
}

TEST(Renderability, BaseMeshRuleOfFifteenPercent) {
  const double edge = lay(1e-4, 0.04, 1).mesh->mean_edge();
  // 14 % of the mean edge is left alone; 40 % is not, and a finer mesh that carries the waves is named.
  const Laid low = lay(0.5 * 0.10 * edge, 8.0 * edge, 1);
  EXPECT_FALSE(advise_base_mesh(*low.mesh, low.coat).exceeded);
  const Laid high = lay(0.5 * 0.60 * edge, 8.0 * edge, 1);
  const BaseMeshAdvice advice = advise_base_mesh(*high.mesh, high.coat);
  EXPECT_TRUE(advice.exceeded);
  EXPECT_NEAR(advice.height_allowed, 0.15 * edge, 1e-12);
  EXPECT_GT(advice.share_of_faces, 0.2);
  ASSERT_GT(advice.subdivisions, 0);
  EXPECT_EQ(advice.triangles, high.mesh->triangles().size() << (2 * advice.subdivisions));
  EXPECT_NEAR(advice.edge_needed, edge / std::exp2(advice.subdivisions), 1e-12);
  // A chord e of a cosine misses its crest by at most c (2 pi / lambda)^2 e^2 / 8.
  const double c = 0.3 * edge;
  const double bend = c * std::pow(2.0 * pi / (8.0 * edge), 2);
  const double sag = bend * advice.edge_needed * advice.edge_needed / 8.0;
  EXPECT_LE(advice.residual, 0.15 * advice.edge_needed);
  EXPECT_NEAR(advice.residual, 2.0 * sag, 0.35 * 2.0 * sag);
}

TEST(Renderability, WallsAreNoMatterOfAFinerMesh) {
  MeshSource source = icosphere(2, 0.05);
  const TriangleMesh mesh = *TriangleMesh::build(std::move(source));
  MesostructureSpec spec;
  spec.kind = MesostructureKind::serrated;
  spec.size = 256;
  spec.count = 4;
  spec.amplitude = 0.5 * mesh.mean_edge();
  const auto map = generate_height_map(spec, Wrap::repeat, Reconstruction::bilinear);
  CoatSettings settings;
  settings.mapping = Mapping::triplanar;
  const auto maps = std::make_shared<const Mesostructure>(*Mesostructure::build(*map, Vec2(0.05, 0.05)));
  const BaseMeshAdvice advice = advise_base_mesh(mesh, *Coat::build(mesh, maps, settings));
  EXPECT_TRUE(advice.exceeded);
  EXPECT_EQ(advice.edge_needed, 0.0);
}

TEST(Renderability, MeasuredTopographies) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::path(ASPERITY_SHARED_DATA) / "topography";
  for (const char* name : {"SainteHelens_height16.png", "matrix-2_height16.png"}) {
    const auto image = read_image((folder / name).string());
    if (!image) GTEST_SKIP() << folder << " is not here";
    HeightMapSettings settings;
    settings.amplitude = 2e-3;
    const auto map = HeightMap::build(*image, Channel::automatic, settings);
    ASSERT_TRUE(map.ok());
    const ReliefShape shape = measure_shape(*map, Vec2(0.06, 0.06));
    EXPECT_GT(shape.wave, shape.finest_wave) << name;
    EXPECT_GE(shape.finest_wave, 2.0 * 0.06 / std::max(map->width(), map->height())) << name << ": below two texels";
    EXPECT_LE(shape.crests.smallest(), shape.crests.sharpest_percent()) << name;
    EXPECT_LE(shape.crests.sharpest_percent(), shape.crests.median()) << name;
    const Renderability answer = judge_relief(shape, conditions_of("phantom-desktop"));
    for (const RenderSuggestion& suggestion : answer.suggestions) {
      const ChangedTouch after = apply_suggestion(suggestion, shape, conditions_of("phantom-desktop"));
      EXPECT_TRUE(judge_relief(after.shape, after.conditions).renderable) << name << ": " << suggestion.text;
    }
  }
}

}  // namespace
}  // namespace asperity::renderability_test
