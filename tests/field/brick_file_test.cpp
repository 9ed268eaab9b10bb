// Bricked files: what is written is what is read, coarser levels against a plain smoothing, damage and bad input.

#include "asperity/field/brick/file.h"

#include <sys/resource.h>
#include <sys/stat.h>

#include <csignal>

#include "tests/field/brick_fixture.h"

namespace asperity::brick_file_test {
namespace {

using BrickFile = BrickFiles;

std::unique_ptr<BrickStore> opened(const std::filesystem::path& file) {
  auto store = BrickStore::open(file, {.stream = false});
  EXPECT_TRUE(store.ok()) << store.error().message();
  return std::move(*store);
}

std::string refusal(const std::filesystem::path& file) {
  const auto store = BrickStore::open(file, {.stream = false});
  return store.ok() ? "none" : to_string(store.error().code);
}

/// Weights of the fine nodes f - 1, f, f + 1 in the coarse node at f: half for the middle, the rest so that x itself is
/// kept; nothing but the middle at an end.
std::array<double, 3> oracle_weights(const GridAxis& axis, std::uint32_t f) {
  if (f == 0 || f + 1 == axis.size()) return {0.0, 1.0, 0.0};
  // w- + w+ = 1/2 and w- x- + w+ x+ = x / 2.
  const double low = axis.node(f - 1) - axis.node(f);
  const double high = axis.node(f + 1) - axis.node(f);
  const double upper = 0.5 * low / (low - high);
  return {0.5 - upper, 0.5, upper};
}

double oracle_smoothed(const ScalarGrid& fine, const std::array<std::uint32_t, 3>& at) {
  std::array<std::array<double, 3>, 3> w{};
  for (std::size_t a = 0; a < 3; ++a) w[a] = oracle_weights(fine.axis(a), at[a]);
  double sum = 0.0;
  for (int n = 0; n < 27; ++n) {
    const int i = n % 3;
    const int j = n / 3 % 3;
    const int k = n / 9;
    sum += w[0][static_cast<std::size_t>(i)] * w[1][static_cast<std::size_t>(j)] * w[2][static_cast<std::size_t>(k)] *
           clamped_value(fine, std::int64_t{at[0]} + i - 1, std::int64_t{at[1]} + j - 1, std::int64_t{at[2]} + k - 1);
  }
  return sum;
}

TEST_F(BrickFile, HoldsEverySampleOfEveryTypeUpToTheBorders) {
  for (const SampleType type : {SampleType::float32, SampleType::int16, SampleType::uint8}) {
    const ScalarGrid grid = noise(uneven_axes(66, 35, 33), type);
    const auto summary = write_brick_file(path(), grid);
    ASSERT_TRUE(summary.ok()) << summary.error().message();
    EXPECT_EQ(summary->levels, 3U);
    EXPECT_EQ(summary->bricks, 3U * 2U * 1U + 2U + 1U);
    EXPECT_EQ(summary->file_bytes, std::filesystem::file_size(path()));
    const auto store = opened(path());
    EXPECT_EQ(store->type(), type);
    EXPECT_EQ(store->name(), "noise");
    EXPECT_EQ(store->lowest(), grid.lowest());
    EXPECT_EQ(store->highest(), grid.highest());
    for (std::size_t a = 0; a < 3; ++a)
      EXPECT_TRUE(std::equal(store->axes(0)[a].nodes().begin(), store->axes(0)[a].nodes().end(),
                             grid.axis(a).nodes().begin(), grid.axis(a).nodes().end()));
    ASSERT_TRUE(store->fetch(whole(grid.axes()), 0).ok());
    int wrong = 0;
    for (std::uint32_t k = 0; k < 32; ++k) {
      for (std::uint32_t j = 0; j < 34; ++j) {
        for (std::uint32_t i = 0; i < 65; ++i) {
          double out[64];
          const CellIndex cell{{i, j, k}};
          if (!store->samples(0, cell, out) || !same_samples(grid, cell, out)) ++wrong;
        }
      }
    }
    EXPECT_EQ(wrong, 0) << to_string(type);
    double out[64];
    EXPECT_FALSE(store->samples(0, CellIndex{{65, 0, 0}}, out)) << "beyond the last cell";
  }
}

TEST_F(BrickFile, ANameThatIsTooLongIsCutAndStillReads) {
  const ScalarGrid grid = noise(uneven_axes(5, 4, 3));
  for (const std::size_t length : {std::size_t{4095}, std::size_t{4096}, std::size_t{5000}}) {
    std::string name(length, 'n');
    for (std::size_t i = 0; i < length; i += 7) name[i] = static_cast<char>('a' + i % 26);
    ASSERT_TRUE(write_brick_file(path(), *ScalarGrid::build(grid.axes(), grid.samples(), name)).ok());
    ASSERT_EQ(refusal(path()), "none") << length;
    EXPECT_EQ(opened(path())->name(), name.substr(0, 4096)) << length;
  }
}

TEST_F(BrickFile, TheSmallestAndTheThinnestVolumesWork) {
  for (const GridAxes& axes : {uneven_axes(2, 2, 2), uneven_axes(100, 2, 3), uneven_axes(2, 34, 33)}) {
    const ScalarGrid grid = noise(axes);
    ASSERT_TRUE(write_brick_file(path(), grid).ok());
    const auto store = opened(path());
    const ScalarGrid read = level_of(*store, 0);
    EXPECT_EQ(std::get<std::vector<float>>(read.samples()), std::get<std::vector<float>>(grid.samples()));
    EXPECT_EQ(store->octree(store->levels() - 1).count(0, 0), 1U);
  }
}

TEST_F(BrickFile, CoarserLevelsAreSmoothedEverySecondNodes) {
  for (const SampleType type : {SampleType::float32, SampleType::int16, SampleType::uint8}) {
    ScalarGrid fine = noise(uneven_axes(71, 34, 40), type);
    ASSERT_TRUE(write_brick_file(path(), fine).ok());
    const auto store = opened(path());
    ASSERT_EQ(store->levels(), 3);
    for (int level = 1; level < 3; ++level) {
      const ScalarGrid coarse = level_of(*store, level);
      double worst = 0.0;
      for (std::uint32_t k = 0; k < coarse.axis(2).size(); ++k) {
        for (std::uint32_t j = 0; j < coarse.axis(1).size(); ++j) {
          for (std::uint32_t i = 0; i < coarse.axis(0).size(); ++i) {
            const std::uint32_t at[3] = {i, j, k};
            std::array<std::uint32_t, 3> f{};
            for (std::size_t a = 0; a < 3; ++a) {
              f[a] = std::min(2 * at[a], fine.axis(a).size() - 1);
              ASSERT_EQ(coarse.axis(a).node(at[a]), fine.axis(a).node(f[a]));
            }
            worst = std::max(worst, std::abs(coarse.value(i, j, k) - oracle_smoothed(fine, f)));
          }
        }
      }
      EXPECT_LE(worst, type == SampleType::float32 ? 1e-4 : 0.501);
      fine = level_of(*store, level);
    }
  }
}

TEST_F(BrickFile, LinearFieldsAreTheSameAtEveryLevel) {
  const GridAxes axes = uneven_axes(100, 50, 70);
  const auto plane = [](double x, double y, double z) { return 3.0 * x - 2.0 * y + 4.0 * z - 1.0; };
  std::vector<float> samples;
  for (const double z : axes[2].nodes()) {
    for (const double y : axes[1].nodes()) {
      for (const double x : axes[0].nodes()) samples.push_back(static_cast<float>(plane(x, y, z)));
    }
  }
  ASSERT_TRUE(write_brick_file(path(), *ScalarGrid::build(axes, samples)).ok());
  const auto store = opened(path());
  for (int level = 0; level < store->levels(); ++level) {
    const ScalarGrid grid = level_of(*store, level);
    for (std::uint32_t n = 0; n < grid.axis(2).size(); ++n) {
      const std::uint32_t i = n % grid.axis(0).size();
      const std::uint32_t j = n % grid.axis(1).size();
      EXPECT_NEAR(grid.value(i, j, n), plane(grid.axis(0).node(i), grid.axis(1).node(j), grid.axis(2).node(n)), 1e-5);
    }
  }
}

TEST_F(BrickFile, RangesHoldEverySampleThatABricksCellsNeed) {
  const ScalarGrid grid = noise(uneven_axes(70, 66, 40));
  ASSERT_TRUE(write_brick_file(path(), grid).ok());
  const auto store = opened(path());
  for (int level = 0; level < store->levels(); ++level) {
    ASSERT_TRUE(store->fetch(whole(grid.axes()), level).ok());
    const GridAxes& axes = store->axes(level);
    for (std::uint32_t k = 0; k < axes[2].cells(); k += 3) {
      for (std::uint32_t j = 0; j < axes[1].cells(); ++j) {
        for (std::uint32_t i = 0; i < axes[0].cells(); ++i) {
          double out[64];
          ASSERT_TRUE(store->samples(level, CellIndex{{i, j, k}}, out));
          const ValueRange& range = store->octree(level).range({0, {i / 32, j / 32, k / 32}});
          const auto [low, high] = std::minmax_element(out, out + 64);
          ASSERT_GE(*low, static_cast<double>(range.lower));
          ASSERT_LE(*high, static_cast<double>(range.upper));
        }
      }
    }
  }
}

TEST_F(BrickFile, HolesStayHolesAndDoNotGrow) {
  const GridAxes axes = uneven_axes(40, 36, 34);
  std::vector<float> samples(std::size_t{40} * 36 * 34, 2.0F);
  const auto index = [](std::size_t i, std::size_t j, std::size_t k) { return i + 40 * (j + 36 * k); };
  samples[index(10, 12, 14)] = std::nanf("");
  samples[index(21, 12, 14)] = std::nanf("");
  const ScalarGrid grid = *ScalarGrid::build(axes, samples);
  const auto summary = write_brick_file(path(), grid);
  ASSERT_TRUE(summary.ok());
  EXPECT_EQ(summary->unknown, 2U);
  const auto store = opened(path());
  EXPECT_EQ(level_of(*store, 0).unknown(), 2U);
  const ScalarGrid coarse = level_of(*store, 1);
  EXPECT_EQ(coarse.unknown(), 1U);
  EXPECT_TRUE(std::isnan(coarse.value(5, 6, 7)));
  EXPECT_EQ(coarse.lowest(), 2.0);
  EXPECT_EQ(coarse.highest(), 2.0);
}

TEST_F(BrickFile, SlabsAreAskedForOnceInOrder) {
  const GridAxes axes = uneven_axes(300, 300, 70);
  std::uint32_t next = 0;
  std::size_t largest = 0;
  const auto source = [&](std::uint32_t first, std::uint32_t last, SampleArray& out) {
    EXPECT_EQ(first, next);
    next = last;
    auto& samples = std::get<std::vector<std::uint8_t>>(out);
    EXPECT_EQ(samples.size(), std::size_t{90000} * (last - first));
    largest = std::max(largest, samples.size());
    std::fill(samples.begin(), samples.end(), static_cast<std::uint8_t>(first));
    return success();
  };
  double reported = -1.0;
  const auto progress = [&](std::string_view, double fraction) {
    EXPECT_GE(fraction, reported);
    reported = fraction;
  };
  ASSERT_TRUE(write_brick_file(path(), axes, SampleType::uint8, "steps", source, progress).ok());
  EXPECT_EQ(next, 70U);
  EXPECT_GE(reported, 0.0);
  EXPECT_EQ(files(), 1U) << "nothing is left beside it";
}

TEST_F(BrickFile, WritingAGreatVolumeTakesLittleMemory) {
  const GridAxis axis = *GridAxis::uniform(0.0, 1e-4, 1024);
  EXPECT_LT(brick_writer_memory({axis, axis, axis}, SampleType::float32), std::size_t{400} << 20U);
}

TEST_F(BrickFile, AFailedSourceLeavesTheOldFileAlone) {
  put_bytes(path(), "old");
  const auto fails = [](std::uint32_t, std::uint32_t, SampleArray&) {
    return Status(Error{ErrorCode::mismatch, "no more", "", "", ""});
  };
  const auto written = write_brick_file(path(), uneven_axes(9, 9, 9), SampleType::float32, "x", fails);
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().what, "no more");
  EXPECT_EQ(bytes_of(path()), "old");
  EXPECT_EQ(files(), 1U);
}

TEST_F(BrickFile, RefusesSamplesThatCannotBe) {
  const auto written = [&](SampleArray slab) {
    const auto source = [&](std::uint32_t, std::uint32_t, SampleArray& out) {
      out = slab;
      return success();
    };
    const auto result = write_brick_file(path(), uneven_axes(4, 4, 4), SampleType::float32, "u", source);
    return result.ok() ? std::string("none") : result.error().message();
  };
  std::vector<float> samples(64, 1.0F);
  EXPECT_EQ(written(samples), "none");
  samples[2 + 4 * (1 + 4 * 3)] = std::numeric_limits<float>::infinity();
  EXPECT_NE(written(samples).find("(2, 1, 3)"), std::string::npos) << written(samples);
  EXPECT_NE(written(std::vector<float>(64, std::nanf(""))).find("no sample that is a number"), std::string::npos);
  EXPECT_NE(written(std::vector<float>(63, 1.0F)).find("slab"), std::string::npos);
  EXPECT_NE(written(std::vector<std::uint8_t>(64)).find("slab"), std::string::npos);
}

TEST_F(BrickFile, AFullDiskIsAnErrorAndLeavesNothing) {
  put_bytes(path(), "old");
  const ScalarGrid grid = noise(uneven_axes(40, 40, 40));
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit small = before;
  small.rlim_cur = 100000;
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  const auto written = write_brick_file(path(), grid);
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().code, ErrorCode::file_unwritable);
  EXPECT_EQ(bytes_of(path()), "old");
  EXPECT_EQ(files(), 1U);
}

