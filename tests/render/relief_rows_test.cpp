// Row H-II on M_a (hrm-2010, Test II): heights, pulses, spectra and asymmetry of H_1 to H_4.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/render/relief_scans.h"

namespace asperity::relief_rows_test {
namespace {

using namespace test;
using std::numbers::pi;

void expect_heights(MesostructureKind kind) {
  for (const Reconstruction how : {Reconstruction::bilinear, Reconstruction::quadratic_bspline}) {
    const Sheet sheet(kind, how);
    for (const auto& [name, law, has_height] : methods()) {
      const Score score = follow_rows(sheet, law);
      if (has_height) {
        EXPECT_GT(score.excursion(), 0.6 * amplitude) << name;
        EXPECT_LT(score.rms(), 0.05 * amplitude) << name;
      } else {
        EXPECT_LT(score.excursion(), 0.05 * amplitude) << name;
      }
    }
  }
}
TEST(H_II, heights_of_H_2_are_followed_on_M_a_and_force_shading_pushes_without_any) {
  expect_heights(MesostructureKind::beams);
}
TEST(H_II, heights_of_H_3_are_followed_on_M_a_and_force_shading_pushes_without_any) {
  expect_heights(MesostructureKind::rings);
}
TEST(H_II, heights_of_H_4_are_followed_on_M_a_and_force_shading_pushes_without_any) {
  expect_heights(MesostructureKind::warts);
}

/// A stretch of a scan on which the force along the way has one sign.
struct Pulse {
  double from = 0.0;  ///< m from the scan's start
  double to = 0.0;
  double work = 0.0;  ///< J, below 0: against the hand
};
std::vector<Pulse> pulses(const Scan& felt) {
  constexpr double least = 1e-3;  // N
  std::vector<Pulse> found;
  int last = 0;
  for (std::size_t i = 0; i < felt.sideways.size(); ++i) {
    const double force = felt.sideways[i];
    const int sign = force > least ? 1 : force < -least ? -1 : 0;
    const double at = static_cast<double>(i) * felt.spacing;
    if (sign != 0 && sign != last) found.push_back({at, at, 0.0});
    if (sign != 0) {
      found.back().to = at;
      found.back().work += force * felt.spacing;
    }
    last = sign;
  }
  return found;
}

// "With the force shading method the user only perceives resistance on the going up and a jump going down, but no
// height differences": on either side of a beam a pulse, worth the held force times the beam's height each.
TEST(H_II, over_H_2_all_push_at_both_sides_of_each_beam_and_only_heights_rise_between) {
  const Sheet sheet(MesostructureKind::beams);
  // Between two of the three beams along the way; those across are a third of their pitch wide.
  constexpr double start = 0.08;
  const double wide = sheet.box.extent().x();
  const double texel = wide / sheet.texels.size();
  for (const auto& [name, law, has_height] : methods()) {
    const Scan felt = scan(scene_of(sheet.surface, law), sheet.at(start, 1.0 / 3.0), sheet.at(0.92, 1.0 / 3.0), 2000);
    EXPECT_LT(felt.off(), 1e-6) << name;
    const std::vector<Pulse> found = pulses(felt);
    ASSERT_EQ(found.size(), 6U) << name;
    for (std::size_t i = 0; i < 6; ++i) {
      const bool up = i % 2 == 0;
      const double edge = ((static_cast<double>(i / 2) + 0.5 + (up ? -1.0 : 1.0) / 6.0) / 3.0 - start) * wide;
      EXPECT_NEAR(0.5 * (found[i].from + found[i].to), edge, texel) << name;
      EXPECT_NEAR(found[i].work, (up ? -1.0 : 1.0) * 0.25 * amplitude, 0.05 * 0.25 * amplitude) << name;
      if (!up) {
        const double top = 0.5 * (found[i - 1].to + found[i].from);
        const double rise = felt.heights[static_cast<std::size_t>(top / felt.spacing)] - felt.heights.front();
        EXPECT_NEAR(rise, has_height ? amplitude : 0.0, 0.01 * amplitude) << name;
      }
    }
    EXPECT_NEAR(felt.heights.back(), felt.heights.front(), 0.01 * amplitude) << name;
    EXPECT_NEAR(felt.work(0, 2000), 0.0, 0.01 * 0.25 * amplitude) << name;
  }
}

// "In both cases there is some similar resistance to go out, with the force shading method the user only perceives the
// resistance for going up to the oval while with the heightfield method the perception is clearly going up to the oval
// and down from it." Out of the ring of H_3 from its inside: what the hand spends sideways on the way up, the held
// force times the rise, is the same; only under heights it has been lifted for it.
TEST(H_II, out_of_a_ring_of_H_3_all_resist_alike_and_only_heights_go_up_and_down) {
  const Sheet sheet(MesostructureKind::rings);
  constexpr double rise = 0.5 * amplitude;
  for (const auto& [name, law, has_height] : methods()) {
    // The ring around (0.28, 0.72): its crest is 0.17 from there, its feet are 0.06 from the crest.
    const Scan felt =
        scan(scene_of(sheet.surface, law), sheet.at(0.28 + 0.10, 0.72), sheet.at(0.28 + 0.24, 0.72), 1400);
    EXPECT_LT(felt.off(), 1e-6) << name;
    const double up = felt.work(0, 700);
    const double down = felt.work(700, 1400);
    EXPECT_NEAR(up, -0.25 * rise, 0.02 * 0.25 * rise) << name;
    EXPECT_NEAR(down, 0.25 * rise, 0.02 * 0.25 * rise) << name;
    const double lifted = felt.heights[700] - felt.heights[0];
    EXPECT_NEAR(lifted, has_height ? rise : 0.0, 0.05 * rise) << name;
    EXPECT_NEAR(felt.heights[1400] - felt.heights[0], 0.0, 0.05 * rise) << name;
    // All that the hand spends on the way up: nothing under heights, the pulse under force shading.
    EXPECT_NEAR(up + 0.25 * lifted, has_height ? 0.0 : -0.25 * rise, 0.05 * 0.25 * rise) << name;
  }
}

/// Amplitudes of the first lines of what a scan feels, under a Hann window.
std::vector<double> spectrum(const std::vector<double>& signal) {
  constexpr int lines = 100;
  const auto count = static_cast<double>(signal.size());
  double mean = 0.0;
  for (const double value : signal) mean += value / count;
  std::vector<double> amplitudes;
  for (int k = 1; k <= lines; ++k) {
    Vec2 sum = Vec2::Zero();
    for (std::size_t i = 0; i < signal.size(); ++i) {
      const double turn = 2.0 * pi * static_cast<double>(i) / count;
      sum += (0.5 - 0.5 * std::cos(turn)) * (signal[i] - mean) * Vec2(std::cos(k * turn), std::sin(k * turn)) / count;
    }
    amplitudes.push_back(sum.norm());
  }
  return amplitudes;
}

double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  const auto count = static_cast<double>(a.size());
  double mean_a = 0.0;
  double mean_b = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    mean_a += a[i] / count;
    mean_b += b[i] / count;
  }
  double ab = 0.0;
  double aa = 0.0;
  double bb = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    ab += (a[i] - mean_a) * (b[i] - mean_b);
    aa += std::pow(a[i] - mean_a, 2);
    bb += std::pow(b[i] - mean_b, 2);
  }
  return ab / std::sqrt(aa * bb);
}

