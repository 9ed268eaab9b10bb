#pragma once
// Volumes and files that the tests of bricked volumes share.

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "asperity/core/rng.h"
#include "asperity/field/brick/file.h"
#include "asperity/field/brick/store.h"

namespace asperity {

/// A folder of its own for each test.
class BrickFiles : public testing::Test {
 protected:
  void SetUp() override {
    const testing::TestInfo* test = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::temp_directory_path() /
              (std::string("asperity-bricks-") + test->name() + "-" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  [[nodiscard]] std::filesystem::path path(const char* name = "volume.aspvol") const { return folder_ / name; }
  [[nodiscard]] std::size_t files() const {
    return static_cast<std::size_t>(
        std::distance(std::filesystem::directory_iterator(folder_), std::filesystem::directory_iterator()));
  }
  static std::string bytes_of(const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  }
  static void put_bytes(const std::filesystem::path& file, const std::string& bytes) {
    std::ofstream(file, std::ios::binary) << bytes;
  }

 private:
  std::filesystem::path folder_;
};

inline GridAxis uneven_axis(std::uint32_t count, double from, double width) {
  std::vector<double> nodes(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const double s = static_cast<double>(i) / (count - 1);
    nodes[i] = from + width * (s + 0.12 * std::sin(6.0 * s));
  }
  return *GridAxis::build(std::move(nodes));
}

inline GridAxes uneven_axes(std::uint32_t x, std::uint32_t y, std::uint32_t z) {
  return {uneven_axis(x, -1.0, 2.0), uneven_axis(y, 0.0, 1.0), uneven_axis(z, 5.0, 0.5)};
}

/// Seeded noise in the range of the sample type.
inline ScalarGrid noise(GridAxes axes, SampleType type = SampleType::float32) {
  Rng rng(7);
  const std::size_t count = std::size_t{axes[0].size()} * axes[1].size() * axes[2].size();
  const auto fill = [&](auto samples) {
    samples.resize(count);
    for (auto& sample : samples) sample = static_cast<typename decltype(samples)::value_type>(rng.below(200));
    return SampleArray(std::move(samples));
  };
  switch (type) {
    case SampleType::int16: return *ScalarGrid::build(std::move(axes), fill(std::vector<std::int16_t>()), "noise");
    case SampleType::uint8: return *ScalarGrid::build(std::move(axes), fill(std::vector<std::uint8_t>()), "noise");
    case SampleType::float32: break;
  }
  return *ScalarGrid::build(std::move(axes), fill(std::vector<float>()), "noise");
}

/// Sample of a grid, places beyond its ends repeating the end.
inline double clamped_value(const ScalarGrid& grid, std::int64_t i, std::int64_t j, std::int64_t k) {
  const auto within = [&](std::int64_t n, std::size_t a) {
    return static_cast<std::uint32_t>(std::clamp<std::int64_t>(n, 0, grid.axis(a).size() - 1));
  };
  return grid.value(within(i, 0), within(j, 1), within(k, 2));
}

/// Whether 64 samples around a cell are the grid's, bit by bit but for the kind of not-a-number.
inline bool same_samples(const ScalarGrid& grid, const CellIndex& cell, const double samples[64]) {
  for (int n = 0; n < 64; ++n) {
    const double expected =
        clamped_value(grid, std::int64_t{cell.at[0]} - 1 + n % 4, std::int64_t{cell.at[1]} - 1 + n / 4 % 4,
                      std::int64_t{cell.at[2]} - 1 + n / 16);
    if (samples[n] != expected && !(std::isnan(samples[n]) && std::isnan(expected))) return false;
  }
  return true;
}

inline Box whole(const GridAxes& axes) {
  return {{axes[0].front(), axes[1].front(), axes[2].front()}, {axes[0].back(), axes[1].back(), axes[2].back()}};
}

/// A level of a bricked file as a grid: all its bricks are fetched.
inline ScalarGrid level_of(const BrickStore& store, int level) {
  const GridAxes& axes = store.axes(level);
  EXPECT_TRUE(store.fetch(whole(axes), level).ok());
  std::vector<float> samples;
  for (std::uint32_t k = 0; k < axes[2].size(); ++k) {
    for (std::uint32_t j = 0; j < axes[1].size(); ++j) {
      for (std::uint32_t i = 0; i < axes[0].size(); ++i) {
        // Node i is the second of its cell's four samples, or the third where the cell ends there.
        const std::uint32_t at[3] = {i, j, k};
        CellIndex cell;
        int n = 0;
        for (std::size_t a = 3; a-- > 0;) {
          cell.at[a] = std::min(at[a], axes[a].cells() - 1);
          n = 4 * n + (at[a] > cell.at[a] ? 2 : 1);
        }
        double out[64];
        store.enter();
        EXPECT_TRUE(store.samples(level, cell, out));
        store.leave();
        samples.push_back(static_cast<float>(out[n]));
      }
    }
  }
  return *ScalarGrid::build(axes, std::move(samples));
}

}  // namespace asperity
