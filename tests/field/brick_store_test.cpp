// The resident set of a bricked volume: readers that never wait, and always see right values.

#include "asperity/field/brick/store.h"

#include <atomic>
#include <chrono>
#include <thread>

#include "tests/field/brick_fixture.h"

namespace asperity::brick_store_test {
namespace {

constexpr std::size_t byte_brick = 42880;  // of uint8, as it lies in memory

/// A volume, its file, and its levels as grids.
struct Volume {
  ScalarGrid grid;
  std::vector<ScalarGrid> levels;
  std::string bytes;
};

class BrickStoreTest : public BrickFiles {
 protected:
  /// 161 x 97 x 65 nodes: 5 x 3 x 2 bricks, then 3 x 2 x 1, 2 x 1 x 1, 1: 39 in all.
  void SetUp() override {
    BrickFiles::SetUp();
    static const Volume once = made(path());
    volume_ = &once;
    put_bytes(path(), once.bytes);
  }
  [[nodiscard]] std::unique_ptr<BrickStore> open(std::size_t bytes, bool stream) const {
    auto store = BrickStore::open(path(), {.resident_bytes = bytes, .stream = stream});
    EXPECT_TRUE(store.ok()) << store.error().message();
    return std::move(*store);
  }
  /// A box of so many cells around the middle of a cell of the finest level.
  [[nodiscard]] Box around(const CellIndex& cell, std::uint32_t cells) const {
    Box box;
    for (std::size_t a = 0; a < 3; ++a) {
      const GridAxis& axis = grid().axis(a);
      const std::uint32_t low = cell.at[a] > cells ? cell.at[a] - cells : 0;
      const std::uint32_t high = std::min(cell.at[a] + cells, axis.cells() - 1);
      box.lower[static_cast<Eigen::Index>(a)] = axis.node(low) + 0.3 * axis.width(low);
      box.upper[static_cast<Eigen::Index>(a)] = axis.node(high) + 0.7 * axis.width(high);
    }
    return box;
  }
  /// Whether all cells that meet the box at a level are here and right.
  [[nodiscard]] bool right(const BrickStore& store, const Box& box, int level) const {
    const GridAxes& axes = store.axes(level);
    std::array<std::uint32_t, 3> low{};
    std::array<std::uint32_t, 3> high{};
    for (std::size_t a = 0; a < 3; ++a) {
      low[a] = axes[a].locate(box.lower[static_cast<Eigen::Index>(a)]).cell;
      high[a] = axes[a].locate(box.upper[static_cast<Eigen::Index>(a)]).cell;
    }
    for (std::uint32_t k = low[2]; k <= high[2]; ++k) {
      for (std::uint32_t j = low[1]; j <= high[1]; ++j) {
        for (std::uint32_t i = low[0]; i <= high[0]; ++i) {
          double out[64];
          const CellIndex cell{{i, j, k}};
          if (!store.samples(level, cell, out)) return false;
          if (!same_samples(volume_->levels[static_cast<std::size_t>(level)], cell, out)) return false;
        }
      }
    }
    return true;
  }
  [[nodiscard]] const ScalarGrid& grid() const { return volume_->grid; }

 private:
  static Volume made(const std::filesystem::path& file) {
    Volume volume{noise(uneven_axes(161, 97, 65), SampleType::uint8), {}, {}};
    EXPECT_TRUE(write_brick_file(file, volume.grid).ok());
    const auto store = BrickStore::open(file, {.resident_bytes = 64 * byte_brick, .stream = false});
    EXPECT_TRUE(store.ok());
    for (int level = 0; level < (*store)->levels(); ++level) volume.levels.push_back(level_of(**store, level));
    volume.bytes = bytes_of(file);
    return volume;
  }

