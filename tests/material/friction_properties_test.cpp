// What must hold for every law on any input: passivity, the cone, finite output, replays.

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>

#include "asperity/core/rng.h"
#include "asperity/material/friction.h"
#include "tests/material/friction_rig.h"

namespace asperity::friction_properties_test {
namespace {

double log_uniform(Rng& rng, double low, double high) {
  return low * std::pow(high / low, rng.uniform(0.0, 1.0));
}

bool chance(Rng& rng, double probability) {
  return rng.uniform(0.0, 1.0) < probability;
}

FrictionLaw random_law(Rng& rng, FrictionKind kind, Formulation formulation) {
  FrictionLaw law = law_of(kind, formulation);
  const std::vector<std::string>& read = friction_parameters(kind);
  const auto some = [&](const char* name) {
    return std::find(read.begin(), read.end(), name) != read.end() && chance(rng, 0.5);
  };
  if (some("stiffness")) law.stiffness = log_uniform(rng, 10.0, 1e5);
  if (some("damping")) law.damping = log_uniform(rng, 0.01, 100.0);
  if (some("viscosity")) law.viscosity = log_uniform(rng, 0.01, 10.0);
  if (some("break_away")) law.break_away = log_uniform(rng, 0.01, 10.0);
  if (some("stick_speed") && formulation == Formulation::consistent) law.stick_speed = log_uniform(rng, 1e-4, 0.1);
  if (some("stribeck_speed")) law.stribeck_speed = log_uniform(rng, 1e-4, 0.1);
  if (some("exponent")) law.exponent = rng.uniform(0.5, 4.0);
  if (some("adhesion")) law.adhesion = rng.uniform(0.0, 0.9);
  return law;
}

FrictionContact random_contact(Rng& rng) {
  FrictionContact contact;
  contact.normal = Vec3(rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0), rng.uniform(0.1, 1.0)).normalized();
  contact.stiffness = log_uniform(rng, 10.0, 1e5);
  contact.dt = Seconds(log_uniform(rng, 1e-6, 1e-2));
  FrictionCoefficients& coefficients = contact.coefficients;
  coefficients.sliding = chance(rng, 0.1) ? 0.0 : rng.uniform(0.0, 1.5);
  coefficients.still = coefficients.sliding + (chance(rng, 0.3) ? 0.0 : rng.uniform(0.0, 1.0));
  if (chance(rng, 0.6)) {
    coefficients.still_ratio = chance(rng, 0.1) ? 0.0 : rng.uniform(0.0, 1.0);
    coefficients.sliding_ratio = chance(rng, 0.1) ? 0.0 : rng.uniform(0.0, 1.0);
    coefficients.across = contact.normal.cross(Vec3(0.3, -1.0, 0.2)).normalized();
    coefficients.formulation = chance(rng, 0.3) ? Formulation::literal : Formulation::consistent;
    // As printed a stiffness by direction feeds energy.
    if (coefficients.formulation == Formulation::consistent && chance(rng, 0.5))
      coefficients.stiffness_ratio = log_uniform(rng, 0.01, 1.0);
  }
  return contact;
}

/// Motions of every kind: strokes, dithering, rest, leaps; pushes that come and go.
class Path {
 public:
  Path(std::uint64_t seed, bool agreeing, bool turning)
      : rng_(seed), agreeing_(agreeing), turning_(turning), scale_(log_uniform(rng_, 1e-7, 1e-2)) {}

  void next(FrictionContact& contact) {
    if (chance(rng_, 0.02)) scale_ = log_uniform(rng_, 1e-8, 1e-1);
    if (chance(rng_, 0.05)) drift_ = random_vector();
    if (chance(rng_, 0.05)) dither_ = rng_.uniform(0.0, 2.0);
    sign_ = -sign_;
    contact.motion =
        chance(rng_, 0.05) ? Vec3(Vec3::Zero()) : Vec3(scale_ * (drift_ + dither_ * sign_ * random_vector()));
    contact.velocity = contact.motion / contact.dt.count();
    if (!agreeing_ && chance(rng_, 0.3)) contact.velocity = random_vector() * log_uniform(rng_, 1e-5, 10.0);
    if (chance(rng_, 0.1)) contact.push = chance(rng_, 0.2) ? 0.0 : log_uniform(rng_, 1e-3, 50.0);
    if (!turning_) return;
    contact.normal = (contact.normal + 0.02 * random_vector()).normalized();
    Vec3& across = contact.coefficients.across;
    if (!across.isZero()) across = (across + 0.02 * random_vector()).normalized();
  }