TEST_F(BrickFile, RefusesPlacesThatCannotBeWritten) {
  const ScalarGrid grid = noise(uneven_axes(4, 4, 4));
  EXPECT_EQ(write_brick_file(path("no/such/folder.aspvol"), grid).error().code, ErrorCode::file_unwritable);
  std::filesystem::create_directory(path("folder"));
  EXPECT_EQ(write_brick_file(path("folder"), grid).error().code, ErrorCode::file_unwritable);
  EXPECT_EQ(files(), 1U);
}

TEST_F(BrickFile, RefusesWhatIsNoBrickedFile) {
  EXPECT_EQ(refusal(path("missing")), "file_missing");
  put_bytes(path("empty"), "");
  EXPECT_EQ(refusal(path("empty")), "file_empty");
  put_bytes(path("text"),
            "# vtk DataFile Version 3.0\n and so on, for more bytes than a prefix has, so that all is there");
  EXPECT_EQ(refusal(path("text")), "file_malformed");
  put_bytes(path("short"), "ASP");
  EXPECT_EQ(refusal(path("short")), "file_truncated");
  EXPECT_EQ(refusal(path("").parent_path()), "file_unsupported");
  ASSERT_EQ(::mkfifo(path("pipe").c_str(), 0600), 0);
  EXPECT_EQ(refusal(path("pipe")), "file_unsupported");
}

