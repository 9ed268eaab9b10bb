// How large friction is by direction: the ellipse, eq. 15, and their rows.

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "asperity/core/rng.h"
#include "asperity/material/friction.h"
#include "tests/material/friction_rig.h"

namespace asperity::friction_limits_test {
namespace {

/// Nearest point of the ellipse by trying angles, then finer around the best one.
double nearest_distance_by_search(double x, double y, double a, double b) {
  double best = infinity;
  double at = 0.0;
  double width = std::numbers::pi;
  for (int round = 0; round < 6; ++round) {
    const double middle = at;
    for (int i = -400; i <= 400; ++i) {
      const double angle = middle + width * i / 400.0;
      const double distance = std::hypot(a * std::cos(angle) - x, b * std::sin(angle) - y);
      if (distance < best) {
        best = distance;
        at = angle;
      }
    }
    width /= 100.0;
  }
  return best;
}

RC_GTEST_PROP(NearestInEllipse, IsTheNearestPointOfItsDisc, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint64_t>());
  const double a = std::pow(10.0, rng.uniform(-3.0, 3.0));
  const double b = a * std::pow(10.0, rng.uniform(-3.0, 3.0));
  const double reach = std::max(a, b) * std::pow(10.0, rng.uniform(-2.0, 3.0));
  const Vec3 normal = Vec3(rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0), 1.1).normalized();
  const Vec3 across = normal.cross(Vec3(rng.uniform(-1.0, 1.0), 1.5, rng.uniform(-1.0, 1.0))).normalized();
  const Vec3 lay = normal.cross(across);
  const double x = rng.uniform(-reach, reach);
  const double y = rng.uniform(-reach, reach);
  const Vec3 pull = x * across + y * lay;
  const Vec3 nearest = nearest_in_ellipse(pull + 3.0 * reach * normal, normal, across, a, b);
  const double p = nearest.dot(across);
  const double q = nearest.dot(lay);
  RC_ASSERT(std::abs(nearest.dot(normal)) <= 1e-9 * reach);
  RC_ASSERT(std::hypot(p / a, q / b) <= 1.0 + 1e-9);
  // No farther than the best of the search; the search itself is within 1e-9 of the best.
  if (std::hypot(x / a, y / b) <= 1.0) {
    RC_ASSERT((nearest - pull).norm() <= 1e-12 * reach);
  } else {
    RC_ASSERT((nearest - pull).norm() <= nearest_distance_by_search(x, y, a, b) * (1.0 + 1e-6) + 1e-6 * reach);
    // Then it is dissipative: (pull - nearest) . nearest >= 0.
    RC_ASSERT((pull - nearest).dot(nearest) >= -1e-12 * reach * reach);
  }
}

TEST(NearestInEllipse, DegenerateEllipsesAreASegmentAPointAndACircle) {
  const Vec3 normal = Vec3::UnitZ();
  const Vec3 across = Vec3::UnitX();
  const Vec3 pull(3.0, -2.0, 7.0);
  EXPECT_EQ(nearest_in_ellipse(pull, normal, across, 1.0, 0.0), Vec3(1.0, 0.0, 0.0));
  EXPECT_EQ(nearest_in_ellipse(pull, normal, across, 0.0, 1.0), Vec3(0.0, -1.0, 0.0));
  EXPECT_EQ(nearest_in_ellipse(Vec3(0.5, -2.0, 0.0), normal, across, 1.0, 0.0), Vec3(0.5, 0.0, 0.0));
  EXPECT_EQ(nearest_in_ellipse(pull, normal, across, 0.0, 0.0), Vec3(0.0, 0.0, 0.0));
  EXPECT_NEAR(
      (nearest_in_ellipse(pull, normal, Vec3::Zero(), 2.0, 0.0) - Vec3(3.0, -2.0, 0.0).normalized() * 2.0).norm(), 0.0,
      1e-15);
  EXPECT_EQ(nearest_in_ellipse(Vec3::Zero(), normal, across, 1.0, 0.5), Vec3(0.0, 0.0, 0.0));
  EXPECT_NEAR(
      (nearest_in_ellipse(pull, normal, across, 2.0, 2.0) - nearest_in_ellipse(pull, normal, Vec3::Zero(), 2.0, 2.0))
          .norm(),
      0.0, 1e-8);
}

/// heterogeneous-features-2008, Tab. 3: smooth along the lay, break-away and stiffness the same everywhere.
FrictionRig table_3(FrictionKind kind, Formulation law, Formulation coefficients) {
  FrictionLaw friction = law_of(kind, law);
  if (kind == FrictionKind::karnopp) {
    friction.stiffness = 250.0;
    friction.break_away = 0.4;
  }
  FrictionRig rig = rig_of(friction, 0.4 / 0.6, 0.4);
  rig.contact.coefficients.sliding_ratio = 0.0;
  rig.contact.coefficients.across = Vec3::UnitX();
  rig.contact.coefficients.formulation = coefficients;
  return rig;
}