  const Volume* volume_ = nullptr;
};

TEST_F(BrickStoreTest, FallsBackToWhatIsHere) {
  const auto store = open(64 * byte_brick, false);
  ASSERT_EQ(store->levels(), 4);
  const Box box = around({{50, 50, 20}}, 2);
  store->enter();
  EXPECT_EQ(store->ready_level(box, 0), 2) << "only the coarsest levels are there by themselves";
  EXPECT_TRUE(right(*store, box, 2));
  double out[64] = {-1.0};
  EXPECT_FALSE(store->samples(0, {{50, 50, 20}}, out));
  EXPECT_EQ(out[0], -1.0) << "nothing is written";
  store->leave();
  ASSERT_TRUE(store->fetch(box, 1).ok());
  EXPECT_EQ(store->ready_level(box, 0), 1);
  ASSERT_TRUE(store->fetch(box, 0).ok());
  EXPECT_EQ(store->ready_level(box, 0), 0);
  EXPECT_EQ(store->ready_level(box, 1), 1) << "not finer than asked";
  EXPECT_EQ(store->ready_level(box, 3), 3);
  EXPECT_EQ(store->ready_level(box, 99), 3);
  EXPECT_EQ(store->ready_level(around({{120, 10, 40}}, 2), 0), 2) << "elsewhere nothing has changed";
}

TEST_F(BrickStoreTest, ALevelCoarserThanAnyIsTheCoarsest) {
  const auto store = open(64 * byte_brick, false);
  const std::uint64_t before = store->traffic().bricks_read;
  for (const int level : {store->levels() - 1, store->levels(), store->levels() + 1, 1000}) {
    ASSERT_TRUE(store->fetch(whole(grid().axes()), level).ok()) << level;
    EXPECT_EQ(store->traffic().bricks_read, before) << "which is always there: level " << level;
  }
}

TEST_F(BrickStoreTest, ABoxThatReachesOverABricksBorderNeedsBoth) {
  const auto store = open(64 * byte_brick, false);
  ASSERT_TRUE(store->fetch(around({{30, 10, 10}}, 0), 0).ok());
  EXPECT_EQ(store->ready_level(around({{30, 10, 10}}, 1), 0), 0) << "cells 29 to 31";
  EXPECT_NE(store->ready_level(around({{30, 10, 10}}, 2), 0), 0) << "cells 28 to 32";
  Box touching = around({{30, 10, 10}}, 1);
  touching.upper.x() = grid().axis(0).node(32);
  EXPECT_NE(store->ready_level(touching, 0), 0) << "a box that ends on the border meets the cell behind it";
  ASSERT_TRUE(store->fetch(touching, 0).ok());
  EXPECT_EQ(store->ready_level(touching, 0), 0);
}

TEST_F(BrickStoreTest, BoxesOutsideTheVolumeAreTakenToItsBorder) {
  const auto store = open(64 * byte_brick, false);
  const Box outside{Vec3::Constant(100.0), Vec3::Constant(101.0)};
  ASSERT_TRUE(store->fetch(outside, 0).ok());
  EXPECT_EQ(store->ready_level(outside, 0), 0);
  EXPECT_EQ(store->ready_level(around({{159, 95, 63}}, 1), 0), 0);
  const Box nowhere{Vec3::Constant(std::nan("")), Vec3::Constant(std::nan(""))};
  EXPECT_LE(store->ready_level(nowhere, 0), 3);
  store->look_ahead(Vec3::Constant(std::nan("")), Vec3::Zero());
}

TEST_F(BrickStoreTest, FetchesEverythingThroughAFewSlots) {
  const auto store = open(12 * byte_brick, false);
  EXPECT_EQ(store->traffic().slots, 12U);
  Rng rng(3);
  for (int n = 0; n < 200; ++n) {
    const Box box = around({{rng.below(160), rng.below(96), rng.below(64)}}, 3);
    ASSERT_TRUE(store->fetch(box, 0).ok());
    store->enter();
    EXPECT_EQ(store->ready_level(box, 0), 0);
    EXPECT_TRUE(right(*store, box, 0));
    store->leave();
    EXPECT_LE(store->traffic().bricks_here, 12U);
  }
  EXPECT_GT(store->traffic().bricks_read, 100U);
  const auto refused = store->fetch(whole(grid().axes()), 0);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::too_large);
}

TEST_F(BrickStoreTest, TooLittleMemoryIsRefused) {
  const auto store = BrickStore::open(path(), {.resident_bytes = byte_brick - 1, .stream = false});
  ASSERT_FALSE(store);
  EXPECT_EQ(store.error().code, ErrorCode::too_large);
  const auto least = open(byte_brick, true);
  const Box box = around({{50, 50, 20}}, 2);
  least->look_ahead(box.centre(), Vec3::Zero());
  least->enter();
  EXPECT_EQ(least->ready_level(box, 0), 3);
  EXPECT_TRUE(right(*least, box, 3));
  least->leave();
}

TEST_F(BrickStoreTest, WhatAReaderWasToldIsHereStaysUntilItLeaves) {
  const auto store = open(9 * byte_brick, false);
  const Box box = around({{16, 16, 16}}, 2);
  ASSERT_TRUE(store->fetch(box, 0).ok());
  store->enter();
  ASSERT_EQ(store->ready_level(box, 0), 0);
  std::atomic<bool> fetched{false};
  std::thread other([&] {
    // The whole pool but the pinned: what the reader holds must go.
    Box far;
    far.include(Vec3(grid().axis(0).node(65), grid().axis(1).node(33), grid().axis(2).node(1)));
    far.include(Vec3(grid().axis(0).node(126), grid().axis(1).node(94), grid().axis(2).node(63)));
    EXPECT_TRUE(store->fetch(far, 0).ok());
    EXPECT_TRUE(store->fetch(far, 0).ok());
    fetched = true;
  });
  for (int n = 0; n < 100; ++n) {
    EXPECT_TRUE(right(*store, box, 0));
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_FALSE(fetched) << "it has to wait for the reader";
  store->leave();
  other.join();
  EXPECT_NE(store->ready_level(box, 0), 0);
}

TEST_F(BrickStoreTest, TheBackgroundThreadFetchesWhereTheProbeIsAndGoes) {
  const auto store = open(30 * byte_brick, true);
  const Box here = around({{16, 16, 16}}, 2);
  const Box ahead = around({{120, 16, 16}}, 2);
  // Fast enough that the place ahead is reached within the horizon.
  const Vec3 velocity = (ahead.centre() - here.centre()) / 0.012;
  int polls = 0;
  for (; polls < 2000; ++polls) {
    store->look_ahead(here.centre(), velocity);
    if (store->ready_level(here, 0) == 0 && store->ready_level(ahead, 0) == 0) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_LT(polls, 2000);
  EXPECT_TRUE(store->status().ok());
}

TEST_F(BrickStoreTest, ReadersSeeRightValuesWhileBricksComeAndGo) {
  const auto store = open(14 * byte_brick, true);
  std::atomic<bool> stop{false};
  std::atomic<int> wrong{0};
  std::atomic<int> finest{0};
  std::atomic<int> looks{0};
  const auto reader = [&](std::uint64_t seed) {
    Rng rng(seed);
    CellIndex cell{{rng.below(160), rng.below(96), rng.below(64)}};
    while (!stop) {
      // A walk with jumps: near enough that bricks are there, restless enough that they go.
      for (std::size_t a = 0; a < 3; ++a) {
        const std::uint32_t cells = grid().axis(a).cells();
        cell.at[a] = rng.below(50) == 0 ? rng.below(cells)
                                        : std::min(cell.at[a] + rng.below(5), cells + 1) - 2 + (cell.at[a] < 2 ? 2 : 0);
        cell.at[a] = std::min(cell.at[a], cells - 1);
      }
      const Box box = around(cell, 1);
      store->look_ahead(box.centre(), Vec3(0.1, 0.0, 0.0));
      store->enter();
      const int level = store->ready_level(box, 0);
      for (int n = 0; n < 3; ++n) {
        if (!right(*store, box, level)) ++wrong;
      }
      store->leave();
      finest += level == 0 ? 1 : 0;
      ++looks;
      if (looks % 4 == 0) std::this_thread::sleep_for(std::chrono::microseconds(50));
    }
  };
  std::thread first(reader, 1);
  std::thread second(reader, 2);
  Rng rng(9);
  const auto begin = std::chrono::steady_clock::now();
  while (std::chrono::steady_clock::now() - begin < std::chrono::milliseconds(700)) {
    const Box box = around({{rng.below(160), rng.below(96), rng.below(64)}}, 1);
    EXPECT_TRUE(store->fetch(box, static_cast<int>(rng.below(2))).ok());
    std::this_thread::sleep_for(std::chrono::microseconds(200));
  }
  stop = true;
  first.join();
  second.join();
  EXPECT_EQ(wrong, 0);
  EXPECT_GT(finest, 0);
  EXPECT_GT(store->traffic().bricks_read, 39U) << "bricks have been read again";
  EXPECT_TRUE(store->status().ok());
}

TEST_F(BrickStoreTest, AFileCutWhileOpenLeavesBricksMissing) {
  const auto store = open(64 * byte_brick, true);
  std::filesystem::resize_file(path(), 8192);
  const Box box = around({{50, 50, 20}}, 2);
  const auto fetched = store->fetch(box, 0);
  ASSERT_FALSE(fetched);
  EXPECT_EQ(fetched.error().code, ErrorCode::file_truncated);
  store->look_ahead(box.centre(), Vec3::Zero());
  for (int n = 0; n < 20; ++n) {
    store->enter();
    EXPECT_EQ(store->ready_level(box, 0), 2);
    EXPECT_TRUE(right(*store, box, 2));
    store->leave();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  ASSERT_FALSE(store->status());
  EXPECT_EQ(store->status().error().code, ErrorCode::file_truncated);
}

TEST_F(BrickStoreTest, ADamagedBrickStaysMissing) {
  std::string bytes = bytes_of(path());
  const std::size_t stride = 45056;
  const std::size_t finest = bytes.size() - 39 * stride;
  bytes[finest + 1000] = static_cast<char>(bytes[finest + 1000] ^ 4);
  put_bytes(path("damaged"), bytes);
  const auto store = BrickStore::open(path("damaged"), {.stream = false});
  ASSERT_TRUE(store.ok());
  const auto fetched = (*store)->fetch(around({{1, 1, 1}}, 1), 0);
  ASSERT_FALSE(fetched);
  EXPECT_EQ(fetched.error().code, ErrorCode::file_malformed);
  EXPECT_NE((*store)->ready_level(around({{1, 1, 1}}, 1), 0), 0);
  EXPECT_TRUE((*store)->fetch(around({{50, 1, 1}}, 1), 0).ok()) << "the others are whole";

  // The coarsest level must be whole.
  bytes[bytes.size() - stride + 1000] = static_cast<char>(bytes[bytes.size() - stride + 1000] ^ 4);
  put_bytes(path("damaged"), bytes);
  const auto refused = BrickStore::open(path("damaged"), {.stream = false});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::file_malformed);
}

}  // namespace
}  // namespace asperity::brick_store_test
