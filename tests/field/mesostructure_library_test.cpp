#include "asperity/field/mesostructure/library.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <string>

#include "asperity/field/height/map.h"

namespace asperity::mesostructure_library_test {
namespace {

LibraryRelief made(const std::string& name, int size, std::uint64_t seed = 0) {
  auto relief = library_mesostructure(name, size, seed);
  EXPECT_TRUE(relief.ok()) << (relief.ok() ? "" : relief.error().message());
  return relief.ok() ? std::move(*relief) : LibraryRelief{};
}

TEST(MesostructureLibrary, IsInOrderAndSaysWhatEachIs) {
  const auto library = mesostructure_library();
  EXPECT_GE(library.size(), 16U);
  std::set<std::string> names;
  std::set<std::uint64_t> seeds;
  for (const LibraryEntry& entry : library) {
    EXPECT_TRUE(names.insert(entry.name).second) << entry.name;
    EXPECT_EQ(*names.rbegin(), entry.name) << "the list goes by name";
    EXPECT_EQ(entry.name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-"), std::string::npos) << entry.name;
    EXPECT_GT(entry.summary.size(), 10U);
    EXPECT_LT(entry.summary.size(), 80U) << entry.name;
    EXPECT_TRUE(seeds.insert(entry.seed).second);
    // Between a machined surface and a wall, and no steeper than a relief can stand.
    EXPECT_GT(entry.tile, 1e-4);
    EXPECT_LE(entry.tile, 1.0);
    EXPECT_GT(entry.amplitude, 1e-6);
    EXPECT_LT(entry.amplitude, 0.15 * entry.tile) << entry.name;
  }
}

TEST(MesostructureLibrary, HeightsFillTheRangeThatIsStated) {
  for (const LibraryEntry& entry : mesostructure_library()) {
    const LibraryRelief relief = made(entry.name, 112);
    ASSERT_EQ(relief.heights.size(), 112U * 112U);
    EXPECT_EQ(relief.size, 112);
    EXPECT_EQ(relief.tile, Vec2(entry.tile, entry.tile));
    EXPECT_EQ(relief.amplitude, entry.amplitude);
    const auto [low, high] = std::minmax_element(relief.heights.begin(), relief.heights.end());
    EXPECT_GE(*low, 0.0F) << entry.name;
    EXPECT_LE(*high, static_cast<float>(entry.amplitude)) << entry.name;
    EXPECT_GT(*high - *low, 0.6 * entry.amplitude) << entry.name << ": 112 texels miss a groove's bottom, no more";
  }
}

TEST(MesostructureLibrary, TilesHaveNoSeam) {
  // A seam is a line over which heights change more than between other neighbouring lines.
  constexpr int size = 64;
  for (const LibraryEntry& entry : mesostructure_library()) {
    const LibraryRelief relief = made(entry.name, size);
    const auto at = [&](int x, int y) {
      return static_cast<double>(
          relief.heights[static_cast<std::size_t>(y % size) * size + static_cast<std::size_t>(x % size)]);
    };
    for (const bool along_s : {true, false}) {
      double most_inside = 0.0;
      double seam = 0.0;
      for (int line = 0; line < size; ++line) {
        double sum = 0.0;
        for (int i = 0; i < size; ++i) {
          const double step = along_s ? at(line + 1, i) - at(line, i) : at(i, line + 1) - at(i, line);
          sum += step * step;
        }
        if (line == size - 1) {
          seam = sum;
        } else {
          most_inside = std::max(most_inside, sum);
        }
      }
      EXPECT_LE(seam, 1.3 * most_inside) << entry.name << (along_s ? " along s" : " along t");
    }
  }
}

TEST(MesostructureLibrary, OtherSizesLieOnTheSameRelief) {
  for (const LibraryEntry& entry : mesostructure_library()) {
    const LibraryRelief coarse = made(entry.name, 32);
    const LibraryRelief fine = made(entry.name, 96);
    for (std::size_t y = 0; y < 32; ++y) {
      for (std::size_t x = 0; x < 32; ++x) {
        // The middle texel of three lies where the coarse one does.
        EXPECT_NEAR(coarse.heights[y * 32 + x], fine.heights[(3 * y + 1) * 96 + 3 * x + 1], 1e-5 * entry.amplitude)
            << entry.name;
      }
    }
  }
}

/// Mean and mean square of the heights by the amplitude, and mean square of their steps along s and t.
struct Fingerprint {
  std::array<double, 4> values{};

  explicit Fingerprint(const LibraryRelief& relief) {
    const auto size = static_cast<std::size_t>(relief.size);
    const auto at = [&](std::size_t x, std::size_t y) {
      return static_cast<double>(relief.heights[y % size * size + x % size]) / relief.amplitude;
    };
    for (std::size_t y = 0; y < size; ++y) {
      for (std::size_t x = 0; x < size; ++x) {
        const double height = at(x, y);
        values[0] += height;
        values[1] += height * height;
        values[2] += std::pow(at(x + 1, y) - height, 2);
        values[3] += std::pow(at(x, y + 1) - height, 2);
      }
    }
    for (double& value : values) value /= static_cast<double>(size * size);
  }
};

TEST(MesostructureLibrary, EachIsTheSameInEveryVersion) {
  // A study that names a relief means this one. Whoever changes one gives it another name.
  const std::map<std::string, std::array<double, 4>> known = {
      {"ball-milled-steel", {0.357392, 0.181825, 0.076749, 0.033772}},
      {"bark", {0.400890, 0.242867, 0.078927, 0.021874}},
      {"basket", {0.850688, 0.734819, 0.010134, 0.010208}},
      {"braille", {0.035617, 0.008013, 0.014497, 0.005199}},
      {"bricks", {0.858872, 0.739716, 0.000807, 0.001553}},
      {"brushed-steel", {0.509579, 0.284354, 0.002365, 0.051116}},
      {"cobblestones", {0.454477, 0.320975, 0.089785, 0.089956}},
      {"corduroy", {0.674288, 0.552573, 0.102663, 0.001996}},
      {"denim", {0.793587, 0.646367, 0.036206, 0.017022}},
      {"diamond-plate", {0.188361, 0.165459, 0.150609, 0.150630}},
      {"file-teeth", {0.425444, 0.235239, 0.057090, 0.096962}},
      {"fish-scales", {0.711110, 0.525904, 0.025371, 0.040438}},
      {"hammered-copper", {0.339717, 0.156318, 0.014627, 0.014693}},
      {"honeycomb", {0.358903, 0.306355, 0.208601, 0.202894}},
      {"knit", {0.657966, 0.491676, 0.084105, 0.029304}},
      {"knurled-metal", {0.377563, 0.212914, 0.071380, 0.026509}},
      {"leather", {0.417755, 0.220452, 0.081550, 0.082437}},
      {"linen", {0.750298, 0.583068, 0.030894, 0.031051}},
      {"orange-peel", {0.671600, 0.476148, 0.031707, 0.031168}},
      {"pebbles", {0.557230, 0.360649, 0.019983, 0.018899}},
      {"record-groove", {0.706783, 0.667716, 0.002665, 0.502539}},
      {"ribbed-rubber", {0.479402, 0.427968, 0.083953, 0.000022}},
      {"ripple-sand", {0.424396, 0.268491, 0.093964, 0.016599}},
      {"roughcast", {0.354815, 0.162441, 0.037256, 0.041518}},
      {"sandpaper-p240", {0.346576, 0.184064, 0.080683, 0.077406}},
      {"sandpaper-p80", {0.338859, 0.170919, 0.070759, 0.067759}},
      {"stud-plate", {0.277387, 0.269924, 0.110238, 0.110260}},
      {"tactile-paving", {0.281867, 0.112869, 0.035648, 0.035648}},
      {"wood", {0.766376, 0.615951, 0.049671, 0.011719}},
  };
  for (const LibraryEntry& entry : mesostructure_library()) {
    const auto found = known.find(entry.name);
    if (found == known.end()) {
      ADD_FAILURE() << entry.name << " is new: it belongs into the list";
      continue;
    }
    const Fingerprint now(made(entry.name, 48));
    for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(now.values[i], found->second[i], 2e-6) << entry.name << ' ' << i;
  }
  EXPECT_EQ(known.size(), mesostructure_library().size());
}

TEST(MesostructureLibrary, IsItsSeeds) {
  for (const char* name : {"leather", "sandpaper-p80", "linen", "ripple-sand"}) {
    const LibraryRelief one = made(name, 48);
    EXPECT_EQ(one.heights, made(name, 48).heights) << name;
    EXPECT_EQ(one.heights, made(name, 48, library_entry(name)->seed).heights) << name;
    EXPECT_NE(one.heights, made(name, 48, 12345).heights) << name;
  }
  // The two papers are not one map at two sizes.
  const LibraryRelief coarse = made("sandpaper-p80", 48);
  const LibraryRelief fine = made("sandpaper-p240", 48);
  EXPECT_NE(coarse.heights[100] / coarse.amplitude, fine.heights[100] / fine.amplitude);
}

/// Crests along a row of texels: local maxima that stand above the middle of the range.
int crests(const LibraryRelief& relief, int row) {
  int count = 0;
  const auto at = [&](int x) {
    return static_cast<double>(relief.heights[static_cast<std::size_t>(row) * static_cast<std::size_t>(relief.size) +
                                              static_cast<std::size_t>((x + relief.size) % relief.size)]);
  };
  for (int x = 0; x < relief.size; ++x) {
    if (at(x) >= 0.5 * relief.amplitude && at(x - 1) < 0.5 * relief.amplitude) ++count;
  }
  return count;
}

TEST(MesostructureLibrary, FeaturesHaveTheSizesThatAreStated) {
  // Ribs 3 mm apart on 12 mm; studs 8 mm apart on 40 mm.
  EXPECT_EQ(crests(made("ribbed-rubber", 128), 64), 4);
  const LibraryRelief studs = made("stud-plate", 200);
  EXPECT_EQ(crests(studs, 20), 5) << "through the middles of a row of studs";
  EXPECT_EQ(crests(studs, 0), 0) << "between two rows";
  const auto covered = static_cast<double>(
      std::count_if(studs.heights.begin(), studs.heights.end(), [](float h) { return h > 0.85e-3F; }));
  EXPECT_NEAR(covered / 40000.0, 3.14159 * 2.375 * 2.375 / 64.0, 0.01) << "studs of 4.8 mm";
  // The first cell holds an a: the upper left dot alone, 1.75 mm from the left and 2.5 mm from the top.
  const LibraryRelief braille = made("braille", 480);
  const auto at = [&](double x, double y) {
    return static_cast<double>(
        braille.heights[static_cast<std::size_t>(y * 8.0) * 480 + static_cast<std::size_t>(x * 8.0)]);
  };
  EXPECT_GT(at(1.75, 2.5), 0.45e-3);
  EXPECT_LT(at(4.25, 2.5), 0.05e-3);
  EXPECT_LT(at(1.75, 5.0), 0.05e-3);
  EXPECT_LT(at(1.75, 7.5), 0.05e-3);
}

TEST(MesostructureLibrary, MakesHeightMaps) {
  const LibraryRelief relief = made("hammered-copper", 64);
  auto map =
      HeightMap::build(relief.heights, relief.size, relief.size, Wrap::repeat, Reconstruction::quadratic_bspline);
  ASSERT_TRUE(map.ok());
  EXPECT_NEAR(map->height_at(Vec2(0.3, 1.0)), map->height_at(Vec2(0.3, 0.0)), 1e-9);
}

TEST(MesostructureLibrary, RefusesWithTheNearestName) {
  const auto unknown = library_mesostructure("linnen");
  ASSERT_FALSE(unknown.ok());
  EXPECT_EQ(unknown.error().code, ErrorCode::bad_value);
  EXPECT_NE(unknown.error().message().find("did you mean 'linen'"), std::string::npos) << unknown.error().message();
  EXPECT_FALSE(library_entry("").ok());
  for (const int size : {0, -5, 15, 4097}) {
    const auto relief = library_mesostructure("linen", size);
    ASSERT_FALSE(relief.ok());
    EXPECT_EQ(relief.error().place, "size");
  }
}

}  // namespace
}  // namespace asperity::mesostructure_library_test
