// Built-in volumes: against their formulas, the cavity flow against its own exact slopes, bad members.

#include "asperity/field/volume/generators.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace asperity::volume_generators_test {
namespace {

constexpr VolumeKind all_kinds[] = {VolumeKind::cavity, VolumeKind::sphere, VolumeKind::shells,
                                    VolumeKind::ramp,   VolumeKind::waves,  VolumeKind::gyroid};

VolumeGenerator small(VolumeKind kind) {
  return {.kind = kind, .size = std::array<std::uint32_t, 3>{17, 12, 9}};
}

ScalarGrid scalars(const VolumeGenerator& generator) {
  return std::get<ScalarGrid>(*generate_volume(generator));
}

double ratio_of_widths(const GridAxis& axis) {
  double widest = 0.0;
  for (std::uint32_t i = 0; i < axis.cells(); ++i) widest = std::max(widest, axis.width(i));
  return widest / axis.narrowest();
}

RC_GTEST_PROP(CavityFlow, HasNoDivergenceAndItsExactSlopes, ()) {
  const auto share = [] { return (*rc::gen::inRange(0, 1001)) / 1000.0; };
  VolumeGenerator generator{.kind = VolumeKind::cavity};
  generator.strength = 0.9 * share();
  generator.time = share();
  const CavityFlow flow = *CavityFlow::build(generator);
  const Vec3 p(0.2 * share(), 0.1 * share(), 0.1 * share());
  const Mat3 gradient = flow.gradient(p);
  RC_ASSERT(std::abs(gradient.trace()) <= 1e-12 * (1.0 + gradient.norm()));
  const double h = 1e-6;
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 slope = (flow.velocity(p + h * Vec3::Unit(axis)) - flow.velocity(p - h * Vec3::Unit(axis))) / (2.0 * h);
    RC_ASSERT((slope - gradient.col(axis)).norm() <= 1e-5 * (1.0 + gradient.norm()));
  }
}

TEST(CavityFlow, StreamsAboveAndRecirculatesBelow) {
  const CavityFlow flow = *CavityFlow::build({.kind = VolumeKind::cavity});
  EXPECT_NEAR(flow.velocity({0.1, 0.03, 0.1}).x(), 10.0, 1e-3);
  EXPECT_GT(flow.velocity({0.1, 0.03, 0.035}).x(), 0.5);   // along with the stream
  EXPECT_LT(flow.velocity({0.1, 0.03, 0.015}).x(), -0.5);  // and back along the floor
  EXPECT_TRUE(flow.velocity({0.1, 0.03, -1e3}).allFinite());
}

TEST(CavityFlow, RollsTurnAboutTheMiddleOfTheLayer) {
  // Nothing else flows across the stream: as much to one side above the layer's middle as to the other below it.
  const CavityFlow flow = *CavityFlow::build({.kind = VolumeKind::cavity});
  for (const double x : {0.05, 0.15}) {
    for (const double y : {0.02, 0.03, 0.085}) {
      EXPECT_NEAR(flow.velocity({x, y, 0.05}).y(), 0.0, 1e-12);
      for (const double off : {0.002, 0.008, 0.02}) {
        const double above = flow.velocity({x, y, 0.05 + off}).y();
        EXPECT_NEAR(above, -flow.velocity({x, y, 0.05 - off}).y(), 1e-12);
        EXPECT_GT(std::abs(above), 0.01);
      }
    }
  }
}

TEST(CavityFlow, VorticesComeDownstreamAtHalfTheSpeed) {
  VolumeGenerator generator{.kind = VolumeKind::cavity};
  const auto vorticity = [&](double x, double time) {
    generator.time = time;
    const Mat3 g = CavityFlow::build(generator)->gradient({x, 0.0, 0.05});
    return g(0, 2) - g(2, 0);
  };
  // Downstream the layer's undulation has grown to its full strength: what was here comes by further on.
  for (const double x : {0.150, 0.155, 0.160, 0.165}) {
    const double moved = vorticity(x + 0.005, 0.005 / 5.0);
    EXPECT_NEAR(moved, vorticity(x, 0.0), 0.02 * std::abs(moved));
  }
  const auto profile = [&](double x) { return vorticity(x, 0.0); };
  double low = infinity;
  double high = -infinity;
  for (int n = 0; n <= 40; ++n) {
    low = std::min(low, profile(0.15 + 0.001 * n));
    high = std::max(high, profile(0.15 + 0.001 * n));
  }
  EXPECT_GT(high, 1.5 * low) << "rolled up: vorticity gathers";
}