 private:
  Vec3 random_vector() { return {rng_.uniform(-1.0, 1.0), rng_.uniform(-1.0, 1.0), rng_.uniform(-1.0, 1.0)}; }

  Rng rng_;
  bool agreeing_;
  bool turning_;
  double scale_;
  Vec3 drift_ = Vec3::Zero();
  double dither_ = 0.0;
  double sign_ = 1.0;
};

RC_GTEST_PROP(FrictionLaws, NeverAddEnergy, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint64_t>());
  for (const FrictionKind kind : all_friction_kinds()) {
    const FrictionLaw law = random_law(rng, kind, Formulation::consistent);
    FrictionContact contact = random_contact(rng);
    // Velocity estimates of their own are the more severe: nothing may be gained from their error.
    Path path(rng.next(), !has_spring(kind), true);
    FrictionState state;
    double before = 0.0;
    for (int tick = 0; tick < 300; ++tick) {
      path.next(contact);
      const Vec3 force = friction_force(law, contact, state);
      const double after = friction_energy(state);
      const double work = -force.dot(contact.motion);
      const double scale = force.norm() * contact.motion.norm() + before + after;
      RC_ASSERT(work - (after - before) >= -1e-10 * scale);
      if (!has_spring(kind)) {
        RC_ASSERT(force.dot(contact.velocity) <= 1e-12 * scale / contact.dt.count());
        RC_ASSERT(after == 0.0);
      }
      before = after;
    }
  }
}

/// Whether a force in the tangent plane is within the larger of both limits.
bool within_cone(const FrictionLaw& law, const FrictionContact& contact, const Vec3& force, bool still_too) {
  const FrictionCoefficients& coefficients = contact.coefficients;
  const double sliding = coefficients.sliding * contact.push;
  const double still = law.break_away > 0.0 ? law.break_away : coefficients.still * contact.push;
  const double across = still_too ? std::max(still, sliding) : sliding;
  const bool literal = coefficients.formulation == Formulation::literal;
  if (coefficients.across.isZero() || literal) return force.norm() <= across * (1.0 + 1e-9) + 1e-15;
  const double lay = still_too ? std::max(still * coefficients.still_ratio, sliding * coefficients.sliding_ratio)
                               : sliding * coefficients.sliding_ratio;
  const double p = force.dot(coefficients.across);
  const double q = force.dot(contact.normal.cross(coefficients.across));
  const double tolerance = 1e-12 * (1.0 + std::abs(p) + std::abs(q));
  if (across <= 0.0 || lay <= 0.0) return std::abs(p) <= across + tolerance && std::abs(q) <= lay + tolerance;
  return std::hypot(std::max(0.0, std::abs(p) - tolerance) / across, std::max(0.0, std::abs(q) - tolerance) / lay) <=
         1.0 + 1e-9;
}

RC_GTEST_PROP(FrictionLaws, KeepForceAndStretchWithinTheCone, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint64_t>());
  for (const FrictionKind kind : all_friction_kinds()) {
    if (kind == FrictionKind::viscous) continue;
    FrictionLaw law = random_law(rng, kind, Formulation::consistent);
    law.viscosity = 0.0;
    FrictionContact contact = random_contact(rng);
    Path path(rng.next(), true, false);
    FrictionState state;
    const bool still_too =
        kind == FrictionKind::implicit_coulomb || kind == FrictionKind::karnopp || kind == FrictionKind::lugre;
    for (int tick = 0; tick < 300; ++tick) {
      path.next(contact);
      const Vec3 force = friction_force(law, contact, state);
      RC_ASSERT(std::abs(force.dot(contact.normal)) <= 1e-9 * (force.norm() + 1e-12));
      RC_ASSERT(within_cone(law, contact, force, still_too));
      // With a damper beside it the spring lets go over damping / stiffness.
      const bool lags = kind == FrictionKind::implicit_coulomb && law.damping > 0.0;
      if (!lags) {
        RC_ASSERT(within_cone(law, contact, friction_spring(contact, state), still_too));
      }
    }
  }
}