TEST_F(BrickFile, TruncatedAnywhereIsSaidSo) {
  ASSERT_TRUE(write_brick_file(path(), noise(uneven_axes(40, 5, 5), SampleType::uint8)).ok());
  const std::string bytes = bytes_of(path());
  put_bytes(path("cut"), bytes);
  for (std::size_t length = bytes.size() - 1; length > 0;
       length = length > 1000 ? std::max<std::size_t>(1000, length - length / 4) : length - 1) {
    std::filesystem::resize_file(path("cut"), length);
    const auto store = BrickStore::open(path("cut"), {.stream = false});
    ASSERT_FALSE(store) << length;
    EXPECT_EQ(store.error().code, ErrorCode::file_truncated) << length << ": " << store.error().message();
    EXPECT_EQ(store.error().file, path("cut").string());
    EXPECT_NE(store.error().place.find("byte"), std::string::npos);
  }
  put_bytes(path("cut"), bytes + "x");
  EXPECT_EQ(refusal(path("cut")), "file_malformed");
}

TEST_F(BrickFile, AFlippedBitAnywhereInTheHeaderIsFound) {
  ASSERT_TRUE(write_brick_file(path(), noise(uneven_axes(40, 5, 5), SampleType::uint8)).ok());
  const std::string bytes = bytes_of(path());
  BrickFilePrefix prefix{};
  std::memcpy(&prefix, bytes.data(), sizeof prefix);
  std::fstream file(path(), std::ios::binary | std::ios::in | std::ios::out);
  const auto put = [&](std::size_t at, char value) {
    file.seekp(static_cast<std::streamoff>(at));
    file.put(value).flush();
  };
  for (std::size_t at = 0; at < prefix.header_bytes; ++at) {
    put(at, static_cast<char>(bytes[at] ^ (1 << (at % 8))));
    EXPECT_NE(refusal(path()), "none") << at;
    put(at, bytes[at]);
  }
  EXPECT_EQ(refusal(path()), "none") << "whole again";
}

