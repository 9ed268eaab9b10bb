// Derived fields (row M-1): order of convergence on stretched axes, exactness on polynomials, holes, bad input.

#include "asperity/field/volume/derived_fields.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "asperity/field/volume/generators.h"

namespace asperity::derived_fields_test {
namespace {

/// Velocity and its exact slopes.
struct Flow {
  std::function<Vec3(const Vec3&)> velocity;
  std::function<Mat3(const Vec3&)> gradient;
};

double exact(const Flow& flow, DerivedField field, const Vec3& p) {
  const Mat3 g = flow.gradient(p);
  const Mat3 spin = 0.5 * (g - g.transpose());
  const Mat3 strain = 0.5 * (g + g.transpose());
  const Vec3 vorticity(g(2, 1) - g(1, 2), g(0, 2) - g(2, 0), g(1, 0) - g(0, 1));
  switch (field) {
    case DerivedField::vorticity_magnitude: return vorticity.norm();
    case DerivedField::q_criterion: return 0.5 * (spin.squaredNorm() - strain.squaredNorm());
    case DerivedField::helicity: return flow.velocity(p).dot(vorticity);
    case DerivedField::gradient_magnitude: return g.norm();
  }
  return 0.0;
}

/// tanh layer along z with a sway along y.
Flow shear_layer() {
  constexpr double d = 0.2;
  return {[](const Vec3& p) { return Vec3(std::tanh((p.z() - 0.5) / d), 0.3 * std::sin(3.0 * p.z()), 0.1 * p.x()); },
          [](const Vec3& p) {
            const double c = std::cosh((p.z() - 0.5) / d);
            Mat3 g = Mat3::Zero();
            g(0, 2) = 1.0 / (d * c * c);
            g(1, 2) = 0.9 * std::cos(3.0 * p.z());
            g(2, 0) = 0.1;
            return g;
          }};
}

/// Taylor and Green's vortices.
Flow taylor_green() {
  return {[](const Vec3& p) {
            return Vec3(std::cos(3.0 * p.x()) * std::sin(3.0 * p.y()) * std::sin(3.0 * p.z()),
                        -std::sin(3.0 * p.x()) * std::cos(3.0 * p.y()) * std::sin(3.0 * p.z()), 0.5);
          },
          [](const Vec3& p) {
            const Vec3 s(std::sin(3.0 * p.x()), std::sin(3.0 * p.y()), std::sin(3.0 * p.z()));
            const Vec3 c(std::cos(3.0 * p.x()), std::cos(3.0 * p.y()), std::cos(3.0 * p.z()));
            Mat3 g;
            g << -s.x() * s.y() * s.z(), c.x() * c.y() * s.z(), c.x() * s.y() * c.z(),  //
                -c.x() * c.y() * s.z(), s.x() * s.y() * s.z(), -s.x() * c.y() * c.z(),  //
                0.0, 0.0, 0.0;
            return Mat3(3.0 * g);
          }};
}

/// The flow of Arnold, Beltrami and Childress: its vorticity is its velocity times the wave number.
Flow beltrami() {
  static constexpr double k = 4.0;
  return {[](const Vec3& p) {
            return Vec3(std::sin(k * p.z()) + 0.7 * std::cos(k * p.y()), std::sin(k * p.x()) + std::cos(k * p.z()),
                        0.7 * std::sin(k * p.y()) + std::cos(k * p.x()));
          },
          [](const Vec3& p) {
            Mat3 g;
            g << 0.0, -0.7 * std::sin(k * p.y()), std::cos(k * p.z()),  //
                std::cos(k * p.x()), 0.0, -std::sin(k * p.z()),         //
                -std::sin(k * p.x()), 0.7 * std::cos(k * p.y()), 0.0;
            return Mat3(k * g);
          }};
}

/// Lamb and Oseen's vortex along z, off the corner of the box, with an axial stream.
Flow lamb_oseen() {
  constexpr double core = 0.3;
  // u_theta / r and its derivative by r^2.
  const auto turn = [](double rr) { return rr < 1e-9 ? 1.0 / (core * core) : -std::expm1(-rr / (core * core)) / rr; };
  const auto turn_slope = [turn](double rr) {
    if (rr < 1e-9) return -0.5 / std::pow(core, 4);
    return (std::exp(-rr / (core * core)) / (core * core) - turn(rr)) / rr;
  };
  return {[turn](const Vec3& p) {
            const double x = p.x() - 0.47;
            const double y = p.y() - 0.52;
            const double w = turn(x * x + y * y);
            return Vec3(-w * y, w * x, 1.0 + 0.2 * p.z() * p.z());
          },
          [turn, turn_slope](const Vec3& p) {
            const double x = p.x() - 0.47;
            const double y = p.y() - 0.52;
            const double w = turn(x * x + y * y);
            const double slope = 2.0 * turn_slope(x * x + y * y);
            Mat3 g = Mat3::Zero();
            g(0, 0) = -slope * x * y;
            g(0, 1) = -w - slope * y * y;
            g(1, 0) = w + slope * x * x;
            g(1, 1) = slope * x * y;
            g(2, 2) = 0.4 * p.z();
            return g;
          }};
}

GridAxis stretched(std::uint32_t count, double low, double high, double strength) {
  std::vector<double> nodes(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const double s = static_cast<double>(i) / (count - 1);
    nodes[i] = low + (high - low) * (s + strength * std::sin(2.0 * std::numbers::pi * s) / (2.0 * std::numbers::pi));
  }
  return *GridAxis::build(std::move(nodes));
}

VectorGrid sampled(const Flow& flow, GridAxes axes) {
  VectorGrid grid{std::move(axes), {}, "velocity"};
  for (const double z : grid.axes[2].nodes()) {
    for (const double y : grid.axes[1].nodes()) {
      for (const double x : grid.axes[0].nodes()) {
        const Vec3 u = flow.velocity({x, y, z});
        for (int a = 0; a < 3; ++a) grid.samples.push_back(static_cast<float>(u[a]));
      }
    }
  }
  return grid;
}

GridAxes stretched_axes(std::uint32_t cells) {
  return {stretched(cells + 1, 0.0, 1.0, 0.6), stretched(cells + 1, 0.0, 1.0, -0.5),
          stretched(cells + 1, 0.0, 1.0, 0.7)};
}

/// Largest error over all nodes, ends included, divided by the largest exact value.
double worst_error(const Flow& flow, DerivedField field, std::uint32_t cells) {
  const VectorGrid grid = sampled(flow, stretched_axes(cells));
  const ScalarGrid derived = *derive(grid, field);
  double worst = 0.0;
  double largest = 0.0;
  for (std::uint32_t k = 0; k <= cells; ++k) {
    for (std::uint32_t j = 0; j <= cells; ++j) {
      for (std::uint32_t i = 0; i <= cells; ++i) {
        const double truth = exact(flow, field, {grid.axes[0].node(i), grid.axes[1].node(j), grid.axes[2].node(k)});
        worst = std::max(worst, std::abs(derived.value(i, j, k) - truth));
        largest = std::max(largest, std::abs(truth));
      }
    }
  }
  return worst / largest;
}

struct OrderCase {
  const char* name;
  Flow (*flow)();
};

class DerivedFieldOrder : public testing::TestWithParam<OrderCase> {};

TEST_P(DerivedFieldOrder, IsTwoOnStretchedAxesUpToTheEnds) {
  const Flow flow = GetParam().flow();
  for (const DerivedField field : {DerivedField::vorticity_magnitude, DerivedField::q_criterion, DerivedField::helicity,
                                   DerivedField::gradient_magnitude}) {
    const double coarse = worst_error(flow, field, 24);
    const double fine = worst_error(flow, field, 48);
    if (fine < 1e-5) continue;  // no slope along which the differences err: rounding of float32 is what is left
    const double order = std::log2(coarse / fine);
    EXPECT_GT(order, 1.75) << to_string(field) << ": " << coarse << " then " << fine;
    EXPECT_LT(fine, 0.06) << to_string(field);
  }
}

INSTANTIATE_TEST_SUITE_P(Flows, DerivedFieldOrder,
                         testing::Values(OrderCase{"ShearLayer", shear_layer}, OrderCase{"TaylorGreen", taylor_green},
                                         OrderCase{"Beltrami", beltrami}, OrderCase{"LambOseen", lamb_oseen}),
                         [](const auto& tested) { return tested.param.name; });

TEST(DerivedFields, CavityFlowConvergesToItsExactVorticity) {
  const auto error = [](std::uint32_t n) {
    VolumeGenerator generator{.kind = VolumeKind::cavity,
                              .size = std::array<std::uint32_t, 3>{2 * n + 1, n + 1, n + 1}};
    const CavityFlow flow = *CavityFlow::build(generator);
    const VectorGrid grid = std::get<VectorGrid>(*generate_volume(generator));
    const ScalarGrid derived = *derive(grid, DerivedField::vorticity_magnitude);
    double sum = 0.0;
    double all = 0.0;
    for (std::uint32_t k = 0; k < grid.axes[2].size(); ++k) {
      for (std::uint32_t j = 0; j < grid.axes[1].size(); ++j) {
        for (std::uint32_t i = 0; i < grid.axes[0].size(); ++i) {
          const Mat3 g = flow.gradient({grid.axes[0].node(i), grid.axes[1].node(j), grid.axes[2].node(k)});
          const double truth = Vec3(g(2, 1) - g(1, 2), g(0, 2) - g(2, 0), g(1, 0) - g(0, 1)).norm();
          sum += std::pow(derived.value(i, j, k) - truth, 2);
          all += truth * truth;
        }
      }
    }
    return std::sqrt(sum / all);
  };
  const double coarse = error(32);
  const double fine = error(64);
  EXPECT_GT(std::log2(coarse / fine), 1.7) << coarse << " then " << fine;
  EXPECT_LT(fine, 0.03);
}

RC_GTEST_PROP(DerivedFields, QuadraticVelocitiesAreExactEverywhere, ()) {
  // u_i = b_i + (G x)_i + x_j x_k terms: three-point differences of second order have no error on them.
  const auto number = [] { return (*rc::gen::inRange(-100, 101)) / 50.0; };
  Mat3 linear;
  Mat3 square;
  for (int n = 0; n < 9; ++n) {
    linear(n / 3, n % 3) = number();
    square(n / 3, n % 3) = number();
  }
  const Flow flow{[=](const Vec3& p) { return Vec3(linear * p + square * p.cwiseProduct(p) + Vec3(0.5, -1.0, 2.0)); },
                  [=](const Vec3& p) { return Mat3(linear + 2.0 * square * p.asDiagonal()); }};
  const GridAxes axes = {stretched(5, -1.0, 1.0, 0.8), stretched(4, 0.0, 2.0, -0.6), stretched(3, 1.0, 1.5, 0.4)};
  const VectorGrid grid = sampled(flow, axes);
  for (const DerivedField field : {DerivedField::vorticity_magnitude, DerivedField::q_criterion, DerivedField::helicity,
                                   DerivedField::gradient_magnitude}) {
    const ScalarGrid derived = *derive(grid, field);
    for (std::uint32_t k = 0; k < 3; ++k) {
      for (std::uint32_t j = 0; j < 4; ++j) {
        for (std::uint32_t i = 0; i < 5; ++i) {
          const double truth = exact(flow, field, {axes[0].node(i), axes[1].node(j), axes[2].node(k)});
          RC_ASSERT(std::abs(derived.value(i, j, k) - truth) < 2e-3);  // samples are float32
        }
      }
    }
  }
}

TEST(DerivedFields, DerivativeStencilsReproduceQuadratics) {
  const GridAxis axis = *GridAxis::build({0.0, 1.0, 1.5, 4.0, 4.25});
  for (std::uint32_t node = 0; node < axis.size(); ++node) {
    const DerivativeStencil stencil = derivative_stencil(axis, node);
    double constant = 0.0;
    double linear = 0.0;
    double square = 0.0;
    for (std::uint32_t n = 0; n < stencil.count; ++n) {
      const double x = axis.node(stencil.first + n);
      constant += stencil.weights[n];
      linear += stencil.weights[n] * x;
      square += stencil.weights[n] * x * x;
    }
    EXPECT_NEAR(constant, 0.0, 1e-12);
    EXPECT_NEAR(linear, 1.0, 1e-12);
    EXPECT_NEAR(square, 2.0 * axis.node(node), 1e-12);
  }
}

TEST(DerivedFields, AxisOfTwoNodesTakesTheSecant) {
  const Flow flow{[](const Vec3& p) { return Vec3(0.0, 3.0 * p.x(), 0.0); }, {}};
  const GridAxis pair = *GridAxis::uniform(0.0, 0.5, 2);
  const ScalarGrid derived = *derive(sampled(flow, {pair, pair, pair}), DerivedField::vorticity_magnitude);
  EXPECT_DOUBLE_EQ(derived.lowest(), 3.0);
  EXPECT_DOUBLE_EQ(derived.highest(), 3.0);
}

TEST(DerivedFields, AHoleSpreadsToItsNeighboursAlongTheAxesOnly) {
  const GridAxis axis = *GridAxis::uniform(0.0, 1.0, 7);
  VectorGrid grid = sampled(beltrami(), {axis, axis, axis});
  const std::size_t hole = 3 + 7 * (3 + 7 * 3);
  for (std::size_t a = 0; a < 3; ++a) grid.samples[3 * hole + a] = std::nanf("");
  const ScalarGrid derived = *derive(grid, DerivedField::vorticity_magnitude);
  EXPECT_EQ(derived.unknown(), 7U);
  for (std::uint32_t k = 0; k < 7; ++k) {
    for (std::uint32_t j = 0; j < 7; ++j) {
      for (std::uint32_t i = 0; i < 7; ++i) {
        const auto off = [](std::uint32_t v) { return v > 3 ? v - 3 : 3 - v; };
        EXPECT_EQ(std::isnan(derived.value(i, j, k)), off(i) + off(j) + off(k) <= 1);
      }
    }
  }
}

TEST(DerivedFields, AHoleInOnePartStaysOutOfWhatDoesNotNeedIt) {
  const GridAxis axis = *GridAxis::uniform(0.0, 1.0, 7);
  VectorGrid grid = sampled(beltrami(), {axis, axis, axis});
  grid.samples[3 * (3 + 7 * (3 + 7 * 3))] = std::nanf("");  // u_x, whose slope along x is in no vorticity
  const ScalarGrid vorticity = *derive(grid, DerivedField::vorticity_magnitude);
  EXPECT_FALSE(std::isnan(vorticity.value(2, 3, 3)));
  EXPECT_TRUE(std::isnan(vorticity.value(3, 2, 3)));
  EXPECT_EQ(vorticity.unknown(), 5U);
  EXPECT_EQ(derive(grid, DerivedField::q_criterion)->unknown(), 7U);
}

TEST(DerivedFields, TwoThreadsAnswerWhatOneDoes) {
  // 80^3 nodes are shared among threads; a part of the same nodes, cut out, is not.
  const GridAxis axis = stretched(80, 0.0, 1.0, 0.5);
  const VectorGrid grid = sampled(taylor_green(), {axis, axis, axis});
  const ScalarGrid whole = *derive(grid, DerivedField::q_criterion);
  const std::vector<double> nodes(axis.nodes().begin() + 20, axis.nodes().begin() + 40);
  const GridAxis part = *GridAxis::build(nodes);
  const ScalarGrid cut = *derive(sampled(taylor_green(), {part, part, part}), DerivedField::q_criterion);
  for (std::uint32_t k = 1; k < 19; ++k) {
    for (std::uint32_t j = 1; j < 19; ++j) {
      for (std::uint32_t i = 1; i < 19; ++i) EXPECT_EQ(cut.value(i, j, k), whole.value(i + 20, j + 20, k + 20));
    }
  }
}

TEST(DerivedFields, GradientOfScalarsOfEveryType) {
  const GridAxis x = *GridAxis::build({0.0, 1.0, 3.0, 4.0});
  std::vector<std::uint8_t> bytes;
  std::vector<std::int16_t> words;
  for (std::uint32_t n = 0; n < 64; ++n) {
    const double value = 3.0 * x.node(n % 4) + 4.0 * x.node(n / 16) + 5.0;
    bytes.push_back(static_cast<std::uint8_t>(value));
    words.push_back(static_cast<std::int16_t>(-value));
  }
  for (const ScalarGrid& grid : {*ScalarGrid::build({x, x, x}, bytes), *ScalarGrid::build({x, x, x}, words)}) {
    const ScalarGrid derived = *derive(grid, DerivedField::gradient_magnitude);
    EXPECT_NEAR(derived.lowest(), 5.0, 1e-6);
    EXPECT_NEAR(derived.highest(), 5.0, 1e-6);
  }
}

TEST(DerivedFields, PartsOfVectors) {
  const GridAxis pair = *GridAxis::uniform(0.0, 1.0, 2);
  VectorGrid grid{{pair, pair, pair}, {}, "u"};
  for (int n = 0; n < 8; ++n) grid.samples.insert(grid.samples.end(), {2.0F, 3.0F, 6.0F});
  EXPECT_EQ(part_of(grid, VectorPart::magnitude)->value(1, 0, 1), 7.0);
  EXPECT_EQ(part_of(grid, VectorPart::x)->value(0, 0, 0), 2.0);
  EXPECT_EQ(part_of(grid, VectorPart::y)->value(0, 0, 0), 3.0);
  EXPECT_EQ(part_of(grid, VectorPart::z)->value(0, 1, 0), 6.0);
  EXPECT_EQ(part_of(grid, VectorPart::z)->name(), "z of u");
}

TEST(DerivedFields, NamesAreReadBack) {
  for (const DerivedField field : {DerivedField::vorticity_magnitude, DerivedField::q_criterion, DerivedField::helicity,
                                   DerivedField::gradient_magnitude})
    EXPECT_EQ(*parse_derived_field(to_string(field)), field);
  for (const VectorPart part : {VectorPart::magnitude, VectorPart::x, VectorPart::y, VectorPart::z})
    EXPECT_EQ(*parse_vector_part(to_string(part)), part);
  const auto unknown = parse_derived_field("vortex");
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.error().code, ErrorCode::bad_value);
  EXPECT_NE(unknown.error().accepted.find("q_criterion"), std::string::npos);
  EXPECT_FALSE(parse_vector_part("w"));
}

TEST(DerivedFields, RefusesWhatIsNoField) {
  const GridAxis axis = *GridAxis::uniform(0.0, 1.0, 4);
  VectorGrid grid = sampled(beltrami(), {axis, axis, axis});
  const auto code = [](const auto& result) {
    return result.ok() ? std::string("none") : to_string(result.error().code);
  };

  VectorGrid few = grid;
  few.samples.pop_back();
  EXPECT_EQ(code(derive(few, DerivedField::helicity)), "mismatch");
  EXPECT_EQ(code(part_of(few, VectorPart::x)), "mismatch");
  EXPECT_EQ(code(derive(VectorGrid{}, DerivedField::helicity)), "mismatch");

  VectorGrid infinite = grid;
  infinite.samples[100] = std::numeric_limits<float>::infinity();
  const auto refused = derive(infinite, DerivedField::helicity);
  EXPECT_EQ(code(refused), "bad_value");
  EXPECT_NE(refused.error().message().find("vector 33"), std::string::npos) << refused.error().message();

  VectorGrid unknown = grid;
  for (float& value : unknown.samples) value = std::nanf("");
  EXPECT_EQ(code(derive(unknown, DerivedField::helicity)), "bad_value");

  const ScalarGrid scalars = *part_of(grid, VectorPart::x);
  EXPECT_EQ(code(derive(scalars, DerivedField::vorticity_magnitude)), "bad_value");
}

}  // namespace
}  // namespace asperity::derived_fields_test
