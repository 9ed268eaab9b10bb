#include "asperity/surface/implicit/texture.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <string>

#include "asperity/core/rng.h"
#include "asperity/surface/iso/surface.h"
#include "tests/field/sparse_grids.h"

namespace asperity::implicit_texture_test {
namespace {

using test::ball_distance;
using test::box_distance;
using test::sparse_grid;

constexpr double voxel = 1e-3;
constexpr double turn = 2.0 * std::numbers::pi;

/// The half-space z < 0 over `half` (m) along x and along y.
std::shared_ptr<const SparseGrid> plane(double half, double band, double half_y = 0.0) {
  if (half_y == 0.0) half_y = half;
  Box box;
  box.lower = Vec3(-half, -half_y, 0.0);
  box.upper = Vec3(half, half_y, 0.0);
  return sparse_grid([](const Vec3& p) { return p.z(); }, box, voxel, band, band);
}

/// A ball of 16 mm.
std::shared_ptr<const SparseGrid> ball() {
  return sparse_grid([](const Vec3& p) { return ball_distance(p, 0.016); }, test::cube(0.016), voxel, 4.0 * voxel,
                     4.0 * voxel);
}

PointHeight constant_height(double height) {
  return [height](const Vec3&, std::uint32_t, std::uint64_t) { return height; };
}

PointHeight wave(double amplitude, double wavelength, double phase = 0.0) {
  return [=](const Vec3& p, std::uint32_t, std::uint64_t) {
    return amplitude * std::sin(turn * p.x() / wavelength + phase);
  };
}

PointHeight bumps(double amplitude, double wavelength) {
  return [=](const Vec3& p, std::uint32_t, std::uint64_t) {
    return amplitude * std::sin(turn * p.x() / wavelength) * std::sin(turn * p.y() / wavelength + 1.0) *
           std::sin(turn * p.z() / wavelength + 2.0);
  };
}

TexturedPotential must_texture(const SparseGrid& grid, const PointHeight& height, Redistancing mode) {
  Result<TexturedPotential> result = textured(grid, height, mode);
  EXPECT_TRUE(result.ok()) << (result.ok() ? "" : result.error().message());
  return std::move(result).value();
}

std::shared_ptr<const ScalarField> field_of(const SparseGrid& grid,
                                            CellReconstruction reconstruction = CellReconstruction::smooth) {
  return std::make_shared<const ScalarField>(std::make_shared<const SparseGrid>(grid), reconstruction);
}

IsoView surface_of(const ScalarField& field, CellCache& cells) {
  return {&field, 0, 0.0, 1.0, &cells};
}

/// Height of the zero set over (x, y), coming down from the band's upper part.
double height_at(const ScalarField& field, double x, double y, CellCache& cells, double reach) {
  const IsoCrossing crossing = surface_of(field, cells).first_crossing({Vec3(x, y, reach), Vec3(x, y, -reach)});
  EXPECT_TRUE(crossing.found) << x;
  return crossing.point.z();
}

/// Half of what lies between the highest and the lowest place of the zero set along x.
double amplitude_along_x(const ScalarField& field, double from, double to, double reach) {
  CellCache cells;
  double lowest = infinity;
  double highest = -infinity;
  for (double x = from; x <= to; x += 0.1 * voxel) {
    const double z = height_at(field, x, 0.3 * voxel, cells, reach);
    lowest = std::min(lowest, z);
    highest = std::max(highest, z);
  }
  return 0.5 * (highest - lowest);
}

// --- heights ---

TEST(GaussianNoise, IsNormalWithTheDeviationAskedForAndCutAtThree) {
  const PointHeight noise = gaussian_noise(2e-4, 7);
  constexpr int count = 200000;
  double sum = 0.0;
  double squares = 0.0;
  double largest = 0.0;
  int within_one = 0;
  double neighbours = 0.0;
  double previous = 0.0;
  for (int i = 0; i < count; ++i) {
    const double h = noise(Vec3::Zero(), no_index, static_cast<std::uint64_t>(i)) / 2e-4;
    sum += h;
    squares += h * h;
    largest = std::max(largest, std::abs(h));
    within_one += std::abs(h) < 1.0 ? 1 : 0;
    neighbours += h * previous;
    previous = h;
  }
  // Four deviations of each estimate.
  EXPECT_NEAR(sum / count, 0.0, 4.0 / std::sqrt(count));
  EXPECT_NEAR(std::sqrt(squares / count), 0.9975, 4.0 / std::sqrt(2.0 * count));
  EXPECT_NEAR(static_cast<double>(within_one) / count, 0.6827, 4.0 * std::sqrt(0.6827 * 0.3173 / count));
  EXPECT_NEAR(neighbours / count, 0.0, 4.0 / std::sqrt(count));
  EXPECT_NEAR(largest, 3.0, 1e-12);
}

TEST(GaussianNoise, DependsOnNodeAndSeedAlone) {
  const PointHeight noise = gaussian_noise(1.0, 7);
  const PointHeight again = gaussian_noise(1.0, 7);
  const PointHeight other = gaussian_noise(1.0, 8);
  int equal = 0;
  for (std::uint64_t node = 0; node < 1000; ++node) {
    const double h = noise(Vec3(1.0, 2.0, 3.0), 4, node);
    // In any order, at any place.
    EXPECT_EQ(h, again(Vec3::Zero(), no_index, node));
    EXPECT_EQ(noise(Vec3::Zero(), 0, 999 - node), again(Vec3::Zero(), 0, 999 - node));
    equal += h == other(Vec3::Zero(), 0, node) ? 1 : 0;
  }
  EXPECT_LT(equal, 5);
}

TEST(GaussianNoise, OfANodeDoesNotDependOnWhatElseIsStored) {
  const auto whole = plane(16.0 * voxel, 4.0 * voxel);
  SparseSource part = whole->source();
  part.blocks.erase(part.blocks.begin(), part.blocks.begin() + 10);
  const SparseGrid few = SparseGrid::build(part).value();
  const PointHeight noise = gaussian_noise(0.3 * voxel, 3);
  const SparseSource a = must_texture(*whole, noise, Redistancing::none).grid.source();
  const SparseSource b = must_texture(few, noise, Redistancing::none).grid.source();
  ASSERT_EQ(a.blocks.size(), b.blocks.size() + 10);
  for (std::size_t n = 0; n < b.blocks.size(); ++n) {
    ASSERT_EQ(a.blocks[n + 10].at, b.blocks[n].at);
    EXPECT_EQ(a.blocks[n + 10].value, b.blocks[n].value);
  }
}

/// A square of two triangles over |x|, |y| <= half at z = 0 whose UVs run from 0 to 1, and one triangle far off.
TriangleMesh square(double half) {
  MeshSource source;
  source.positions = {{-half, -half, 0.0}, {half, -half, 0.0}, {half, half, 0.0}, {-half, half, 0.0}};
  source.triangles = {{0, 1, 2}, {0, 2, 3}};
  source.corner_uvs = {{Vec2f(0.0F, 0.0F), Vec2f(1.0F, 0.0F), Vec2f(1.0F, 1.0F)},
                       {Vec2f(0.0F, 0.0F), Vec2f(1.0F, 1.0F), Vec2f(0.0F, 1.0F)}};
  return TriangleMesh::build(std::move(source)).value();
}

/// The map by the mesh's own UVs.
Coat coat_of(const TriangleMesh& mesh, HeightMap map) {
  auto maps = std::make_shared<const Mesostructure>(Mesostructure::build(std::move(map), Vec2(0.01, 0.01)).value());
  return Coat::build(mesh, std::move(maps), {Mapping::uv, Vec2::Ones()}).value();
}

TEST(CoatHeight, PutsTheImageWhereTheTextureCoordinatesSay) {
  const double half = 20.0 * voxel;
  // Face 0 lies below the diagonal y = x.
  SparseSource source = plane(half, 4.0 * voxel)->source();
  for (SparseBlock& block : source.blocks) {
    block.face.resize(SparseBlock::points);
    for (std::size_t point = 0; point < SparseBlock::points; ++point) {
      const auto x = static_cast<int>(8 * block.at[0]) + static_cast<int>(point % 8);
      const auto y = static_cast<int>(8 * block.at[1]) + static_cast<int>(point / 8 % 8);
      block.face[point] = y < x ? 0 : 1;
    }
  }
  const SparseGrid grid = SparseGrid::build(source).value();
  // Four texels along s, two along t; one is high: s in 1/2 … 3/4, t in 1/2 … 1.
  const float high = 1.0e-3F;
  HeightMap map =
      HeightMap::build({0.0F, 0.0F, high, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F}, 4, 2, Wrap::clamp, Reconstruction::nearest)
          .value();
  const TriangleMesh mesh = square(half);
  const Coat coat = coat_of(mesh, std::move(map));
  const TexturedPotential result = must_texture(grid, coat_height(coat, mesh), Redistancing::none);
  EXPECT_NEAR(result.lowest, 0.0, 1e-9);
  EXPECT_NEAR(result.highest, 1e-3, 1e-9);
  const auto field = field_of(result.grid);
  CellCache cells;
  for (double y = -17.0; y <= 17.0; y += 1.7) {
    for (double x = -17.0; x <= 17.0; x += 1.3) {
      const bool inside = x > 0.0 && x < 10.0 && y > 0.0;
      const bool near_border = std::min({std::abs(x), std::abs(x - 10.0), std::abs(y)}) < 2.0;
      if (near_border) continue;
      EXPECT_NEAR(height_at(*field, x * voxel, y * voxel, cells, 3.5 * voxel), inside ? 1e-3 : 0.0, 1e-7)
          << x << " " << y;
    }
  }
}

TEST(CoatHeight, IsZeroWithoutAFace) {
  HeightMap map = HeightMap::build({1e-3F, 1e-3F}, 2, 1, Wrap::clamp, Reconstruction::nearest).value();
  const TriangleMesh mesh = square(0.02);
  const Coat coat = coat_of(mesh, std::move(map));
  const PointHeight height = coat_height(coat, mesh);
  EXPECT_NEAR(height(Vec3(0.001, 0.0, 0.005), 0, 0), 1e-3, 1e-9);
  EXPECT_EQ(height(Vec3(0.001, 0.0, 0.005), no_index, 0), 0.0);
  EXPECT_EQ(height(Vec3(0.001, 0.0, 0.005), 2, 0), 0.0);
}

// --- what heights do to a potential ---

TEST(Textured, TakesTheHeightOffEveryStoredPointWithinTheBand) {
  const auto grid = ball();
  const PointHeight height = bumps(1.5 * voxel, 9.0 * voxel);
  const SparseSource before = grid->source();
  const SparseSource after = must_texture(*grid, height, Redistancing::none).grid.source();
  ASSERT_EQ(before.blocks.size(), after.blocks.size());
  for (std::size_t b = 0; b < before.blocks.size(); ++b) {
    ASSERT_EQ(before.blocks[b].at, after.blocks[b].at);
    for (std::size_t n = 0; n < SparseBlock::points; ++n) {
      const auto value = static_cast<double>(before.blocks[b].value[n]);
      const Vec3 p = voxel * Vec3(8.0 * before.blocks[b].at[0] + static_cast<double>(n % 8),
                                  8.0 * before.blocks[b].at[1] + static_cast<double>(n / 8 % 8),
                                  8.0 * before.blocks[b].at[2] + static_cast<double>(n / 64));
      const bool constant = std::abs(value) >= 4.0 * voxel - 1e-9;
      const double expected = constant ? value : std::clamp(value - height(p, no_index, 0), -4.0 * voxel, 4.0 * voxel);
      ASSERT_NEAR(static_cast<double>(after.blocks[b].value[n]), expected, 1e-9);
    }
  }
}

TEST(Textured, KeepsFacesAndMaterialsAndTellsItsProgress) {
  SparseSource source = plane(10.0 * voxel, 4.0 * voxel)->source();
  for (SparseBlock& block : source.blocks) {
    block.face.assign(SparseBlock::points, 3);
    block.material.resize(SparseBlock::points);
    block.material[5].stiffness = 500.0F;
  }
  const SparseGrid grid = SparseGrid::build(source).value();
  for (const Redistancing mode : {Redistancing::none, Redistancing::normalised, Redistancing::redistanced}) {
    double last = 0.0;
    const Result<TexturedPotential> result =
        textured(grid, wave(0.5 * voxel, 8.0 * voxel), mode, [&](std::string_view what, double fraction) {
          EXPECT_FALSE(what.empty());
          EXPECT_TRUE(fraction >= 0.0 && fraction <= 1.0);
          last = fraction;
        });
    ASSERT_TRUE(result.ok());
    EXPECT_EQ(last, 1.0);
    const SparseSource after = result->grid.source();
    for (const SparseBlock& block : after.blocks) {
      ASSERT_EQ(block.face.size(), SparseBlock::points);
      EXPECT_EQ(block.face[100], 3U);
      ASSERT_EQ(block.material.size(), SparseBlock::points);
      EXPECT_EQ(block.material[5].stiffness, 500.0F);
    }
  }
}

TEST(Textured, RoughnessMultipliesTheHeight) {
  SparseSource source = plane(16.0 * voxel, 4.0 * voxel)->source();
  for (SparseBlock& block : source.blocks) {
    block.material.resize(SparseBlock::points);
    for (PointMaterial& material : block.material) {
      if (block.at[0] >= 0) material.roughness = 0.25F;
    }
  }
  const TexturedPotential result =
      must_texture(SparseGrid::build(source).value(), constant_height(voxel), Redistancing::none);
  const auto field = field_of(result.grid);
  CellCache cells;
  EXPECT_NEAR(height_at(*field, 8.0 * voxel, 0.0, cells, 3.0 * voxel), 0.25 * voxel, 1e-8);
  EXPECT_NEAR(height_at(*field, -8.0 * voxel, 0.0, cells, 3.0 * voxel), voxel, 1e-8);
  EXPECT_NEAR(result.lowest, 0.25 * voxel, 1e-9);
  EXPECT_NEAR(result.highest, voxel, 1e-9);
}

TEST(Textured, RefusesHeightsThatLeaveTheBandAndNamesThem) {
  const auto grid = plane(10.0 * voxel, 4.0 * voxel);
  for (const double height : {2.001 * voxel, -2.001 * voxel}) {
    const auto result = textured(*grid, constant_height(height), Redistancing::none);
    ASSERT_FALSE(result.ok());
    EXPECT_EQ(result.error().code, ErrorCode::bad_value);
    EXPECT_NE(result.error().what.find("2.001 mm"), std::string::npos) << result.error().message();
    EXPECT_NE(result.error().accepted.find("up to 2 mm"), std::string::npos) << result.error().message();
  }
  EXPECT_TRUE(textured(*grid, constant_height(1.999 * voxel), Redistancing::none).ok());
  // One point is enough, and it is named.
  const auto one = textured(
      *grid, [](const Vec3& p, std::uint32_t, std::uint64_t) { return p.norm() < 0.1 * voxel ? 0.003 : 0.0; },
      Redistancing::none);
  ASSERT_FALSE(one.ok());
  EXPECT_NE(one.error().place.find("(0, 0, 0) mm"), std::string::npos) << one.error().message();
  const auto narrow = textured(*plane(10.0 * voxel, 1.5 * voxel), constant_height(1e-6), Redistancing::none);
  ASSERT_FALSE(narrow.ok());
  EXPECT_NE(narrow.error().accepted.find("two voxels"), std::string::npos);
}

TEST(Textured, RefusesHeightsThatAreNotFinite) {
  const auto grid = plane(10.0 * voxel, 4.0 * voxel);
  for (const double height : {std::numeric_limits<double>::quiet_NaN(), infinity, -infinity}) {
    const auto result = textured(*grid, constant_height(height), Redistancing::redistanced);
    ASSERT_FALSE(result.ok());
    EXPECT_NE(result.error().what.find("finite"), std::string::npos);
  }
  EXPECT_FALSE(textured(*grid, gradient_noise(1e-4, 0.0, 1), Redistancing::none).ok());
  EXPECT_FALSE(textured(*grid, gradient_noise(1e-4, -1.0, 1), Redistancing::none).ok());
}

TEST(Textured, ModesAreNamed) {
  for (const Redistancing mode : {Redistancing::none, Redistancing::normalised, Redistancing::redistanced})
    EXPECT_EQ(value_named<Redistancing>(to_string(mode)), mode);
  EXPECT_FALSE(value_named<Redistancing>("fast").has_value());
  EXPECT_NE(name_list<Redistancing>().find("redistanced"), std::string::npos);
}

// --- K-8: what is felt of a wave ---

TEST(Textured, K_8_RecoversAmplitudeWithinFivePerCentFromSixVoxelsOn) {
  const auto grid = plane(10.0 * voxel, 4.0 * voxel, 2.0 * voxel);
  const double amplitude = 0.5 * voxel;
  for (const double voxels : {6.0, 8.0, 12.0}) {
    for (const Redistancing mode : {Redistancing::none, Redistancing::normalised, Redistancing::redistanced}) {
      double worst = 0.0;
      double worst_trilinear = 0.0;
      // The crest from a node on to the next one.
      constexpr int phases = 4;
      for (int i = 0; i < phases; ++i) {
        const PointHeight height = wave(amplitude, voxels * voxel, turn / voxels * i / phases);
        const TexturedPotential result = must_texture(*grid, height, mode);
        const auto error = [&](CellReconstruction reconstruction) {
          const auto field = field_of(result.grid, reconstruction);
          return amplitude_along_x(*field, -6.0 * voxel, 6.0 * voxel, 3.0 * voxel) / amplitude - 1.0;
        };
        const double smooth = error(CellReconstruction::smooth);
        const double trilinear = error(CellReconstruction::trilinear);
        if (std::abs(smooth) > std::abs(worst)) worst = smooth;
        if (std::abs(trilinear) > std::abs(worst_trilinear)) worst_trilinear = trilinear;
      }
      EXPECT_LT(std::abs(worst), 0.05) << voxels << " " << to_string(mode);
      // Why the smooth reconstruction is the one that is felt.
      if (voxels == 6.0) {
        EXPECT_LT(worst_trilinear, -0.05);
      }
      std::printf("wavelength %2.0f voxels, %-11s worst amplitude error %+.2f %% smooth, %+.2f %% trilinear\n", voxels,
                  to_string(mode), 100.0 * worst, 100.0 * worst_trilinear);
    }
  }
}

/// Where a function that is below 0 at `from` passes it on the way to `to`, as a share of that way.
double crossing(const std::function<double(const Vec3&)>& f, const Vec3& from, const Vec3& to) {
  double low = 0.0;
  double high = 1.0;
  EXPECT_LT(f(from), 0.0);
  EXPECT_GT(f(to), 0.0);
  while (high - low > 1e-12) {
    const double middle = 0.5 * (low + high);
    (f(from + middle * (to - from)) < 0.0 ? low : high) = middle;
  }
  return low;
}

TEST(Textured, K_8_RecoversAmplitudeOverAnEdgeOfTheDisplacedBox) {
  // Rays from within a box's edge outwards, against the displaced box in closed form: its distance less the height.
  const double h = 0.5e-3;
  const double half = 0.02;
  const Vec3 size = Vec3::Constant(half);
  Box box;
  box.lower = Vec3(0.006, -0.012, 0.006);
  box.upper = Vec3(half, 0.012, half);
  const auto smooth = sparse_grid([&](const Vec3& p) { return box_distance(p, size); }, box, h, 5.0 * h, 5.0 * h);
  for (const double voxels : {6.0, 8.0, 12.0}) {
    const PointHeight height = bumps(0.5 * h, voxels * h);
    for (const Redistancing mode : {Redistancing::none, Redistancing::normalised, Redistancing::redistanced}) {
      const auto plain = field_of(*smooth);
      const auto rough = field_of(must_texture(*smooth, height, mode).grid);
      CellCache cells;
      const auto value = [&](const ScalarField& field) {
        return [&](const Vec3& p) {
          FieldJet jet;
          EXPECT_TRUE(surface_of(field, cells).sample(p, jet));
          return jet.value;
        };
      };
      // By how far off the edge: more than two voxels, and less.
      double felt_by_true[2] = {};
      double true_by_true[2] = {};
      for (int i = 0; i <= 60; ++i) {
        for (int j = 0; j <= 60; ++j) {
          const double angle = 0.5 * std::numbers::pi * i / 60.0;
          const double y = (-10.0 + 20.0 * j / 60.0) * 1e-3;
          const Vec3 from(half - 4.0 * h, y, half - 4.0 * h);
          const Vec3 way(std::sin(angle), 0.0, std::cos(angle));
          // Between the outer and the inner end of the stored band.
          const double reach = 4.0 * h / std::max(way.x(), way.z());
          const Vec3 begin = from + (reach - 2.0 * h) * way;
          const Vec3 end = from + (reach + 2.0 * h) * way;
          const auto exact = [&](const Vec3& p) { return box_distance(p, size); };
          const auto displaced = [&](const Vec3& p) { return box_distance(p, size) - height(p, no_index, 0); };
          const double expected = crossing(displaced, begin, end) - crossing(exact, begin, end);
          const double felt = crossing(value(*rough), begin, end) - crossing(value(*plain), begin, end);
          const double off = 4.0 * h * (1.0 - std::min(way.x(), way.z()) / std::max(way.x(), way.z()));
          const int which = off > 2.0 * h ? 0 : 1;
          felt_by_true[which] += felt * expected;
          true_by_true[which] += expected * expected;
        }
      }
      const double face = felt_by_true[0] / true_by_true[0] - 1.0;
      const double edge = felt_by_true[1] / true_by_true[1] - 1.0;
      std::printf(
          "wavelength %2.0f voxels, %-11s amplitude error %+.2f %% on faces, %+.2f %% within two voxels of an edge\n",
          voxels, to_string(mode), 100.0 * face, 100.0 * edge);
      EXPECT_LT(std::abs(face), 0.05);
      // Beside the edge the grid rounds off some tenths of a voxel, more or less as the texture shifts it: of an
      // amplitude of half a voxel a seventh at most.
      EXPECT_LT(std::abs(edge), 0.15);
    }
  }
}

// --- how far from a distance ---

TEST(Textured, RedistancingMakesItADistanceAndNormalisingComesNearer) {
  const auto grid = ball();
  const PointHeight heights[] = {bumps(0.5 * voxel, 8.0 * voxel), gradient_noise(voxel, 6.0 * voxel, 1)};
  for (const PointHeight& height : heights) {
    const TexturedPotential none = must_texture(*grid, height, Redistancing::none);
    const TexturedPotential normalised = must_texture(*grid, height, Redistancing::normalised);
    const TexturedPotential redistanced = must_texture(*grid, height, Redistancing::redistanced);
    EXPECT_EQ(none.rms_error_before, none.rms_error);
    EXPECT_EQ(none.rms_error_before, redistanced.rms_error_before);
    EXPECT_GT(none.rms_error, 0.08 * voxel);
    EXPECT_LT(normalised.rms_error, 0.85 * none.rms_error);
    EXPECT_LT(redistanced.rms_error, 0.02 * voxel);
    EXPECT_LT(redistanced.rms_error, 0.1 * normalised.rms_error);
    EXPECT_LE(redistanced.rms_error, redistanced.largest_error);
    for (const TexturedPotential* result : {&none, &normalised, &redistanced})
      std::printf("error rms %.4f largest %.4f voxels\n", result->rms_error / voxel, result->largest_error / voxel);
  }
}

TEST(Textured, NormalisingChangesWhatIsNearAndLeavesWhatIsFar) {
  const auto grid = plane(8.0 * voxel, 10.0 * voxel);
  const PointHeight height = wave(voxel, 8.0 * voxel);
  const SparseSource before = must_texture(*grid, height, Redistancing::none).grid.source();
  const SparseSource after = must_texture(*grid, height, Redistancing::normalised).grid.source();
  int far = 0;
  int near = 0;
  for (std::size_t b = 0; b < before.blocks.size(); ++b) {
    for (std::size_t n = 0; n < SparseBlock::points; ++n) {
      const auto was = static_cast<double>(before.blocks[b].value[n]);
      const auto is = static_cast<double>(after.blocks[b].value[n]);
      ASSERT_LE(std::abs(is), std::abs(was) * (1.0 + 1e-6)) << "its slope is 1 or more";
      if (std::abs(was) >= 4.0 * voxel) {
        ++far;
        ASSERT_EQ(is, was) << was / voxel;
      } else if (std::abs(was) > 0.1 * voxel && std::abs(is) < 0.95 * std::abs(was)) {
        ++near;
      }
    }
  }
  EXPECT_GT(far, 1000);
  EXPECT_GT(near, 1000);
}

TEST(Textured, InAWideBandTheDistanceTurnsIntoThePotential) {
  // As far as eight voxels; what is stored is the one near the surface and the other near the end of that.
  const auto grid = plane(16.0 * voxel, 12.0 * voxel, 4.0 * voxel);
  const PointHeight height = wave(voxel, 16.0 * voxel);
  const SparseGrid potential = must_texture(*grid, height, Redistancing::none).grid;
  const SparseGrid stored = must_texture(*grid, height, Redistancing::redistanced).grid;
  const auto field = field_of(potential);
  CellCache cells;
  SparseHint hint;
  int near = 0;
  int far = 0;
  for (int x = -6; x <= 6; ++x) {
    for (int z = -10; z <= 10; ++z) {
      const Vec3 p = voxel * Vec3(x, 0.0, z);
      const double own = std::abs(potential.trilinear(p, hint).value);
      const Foot foot = surface_of(*field, cells).nearest(p, 12.0 * voxel);
      ASSERT_TRUE(foot.found());
      if (own - foot.distance < 0.05 * voxel) continue;
      const double is = std::abs(stored.trilinear(p, hint).value);
      const double share = (is - foot.distance) / (own - foot.distance);
      if (foot.distance < 4.0 * voxel) {
        ++near;
        EXPECT_LT(share, 0.1) << p.transpose() / voxel;
      } else if (foot.distance > 7.5 * voxel) {
        ++far;
        EXPECT_GT(share, 0.8) << p.transpose() / voxel;
      }
    }
  }
  EXPECT_GT(near, 10);
  EXPECT_GT(far, 10);
}

TEST(Textured, AFlatTextureMovesTheSurfaceAndKeepsTheDistance) {
  const auto grid = ball();
  const TexturedPotential result = must_texture(*grid, constant_height(voxel), Redistancing::redistanced);
  // The band ends where it did: a voxel nearer to the surface.
  EXPECT_NEAR(result.grid.outside(), 3.0 * voxel, 1e-12);
  EXPECT_NEAR(result.grid.inside(), -4.0 * voxel, 1e-12);
  const auto field = field_of(result.grid);
  CellCache cells;
  Rng rng(5);
  for (int i = 0; i < 500; ++i) {
    const Vec3 d = Vec3(rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0)).normalized();
    const double r = 0.017 + rng.uniform(-2.0, 1.0) * voxel;
    FieldJet jet;
    ASSERT_TRUE(surface_of(*field, cells).sample(r * d, jet));
    EXPECT_NEAR(jet.value, r - 0.017, 2e-3 * voxel);
    EXPECT_GT(jet.gradient.dot(d), 0.995);
  }
}

/// Points where the own descent is compared with the isosurface's search, which visits every cell within reach.
TEST(Textured, RedistancedPointsHoldTheDistanceToTheTexturedZeroSet) {
  const auto grid = ball();
  const double h = voxel;
  const std::pair<PointHeight, double> textures[] = {
      {bumps(0.5 * h, 8.0 * h), 1e-3}, {gradient_noise(1.5 * h, 4.0 * h, 2), 1e-3}, {gaussian_noise(0.2 * h, 2), 2e-2}};
  for (const auto& [height, allowed] : textures) {
    const TexturedPotential none = must_texture(*grid, height, Redistancing::none);
    const TexturedPotential redistanced = must_texture(*grid, height, Redistancing::redistanced);
    const SparseSource source = redistanced.grid.source();
    const SparseSource before = none.grid.source();
    const auto field = field_of(none.grid);
    CellCache cells;
    const IsoView view = surface_of(*field, cells);
    int compared = 0;
    int wrong = 0;
    for (std::size_t b = 0; b < source.blocks.size(); b += 3) {
      for (std::size_t n = b % 23; n < SparseBlock::points; n += 23) {
        const SparseBlock& block = source.blocks[b];
        const double value = static_cast<double>(block.value[n]);
        if (!(value < 0.999 * redistanced.grid.outside() && value > 0.999 * redistanced.grid.inside())) continue;
        ASSERT_GE(value * static_cast<double>(before.blocks[b].value[n]), 0.0);
        const Vec3 p =
            h * Vec3(8.0 * block.at[0] + static_cast<double>(n % 8), 8.0 * block.at[1] + static_cast<double>(n / 8 % 8),
                     8.0 * block.at[2] + static_cast<double>(n / 64));
        const Foot foot = view.nearest(p, std::abs(value) + 0.5 * h);
        ASSERT_TRUE(foot.found());
        ++compared;
        if (std::abs(std::abs(value) - foot.distance) > allowed * h) ++wrong;
        EXPECT_LT(std::abs(std::abs(value) - foot.distance), 0.5 * h);
      }
    }
    EXPECT_GT(compared, 100);
    EXPECT_LE(wrong, compared / 50);
    std::printf("%d of %d points off by more than %g voxels\n", wrong, compared, allowed);
  }
}

TEST(Textured, ZeroSetStaysWhereTheTexturePutsIt) {
  const auto grid = ball();
  const PointHeight height = gradient_noise(voxel, 6.0 * voxel, 1);
  const auto none = field_of(must_texture(*grid, height, Redistancing::none).grid);
  for (const auto& [mode, allowed] :
       {std::pair(Redistancing::normalised, 0.1), std::pair(Redistancing::redistanced, 0.05)}) {
    const auto field = field_of(must_texture(*grid, height, mode).grid);
    Rng rng(9);
    CellCache cells;
    CellCache other;
    double squares = 0.0;
    double largest = 0.0;
    constexpr int count = 1000;
    for (int i = 0; i < count; ++i) {
      const Vec3 d = Vec3(rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0)).normalized();
      const IsoCrossing a = surface_of(*none, cells).first_crossing({0.019 * d, 0.013 * d});
      ASSERT_TRUE(a.found);
      const Foot foot = surface_of(*field, other).nearest(a.point, voxel);
      ASSERT_TRUE(foot.found());
      squares += foot.distance * foot.distance;
      largest = std::max(largest, foot.distance);
    }
    EXPECT_LT(std::sqrt(squares / count), 0.25 * allowed * voxel);
    EXPECT_LT(largest, allowed * voxel);
    std::printf("%s: zero set moved by rms %.4f, largest %.4f voxels\n", to_string(mode),
                std::sqrt(squares / count) / voxel, largest / voxel);
  }
}