RC_GTEST_PROP(FrictionLaws, ReplayToTheBit, ()) {
  const std::uint64_t seed = *rc::gen::arbitrary<std::uint64_t>();
  for (const FrictionKind kind : all_friction_kinds()) {
    for (const Formulation formulation : {Formulation::literal, Formulation::consistent}) {
      Vec3 sums[2];
      for (Vec3& sum : sums) {
        Rng rng(seed);
        const FrictionLaw law = random_law(rng, kind, formulation);
        FrictionContact contact = random_contact(rng);
        Path path(rng.next(), false, true);
        FrictionState state;
        sum.setZero();
        for (int tick = 0; tick < 100; ++tick) {
          path.next(contact);
          sum = 0.5 * sum + friction_force(law, contact, state);
        }
      }
      RC_ASSERT(sums[0] == sums[1]);
    }
  }
}

RC_GTEST_PROP(FrictionLaws, AnswerFiniteForcesToAnyInput, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint64_t>());
  for (const FrictionKind kind : all_friction_kinds()) {
    for (const Formulation formulation : {Formulation::literal, Formulation::consistent}) {
      const FrictionLaw law = random_law(rng, kind, formulation);
      FrictionContact contact = random_contact(rng);
      FrictionState state;
      for (int tick = 0; tick < 100; ++tick) {
        const auto extreme = [&rng] {
          const double values[] = {0.0, 1e-300, 1e-12, 1e-3, 1.0, 1e6, 1e150, 1e300};
          return (chance(rng, 0.5) ? 1.0 : -1.0) * values[rng.next() % 8];
        };
        contact.push = std::abs(extreme());
        contact.motion = {extreme(), extreme(), extreme()};
        contact.velocity = {extreme(), extreme(), extreme()};
        RC_ASSERT(friction_force(law, contact, state).allFinite());
        RC_ASSERT(state.stretch.allFinite());
      }
    }
  }
}

/// A law that promises it does not creep, however it is shaken within its limits.
RC_GTEST_PROP(FrictionLaws, DoNotDriftUnderDithering, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint64_t>());
  for (const FrictionKind kind :
       {FrictionKind::implicit_coulomb, FrictionKind::karnopp, FrictionKind::hayward_armstrong}) {
    FrictionLaw law = law_of(kind);
    if (kind == FrictionKind::hayward_armstrong) law.adhesion = rng.uniform(0.2, 0.9);
    FrictionContact contact = random_contact(rng);
    contact.push = 1.0;
    contact.coefficients.sliding = rng.uniform(0.1, 1.0);
    contact.coefficients.still = contact.coefficients.sliding;
    contact.coefficients.still_ratio = contact.coefficients.sliding_ratio = rng.uniform(0.2, 1.0);
    contact.coefficients.formulation = Formulation::consistent;
    FrictionState state;
    contact.motion.setZero();
    friction_force(law, contact, state);
    // Within the smallest half-axis, and within the adhesion there.
    const double share = kind == FrictionKind::hayward_armstrong ? law.adhesion : 1.0;
    const double radius =
        0.99 * share * contact.coefficients.sliding * contact.coefficients.sliding_ratio / contact.stiffness;
    const Vec3 first = contact.normal.unitOrthogonal();
    const Vec3 second = contact.normal.cross(first);
    Vec3 place = Vec3::Zero();
    for (int tick = 0; tick < 500; ++tick) {
      const double angle = rng.uniform(0.0, 6.3);
      const double r = radius * rng.uniform(0.0, 1.0);
      const Vec3 to = r * std::cos(angle) * first + r * std::sin(angle) * second;
      contact.motion = to - place;
      contact.velocity = contact.motion / contact.dt.count();
      place = to;
      friction_force(law, contact, state);
      // The anchor is where it was: the spring pulls back by all of the way from there.
      const FrictionCoefficients& coefficients = contact.coefficients;
      const Vec3 lay = contact.normal.cross(coefficients.across);
      const double softer = 1.0 - coefficients.stiffness_ratio;
      const Vec3 pull = -contact.stiffness * (place - softer * place.dot(lay) * lay);
      RC_ASSERT((friction_spring(contact, state) - pull).norm() <= 1e-10 * radius * contact.stiffness);
    }
  }
}