Vec3 heading(double degrees) {
  const double angle = degrees * std::numbers::pi / 180.0;
  return {std::cos(angle), std::sin(angle), 0.0};
}

TEST(Y_8_Anisotropy, LiteralFrictionFallsLinearlyWithTheAngleToTheGradient) {
  const double expected[][2] = {{0.0, 0.24}, {30.0, 0.16}, {60.0, 0.08}, {90.0, 0.0}};
  for (const FrictionKind kind : {FrictionKind::coulomb, FrictionKind::karnopp}) {
    for (const auto& [angle, force] : expected) {
      FrictionRig rig = table_3(kind, Formulation::literal, Formulation::literal);
      const Vec3 felt = rig.drag(0.05 * heading(angle), 0.1);
      EXPECT_NEAR((felt + force * heading(angle)).norm(), 0.0, 1e-12) << friction_name(kind) << " " << angle;
      // The angle is the acute one.
      const Vec3 back = rig.drag(-0.05 * heading(angle), 0.1);
      EXPECT_NEAR((back - force * heading(angle)).norm(), 0.0, 1e-12) << friction_name(kind) << " " << angle;
    }
  }
}

TEST(Y_8_Anisotropy, EllipticFrictionIsTheOneOfMaximumDissipation) {
  // f = -N D v / sqrt(v' D v), D = diag(mu_across^2, mu_lay^2).
  for (const FrictionKind kind : all_friction_kinds()) {
    if (kind == FrictionKind::viscous) continue;
    for (const double ratio : {0.0, 0.4, 1.0}) {
      for (const double angle : {0.0, 30.0, 60.0, 120.0}) {
        // Whatever the spring that is drawn along.
        for (const double stiffness_ratio : {1.0, 0.25}) {
          FrictionRig rig = rig_of(law_of(kind), 0.4, 0.4);
          rig.contact.coefficients.still_ratio = ratio;
          rig.contact.coefficients.sliding_ratio = ratio;
          rig.contact.coefficients.stiffness_ratio = stiffness_ratio;
          rig.contact.coefficients.across = Vec3::UnitX();
          const Vec3 v = 0.05 * heading(angle);
          const Vec3 felt = rig.drag(v, 0.5);
          const Vec3 d(0.16, 0.16 * ratio * ratio, 0.0);
          const Vec3 expected = -0.6 * d.cwiseProduct(v) / std::sqrt(v.dot(d.cwiseProduct(v)));
          EXPECT_NEAR((felt - expected).norm(), 0.0, 1e-6)
              << friction_name(kind) << " " << ratio << " " << angle << " " << stiffness_ratio;
        }
      }
    }
  }
}

/// Eq. 15 for k_s: 250 N/m across the lay, 100 N/m along it; F_s as in Tab. 3.
FrictionRig soft_along_the_lay(FrictionKind kind, Formulation law, Formulation coefficients) {
  FrictionRig rig = table_3(kind, law, coefficients);
  rig.law.stiffness = 250.0;
  rig.law.break_away = 0.4;
  rig.contact.coefficients.sliding_ratio = 1.0;
  rig.contact.coefficients.stiffness_ratio = 0.4;
  return rig;
}

TEST(Rows, Eq15_LiteralStiffnessFallsLinearlyWithTheAngleToTheGradient) {
  for (const auto& [kind, law] : {std::pair{FrictionKind::karnopp, Formulation::literal},
                                  {FrictionKind::karnopp, Formulation::consistent},
                                  {FrictionKind::implicit_coulomb, Formulation::consistent}}) {
    for (const double angle : {0.0, 30.0, 60.0, 90.0}) {
      const double stiffness = 250.0 - (250.0 - 100.0) * angle / 90.0;
      FrictionRig rig = soft_along_the_lay(kind, law, Formulation::literal);
      constexpr double step = 2e-6;  // 2 mm/s: it sticks
      double moved = 0.0;
      while (moved < 6e-3) {
        const Vec3 felt = rig.move(step * heading(angle));
        if (rig.state.sliding) break;
        moved += step;
        ASSERT_NEAR((felt + stiffness * moved * heading(angle)).norm(), 0.0, 1e-9) << friction_name(kind) << angle;
      }
      // F_s is no coefficient C of eq. 15: the threshold stays, the stretch at which it is reached grows.
      EXPECT_NEAR(moved, 0.4 / stiffness, 1.01 * step) << friction_name(kind) << " " << angle;
    }
  }
}

