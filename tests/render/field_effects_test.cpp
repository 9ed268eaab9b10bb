#include "asperity/render/field_effects.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "tests/render/volumes.h"

namespace asperity::field_effects_test {
namespace {

using volumes::cube;
using volumes::sampled;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
const Vec3 slope(30.0, -20.0, 60.0);  // length 70

/// 2 + slope . p over |x|, |y|, |z| <= 0.05: both reconstructions are exact on it, floats to 1e-6.
std::shared_ptr<const ScalarField> linear_field() {
  return sampled(cube(0.05, 9), [](const Vec3& p) { return 2.0 + slope.dot(p); });
}

double value_at(const Vec3& p) {
  return 2.0 + slope.dot(p);
}

TransferFunction constant(double answer) {
  return TransferFunction::build({{0.0, answer}}).value();
}

FieldEffect effect_of(FieldEffectKind kind, TransferFunction transfer) {
  FieldEffect effect;
  effect.field = linear_field();
  effect.kind = kind;
  effect.transfer = std::move(transfer);
  effect.largest_force = 1e3;
  return effect;
}

Vec3 force_of(const FieldEffect& effect, const Vec3& p, const Vec3& v) {
  CellPolynomial cache;
  return field_effect_force(effect, 0, p, v, cache);
}

const Vec3 place(0.011, -0.023, 0.007);
const Vec3 velocity(0.3, -0.1, 0.2);

// --- transfer function ---

TEST(TransferFunction, IsPiecewiseLinearAndConstantBeyondItsEnds) {
  const TransferFunction f = TransferFunction::build({{-1.0, 4.0}, {1.0, 0.0}, {3.0, 10.0}}).value();
  EXPECT_DOUBLE_EQ(f(-5.0), 4.0);
  EXPECT_DOUBLE_EQ(f(-1.0), 4.0);
  EXPECT_DOUBLE_EQ(f(0.0), 2.0);
  EXPECT_DOUBLE_EQ(f(1.0), 0.0);
  EXPECT_DOUBLE_EQ(f(2.5), 7.5);
  EXPECT_DOUBLE_EQ(f(3.0), 10.0);
  EXPECT_DOUBLE_EQ(f(1e300), 10.0);
  EXPECT_DOUBLE_EQ(f(std::numeric_limits<double>::infinity()), 10.0);
  EXPECT_DOUBLE_EQ(f(nan), 0.0);
  EXPECT_DOUBLE_EQ(TransferFunction()(1.0), 0.0);
}

RC_GTEST_PROP(TransferFunction, StaysBetweenTheAnswersOfItsNeighbours, ()) {
  std::vector<TransferFunction::Point> points;
  double value = -3.0;
  const int count = *rc::gen::inRange(1, 8);
  for (int i = 0; i < count; ++i) {
    value += 1e-3 * *rc::gen::inRange(1, 1000);
    points.push_back({value, 1e-2 * *rc::gen::inRange(-500, 500)});
  }
  const TransferFunction f = TransferFunction::build(points).value();
  const double at = 1e-3 * *rc::gen::inRange(-4000, 7000);
  std::size_t above = 0;
  while (above < points.size() && points[above].value <= at) ++above;
  const double left = points[above == 0 ? 0 : above - 1].answer;
  const double right = points[std::min(above, points.size() - 1)].answer;
  RC_ASSERT(f(at) >= std::min(left, right) - 1e-12);
  RC_ASSERT(f(at) <= std::max(left, right) + 1e-12);
}

TEST(TransferFunction, RefusesBadPointsAndNamesThem) {
  const auto place_of = [](std::vector<TransferFunction::Point> points) {
    const auto result = TransferFunction::build(std::move(points));
    return result ? std::string("accepted") : result.error().place;
  };
  EXPECT_EQ(place_of({}), "transfer");
  EXPECT_EQ(place_of({{0.0, nan}}), "transfer[0]");
  EXPECT_EQ(place_of({{0.0, 1.0}, {std::numeric_limits<double>::infinity(), 1.0}}), "transfer[1]");
  EXPECT_EQ(place_of({{0.0, 1.0}, {0.0, 2.0}}), "transfer[1]");
  EXPECT_EQ(place_of({{0.0, 1.0}, {1.0, 2.0}, {0.5, 2.0}}), "transfer[2]");
  EXPECT_EQ(place_of({{0.0, 1.0}, {1.0, 2.0}}), "accepted");
}

// --- each equation ---

TEST(FieldEffect, ViscosityIsEquation2) {
  const TransferFunction t = TransferFunction::build({{0.0, 0.0}, {10.0, 5.0}}).value();
  const Vec3 force = force_of(effect_of(FieldEffectKind::viscosity, t), place, velocity);
  EXPECT_LT((force + 0.5 * value_at(place) * velocity).norm(), 1e-6);
  EXPECT_GT(force.norm(), 0.1);
}

TEST(FieldEffect, GradientIsEquation3) {
  const TransferFunction t = TransferFunction::build({{0.0, 0.0}, {10.0, 0.1}}).value();
  const Vec3 force = force_of(effect_of(FieldEffectKind::gradient, t), place, velocity);
  EXPECT_LT((force - 0.01 * value_at(place) * slope).norm(), 1e-4);
  EXPECT_EQ(force_of(effect_of(FieldEffectKind::gradient, t), place, Vec3::Zero()), force);
}

TEST(FieldEffect, IwataPushesAlongAFixedDirectionWithEitherSign) {
  FieldEffect effect = effect_of(FieldEffectKind::iwata, constant(-1.5));
  effect.direction = Vec3(0.6, 0.0, 0.8);
  EXPECT_LT((force_of(effect, place, velocity) + 1.5 * effect.direction).norm(), 1e-12);
}

TEST(FieldEffect, PaoResistsAlongTheGradientAlone) {
  const FieldEffect effect = effect_of(FieldEffectKind::pao, constant(2.0));
  const Vec3 along = slope.normalized();
  EXPECT_LT((force_of(effect, place, velocity) + 2.0 * velocity.dot(along) * along).norm(), 1e-5);
  const Vec3 across = along.cross(Vec3::UnitX()).normalized();
  EXPECT_LT(force_of(effect, place, across).norm(), 1e-5);
}

TEST(FieldEffect, PaoAsPrintedLacksTheProjectionAndDrives) {
  FieldEffect effect = effect_of(FieldEffectKind::pao, constant(2.0));
  effect.formulation = Formulation::literal;
  const Vec3 along = slope.normalized();
  const Vec3 force = force_of(effect, place, velocity);
  EXPECT_LT((force + 2.0 * velocity.cwiseProduct(along)).norm(), 1e-5);
  // The gradient falls along y (-2/7): the printed form pushes a probe that moves that way on.
  EXPECT_NEAR(force_of(effect, place, Vec3::UnitY()).dot(Vec3::UnitY()), 4.0 / 7.0, 1e-5);
}

TEST(FieldEffect, GravityScalarsPullTowardsTheValueFromBothSides) {
  FieldEffect effect =
      effect_of(FieldEffectKind::gravity_scalars, TransferFunction::build({{0.0, 0.0}, {1.0, 2.0}}).value());
  const Vec3 along = slope.normalized();
  const Vec3 above = place + 0.005 * along;  // 0.35 over the value there
  const Vec3 below = place - 0.005 * along;
  effect.value = value_at(place);
  EXPECT_LT((force_of(effect, above, velocity) + 0.7 * along).norm(), 1e-4);
  EXPECT_LT((force_of(effect, below, velocity) - 0.7 * along).norm(), 1e-4);
  EXPECT_LT(force_of(effect, place, velocity).norm(), 1e-4);
}

TEST(FieldEffect, ViscosityScalarsDependOnTheDistanceFromTheValue) {
  FieldEffect effect =
      effect_of(FieldEffectKind::viscosity_scalars, TransferFunction::build({{0.0, 3.0}, {1.0, 0.0}}).value());
  effect.value = value_at(place) + 0.5;
  const Vec3 force = force_of(effect, place, velocity);
  EXPECT_LT((force + 1.5 * velocity).norm(), 1e-5);
  effect.value = value_at(place) - 0.5;
  EXPECT_LT((force_of(effect, place, velocity) - force).norm(), 1e-5);
}

TEST(FieldEffect, IsFeltWhereTheVolumeStandsInTheWorld) {
  FieldEffect effect = effect_of(FieldEffectKind::pao, constant(2.0));
  effect.world_from_object.position = Vec3(0.4, 0.1, -0.2);
  effect.world_from_object.orientation = Quat(Eigen::AngleAxisd(0.7, Vec3(1.0, 2.0, -1.0).normalized()));
  const Pose& pose = effect.world_from_object;
  const Vec3 along = pose.rotate(slope.normalized());
  const Vec3 force = force_of(effect, pose.apply(place), velocity);
  EXPECT_LT((force + 2.0 * velocity.dot(along) * along).norm(), 1e-5);

  FieldEffect wind = effect;
  wind.kind = FieldEffectKind::iwata;
  EXPECT_LT((force_of(wind, pose.apply(place), velocity) - 2.0 * wind.direction).norm(), 1e-12);
}

// --- limits ---

TEST(FieldEffect, IsCutToItsLargestForceWithoutTurning) {
  FieldEffect effect = effect_of(FieldEffectKind::gradient, constant(1.0));
  effect.largest_force = 2.5;
  const Vec3 force = force_of(effect, place, velocity);
  EXPECT_NEAR(force.norm(), 2.5, 1e-12);
  EXPECT_LT((force.normalized() - slope.normalized()).norm(), 1e-6);
}

TEST(FieldEffect, IsNothingOutsideTheVolumeAndForBadInput) {
  for (int kind = 0; kind < 6; ++kind) {
    const FieldEffect effect = effect_of(static_cast<FieldEffectKind>(kind), constant(1.0));
    EXPECT_EQ(force_of(effect, Vec3(0.0501, 0.0, 0.0), velocity), Vec3::Zero()) << kind;
    EXPECT_EQ(force_of(effect, Vec3(0.0, 0.0, -1e9), velocity), Vec3::Zero()) << kind;
    EXPECT_EQ(force_of(effect, Vec3(nan, 0.0, 0.0), velocity), Vec3::Zero()) << kind;
    EXPECT_TRUE(force_of(effect, place, Vec3(nan, 0.0, 0.0)).allFinite()) << kind;
    EXPECT_GT(force_of(effect, place, velocity).norm(), 0.0) << kind;
  }
}

TEST(FieldEffect, IsNothingWhereTheFieldIsUnknown) {
  FieldEffect effect = effect_of(FieldEffectKind::viscosity, constant(1.0));
  effect.field = sampled(cube(0.05, 9), [](const Vec3& p) { return p.x() > 0.03 ? nan : value_at(p); });
  EXPECT_EQ(force_of(effect, Vec3(0.04, 0.0, 0.0), velocity), Vec3::Zero());
  EXPECT_LT((force_of(effect, Vec3(-0.03, 0.0, 0.0), velocity) + velocity).norm(), 1e-9);
}

TEST(FieldEffect, DirectionOfAFlatFieldIsNoForce) {
  for (const FieldEffectKind kind :
       {FieldEffectKind::gradient, FieldEffectKind::pao, FieldEffectKind::gravity_scalars}) {
    FieldEffect effect = effect_of(kind, constant(1.0));
    effect.field = sampled(cube(0.05, 3), [](const Vec3&) { return 1.0; });
    EXPECT_LT(force_of(effect, place, velocity).norm(), 1e-12);
  }
}

// --- invariants ---

RC_GTEST_PROP(FieldEffect, ResistancesNeverDrive, ()) {
  static const auto field = sampled(cube(0.05, 7), [](const Vec3& p) {
    return std::sin(90.0 * p.x()) * std::cos(70.0 * p.y()) + std::sin(110.0 * p.z() + 1.0);
  });
  const auto number = [](double low, double high) { return low + (high - low) * 1e-4 * *rc::gen::inRange(0, 10001); };
  FieldEffect effect;
  effect.field = field;
  constexpr FieldEffectKind kinds[] = {FieldEffectKind::viscosity, FieldEffectKind::pao,
                                       FieldEffectKind::viscosity_scalars};
  effect.kind = kinds[*rc::gen::inRange(0, 3)];
  effect.transfer =
      TransferFunction::build({{-1.0, number(0.0, 5.0)}, {0.0, number(0.0, 5.0)}, {1.5, number(0.0, 5.0)}}).value();
  effect.value = number(-2.0, 2.0);
  effect.largest_force = number(0.1, 4.0);
  effect.world_from_object.orientation =
      Quat(Eigen::AngleAxisd(number(-3.0, 3.0), Vec3(number(-1.0, 1.0), 1.0, number(-1.0, 1.0)).normalized()));
  RC_ASSERT(validate(effect).ok());
  const Vec3 p(number(-0.06, 0.06), number(-0.06, 0.06), number(-0.06, 0.06));
  const Vec3 v(number(-2.0, 2.0), number(-2.0, 2.0), number(-2.0, 2.0));
  const Vec3 force = force_of(effect, p, v);
  RC_ASSERT(force.dot(v) <= 1e-12);
  RC_ASSERT(force.norm() <= effect.largest_force * (1.0 + 1e-12));
}

// --- bad settings ---

TEST(FieldEffect, RefusesEachBadMemberByName) {
  const FieldEffect good = effect_of(FieldEffectKind::viscosity, constant(1.0));
  ASSERT_TRUE(validate(good).ok());
  const auto place_of = [&](const std::function<void(FieldEffect&)>& spoil) {
    FieldEffect effect = good;
    spoil(effect);
    const Status status = validate(effect);
    if (status.ok()) return std::string("accepted");
    EXPECT_EQ(status.error().code, ErrorCode::bad_value);
    EXPECT_FALSE(status.error().accepted.empty());
    return status.error().place;
  };
  EXPECT_EQ(place_of([](FieldEffect& e) { e.field = nullptr; }), "field");
  EXPECT_EQ(place_of([](FieldEffect& e) { e.kind = static_cast<FieldEffectKind>(9); }), "kind");
  EXPECT_EQ(place_of([](FieldEffect& e) { e.transfer = {}; }), "transfer");
  EXPECT_EQ(place_of([](FieldEffect& e) {
              e.transfer = TransferFunction::build({{0.0, 1.0}, {1.0, -0.1}}).value();
            }),
            "transfer[1]");
  EXPECT_EQ(place_of([](FieldEffect& e) { e.direction = Vec3::Zero(); }), "direction");
  EXPECT_EQ(place_of([](FieldEffect& e) { e.direction = Vec3(nan, 0.0, 0.0); }), "direction");
  EXPECT_EQ(place_of([](FieldEffect& e) { e.value = nan; }), "value");
  EXPECT_EQ(place_of([](FieldEffect& e) { e.largest_force = 0.0; }), "largest_force");
  EXPECT_EQ(place_of([](FieldEffect& e) { e.largest_force = nan; }), "largest_force");
  EXPECT_EQ(place_of([](FieldEffect& e) { e.formulation = Formulation::literal; }), "formulation");
  EXPECT_EQ(place_of([](FieldEffect& e) { e.world_from_object.position.x() = nan; }), "world_from_object");
  EXPECT_EQ(place_of([](FieldEffect& e) { e.world_from_object.orientation = Quat(2.0, 0.0, 0.0, 0.0); }),
            "world_from_object");
  // A pull or push that does not depend on the motion may have either sign.
  EXPECT_EQ(place_of([](FieldEffect& e) {
              e.kind = FieldEffectKind::iwata;
              e.transfer = constant(-1.0);
            }),
            "accepted");
}

TEST(FieldEffect, NamesAreInTheOrderOfTheKinds) {
  ASSERT_EQ(field_effect_names().size(), 6U);
  EXPECT_EQ(field_effect_names()[static_cast<std::size_t>(FieldEffectKind::pao)], "pao");
  EXPECT_EQ(field_effect_names()[static_cast<std::size_t>(FieldEffectKind::viscosity_scalars)], "viscosity-scalars");
}

}  // namespace
}  // namespace asperity::field_effects_test
