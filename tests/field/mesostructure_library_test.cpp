#include "asperity/field/mesostructure/library.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
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
