// What convert_mesh makes of a voxeliser's answer. The voxelisers here are made up; OpenVDB's is tested with it
// (tests/io/vdb).

#include "asperity/field/conversion/mesh_conversion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <string>

#include "asperity/field/conversion/detail/signs.h"
#include "asperity/geometry/closest_point.h"
#include "asperity/geometry/generators.h"

namespace asperity::mesh_conversion_test {
namespace {

TriangleIndex index_of(MeshSource source) {
  return TriangleIndex::build(TriangleMesh::build(std::move(source)).value());
}

struct Nearest {
  double distance = infinity;
  std::uint32_t face = no_index;
};

Nearest nearest(std::span<const Vec3f> positions, std::span<const TriangleMesh::Triangle> triangles, const Vec3& p) {
  Nearest best;
  for (std::uint32_t f = 0; f < triangles.size(); ++f) {
    const auto corner = [&](std::size_t k) { return Vec3(positions[triangles[f][k]].cast<double>()); };
    const double squared = closest_point_on_triangle(p, corner(0), corner(1), corner(2)).squared_distance;
    if (squared < best.distance) best = {squared, f};
  }
  best.distance = std::sqrt(best.distance);
  return best;
}

/// A voxeliser by brute force for shapes that are star-shaped around their middle, as bad as OpenVDB's at worst: too
/// large by up to 0.4 voxels, now and then with the wrong face and without points that belong to the band, and with
/// wrong signs beside the surface.
Result<std::vector<VoxelBlock>> sloppy_voxelizer(const VoxelRequest& request, const Progress&) {
  Box box;
  for (const Vec3f& p : request.positions) box.include(Vec3(p.cast<double>()));
  const Vec3 middle = box.centre();
  const double band = std::max(static_cast<double>(request.band_outside),
                               std::isfinite(request.band_inside) ? static_cast<double>(request.band_inside) : 0.0);
  std::array<int, 3> low{};
  std::array<int, 3> high{};
  for (std::size_t a = 0; a < 3; ++a) {
    low[a] = static_cast<int>(std::floor((box.lower[static_cast<int>(a)] - band) / 8.0));
    high[a] = static_cast<int>(std::floor((box.upper[static_cast<int>(a)] + band) / 8.0));
  }
  std::vector<VoxelBlock> blocks;
  std::uint32_t number = 0;
  for (int z = low[2]; z <= high[2]; ++z) {
    for (int y = low[1]; y <= high[1]; ++y) {
      for (int x = low[0]; x <= high[0]; ++x) {
        VoxelBlock block;
        block.at = {x, y, z};
        bool any = false;
        for (int n = 0; n < 512; ++n) {
          const auto at = static_cast<std::size_t>(n);
          const Vec3 p(8 * x + n % 8, 8 * y + n / 8 % 8, 8 * z + n / 64);
          const Nearest found = nearest(request.positions, request.triangles, p);
          // Inside where the nearest point lies farther out.
          const auto& t = request.triangles[found.face];
          const auto corner = [&](std::size_t k) { return Vec3(request.positions[t[k]].cast<double>()); };
          const Vec3 normal = (corner(1) - corner(0)).cross(corner(2) - corner(0));
          bool inside = request.signed_by_flood && (p - middle).norm() < 0.5 * box.extent().maxCoeff() &&
                        normal.dot(p - corner(0)) < 0.0;
          const double limit = static_cast<double>(inside ? request.band_inside : request.band_outside);
          ++number;
          const double given = found.distance + 0.4 * (number % 5) / 4.0;
          const bool kept = given < limit && (found.distance < 2.0 || number % 11 != 0);
          if (found.distance < 0.4 && number % 7 == 0 && inside) inside = false;
          block.face[at] = kept ? (number % 13 == 0 && found.face > 0 ? found.face - 1 : found.face) : no_index;
          block.distance[at] = static_cast<float>((inside ? -1.0 : 1.0) * (kept ? given : limit));
          any = any || kept;
        }
        if (any) blocks.push_back(block);
      }
    }
  }
  return blocks;
}

class MeshConversion : public ::testing::Test {
 protected:
  void SetUp() override { register_mesh_voxelizer(sloppy_voxelizer); }
  void TearDown() override { register_mesh_voxelizer(nullptr); }
  const TriangleIndex box_ = index_of(box_mesh({0.1, 0.06, 0.04}));

