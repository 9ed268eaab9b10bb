// What each law is by its equation, and rows Y-7 and T12.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "asperity/material/friction.h"
#include "tests/material/friction_rig.h"

namespace asperity::friction_laws_test {
namespace {

constexpr double push = 0.6;

// --- heterogeneous-features-2008, Tab. 2 and Fig. 15 ---

struct Simulation {
  double stiffness;   ///< N/m
  double sliding;     ///< k_d
  double break_away;  ///< N
  double stretch;     ///< m, at the break
};
constexpr Simulation table_2[] = {{250.0, 0.4, 0.4, 1.6e-3}, {300.0, 0.6, 0.6, 2.0e-3}};

FrictionRig rig_of(const Simulation& simulation, Formulation formulation) {
  FrictionLaw law = law_of(FrictionKind::karnopp, formulation);
  law.stiffness = simulation.stiffness;
  law.break_away = simulation.break_away;
  law.stick_speed = 5e-3;
  return rig_of(law, simulation.break_away / push, simulation.sliding);
}

TEST(Y_7_StickSlip, SticksToTheThresholdDropsAndSticksAgain) {
  for (const Simulation& simulation : table_2) {
    for (const Formulation formulation : {Formulation::literal, Formulation::consistent}) {
      FrictionRig rig = rig_of(simulation, formulation);
      const double step = 2e-6;  // 2 mm/s at 1 kHz
      // Stick: a spring, up to the threshold.
      double moved = 0.0;
      double peak = 0.0;
      while (moved < 5e-3) {
        const double force = -rig.move(Vec3(step, 0.0, 0.0)).x();
        if (rig.state.sliding) break;
        moved += step;
        peak = force;
        ASSERT_NEAR(force, simulation.stiffness * moved, 1e-9);
      }
      EXPECT_NEAR(moved, simulation.stretch, 1.01 * step);
      EXPECT_NEAR(peak, simulation.break_away, 1.01 * step * simulation.stiffness);
      // Let go, it slips at k_d N: 0.6 of the threshold in both simulations.
      const double slipping = -rig.drag(Vec3(0.03, 0.0, 0.0), 0.02).x();
      EXPECT_NEAR(slipping, simulation.sliding * push, 1e-12);
      EXPECT_NEAR(slipping / simulation.break_away, 0.6, 1e-9);
      // Just faster than 5 mm/s it still slips; just slower it sticks, and the spring is loaded anew.
      EXPECT_NEAR(-rig.drag(Vec3(5.1e-3, 0.0, 0.0), 0.05).x(), simulation.sliding * push, 1e-12);
      EXPECT_TRUE(rig.state.sliding);
      const double first = -rig.move(Vec3(4.9e-6, 0.0, 0.0)).x();
      EXPECT_FALSE(rig.state.sliding);
      const double second = -rig.move(Vec3(4.9e-6, 0.0, 0.0)).x();
      EXPECT_NEAR(second - first, simulation.stiffness * 4.9e-6, 1e-12);
      // As printed the anchor jumps to where it sticks and the force to 0; consistent, the force goes on.
      const double from =
          formulation == Formulation::literal ? 0.0 : simulation.sliding * push + simulation.stiffness * 4.9e-6;
      EXPECT_NEAR(first, from, 1e-12);
    }
  }
}

/// A mass on a spring whose other end is drawn along at a constant speed: friction force and slips.
struct StickSlip {
  std::vector<double> breaks;  ///< s, when it broke away
  double highest = 0.0;        ///< N
  double slip_force = 0.0;     ///< N, at the fastest
  int landings = 0;            ///< times that it came to stick
};
StickSlip draw(FrictionRig rig, double mass, double spring, double damping, double speed, double slip_speed, double dt,
               double duration) {
  StickSlip result;
  rig.contact.dt = Seconds(dt);
  double x = 0.0;
  double v = 0.0;
  double fastest = 0.0;
  bool armed = true;
  for (int tick = 1; tick * dt < duration; ++tick) {
    x += v * dt;
    const bool slid = rig.state.sliding;
    const double friction = rig.move(Vec3(v * dt, 0.0, 0.0)).x();
    v += dt / mass * (spring * (speed * tick * dt - x) + friction - damping * v);
    if (slid && !rig.state.sliding) ++result.landings;
    result.highest = std::max(result.highest, -friction);
    if (v > fastest) {
      fastest = v;
      result.slip_force = -friction;
    }
    // Armed again once it has stood still; the ringing of the stuck mass is slower than a slip.
    if (armed && v > slip_speed) result.breaks.push_back(tick * dt);
    if (v > slip_speed) armed = false;
    if (v <= 0.0) armed = true;
  }
  return result;
}

TEST(Y_7_StickSlip, AHandThatDrawsAMassFeelsBothSimulations) {
  for (const Simulation& simulation : table_2) {
    for (const Formulation formulation : {Formulation::literal, Formulation::consistent}) {
      const StickSlip run = draw(rig_of(simulation, formulation), 0.05, 60.0, 1.5, 4e-3, 12e-3, 1e-3, 12.0);
      if (formulation == Formulation::consistent) {
        EXPECT_GE(run.breaks.size(), 3u);
        EXPECT_LE(run.landings, static_cast<int>(run.breaks.size()));
      } else {
        // As printed the force is gone where it sticks, and what still pulls makes it faster than 5 mm/s again: it
        // chatters along instead of standing still.
        EXPECT_GE(run.breaks.size(), 1u);
        EXPECT_GE(run.landings, 20);
      }
      EXPECT_NEAR(run.highest, simulation.break_away, 0.03 * simulation.break_away);
      EXPECT_NEAR(run.slip_force, simulation.sliding * push, 1e-9);
    }
  }
}

TEST(T12_StickSlip, FrequencyIsTheAnalyticOne) {
  // Rigid Coulomb friction F_s, F_d, spring k drawn at a speed V that is small against D omega, D = (F_s - F_d) / k:
  // the slip is half a swing of damping ratio zeta, 2 / omega' (pi - atan(D omega / V)), and ends D r below F_d / k,
  // r = exp(-pi zeta / sqrt(1 - zeta^2)); the stick lasts D (1 + r) / V. The contact's own spring is in series.
  const double mass = 0.1;
  const double spring = 100.0;
  const double speed = 0.5e-3;
  const double contact = 1e4;
  const double zeta = 0.05;
  const double still = 0.4;
  const double sliding = 0.24;
  const double omega = std::sqrt(spring / mass);
  const double damped = omega * std::sqrt(1.0 - zeta * zeta);
  const double ratio = std::exp(-std::numbers::pi * zeta / std::sqrt(1.0 - zeta * zeta));
  const double drop = (still - sliding) / spring;
  const double period = drop * (1.0 + ratio) / speed * (1.0 + spring / contact) +
                        2.0 / damped * (std::numbers::pi - std::atan(drop * omega / speed));
  for (const FrictionKind kind : {FrictionKind::karnopp, FrictionKind::implicit_coulomb}) {
    FrictionLaw law = law_of(kind);
    law.stiffness = contact;
    law.stick_speed = kind == FrictionKind::karnopp ? 1e-3 : law.stick_speed;
    const StickSlip run = draw(rig_of(law, still / push, sliding / push), mass, spring, 2.0 * zeta * mass * omega,
                               speed, 0.5 * drop * omega, 2e-4, 28.0);
    ASSERT_GE(run.breaks.size(), 4u) << friction_name(kind);
    const double measured = (run.breaks.back() - run.breaks[1]) / static_cast<double>(run.breaks.size() - 2);
    EXPECT_NEAR(measured / period, 1.0, 0.03) << friction_name(kind);
    EXPECT_NEAR(run.highest, still, 0.02 * still);
  }
}

// --- drift ---

/// How far the anchor has gone after the contact was strained to a share of its limit and shaken around there.
double anchor_drift(const FrictionLaw& law, double strained, double shaken) {
  FrictionRig rig = rig_of(law, 0.5, 0.5);
  const double largest = 0.5 * push / rig.contact.stiffness;
  double x = 0.0;
  const auto go = [&](double to) {
    rig.move(Vec3(to - x, 0.0, 0.0));
    x = to;
  };
  for (int tick = 1; tick <= 50; ++tick) go(strained * largest * tick / 50.0);
  const double anchor = x - rig.state.stretch.x();
  for (int tick = 1; tick <= 5000; ++tick) go(largest * (strained + shaken * std::sin(tick * 0.7)));
  return std::abs(x - rig.state.stretch.x() - anchor) / largest;
}

TEST(T12_Drift, NoneForTheLawsThatPromiseItAndSomeForTheOthers) {
  FrictionLaw adhesive = law_of(FrictionKind::hayward_armstrong);
  adhesive.adhesion = 0.6;
  for (const FrictionLaw& law : {law_of(FrictionKind::implicit_coulomb), law_of(FrictionKind::karnopp), adhesive}) {
    EXPECT_LE(anchor_drift(law, 0.5, 0.05), 1e-10) << friction_name(law.kind);
  }
  // Dahl's and LuGre's bristles forget on every way, there and back: the strain is lost to half at least.
  EXPECT_GE(anchor_drift(law_of(FrictionKind::dahl), 0.5, 0.05), 0.25);
  EXPECT_GE(anchor_drift(law_of(FrictionKind::lugre), 0.5, 0.05), 0.25);
  // Beyond its adhesion Hayward and Armstrong's creeps too, but only until it is within.
  const double beyond = anchor_drift(law_of(FrictionKind::hayward_armstrong), 0.5, 0.05);
  EXPECT_GE(beyond, 0.05);
  EXPECT_LE(beyond, 0.5);
}

// --- the laws one by one ---

TEST(ImplicitCoulomb, SticksAsASpringAndSlidesAtTheLimitWhateverTheStep) {
  for (const double dt : {1e-5, 1e-3, 1e-2}) {
    FrictionRig rig = rig_of(law_of(FrictionKind::implicit_coulomb), 0.5, 0.3);
    rig.contact.dt = Seconds(dt);
    EXPECT_NEAR(rig.move(Vec3(2e-4, 0.0, 0.0)).x(), -0.2, 1e-15);
    EXPECT_NEAR(rig.move(Vec3(0.9e-4, 0.0, 0.0)).x(), -0.29, 1e-15);
    EXPECT_FALSE(rig.state.sliding);
    // Beyond 0.3 N it breaks, to 0.18 N.
    EXPECT_NEAR(rig.move(Vec3(0.2e-4, 0.0, 0.0)).x(), -0.18, 1e-15);
    EXPECT_TRUE(rig.state.sliding);
    EXPECT_NEAR(rig.move(Vec3(1.0, 0.0, 0.0)).x(), -0.18, 1e-15);
    // It sticks as soon as the spring is within the dynamic limit, and needs the static one to break again.
    EXPECT_NEAR(rig.move(Vec3(-1e-5, 0.0, 0.0)).x(), -0.17, 1e-12);
    EXPECT_FALSE(rig.state.sliding);
    EXPECT_NEAR(rig.move(Vec3(1e-4, 0.0, 0.0)).x(), -0.27, 1e-12);
  }
}

TEST(ImplicitCoulomb, DampingSolvesTheImplicitStep) {
  FrictionLaw law = law_of(FrictionKind::implicit_coulomb);
  law.damping = 2.0;
  FrictionRig rig = rig_of(law, 0.5, 0.3);
  rig.contact.dt = Seconds(1e-3);
  EXPECT_NEAR(rig.move(Vec3(5e-5, 0.0, 0.0)).x(), -(1000.0 * 5e-5 + 2.0 * 5e-5 / 1e-3), 1e-15);
  const Vec3 before = rig.state.stretch;
  const Vec3 force = rig.move(Vec3(3e-4, 1e-4, 0.0));
  EXPECT_TRUE(rig.state.sliding);
  EXPECT_NEAR(force.norm(), 0.3 * push, 1e-12);
  const Vec3 implicit = 1000.0 * rig.state.stretch + 2.0 / 1e-3 * (rig.state.stretch - before);
  EXPECT_NEAR((force + implicit).norm(), 0.0, 1e-12);
}

TEST(Coulomb, LiteralJumpsAtRestAndConsistentIsProportionalThere) {
  FrictionRig literal = rig_of(law_of(FrictionKind::coulomb, Formulation::literal), 0.5, 0.4);
  EXPECT_EQ(literal.move(Vec3::Zero()), Vec3::Zero());
  EXPECT_NEAR(literal.move(Vec3(1e-15, 0.0, 0.0)).x(), -0.24, 1e-12);
  EXPECT_NEAR(literal.move(Vec3(-1e-4, 0.0, 0.0)).x(), 0.24, 1e-12);
  FrictionRig consistent = rig_of(law_of(FrictionKind::coulomb), 0.5, 0.4);
  EXPECT_EQ(consistent.move(Vec3::Zero()), Vec3::Zero());
  EXPECT_NEAR(consistent.move(Vec3(2.5e-6, 0.0, 0.0)).x(), -0.12, 1e-12);
  EXPECT_NEAR(consistent.move(Vec3(1e-4, 0.0, 0.0)).x(), -0.24, 1e-12);
}

TEST(Viscous, IsProportionalToTangentialVelocityAlone) {
  FrictionLaw law = law_of(FrictionKind::viscous);
  law.viscosity = 3.0;
  FrictionRig rig = rig_of(law, 0.5, 0.4);
  EXPECT_NEAR((rig.move(Vec3(1e-4, -2e-4, 5e-4)) - Vec3(-0.3, 0.6, 0.0)).norm(), 0.0, 1e-12);
}

TEST(Karnopp, LimitsGrowWithThePushUnlessTheBreakAwayIsGiven) {
  for (const Formulation formulation : {Formulation::literal, Formulation::consistent}) {
    for (const double given : {0.0, 0.4}) {
      FrictionLaw law = law_of(FrictionKind::karnopp, formulation);
      law.break_away = given;
      FrictionRig rig = rig_of(law, 0.5, 0.3);
      rig.contact.push = 2.0;
      double highest = 0.0;
      for (int tick = 0; tick < 2000; ++tick) highest = std::max(highest, -rig.move(Vec3(1e-6, 0.0, 0.0)).x());
      // A constant break-away below the sliding friction never lets go of the latter.
      const double expected = given > 0.0 ? std::max(given, 0.6) : 1.0;
      EXPECT_NEAR(highest, expected, 0.002) << given;
    }
  }
}

TEST(Karnopp, LiteralLandsWithoutForceAndConsistentHoldsTheSlidingForce) {
  for (const Formulation formulation : {Formulation::literal, Formulation::consistent}) {
    FrictionRig rig = rig_of(table_2[0], formulation);
    rig.drag(Vec3(0.03, 0.0, 0.0), 0.2);
    const double slipping = rig.energy();
    const double landed = -rig.move(Vec3::Zero()).x();
    EXPECT_FALSE(rig.state.sliding);
    if (formulation == Formulation::literal) {
      EXPECT_EQ(landed, 0.0);
    } else {
      // The anchor was dragged along: landing makes no energy, it was there already.
      EXPECT_NEAR(landed, 0.24, 1e-12);
      EXPECT_NEAR(slipping, 0.5 * 0.24 * 0.24 / 250.0, 1e-12);
    }
    EXPECT_NEAR(rig.energy(), slipping, 1e-15);
  }
}

TEST(Karnopp, ASlowDragSlipsForOneTickLiterallyAndGoesOnSlidingConsistently) {
  for (const Formulation formulation : {Formulation::literal, Formulation::consistent}) {
    FrictionRig rig = rig_of(table_2[0], formulation);
    int slips = 0;
    double last = 0.0;
    for (int tick = 0; tick < 4000; ++tick) {
      last = -rig.move(Vec3(2e-6, 0.0, 0.0)).x();
      slips += rig.state.sliding ? 1 : 0;
    }
    if (formulation == Formulation::literal) {
      // 8 mm of teeth 1.6 mm long.
      EXPECT_NEAR(slips, 5, 1);
    } else {
      EXPECT_NEAR(slips, 4000 - 800, 2);
      EXPECT_NEAR(last, 0.24, 1e-12);
    }
  }
}

TEST(Dahl, FollowsItsClosedFormAtAnyStep) {
  // From rest: i = 1: F_c (1 - exp(-K x / F_c)); i = 2: F_c y / (1 + y); i = 1/2: F_c (1 - (1 - y / 2)^2), y = K x /
  // F_c.
  const double limit = 0.4 * push;
  for (const double exponent : {0.5, 1.0, 2.0}) {
    for (const int steps : {20, 200, 1000}) {
      FrictionLaw law = law_of(FrictionKind::dahl);
      law.exponent = exponent;
      FrictionRig rig = rig_of(law, 0.5, 0.4);
      const double far = 1.5 * limit / rig.contact.stiffness;
      for (int n = 1; n <= steps; ++n) {
        const double force = -rig.move(Vec3(far / steps, 0.0, 0.0)).x();
        const double y = 1.5 * n / steps;
        const double expected = exponent == 1.0   ? 1.0 - std::exp(-y)
                                : exponent == 2.0 ? y / (1.0 + y)
                                                  : 1.0 - (1.0 - y / 2.0) * (1.0 - y / 2.0);
        const double tolerance = exponent == 1.0 ? 1e-10 : 0.5 / steps / steps;
        EXPECT_NEAR(force / limit, expected, tolerance) << exponent << " " << steps;
      }
    }
  }
}

TEST(Dahl, FollowsItsClosedFormAtStepsTooSmallForAnExponential) {
  // F_c (1 - exp(-K x / F_c)), to rounding: steps of less than 1e-4 F_c / K, and a little more.
  const double limit = 0.4 * push;
  for (const int steps : {10500, 9500}) {
    FrictionRig rig = rig_of(law_of(FrictionKind::dahl), 0.5, 0.4);
    const double far = limit / rig.contact.stiffness;
    for (int n = 1; n <= steps; ++n) {
      const double force = -rig.move(Vec3(far / steps, 0.0, 0.0)).x();
      ASSERT_NEAR(force / limit, 1.0 - std::exp(-static_cast<double>(n) / steps), 1e-11) << n << " of " << steps;
    }
  }
}

TEST(HaywardArmstrong, IsASpringWithinItsAdhesionAndReachesTheSlidingForce) {
  FrictionLaw law = law_of(FrictionKind::hayward_armstrong);
  law.adhesion = 0.4;
  FrictionRig rig = rig_of(law, 0.5, 0.5);
  double x = 0.0;
  double before = 0.0;
  for (int tick = 0; tick < 2000; ++tick) {
    x += 1e-6;
    const double force = -rig.move(Vec3(1e-6, 0.0, 0.0)).x();
    if (1000.0 * x <= 0.4 * 0.3) {
      ASSERT_NEAR(force, 1000.0 * x, 1e-12);
    }
    ASSERT_GE(force, before - 1e-12);
    before = force;
  }
  EXPECT_NEAR(before, 0.3, 1e-3);
}

TEST(HaywardArmstrong, FollowsItsEquationToSecondOrderInTheStep) {
  // dz/dx = 1 - S z / z_max, S = t^2 (3 - 2 t), t = (z / z_max - adhesion) / (1 - adhesion), by a fine Runge-Kutta.
  const double adhesion = 0.2;
  const auto slope = [=](double z) {
    const double t = std::clamp((z - adhesion) / (1.0 - adhesion), 0.0, 1.0);
    return 1.0 - t * t * (3.0 - 2.0 * t) * z;
  };
  double exact = 0.0;
  const double h = 1e-3;
  for (int n = 0; n < 1200; ++n) {
    const double k1 = slope(exact);
    const double k2 = slope(exact + 0.5 * h * k1);
    const double k3 = slope(exact + 0.5 * h * k2);
    const double k4 = slope(exact + h * k3);
    exact += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
  }
  FrictionLaw law = law_of(FrictionKind::hayward_armstrong);
  law.adhesion = adhesion;
  double errors[2];
  int steps = 12;
  for (double& error : errors) {
    FrictionRig rig = rig_of(law, 0.5, 0.5);
    const double largest = 0.3 / rig.contact.stiffness;
    double force = 0.0;
    for (int n = 0; n < steps; ++n) force = -rig.move(Vec3(1.2 * largest / steps, 0.0, 0.0)).x();
    error = std::abs(force / 0.3 - exact);
    steps *= 4;
  }
  EXPECT_LE(errors[0], 0.02);
  EXPECT_LE(errors[1], errors[0] / 8.0);
}

TEST(LuGre, SteadySlidingIsTheStribeckCurve) {
  FrictionLaw law = law_of(FrictionKind::lugre);
  law.damping = 5.0;
  law.viscosity = 0.7;
  law.stribeck_speed = 0.02;
  for (const Formulation formulation : {Formulation::literal, Formulation::consistent}) {
    law.formulation = formulation;
    for (const double speed : {1e-3, 0.01, 0.02, 0.05, 0.3}) {
      FrictionRig rig = rig_of(law, 0.7, 0.4);
      const double fall = std::exp(-speed * speed / (0.02 * 0.02));
      const double expected = push * (0.4 + 0.3 * fall) + 0.7 * speed;
      EXPECT_NEAR(-rig.drag(Vec3(speed, 0.0, 0.0), 0.02 / speed).x(), expected, 1e-6) << speed;
    }
  }
}

TEST(LuGre, LiteralBristleDampingGivesEnergyAndConsistentDoesNot) {
  // Slow, so that the bristles are at the static limit; then fast: they fall back against the motion, and a constant
  // damping pushes the probe along. Barahanov and Ortega: passive only up to 4 g(v) / |v|.
  FrictionLaw law = law_of(FrictionKind::lugre);
  law.damping = 30.0;
  const auto loop = [&law](double& lowest) {
    FrictionRig rig = rig_of(law, 0.9, 0.3);
    double work = 0.0;
    for (int cycle = 0; cycle < 5; ++cycle) {
      for (int tick = 0; tick < 2000; ++tick) work -= rig.move(Vec3(1e-6, 0.0, 0.0)).x() * 1e-6;
      for (int tick = 0; tick < 5; ++tick) {
        const double force = -rig.move(Vec3(5e-4, 0.0, 0.0)).x();
        lowest = std::min(lowest, force);
        work += force * 5e-4;
      }
    }
    return work - rig.energy();
  };
  double lowest = infinity;
  law.formulation = Formulation::literal;
  const double literal = loop(lowest);
  EXPECT_LT(lowest, -0.1);
  EXPECT_LT(literal, -1e-3);
  law.formulation = Formulation::consistent;
  lowest = infinity;
  EXPECT_GT(loop(lowest), 0.0);
  EXPECT_GE(lowest, 0.0);
}

// --- a law that is changed while it is felt ---

TEST(ChangedFriction, ASpringGoesOnWithItsForceOrItsEnergyWhicheverIsLess) {
  for (const FrictionKind kind : {FrictionKind::implicit_coulomb, FrictionKind::karnopp}) {
    for (const double factor : {0.25, 4.0}) {
      FrictionLaw law = law_of(kind);
      law.stiffness = 400.0;
      FrictionRig rig = rig_of(law, 0.9, 0.8);
      rig.drag(Vec3(1e-3, 0.0, 0.0), 0.5);  // 0.5 mm: 0.2 N of the 0.54 N that it can hold
      ASSERT_NEAR(rig.energy(), 0.5 * 400.0 * 0.25e-6, 1e-9);
      const double energy = rig.energy();
      rig.law.stiffness = factor * 400.0;
      const double force = -rig.move(Vec3(1e-12, 0.0, 0.0)).x();
      if (factor > 1.0) {
        EXPECT_NEAR(force, 0.2, 1e-6);
        EXPECT_NEAR(rig.energy(), energy / factor, 1e-9);
      } else {
        EXPECT_NEAR(rig.energy(), energy, 1e-9);
        EXPECT_NEAR(force, 0.2 * std::sqrt(factor), 1e-6);
      }
    }
  }
}

TEST(ChangedFriction, ALawWithoutASpringForgetsTheStretch) {
  for (const FrictionKind between : {FrictionKind::viscous, FrictionKind::coulomb}) {
    FrictionLaw law = law_of(FrictionKind::karnopp);
    law.stiffness = 400.0;
    FrictionRig rig = rig_of(law, 0.9, 0.8);
    rig.drag(Vec3(1e-3, 0.0, 0.0), 0.5);
    rig.law = law_of(between);
    rig.move(Vec3(1e-9, 0.0, 0.0));
    EXPECT_EQ(rig.energy(), 0.0);
    rig.law = law;
    EXPECT_NEAR(-rig.move(Vec3(1e-6, 0.0, 0.0)).x(), 400.0 * 1e-6, 1e-6) << "not the 0.2 N of before";
  }
}

}  // namespace
}  // namespace asperity::friction_laws_test