TEST(Rows, Eq15_ConsistentStiffnessIsOneSpringForEveryDirection) {
  for (const FrictionKind kind : {FrictionKind::karnopp, FrictionKind::implicit_coulomb}) {
    FrictionRig rig = soft_along_the_lay(kind, Formulation::consistent, Formulation::consistent);
    // Around corners: the force goes by where the probe is, not by how it came there.
    Vec3 at = Vec3::Zero();
    for (const Vec3& leg : {Vec3(8e-4, 0.0, 0.0), Vec3(0.0, 9e-4, 0.0), Vec3(-5e-4, -3e-4, 0.0)}) {
      for (int i = 0; i < 200; ++i) {
        at += leg / 200.0;
        const Vec3 felt = rig.move(leg / 200.0);
        ASSERT_NEAR((felt + Vec3(250.0 * at.x(), 100.0 * at.y(), 0.0)).norm(), 0.0, 1e-9) << friction_name(kind);
        ASSERT_NEAR(rig.energy(), 125.0 * at.x() * at.x() + 50.0 * at.y() * at.y(), 1e-12);
      }
    }
    ASSERT_FALSE(rig.state.sliding);
  }
}

/// Work on the hand (J) that stretches the spring along its soft lay and lets it go back in zigzags, mostly across.
double zigzag_work(Formulation coefficients) {
  FrictionRig rig = soft_along_the_lay(FrictionKind::implicit_coulomb, Formulation::consistent, coefficients);
  rig.law.break_away = 100.0;
  double work = 0.0;
  const auto move = [&](const Vec3& way) { work += rig.move(way).dot(way); };
  for (int i = 0; i < 100; ++i) move(Vec3(0.0, 1e-5, 0.0));
  for (int i = 0; i < 100; ++i) move(Vec3(i % 2 == 0 ? 2e-5 : -2e-5, -1e-5, 0.0));
  return work;
}

TEST(Rows, Eq15_AsPrintedTheSpringGivesEnergyAndOfTwoStiffnessesItDoesNot) {
  // Out at 90 degrees with 100 N/m over 1 mm: 0.05 mJ are put in. Back at 26.6 degrees with 205.7 N/m: 0.103 mJ, less
  // the 50 x 205.7 x (20 um)^2 = 0.004 mJ of the zigzag's own stretching.
  EXPECT_NEAR(zigzag_work(Formulation::literal), 0.103e-3 - 0.050e-3 - 0.004e-3, 0.003e-3);
  EXPECT_LE(zigzag_work(Formulation::consistent), 0.0);
}

TEST(Y_8_Anisotropy, NothingResistsAlongASmoothLay) {
  for (const FrictionKind kind : all_friction_kinds()) {
    for (const Formulation formulation : {Formulation::literal, Formulation::consistent}) {
      for (const Formulation coefficients : {Formulation::literal, Formulation::consistent}) {
        FrictionRig rig = table_3(kind, formulation, coefficients);
        rig.contact.coefficients.still_ratio = 0.0;
        const Vec3 felt = rig.drag(0.05 * Vec3::UnitY(), 0.1);
        EXPECT_TRUE(felt.allFinite());
        EXPECT_LE(felt.norm(), 1e-12) << friction_name(kind);
      }
    }
  }
}

TEST(Anisotropy, AtRestTheStretchSaysTheDirection) {
  FrictionLaw law = law_of(FrictionKind::implicit_coulomb);
  law.stiffness = 100.0;
  FrictionRig rig = rig_of(law, 0.5, 0.5);
  rig.contact.coefficients.across = Vec3::UnitX();
  rig.contact.coefficients.still_ratio = 0.2;
  rig.contact.coefficients.sliding_ratio = 0.2;
  rig.contact.coefficients.formulation = Formulation::literal;
  rig.drag(0.02 * Vec3::UnitY(), 0.1);
  EXPECT_NEAR(rig.move(Vec3::Zero()).norm(), 0.6 * 0.5 * 0.2, 1e-12);
}

TEST(Anisotropy, AGradientAlongTheNormalIsNoDirection) {
  FrictionRig rig = rig_of(law_of(FrictionKind::implicit_coulomb), 0.5, 0.5);
  rig.contact.coefficients.across = Vec3::UnitZ();
  rig.contact.coefficients.sliding_ratio = 0.1;
  EXPECT_NEAR(rig.drag(0.05 * Vec3::UnitY(), 0.1).norm(), 0.3, 1e-12);
}

}  // namespace
}  // namespace asperity::friction_limits_test