TEST(CavityFlow, DefaultsAreThePapersGridWithStretchedAxes) {
  const GridAxes axes = *volume_axes({.kind = VolumeKind::cavity});
  EXPECT_EQ(axes[0].size(), 259U);
  EXPECT_EQ(axes[1].size(), 127U);
  EXPECT_EQ(axes[2].size(), 128U);
  EXPECT_FALSE(axes[0].is_uniform());
  EXPECT_TRUE(axes[1].is_uniform());
  EXPECT_FALSE(axes[2].is_uniform());
  EXPECT_NEAR(ratio_of_widths(axes[0]), 6.0, 0.3);
  EXPECT_NEAR(ratio_of_widths(axes[2]), 6.0, 0.3);
  EXPECT_LT(axes[2].width(63), 1.01 * axes[2].narrowest()) << "finest at the layer";
  EXPECT_LT(axes[0].width(0), 1.01 * axes[0].narrowest()) << "finest at the walls";
  EXPECT_NEAR(axes[0].back(), 0.2, 1e-12);
}

TEST(VolumeGenerators, GridsHoldTheirFunction) {
  for (const VolumeKind kind : all_kinds) {
    for (const double stretch : {1.0, 4.0}) {
      VolumeGenerator generator = small(kind);
      generator.stretch = stretch;
      const auto volume = generate_volume(generator);
      ASSERT_TRUE(volume.ok()) << volume.error().message();
      if (kind == VolumeKind::cavity) {
        const VectorGrid& grid = std::get<VectorGrid>(*volume);
        const Vec3 p(grid.axes[0].node(5), grid.axes[1].node(7), grid.axes[2].node(3));
        const Vec3 u = CavityFlow::build(generator)->velocity(p);
        const std::size_t at = 3 * (5 + 17 * (7 + 12 * 3));
        for (int a = 0; a < 3; ++a) EXPECT_EQ(grid.samples[at + static_cast<std::size_t>(a)], static_cast<float>(u[a]));
        continue;
      }
      const ScalarGrid& grid = std::get<ScalarGrid>(*volume);
      const VolumeFunction function = *VolumeFunction::build(generator);
      for (std::uint32_t k = 0; k < 9; ++k) {
        for (std::uint32_t j = 0; j < 12; ++j) {
          for (std::uint32_t i = 0; i < 17; ++i) {
            const double exact = function.value({grid.axis(0).node(i), grid.axis(1).node(j), grid.axis(2).node(k)});
            EXPECT_NEAR(grid.value(i, j, k), exact, 1e-6 * (1.0 + std::abs(exact)));
          }
        }
      }
    }
  }
}

TEST(VolumeGenerators, SphereIsADistance) {
  const VolumeFunction sphere = *VolumeFunction::build({.kind = VolumeKind::sphere, .radius = 0.03});
  EXPECT_NEAR(sphere.value(sphere.centre() + 0.03 * Vec3(1.0, 2.0, -2.0) / 3.0), 0.0, 1e-15);
  EXPECT_NEAR(sphere.value(sphere.centre()), 0.03, 1e-15);
  EXPECT_NEAR(sphere.value(sphere.centre() + Vec3(0.0, 0.04, 0.0)), -0.01, 1e-15);
}

TEST(VolumeGenerators, ShellsHaveTheirFacesWhereTheyShould) {
  const VolumeGenerator generator{.kind = VolumeKind::shells, .wavelength = 0.01, .thickness = 0.0002, .count = 4};
  const VolumeFunction shells = *VolumeFunction::build(generator);
  const Vec3 way = Vec3(2.0, -1.0, 2.0) / 3.0;
  const auto at = [&](double r) { return shells.value(shells.centre() + r * way); };
  for (int n = 1; n <= 4; ++n) {
    EXPECT_NEAR(at(0.01 * n), 1.0, 1e-9);
    EXPECT_NEAR(at(0.01 * n - 0.0002 * n), 0.5, 1e-6);
    EXPECT_NEAR(at(0.01 * n + 0.0002 * n), 0.5, 1e-6);
    EXPECT_NEAR(at(0.01 * n + 0.005), 0.0, 1e-6);
  }
  EXPECT_EQ(at(0.0), 0.0);
  EXPECT_EQ(at(0.05), 0.0);
  // Own values: the innermost sheet is thinner than a cell of its own grid.
  const VolumeGenerator own = completed({.kind = VolumeKind::shells});
  EXPECT_LT(2.0 * *own.thickness, own.extent->x() / ((*own.size)[0] - 1));
}

