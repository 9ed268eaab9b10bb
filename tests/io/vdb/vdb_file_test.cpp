// .vdb files: ours read back, those of other tools, and files that are broken.

#include <gtest/gtest.h>
#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "asperity/core/rng.h"
#include "asperity/io/vdb/vdb_check.h"
#include "tests/field/sparse_grids.h"
#include "tests/io/vdb/vdb_files.h"

namespace asperity::vdb_file_test {
namespace {

class VdbFile : public WithVdb {
 protected:
  void SetUp() override {
    WithVdb::SetUp();
    openvdb::initialize();
  }
  std::filesystem::path save(const std::string& name, const openvdb::GridPtrVec& grids) const {
    openvdb::io::File file((folder_ / name).string());
    file.write(grids);
    file.close();
    return folder_ / name;
  }
  /// A level set of another tool: voxel 2, band 3 voxels, a ball of 20 around (5, -3, 1).
  static openvdb::FloatGrid::Ptr ball() {
    auto grid = openvdb::FloatGrid::create(6.0F);
    grid->setTransform(openvdb::math::Transform::createLinearTransform(2.0));
    grid->transform().postTranslate({5.0, -3.0, 1.0});
    for (int x = -14; x <= 14; ++x) {
      for (int y = -14; y <= 14; ++y) {
        for (int z = -14; z <= 14; ++z) {
          const double value = 2.0 * std::sqrt(x * x + y * y + z * z) - 20.0;
          const openvdb::Coord at(x, y, z);
          if (std::abs(value) < 6.0) {
            grid->tree().setValueOn(at, static_cast<float>(value));
          } else if (value <= -6.0) {
            grid->tree().setValueOff(at, -6.0F);
          }
        }
      }
    }
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    grid->setName("ball");
    return grid;
  }
  static void expect_error(const std::filesystem::path& path, ErrorCode code, const std::string& part) {
    const auto file = read_sparse(path);
    ASSERT_FALSE(file) << part;
    EXPECT_STREQ(to_string(file.error().code), to_string(code)) << file.error().message();
    EXPECT_EQ(file.error().file, path.string());
    EXPECT_NE(file.error().message().find(part), std::string::npos) << file.error().message();
  }
};

/// A ball with faces that count the points, and materials on one side.
SparseSource painted_ball() {
  SparseSource source = test::sparse_source([](const Vec3& p) { return test::ball_distance(p, 0.05); },
                                            {Vec3::Constant(-0.06), Vec3::Constant(0.06)}, 0.003, 0.009, 0.012);
  source.origin = Vec3(0.1, -0.25, 0.003);
  std::uint32_t number = 0;
  for (SparseBlock& block : source.blocks) {
    block.face.assign(SparseBlock::points, no_index);
    for (std::size_t n = 0; n < SparseBlock::points; ++n) {
      if (std::abs(block.value[n]) < 0.009F) block.face[n] = number++ % 4001;
    }
    if (block.at[0] < 0) continue;
    block.material.resize(SparseBlock::points);
    for (std::size_t n = 0; n < SparseBlock::points; n += 3) {
      block.material[n].stiffness = 300.0F + static_cast<float>(n);
      if (n % 2 == 0) block.material[n].roughness = 0.25F;
    }
  }
  return source;
}

void expect_same(const SparseSource& a, const SparseSource& b) {
  EXPECT_EQ(a.voxel, b.voxel);
  EXPECT_EQ(a.origin, b.origin);
  EXPECT_EQ(a.outside, b.outside);
  EXPECT_EQ(a.inside, b.inside);
  ASSERT_EQ(a.blocks.size(), b.blocks.size());
  for (std::size_t i = 0; i < a.blocks.size(); ++i) {
    ASSERT_EQ(a.blocks[i].at, b.blocks[i].at);
    ASSERT_EQ(a.blocks[i].value, b.blocks[i].value) << i;
    ASSERT_EQ(a.blocks[i].face, b.blocks[i].face) << i;
    ASSERT_EQ(a.blocks[i].material.size(), b.blocks[i].material.size()) << i;
    for (std::size_t n = 0; n < a.blocks[i].material.size(); ++n) {
      for (std::size_t c = 0; c < material_channels; ++c) {
        const float one = a.blocks[i].material[n].get(c);
        const float other = b.blocks[i].material[n].get(c);
        ASSERT_TRUE(one == other || (std::isnan(one) && std::isnan(other))) << one << " " << other;
      }
    }
  }
}

TEST_F(VdbFile, EverythingComesBackBitForBit) {
  const auto grid = SparseGrid::build(painted_ball());
  ASSERT_TRUE(grid) << grid.error().message();
  const std::filesystem::path path = folder_ / "ball.vdb";
  const auto written = write_sparse(path, *grid, 4001);
  ASSERT_TRUE(written) << written.error().message();
  auto file = read_sparse(path);
  ASSERT_TRUE(file) << file.error().message();
  EXPECT_EQ(file->grid, "distance");
  EXPECT_TRUE(file->has_faces);
  EXPECT_EQ(file->mesh_faces, 4001U);
  EXPECT_EQ(file->channels, (std::vector<std::string>{"stiffness", "roughness"}));
  EXPECT_TRUE(file->notes.empty()) << file->notes.front();
  ASSERT_EQ(file->entries.size(), 4U);
  for (const SparseGridEntry& entry : file->entries) {
    EXPECT_EQ(entry.voxel, 0.003) << entry.name;
    EXPECT_GT(entry.points, 0U) << entry.name;
  }
  // Read whole: that the file goes away does not matter.
  std::filesystem::remove(path);
  const auto again = SparseGrid::build(std::move(file->source));
  ASSERT_TRUE(again) << again.error().message();
  expect_same(grid->source(), again->source());
}

TEST_F(VdbFile, OtherToolsReadWhatIsWritten) {
  const auto grid = SparseGrid::build(painted_ball());
  ASSERT_TRUE(grid);
  ASSERT_TRUE(write_sparse(folder_ / "ball.vdb", *grid, 4001));
  openvdb::io::File file((folder_ / "ball.vdb").string());
  file.open(false);
  const auto read = openvdb::gridPtrCast<openvdb::FloatGrid>(file.readGrid("distance"));
  ASSERT_NE(read, nullptr);
  EXPECT_EQ(read->getGridClass(), openvdb::GRID_LEVEL_SET);
  EXPECT_EQ(read->background(), 0.009F);
  // A node of the surface, the ball's middle (a tile) and far away.
  const openvdb::Vec3d pole = read->transform().worldToIndex({0.1, -0.25, 0.003 + 0.05});
  EXPECT_NEAR(pole.z(), 50.0 / 3.0, 1e-9);
  EXPECT_NEAR(read->tree().getValue({0, 0, 17}), 0.001, 1e-8);
  EXPECT_EQ(read->tree().getValue({0, 0, 0}), -0.012F);
  EXPECT_EQ(read->tree().getValue({500, 0, 0}), 0.009F);
}

TEST_F(VdbFile, LevelSetsOfOtherToolsKeepTheirPlace) {
  const auto file = read_sparse(save("ball.vdb", {ball()}));
  ASSERT_TRUE(file) << file.error().message();
  EXPECT_EQ(file->source.voxel, 2.0);
  EXPECT_EQ(file->source.origin, Vec3(5.0, -3.0, 1.0));
  EXPECT_EQ(file->source.outside, 6.0);
  EXPECT_EQ(file->source.inside, -6.0);
  EXPECT_FALSE(file->has_faces);
  const auto grid = SparseGrid::build(file->source);
  ASSERT_TRUE(grid) << grid.error().message();
  SparseHint hint;
  for (const Vec3& way : {Vec3(1, 0, 0), Vec3(0, -1, 0), Vec3(0.6, 0.0, 0.8), Vec3(-0.48, 0.6, 0.64)}) {
    const Vec3 p = Vec3(5.0, -3.0, 1.0) + 21.0 * way;
    EXPECT_NEAR(grid->trilinear(p, hint).value, 1.0, 0.06) << way.transpose();
  }
  EXPECT_EQ(grid->trilinear(Vec3(5.0, -3.0, 1.0), hint).value, -6.0);
  EXPECT_EQ(grid->trilinear(Vec3(5.0, 300.0, 1.0), hint).value, 6.0);
}

TEST_F(VdbFile, OpenVdbsOwnBallIsRead) {
  const auto ball = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(10.0F, {1.0F, 2.0F, 3.0F}, 0.5F);
  const auto file = read_sparse(save("sphere.vdb", {ball}));
  ASSERT_TRUE(file) << file.error().message();
  const auto grid = SparseGrid::build(file->source);
  ASSERT_TRUE(grid) << grid.error().message();
  SparseHint hint;
  EXPECT_NEAR(grid->trilinear(Vec3(1.0, 2.0, 12.8), hint).value, -0.2, 0.02);
  EXPECT_LT(grid->trilinear(Vec3(1.0, 2.0, 3.0), hint).value, 0.0);
}

TEST_F(VdbFile, DoublesAndHalvesAreRead) {
  const auto single = ball();
  const auto expected = read_sparse(save("single.vdb", {single}));
  ASSERT_TRUE(expected);
  const auto doubled = openvdb::DoubleGrid::create(6.0);
  doubled->setTransform(single->transform().copy());
  for (auto it = single->tree().cbeginValueAll(); it; ++it) {
    if (it.getVoxelCount() != 1) continue;
    if (it.isValueOn()) {
      doubled->tree().setValueOn(it.getCoord(), static_cast<double>(*it));
    } else {
      doubled->tree().setValueOff(it.getCoord(), static_cast<double>(*it));
    }
  }
  doubled->setGridClass(openvdb::GRID_LEVEL_SET);
  doubled->setName("double");
  const auto file = read_sparse(save("double.vdb", {doubled}));
  ASSERT_TRUE(file) << file.error().message();
  ASSERT_FALSE(file->notes.empty());
  EXPECT_NE(file->notes.front().find("single precision"), std::string::npos);
  expect_same(file->source, expected->source);
  single->setSaveFloatAsHalf(true);
  const auto half = read_sparse(save("half.vdb", {single}));
  ASSERT_TRUE(half) << half.error().message();
  ASSERT_EQ(half->source.blocks.size(), expected->source.blocks.size());
  for (std::size_t b = 0; b < half->source.blocks.size(); ++b) {
    for (std::size_t n = 0; n < SparseBlock::points; ++n)
      ASSERT_NEAR(half->source.blocks[b].value[n], expected->source.blocks[b].value[n], 6.0 / 2048.0);
  }
}

TEST_F(VdbFile, ActiveTilesAreRead) {
  auto grid = ball();
  // As some tools fill the inside: a tile of active values. Eight blocks, at the middle.
  grid->tree().addTile(1, {0, 0, 0}, -6.5F, true);
  const auto file = read_sparse(save("tile.vdb", {grid}));
  ASSERT_TRUE(file) << file.error().message();
  EXPECT_EQ(file->source.inside, -6.5);
  const auto block = std::find_if(file->source.blocks.begin(), file->source.blocks.end(), [](const SparseBlock& b) {
    return b.at == std::array<std::int32_t, 3>{0, 0, 0};
  });
  ASSERT_NE(block, file->source.blocks.end());
  EXPECT_EQ(block->value[77], -6.5F);
}

TEST_F(VdbFile, TheWantedGridIsChosen) {
  auto other = ball();
  other->setName("other");
  other->setTransform(openvdb::math::Transform::createLinearTransform(1.0));
  auto fog = openvdb::FloatGrid::create(0.0F);
  fog->setName("density");
  fog->setGridClass(openvdb::GRID_FOG_VOLUME);
  fog->tree().setValueOn({1, 2, 3}, 0.5F);
  auto points = openvdb::Vec3SGrid::create();
  points->setName("velocity");
  const auto path = save("many.vdb", {fog, ball(), other, points});
  const auto first = read_sparse(path);
  ASSERT_TRUE(first) << first.error().message();
  EXPECT_EQ(first->grid, "ball");
  EXPECT_EQ(first->entries.size(), 4U);
  ASSERT_EQ(first->notes.size(), 2U);
  EXPECT_NE(first->notes[0].find("of 2 level sets the first"), std::string::npos) << first->notes[0];
  EXPECT_NE(first->notes[1].find("\"density\", \"other\", \"velocity\""), std::string::npos) << first->notes[1];
  const auto named = read_sparse(path, {.grid = "other", .most_bytes = std::size_t{1} << 30U});
  ASSERT_TRUE(named) << named.error().message();
  EXPECT_EQ(named->source.voxel, 1.0);
  const auto wrong = read_sparse(path, {.grid = "balls", .most_bytes = std::size_t{1} << 30U});
  ASSERT_FALSE(wrong);
  EXPECT_EQ(wrong.error().code, ErrorCode::bad_value);
  EXPECT_NE(wrong.error().message().find("\"density\" (float, fog volume)"), std::string::npos);
  const auto fogged = read_sparse(path, {.grid = "density", .most_bytes = std::size_t{1} << 30U});
  ASSERT_FALSE(fogged);
  EXPECT_NE(fogged.error().message().find("is a fog volume of float"), std::string::npos) << fogged.error().message();
}

TEST_F(VdbFile, WhatIsNoSignedDistanceIsRefused) {
  auto fog = openvdb::FloatGrid::create(0.0F);
  fog->setName("smoke");
  fog->setGridClass(openvdb::GRID_FOG_VOLUME);
  fog->tree().setValueOn({1, 2, 3}, 0.5F);
  expect_error(save("fog.vdb", {fog}), ErrorCode::file_unsupported, "\"smoke\" (float, fog volume)");
  auto unsigned_one = openvdb::FloatGrid::create(3.0F);
  unsigned_one->setName("sheet");
  unsigned_one->setGridClass(openvdb::GRID_LEVEL_SET);
  unsigned_one->tree().setValueOn({1, 2, 3}, 0.5F);
  expect_error(save("unsigned.vdb", {unsigned_one}), ErrorCode::file_unsupported, "distances from 0 to 3");
  auto empty = openvdb::FloatGrid::create(3.0F);
  empty->setGridClass(openvdb::GRID_LEVEL_SET);
  expect_error(save("none.vdb", {empty}), ErrorCode::file_unsupported, "is empty");
  auto bad = ball();
  bad->tree().setValueOn({9, 0, 0}, std::numeric_limits<float>::quiet_NaN());
  expect_error(save("nan.vdb", {bad}), ErrorCode::file_malformed, "at voxel (9, 0, 0)");
  expect_error(save("nothing.vdb", {}), ErrorCode::file_unsupported, "no grid");
}

TEST_F(VdbFile, VoxelsThatAreNoCubesAreRefused) {
  auto grid = ball();
  grid->setTransform(openvdb::math::Transform::createLinearTransform(1.0));
  grid->transform().postScale({1.0, 1.0, 1.5});
  expect_error(save("stretched.vdb", {grid}), ErrorCode::file_unsupported, "voxels of 1 x 1 x 1.5");
  grid->setTransform(openvdb::math::Transform::createLinearTransform(1.0));
  grid->transform().postRotate(0.3, openvdb::math::X_AXIS);
  expect_error(save("turned.vdb", {grid}), ErrorCode::file_unsupported, "turned");
  grid->setTransform(openvdb::math::Transform::createFrustumTransform(
      openvdb::BBoxd(openvdb::Vec3d(0.0), openvdb::Vec3d(100.0)), 0.5, 10.0));
  expect_error(save("frustum.vdb", {grid}), ErrorCode::file_unsupported, "NonlinearFrustumMap");
}

TEST_F(VdbFile, TooLargeIsRefusedBeforeItIsRead) {
  auto grid = ball();
  grid->tree().root().addTile(openvdb::Coord(4096, 0, 0), -6.0F, true);  // 134 million blocks
  expect_error(save("vast.vdb", {grid}), ErrorCode::too_large, "grid \"ball\"");
  auto far = ball();
  far->tree().setValueOn({1 << 24, 1 << 24, 1 << 24}, 1.0F);
  expect_error(save("far.vdb", {far}), ErrorCode::too_large, "spreads its voxels");
  const auto path = save("ball.vdb", {ball()});
  const auto tight = read_sparse(path, {.grid = {}, .most_bytes = 400'000});
  ASSERT_FALSE(tight);
  EXPECT_EQ(tight.error().code, ErrorCode::too_large);
}

TEST_F(VdbFile, WhatIsNoVdbFileIsRefused) {
  expect_error(folder_ / "absent.vdb", ErrorCode::file_missing, "no such file");
  expect_error(folder_, ErrorCode::file_missing, "folder");
  expect_error(write("empty.vdb", ""), ErrorCode::file_empty, "empty");
  expect_error(write("text.vdb", "solid cube\nfacet normal 0 0 1\n"), ErrorCode::file_malformed, "no OpenVDB file");
  expect_error(write("short.vdb", "x"), ErrorCode::file_malformed, "no OpenVDB file");
  std::string bytes = bytes_of(save("ball.vdb", {ball()}));
  std::string old = bytes;
  old[8] = 100;
  expect_error(write("old.vdb", old), ErrorCode::file_unsupported, "of format 100");
  bytes[0] = 'x';
  expect_error(write("magic.vdb", bytes), ErrorCode::file_malformed, "no OpenVDB file");
}

TEST_F(VdbFile, TruncatedFilesAreRefusedAtEveryLength) {
  const auto grid = SparseGrid::build(painted_ball());
  ASSERT_TRUE(grid);
  ASSERT_TRUE(write_sparse(folder_ / "ball.vdb", *grid, 4001));
  const std::string bytes = bytes_of(folder_ / "ball.vdb");
  for (int n = 1; n < 60; ++n) {
    const std::size_t length =
        n < 30 ? static_cast<std::size_t>(7 * n) : bytes.size() * static_cast<std::size_t>(n) / 60;
    const auto file = read_sparse(write("cut.vdb", bytes.substr(0, length)));
    ASSERT_FALSE(file) << length;
    EXPECT_FALSE(file.error().accepted.empty());
  }
}

/// One byte changed: an error, or a file that is read; never a crash, and never memory that the file does not warrant.
TEST_F(VdbFile, ChangedBytesDoNoHarm) {
  const auto grid = SparseGrid::build(painted_ball());
  ASSERT_TRUE(grid);
  ASSERT_TRUE(write_sparse(folder_ / "ball.vdb", *grid, 4001));
  const std::string bytes = bytes_of(folder_ / "ball.vdb");
  const auto outlines = vdb_io::outline(bytes);
  ASSERT_TRUE(outlines) << outlines.error().message();
  Rng rng(7);
  std::size_t refused = 0;
  for (int n = 0; n < 280; ++n) {
    std::string changed = bytes;
    const vdb_io::GridOutline& hit = outlines->at(static_cast<std::size_t>(n) % outlines->size());
    // Header and descriptors, topology, buffers: where a byte weighs most.
    std::size_t from = 0;
    std::size_t to = outlines->front().tree_at;
    if (n % 3 == 1) {
      from = hit.at;
      to = hit.tree_at + 200;
    } else if (n % 3 == 2) {
      from = hit.tree_at;
      to = hit.end;
    }
    const std::size_t at = from + static_cast<std::size_t>(rng.uniform() * static_cast<double>(to - from));
    changed[at] = static_cast<char>(rng.uniform() < 0.3 ? 0xFF : static_cast<int>(rng.uniform() * 256.0));
    const auto file = read_sparse(write("changed.vdb", changed));
    if (!file) {
      ++refused;
      EXPECT_FALSE(file.error().what.empty());
      continue;
    }
    const auto built = SparseGrid::build(file->source);
    EXPECT_TRUE(built || !built.error().what.empty());
  }
  EXPECT_GT(refused, 20U);
}

TEST_F(VdbFile, VoxelsOfMicrometresAreKept) {
  SparseSource source = test::sparse_source([](const Vec3& p) { return test::ball_distance(p, 2e-5); },
                                            {Vec3::Constant(-2.1e-5), Vec3::Constant(2.1e-5)}, 1e-6, 3e-6, 3e-6);
  source.origin = Vec3(1e-5, 0.1, -3.0);
  const auto grid = SparseGrid::build(std::move(source));
  ASSERT_TRUE(grid) << grid.error().message();
  const auto written = write_sparse(folder_ / "small.vdb", *grid);
  ASSERT_TRUE(written) << written.error().message();
  const auto file = read_sparse(folder_ / "small.vdb");
  ASSERT_TRUE(file) << file.error().message();
  expect_same(grid->source(), SparseGrid::build(file->source).value().source());
}

TEST_F(VdbFile, AFileThatCannotBeWrittenIsSaid) {
  const auto grid = SparseGrid::build(painted_ball());
  ASSERT_TRUE(grid);
  const auto written = write_sparse(folder_ / "no" / "such" / "folder.vdb", *grid);
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().code, ErrorCode::file_unwritable);
}

TEST_F(VdbFile, AConvertedMeshComesBack) {
  const TriangleIndex index = index_of(icosphere(3, 0.05));
  ConversionSettings settings;
  settings.resolution = 32;
  const auto converted = convert_mesh(index, settings);
  ASSERT_TRUE(converted) << converted.error().message();
  ASSERT_TRUE(write_sparse(folder_ / "mesh.vdb", converted->grid, index.mesh().triangles().size()));
  auto file = read_sparse(folder_ / "mesh.vdb");
  ASSERT_TRUE(file) << file.error().message();
  EXPECT_EQ(file->mesh_faces, 1280U);
  const auto again = SparseGrid::build(std::move(file->source));
  ASSERT_TRUE(again) << again.error().message();
  expect_same(converted->grid.source(), again->source());
}

}  // namespace
}  // namespace asperity::vdb_file_test