TEST(FrictionLaws, TheFirstTickStretchesNothing) {
  for (const FrictionKind kind : all_friction_kinds()) {
    if (!has_spring(kind)) continue;
    FrictionRig rig;
    rig.law = law_of(kind);
    rig.contact.push = 1.0;
    rig.contact.coefficients.still = rig.contact.coefficients.sliding = 0.5;
    EXPECT_EQ(rig.move(Vec3(1e-3, 0.0, 0.0)), Vec3::Zero()) << friction_name(kind);
    EXPECT_TRUE(rig.state.held);
    EXPECT_EQ(rig.energy(), 0.0);
    EXPECT_LT(rig.move(Vec3(1e-4, 0.0, 0.0)).x(), 0.0);
  }
}

TEST(FrictionLaws, ThoseOfDisplacementReadNeitherVelocityNorTime) {
  for (const FrictionKind kind :
       {FrictionKind::implicit_coulomb, FrictionKind::dahl, FrictionKind::hayward_armstrong}) {
    Vec3 sums[2] = {Vec3::Zero(), Vec3::Zero()};
    for (int run = 0; run < 2; ++run) {
      FrictionRig rig = rig_of(law_of(kind), 0.5, 0.4);
      rig.contact.dt = Seconds(run == 0 ? 1e-3 : 7e-6);
      for (int tick = 0; tick < 500; ++tick) {
        rig.contact.motion = 1e-4 * Vec3(std::sin(tick * 0.1), std::cos(tick * 0.17), 0.0);
        rig.contact.velocity = run == 0 ? Vec3(Vec3::Zero()) : Vec3(3.0, -2.0, 1.0);
        sums[run] = 0.9 * sums[run] + friction_force(rig.law, rig.contact, rig.state);
      }
    }
    EXPECT_EQ(sums[0], sums[1]) << friction_name(kind);
  }
}

TEST(FrictionLaws, LoseTheSpringWithThePush) {
  for (const FrictionKind kind : all_friction_kinds()) {
    if (!has_spring(kind)) continue;
    FrictionRig rig = rig_of(law_of(kind), 0.5, 0.4);
    rig.drag(Vec3(0.02, 0.01, 0.0), 0.1);
    EXPECT_GT(rig.energy(), 0.0);
    rig.contact.push = 0.0;
    EXPECT_LE(rig.move(Vec3(1e-5, 0.0, 0.0)).norm(), 1e-12) << friction_name(kind);
    EXPECT_LE(rig.energy(), 1e-20) << friction_name(kind);
  }
}

TEST(FrictionLaws, ABrokenTickIsNotRemembered) {
  for (const FrictionKind kind : all_friction_kinds()) {
    FrictionLaw law = law_of(kind);
    if (kind == FrictionKind::viscous) law.viscosity = 1.0;
    FrictionRig rig = rig_of(law, 0.5, 0.4);
    const double nan = std::nan("");
    EXPECT_EQ(rig.move(Vec3(nan, 0.0, 0.0)), Vec3::Zero()) << friction_name(kind);
    const Vec3 after = rig.drag(Vec3(0.02, 0.0, 0.0), 0.1);
    EXPECT_LT(after.x(), 0.0) << friction_name(kind);
    EXPECT_TRUE(after.allFinite());
  }
}

}  // namespace
}  // namespace asperity::friction_properties_test