TEST(VolumeGenerators, RampIsLinearOrLevelsOff) {
  const VolumeFunction linear = *VolumeFunction::build({.kind = VolumeKind::ramp, .gradient = -40.0});
  EXPECT_NEAR(linear.value({0.02, 0.07, 0.06}), -0.4, 1e-12);
  const VolumeFunction layer = *VolumeFunction::build({.kind = VolumeKind::ramp, .amplitude = 2.0, .gradient = 1000.0});
  EXPECT_NEAR((layer.value({0.0, 0.0, 0.05 + 1e-7}) - layer.value({0.0, 0.0, 0.05 - 1e-7})) / 2e-7, 1000.0, 1e-3);
  EXPECT_NEAR(layer.value({0.0, 0.0, 0.1}), 2.0, 1e-6);
  EXPECT_NEAR(layer.value({0.0, 0.0, 0.0}), -2.0, 1e-6);
}

TEST(VolumeGenerators, WavesUndulate) {
  const VolumeFunction waves =
      *VolumeFunction::build({.kind = VolumeKind::waves, .wavelength = 0.02, .amplitude = 1e-4});
  EXPECT_NEAR(waves.value({0.005, 0.01, 0.05 + 1e-4}), 0.0, 1e-12);
  EXPECT_NEAR(waves.value({0.015, 0.03, 0.05 - 1e-4}), 0.0, 1e-12);
  EXPECT_NEAR(waves.value({0.01, 0.03, 0.05}), 0.0, 1e-12);
}

TEST(VolumeGenerators, SteepWavesStandWhereTheOthersDo) {
  const VolumeFunction waves = *VolumeFunction::build(
      {.kind = VolumeKind::waves, .wavelength = 0.02, .thickness = 0.01, .amplitude = 1e-4, .steepness = 400.0});
  for (const double y : {0.0, 0.03, 0.05, 0.09}) {
    EXPECT_NEAR(waves.value({0.005, y, 0.05 + 1e-4}), 0.0, 1e-12);
    EXPECT_NEAR(waves.value({0.015, y, 0.05 - 1e-4}), 0.0, 1e-12);
  }
  // 1 mm over the middle: steepest in the strip's middle, 1 + 399 / e at its half width, plain far from it.
  EXPECT_NEAR(waves.value({0.01, 0.05, 0.051}), 0.4, 1e-12);
  EXPECT_NEAR(waves.value({0.01, 0.04, 0.051}), 1e-3 * (1.0 + 399.0 / std::numbers::e), 1e-9);
  EXPECT_NEAR(waves.value({0.01, 0.0, 0.051}), 1e-3, 1e-11);
  // Rows of a grid differ along y.
  VolumeGenerator generator = small(VolumeKind::waves);
  generator.steepness = 400.0;
  const ScalarGrid grid = scalars(generator);
  const VolumeFunction function = *VolumeFunction::build(generator);
  for (std::uint32_t j = 0; j < grid.axis(1).size(); ++j) {
    const Vec3 p(grid.axis(0).node(2), grid.axis(1).node(j), grid.axis(2).node(1));
    EXPECT_EQ(grid.value(2, j, 1), static_cast<double>(static_cast<float>(function.value(p)))) << j;
  }
}

TEST(VolumeGenerators, SlabsAreTheVolumeInPieces) {
  for (const VolumeKind kind : {VolumeKind::sphere, VolumeKind::shells, VolumeKind::waves, VolumeKind::gyroid}) {
    const VolumeGenerator generator = small(kind);
    const ScalarGrid grid = scalars(generator);
    const auto& samples = std::get<std::vector<float>>(grid.samples());
    const VolumeFunction function = *VolumeFunction::build(generator);
    std::vector<float> slab(std::size_t{17} * 12 * 4);
    function.slab(grid.axes(), 3, 7, slab);
    EXPECT_TRUE(std::equal(slab.begin(), slab.end(), samples.begin() + std::ptrdiff_t{17} * 12 * 3));
  }
}