  void expect_bad(const ConversionSettings& settings, const std::string& place) const {
    const auto converted = convert_mesh(box_, settings);
    ASSERT_FALSE(converted) << place;
    EXPECT_EQ(converted.error().code, ErrorCode::bad_value);
    EXPECT_EQ(converted.error().place, place);
    EXPECT_FALSE(converted.error().accepted.empty());
  }
};

TEST_F(MeshConversion, RulesHaveNames) {
  for (const InsideRule rule : {InsideRule::automatic, InsideRule::flood, InsideRule::winding, InsideRule::shell}) {
    const auto parsed = parse_inside_rule(to_string(rule));
    ASSERT_TRUE(parsed);
    EXPECT_EQ(*parsed, rule);
  }
  const auto wrong = parse_inside_rule("even-odd");
  ASSERT_FALSE(wrong);
  EXPECT_NE(wrong.error().accepted.find("\"winding\""), std::string::npos);
}

TEST_F(MeshConversion, SettingsAreCheckedByName) {
  ConversionSettings settings;
  settings.voxel = -1.0;
  expect_bad(settings, "voxel");
  settings.voxel = 1e-6;  // 100,000 along the longest side
  expect_bad(settings, "voxel");
  settings.voxel = 0.02;
  expect_bad(settings, "voxel");
  settings.voxel = 0.002;
  settings.resolution = 64;
  expect_bad(settings, "voxel");
  settings = {};
  settings.resolution = 7;
  expect_bad(settings, "resolution");
  settings.resolution = 4097;
  expect_bad(settings, "resolution");
  settings = {};
  settings.band_outside = infinity;
  expect_bad(settings, "band_outside");
  settings = {};
  settings.band_inside = std::nan("");
  expect_bad(settings, "band_inside");
  settings = {};
  settings.shell_thickness = -0.001;
  expect_bad(settings, "shell_thickness");
  settings.shell_thickness = 0.01;
  settings.rule = InsideRule::flood;
  expect_bad(settings, "shell_thickness");
}

TEST_F(MeshConversion, WithoutAConverterItSaysWhatToInstall) {
  register_mesh_voxelizer(nullptr);
  EXPECT_FALSE(has_mesh_voxelizer());
  const auto converted = convert_mesh(box_);
  ASSERT_FALSE(converted);
  EXPECT_EQ(converted.error().code, ErrorCode::file_unsupported);
  EXPECT_NE(converted.error().accepted.find("OpenVDB"), std::string::npos);
  ConversionSettings settings;
  settings.resolution = 1;
  expect_bad(settings, "resolution");
}

TEST_F(MeshConversion, ASloppyConverterIsPutRight) {
  for (const bool throughout : {false, true}) {
    const TriangleIndex index = index_of(icosphere(2, 0.05));
    ConversionSettings settings;
    settings.resolution = 14;
    if (throughout) settings.band_inside = infinity;
    const auto converted = convert_mesh(index, settings);
    ASSERT_TRUE(converted) << converted.error().message();
    EXPECT_EQ(converted->report.rule, InsideRule::flood);
    const SparseSource source = converted->grid.source();
    const double voxel = source.voxel;
    // The wrong face beside the right one is some way off, too large a distance 0.4 voxels.
    EXPECT_GT(converted->report.largest_correction, 0.39 * voxel);
    std::size_t in_band = 0;
    for (const SparseBlock& block : source.blocks) {
      for (int n = 0; n < 512; ++n) {
        const auto at = static_cast<std::size_t>(n);
        const Vec3 p = source.origin +
                       voxel * Vec3(8 * block.at[0] + n % 8, 8 * block.at[1] + n / 8 % 8, 8 * block.at[2] + n / 64);
        const Foot foot = index.closest(p, infinity);
        const bool inside = index.mesh().face_normal(foot.element).dot(p - foot.point) < 0.0;
        const double expected = std::clamp(inside ? -foot.distance : foot.distance, source.inside, source.outside);
        ASSERT_NEAR(block.value[at], expected, 1e-6 * voxel) << p.transpose() / voxel;
        const auto value = static_cast<double>(block.value[at]);
        if (value <= source.inside || value >= source.outside) continue;
        ++in_band;
        const auto c = index.mesh().corners(block.face[at]);
        ASSERT_NEAR(std::sqrt(closest_point_on_triangle(p, c[0], c[1], c[2]).squared_distance), foot.distance,
                    1e-9 * voxel);
      }
    }
    EXPECT_EQ(in_band, converted->report.points);
  }
}

/// A flood from outside around a box with another one within: what it cannot reach is inside, and the outer box's faces
/// alone are what its distances are of.
Result<std::vector<VoxelBlock>> flood_of_the_outer_box(const VoxelRequest& request, const Progress&) {
  Box outer;
  for (const Vec3f& p : request.positions) outer.include(Vec3(p.cast<double>()));
  std::vector<TriangleMesh::Triangle> reached;
  std::vector<std::uint32_t> number;
  for (std::uint32_t f = 0; f < request.triangles.size(); ++f) {
    const auto on_it = [&](std::uint32_t vertex) {
      const Vec3 p = request.positions[vertex].cast<double>();
      return ((p - outer.lower).cwiseAbs().minCoeff() < 1e-3) || ((p - outer.upper).cwiseAbs().minCoeff() < 1e-3);
    };
    const auto& t = request.triangles[f];
    if (!on_it(t[0]) || !on_it(t[1]) || !on_it(t[2])) continue;
    reached.push_back(t);
    number.push_back(f);
  }
  std::vector<VoxelBlock> blocks;
  const auto first = [&](int a) { return static_cast<int>(std::floor((outer.lower[a] - 3.0) / 8.0)); };
  const auto last = [&](int a) { return static_cast<int>(std::floor((outer.upper[a] + 3.0) / 8.0)); };
  for (int z = first(2); z <= last(2); ++z) {
    for (int y = first(1); y <= last(1); ++y) {
      for (int x = first(0); x <= last(0); ++x) {
        VoxelBlock& block = blocks.emplace_back();
        block.at = {x, y, z};
        for (int n = 0; n < 512; ++n) {
          const Vec3 p(8 * x + n % 8, 8 * y + n / 8 % 8, 8 * z + n / 64);
          const bool inside = (p.array() > outer.lower.array() && p.array() < outer.upper.array()).all();
          const Nearest found = nearest(request.positions, reached, p);
          const bool kept = inside || found.distance < static_cast<double>(request.band_outside);
          block.face[static_cast<std::size_t>(n)] = kept ? number[found.face] : no_index;
          block.distance[static_cast<std::size_t>(n)] =
              inside ? static_cast<float>(-found.distance)
                     : std::min(static_cast<float>(found.distance), request.band_outside);
        }
      }
    }
  }
  return blocks;
}

TEST_F(MeshConversion, WallsThatNothingReachesFromOutsideAreSwallowed) {
  register_mesh_voxelizer(flood_of_the_outer_box);
  const Vec3 outer(0.06, 0.05, 0.04);
  MeshSource source = box_mesh(outer);
  const MeshSource within = box_mesh({0.03, 0.02, 0.01});
  source.corner_uvs.clear();
  const auto before = static_cast<std::uint32_t>(source.positions.size());
  source.positions.insert(source.positions.end(), within.positions.begin(), within.positions.end());
  for (const TriangleMesh::Triangle& t : within.triangles)
    source.triangles.push_back({t[0] + before, t[1] + before, t[2] + before});
  ConversionSettings settings;
  settings.rule = InsideRule::flood;
  settings.resolution = 30;
  settings.band_inside = infinity;
  const auto converted = convert_mesh(index_of(std::move(source)), settings);
  ASSERT_TRUE(converted) << converted.error().message();
  // All through the outer box the potential is the distance from its own six sides.
  SparseHint hint;
  const double voxel = converted->grid.voxel();
  for (const Vec3& p : {Vec3(0.0, 0.0, 0.003), Vec3(0.014, 0.009, 0.004), Vec3(0.002, 0.001, 0.0055),
                        Vec3(0.0, 0.0105, 0.0), Vec3(-0.0155, 0.0, 0.0), Vec3(0.001, -0.012, -0.007)}) {
    const double depth = (0.5 * outer - p.cwiseAbs()).minCoeff();
    EXPECT_NEAR(converted->grid.trilinear(p, hint).value, -depth, 0.5 * voxel) << p.transpose();
  }
}

TEST(BlockMap, AddedBlocksKnowWhatIsBesideThem) {
  std::vector<VoxelBlock> blocks(1);
  conversion::BlockMap map(blocks);
  // Around in a ring, out of order, and one apart from the others.
  for (const std::array<std::int32_t, 3>& at :
       {std::array<std::int32_t, 3>{1, 0, 0}, {1, 1, 0}, {5, 5, 5}, {0, 1, 0}, {0, 0, -1}, {0, 1, -1}, {1, 0, -1}})
    map.append(at, 1.0, blocks);
  const double voxel = 1e-3;
  conversion::for_each_node(blocks, [&](const conversion::Node& node) {
    const Vec3 here = conversion::position_of(blocks[node.block], node.point, Vec3::Zero(), voxel);
    for (std::uint32_t way = 0; way < 6; ++way) {
      const Vec3 there = here + (way % 2 == 0 ? -voxel : voxel) * Vec3::Unit(way / 2);
      const conversion::Node next = map.beside(node, way);
      const Vec3 block = (there / (8.0 * voxel) + Vec3::Constant(1e-6)).array().floor();
      const bool stored = std::any_of(blocks.begin(), blocks.end(), [&](const VoxelBlock& one) {
        return Vec3(one.at[0], one.at[1], one.at[2]) == block;
      });
      ASSERT_EQ(next.block != no_index, stored) << there.transpose();
      if (!stored) continue;
      const Vec3 found = conversion::position_of(blocks[next.block], next.point, Vec3::Zero(), voxel);
      ASSERT_LT((found - there).norm(), 1e-12);
    }
  });
}

TEST_F(MeshConversion, VoxelAndBandsAreKept) {
  ConversionSettings settings;
  settings.voxel = 0.01;
  settings.band_outside = 0.001;
  settings.band_inside = 0.05;
  const auto converted = convert_mesh(box_, settings);
  ASSERT_TRUE(converted) << converted.error().message();
  EXPECT_EQ(converted->grid.voxel(), 0.01);
  EXPECT_NEAR(converted->grid.outside(), 0.03, 1e-8);
  EXPECT_NEAR(converted->grid.inside(), -0.05, 1e-8);
  bool said = false;
  for (const std::string& note : converted->report.notes)
    said = said || note.find("three are the least") != std::string::npos;
  EXPECT_TRUE(said);
}

TEST_F(MeshConversion, TheShellIsToldAbout) {
  const TriangleIndex sheet = index_of(plane_grid(0.1, 0.1, 2, 2));
  ConversionSettings settings;
  settings.resolution = 10;
  const auto converted = convert_mesh(sheet, settings);
  ASSERT_TRUE(converted) << converted.error().message();
  EXPECT_EQ(converted->report.rule, InsideRule::shell);
  EXPECT_NEAR(converted->report.shell_thickness, 0.02, 1e-12);
  SparseHint hint;
  EXPECT_NEAR(converted->grid.trilinear(Vec3(0.0, 0.0, 0.025), hint).value, 0.015, 1e-8);
  EXPECT_NEAR(converted->grid.trilinear(Vec3(0.0, 0.0, -0.025), hint).value, 0.015, 1e-8);
}

TEST_F(MeshConversion, FailuresOfTheConverterArePassedOn) {
  register_mesh_voxelizer([](const VoxelRequest&, const Progress&) -> Result<std::vector<VoxelBlock>> {
    return Error{ErrorCode::too_large, "is too much", {}, "voxel", "less"};
  });
  const auto converted = convert_mesh(box_);
  ASSERT_FALSE(converted);
  EXPECT_EQ(converted.error().code, ErrorCode::too_large);
  register_mesh_voxelizer([](const VoxelRequest&, const Progress&) -> Result<std::vector<VoxelBlock>> {
    return std::vector<VoxelBlock>{};
  });
  const auto nothing = convert_mesh(box_);
  ASSERT_FALSE(nothing);
  EXPECT_EQ(nothing.error().code, ErrorCode::bad_mesh);
}

TEST_F(MeshConversion, ABandFarWiderThanTheMeshIsRefusedBeforeItIsMade) {
  register_mesh_voxelizer([](const VoxelRequest&, const Progress&) -> Result<std::vector<VoxelBlock>> {
    ADD_FAILURE() << "nothing may be made";
    return std::vector<VoxelBlock>{};
  });
  ConversionSettings settings;
  settings.resolution = 16;
  settings.band_outside = 7.0;  // of a box of centimetres: a texture whose amplitude has lost its unit asks for that
  const auto converted = convert_mesh(box_, settings);
  ASSERT_FALSE(converted);
  EXPECT_EQ(converted.error().code, ErrorCode::too_large);
  EXPECT_EQ(converted.error().place, "voxel");
}

TEST_F(MeshConversion, AThinBandAroundALargeSurfaceIsRefusedBeforeItIsMade) {
  register_mesh_voxelizer([](const VoxelRequest&, const Progress&) -> Result<std::vector<VoxelBlock>> {
    ADD_FAILURE() << "nothing may be made";
    return std::vector<VoxelBlock>{};
  });
  ConversionSettings settings;
  settings.voxel = 1e-4;
  settings.band_outside = settings.band_inside = 3e-4;
  // Every square of 8 x 8 voxels of the surface takes a block of 512 floats or more.
  const double squares = 2.0 * (0.1 * 0.06 + 0.06 * 0.04 + 0.04 * 0.1) / (8e-4 * 8e-4);
  settings.most_bytes = static_cast<std::size_t>(0.45 * squares * 512.0 * sizeof(float));
  const auto converted = convert_mesh(box_, settings);
  ASSERT_FALSE(converted);
  EXPECT_EQ(converted.error().code, ErrorCode::too_large);
  EXPECT_EQ(converted.error().place, "voxel");
}

}  // namespace
}  // namespace asperity::mesh_conversion_test