TEST_F(BrickFile, SizesThatLieAreRefusedBeforeAnythingIsAllocated) {
  ASSERT_TRUE(write_brick_file(path(), noise(uneven_axes(40, 5, 5), SampleType::uint8)).ok());
  const std::string bytes = bytes_of(path());
  // Even with the right checksum: every number of the prefix at extremes.
  const std::size_t fields[] = {offsetof(BrickFilePrefix, version),      offsetof(BrickFilePrefix, type),
                                offsetof(BrickFilePrefix, cells),        offsetof(BrickFilePrefix, nodes),
                                offsetof(BrickFilePrefix, levels),       offsetof(BrickFilePrefix, name_bytes),
                                offsetof(BrickFilePrefix, axis_nodes),   offsetof(BrickFilePrefix, bricks),
                                offsetof(BrickFilePrefix, header_bytes), offsetof(BrickFilePrefix, file_bytes)};
  for (const std::size_t field : fields) {
    for (const std::uint32_t number : {0xFFFFFFFFU, 0x7FFFFFFFU, 0x80000000U, 77777U}) {
      std::string lie = bytes;
      std::memcpy(lie.data() + field, &number, sizeof number);
      reseal_brick_header(lie);
      put_bytes(path("lie"), lie);
      EXPECT_NE(refusal(path("lie")), "none") << "byte " << field << " = " << number;
    }
  }
  // The same in the tables after it: node counts, nodes, offsets and ranges.
  for (std::size_t field = sizeof(BrickFilePrefix) + 5; field + 4 < 600; field += 4) {
    std::string lie = bytes;
    const std::uint32_t number = 0xFFFFFFFFU;
    std::memcpy(lie.data() + field, &number, sizeof number);
    reseal_brick_header(lie);
    put_bytes(path("lie"), lie);
    const auto store = BrickStore::open(path("lie"), {.stream = false});
    EXPECT_TRUE(store.ok() || !store.error().what.empty());
  }
}

}  // namespace
}  // namespace asperity::brick_file_test