// "The resulting perception is somehow similar in both methods": the forces sideways have one spectrum, that of the
// held force times the texels' slope; it is not that of another line.
TEST(H_II, over_H_4_the_forces_of_both_methods_have_the_spectrum_of_the_slope) {
  const Sheet sheet(MesostructureKind::warts);
  constexpr double rows[] = {0.28, 0.41, 0.52, 0.66};
  std::vector<std::vector<double>> slopes;
  for (const double t : rows) {
    std::vector<double> slope;
    for (const Vec3& p : line(sheet.at(0.1, t), sheet.at(0.9, t), 1024)) {
      const Vec2 ahead(1e-4, 0.0);
      const Vec2 st = sheet.texture_at(p);
      slope.push_back(-0.25 * (sheet.texels.height(st + ahead) - sheet.texels.height(st - ahead)) /
                      (2e-4 * sheet.box.extent().x()));
    }
    slopes.push_back(spectrum(slope));
  }
  double other = 0.0;
  for (std::size_t i = 0; i < 3; ++i) other = std::max(other, correlation(slopes[i], slopes[i + 1]));
  EXPECT_LT(other, 0.9);
  for (std::size_t row = 0; row < std::size(rows); ++row) {
    for (const auto& [name, law, has_height] : methods()) {
      const Scan felt = scan(scene_of(sheet.surface, law), sheet.at(0.1, rows[row]), sheet.at(0.9, rows[row]), 1024);
      EXPECT_LT(felt.off(), 1e-6) << name;
      EXPECT_GT(correlation(spectrum(felt.sideways), slopes[row]), 0.98) << name << " at " << rows[row];
      EXPECT_EQ(felt.excursion() > 0.2 * amplitude, has_height) << name;
    }
  }
}

// H_1 is steep on its left side: of its heights one texel in 32 rises from left to right, and one falls on the way
// back. Force shading feels the same asymmetry in the force sideways, in heights none.
TEST(H_II, over_H_1_heights_are_asymmetric_by_the_way_and_force_shading_has_none) {
  const Sheet sheet({.kind = MesostructureKind::serrated, .size = 256, .amplitude = amplitude, .count = 8});
  constexpr double texels_a_ridge = 32.0;
  const auto centre = [](double column) { return (column + 0.5) / 256.0; };
  for (const auto& [name, law, has_height] : methods()) {
    const Scene scene = scene_of(sheet.surface, law);
    for (const bool back : {false, true}) {
      // Six ridges, from centre to centre of texels.
      const Vec3 left = sheet.at(centre(30.0), 0.43);
      const Vec3 right = sheet.at(centre(222.0), 0.43);
      const Scan felt = scan(scene, back ? right : left, back ? left : right, 960);
      EXPECT_LT(felt.off(), 1e-6) << name;
      double least = 0.0;
      double most = 0.0;
      for (const double force : felt.sideways) {
        least = std::min(least, force);
        most = std::max(most, force);
      }
      const double steep = back ? most : -least;
      const double gentle = back ? -least : most;
      EXPECT_NEAR(steep / gentle, texels_a_ridge - 1.0, 0.05 * texels_a_ridge) << name;
      int up = 0;
      int down = 0;
      for (std::size_t i = 1; i < felt.heights.size(); ++i) {
        const bool wall = sheet.texels.near_step(sheet.texture_at(0.5 * (felt.places[i] + felt.places[i - 1])));
        const double change = felt.heights[i] - felt.heights[i - 1];
        if (!has_height) {
          // Along a wall the held force is a small part of force shading's.
          EXPECT_NEAR(wall ? 0.0 : change, 0.0, 0.01 * amplitude) << name;
          continue;
        }
        up += change > 1e-8 ? 1 : 0;
        down += change < -1e-8 ? 1 : 0;
      }
      if (!has_height) continue;
      const double asymmetry = static_cast<double>(down - up) / (down + up);
      EXPECT_NEAR(asymmetry, (back ? -1.0 : 1.0) * (texels_a_ridge - 2.0) / texels_a_ridge, 0.01) << name;
    }
  }
}

}  // namespace
}  // namespace asperity::relief_rows_test