/// Values rise along every column of a plane, whatever the band and the heights: no second surface, no dent.
TEST(Textured, FarFieldRisesFromInsideToOutside) {
  Rng rng(21);
  for (const double band : {3.0 * voxel, 4.0 * voxel, 10.0 * voxel}) {
    for (const Redistancing mode : {Redistancing::none, Redistancing::normalised, Redistancing::redistanced}) {
      for (int i = 0; i < 3; ++i) {
        const double amplitude = rng.uniform() * std::min(band - 2.0 * voxel, 2.0 * voxel);
        const PointHeight height = wave(amplitude, rng.uniform(16.0, 30.0) * voxel, rng.uniform(0.0, turn));
        const SparseGrid grid = must_texture(*plane(4.0 * voxel, band, 2.0 * voxel), height, mode).grid;
        SparseHint hint;
        for (int x = -4; x <= 4; ++x) {
          double below = -band;
          for (double z = -band; z <= band + 0.5 * voxel; z += voxel) {
            const double here = grid.trilinear(Vec3(x * voxel, 0.0, std::round(z / voxel) * voxel), hint).value;
            ASSERT_GE(here, below - 1e-6 * voxel) << to_string(mode) << " " << band << " " << amplitude;
            below = here;
          }
          ASSERT_NEAR(below, grid.outside(), 1e-6 * voxel);
        }
      }
    }
  }
}

TEST(Textured, AnswersTheSameEveryTime) {
  const auto grid = plane(10.0 * voxel, 4.0 * voxel);
  const PointHeight height = gaussian_noise(0.2 * voxel, 5);
  for (const Redistancing mode : {Redistancing::normalised, Redistancing::redistanced}) {
    const TexturedPotential one = must_texture(*grid, height, mode);
    const TexturedPotential two = must_texture(*grid, height, mode);
    const SparseSource a = one.grid.source();
    const SparseSource b = two.grid.source();
    for (std::size_t n = 0; n < a.blocks.size(); ++n) ASSERT_EQ(a.blocks[n].value, b.blocks[n].value);
    EXPECT_EQ(one.rms_error, two.rms_error);
    EXPECT_EQ(one.largest_error, two.largest_error);
  }
}

}  // namespace
}  // namespace asperity::implicit_texture_test