TEST(VolumeGenerators, IntegerTypesFillTheirRange) {
  VolumeGenerator generator = small(VolumeKind::sphere);
  const ScalarGrid real = scalars(generator);
  for (const SampleType type : {SampleType::int16, SampleType::uint8}) {
    generator.type = type;
    const ScalarGrid grid = scalars(generator);
    EXPECT_EQ(grid.type(), type);
    const bool byte = type == SampleType::uint8;
    EXPECT_EQ(grid.lowest(), byte ? 0.0 : -32768.0);
    EXPECT_EQ(grid.highest(), byte ? 255.0 : 32767.0);
    const double share = (real.value(4, 5, 6) - real.lowest()) / (real.highest() - real.lowest());
    EXPECT_NEAR((grid.value(4, 5, 6) - grid.lowest()) / (grid.highest() - grid.lowest()), share, byte ? 3e-3 : 2e-5);
  }
}

TEST(VolumeGenerators, NamesAreReadBack) {
  for (const VolumeKind kind : all_kinds) {
    EXPECT_EQ(*parse_volume_kind(to_string(kind)), kind);
    EXPECT_FALSE(parameters_of(kind).empty());
    EXPECT_TRUE(validate({.kind = kind}).ok());
  }
  const auto unknown = parse_volume_kind("ball");
  ASSERT_FALSE(unknown);
  EXPECT_NE(unknown.error().accepted.find("sphere"), std::string::npos);
}

TEST(VolumeGenerators, RefusesWhatCannotBe) {
  const auto refusal = [](const VolumeGenerator& generator) {
    const auto volume = generate_volume(generator);
    return volume.ok() ? std::string("none") : volume.error().place;
  };
  const double nan = std::nan("");
  using Size = std::array<std::uint32_t, 3>;
  EXPECT_EQ(refusal({.size = Size{1, 8, 8}}), "size");
  EXPECT_EQ(refusal({.size = Size{8, 8, 5000}}), "size");
  EXPECT_EQ(refusal({.size = Size{4096, 4096, 4096}}), "size");
  EXPECT_EQ(refusal({.kind = VolumeKind::cavity, .size = Size{512, 512, 512}}), "size");
  EXPECT_EQ(refusal({.extent = Vec3(0.1, -0.1, 0.1)}), "extent");
  EXPECT_EQ(refusal({.extent = Vec3(0.1, nan, 0.1)}), "extent");
  EXPECT_EQ(refusal({.stretch = 0.5}), "stretch");
  EXPECT_EQ(refusal({.stretch = nan}), "stretch");
  EXPECT_EQ(refusal({.radius = 0.0}), "radius");
  EXPECT_EQ(refusal({.kind = VolumeKind::shells, .thickness = 0.01}), "thickness");
  EXPECT_EQ(refusal({.kind = VolumeKind::shells, .count = 0}), "count");
  EXPECT_EQ(refusal({.kind = VolumeKind::shells, .wavelength = -1.0}), "wavelength");
  EXPECT_EQ(refusal({.kind = VolumeKind::ramp, .gradient = 0.0}), "gradient");
  EXPECT_EQ(refusal({.kind = VolumeKind::ramp, .amplitude = -1.0}), "amplitude");
  EXPECT_EQ(refusal({.kind = VolumeKind::waves, .amplitude = nan}), "amplitude");
  EXPECT_EQ(refusal({.kind = VolumeKind::waves, .thickness = 0.0}), "thickness");
  EXPECT_EQ(refusal({.kind = VolumeKind::waves, .steepness = 0.5}), "steepness");
  EXPECT_EQ(refusal({.kind = VolumeKind::gyroid, .wavelength = infinity}), "wavelength");
  EXPECT_EQ(refusal({.kind = VolumeKind::cavity, .speed = 0.0}), "speed");
  EXPECT_EQ(refusal({.kind = VolumeKind::cavity, .wavelength = 0.0}), "wavelength");
  EXPECT_EQ(refusal({.kind = VolumeKind::cavity, .thickness = 0.0}), "thickness");
  EXPECT_EQ(refusal({.kind = VolumeKind::cavity, .strength = 1.0}), "strength");
  EXPECT_FALSE(VolumeFunction::build({.kind = VolumeKind::cavity}).ok());
}

}  // namespace
}  // namespace asperity::volume_generators_test
