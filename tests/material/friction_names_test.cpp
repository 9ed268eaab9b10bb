// Names, parameters and what is refused.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "asperity/material/friction.h"
#include "asperity/material/material.h"
#include "tests/material/friction_rig.h"

namespace asperity::friction_names_test {
namespace {

TEST(FrictionNames, EveryKindIsFoundByItsName) {
  EXPECT_EQ(friction_names().size(), all_friction_kinds().size());
  for (const FrictionKind kind : all_friction_kinds()) {
    const auto found = friction_by_name(friction_name(kind));
    ASSERT_TRUE(found.ok());
    EXPECT_EQ(*found, kind);
    EXPECT_TRUE(validate(law_of(kind)).ok());
    EXPECT_TRUE(validate(law_of(kind, Formulation::literal)).ok());
    EXPECT_FALSE(friction_parameters(kind).empty());
  }
}

TEST(FrictionNames, AWrongNameIsAnsweredWithTheNearestAndTheList) {
  const auto result = friction_by_name("karnop");
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().code, ErrorCode::bad_value);
  EXPECT_NE(result.error().what.find("did you mean \"karnopp\"?"), std::string::npos) << result.error().message();
  for (const std::string& name : friction_names())
    EXPECT_NE(result.error().accepted.find(name), std::string::npos) << name;
  const auto far = friction_by_name("sandpaper");
  ASSERT_FALSE(far.ok());
  EXPECT_EQ(far.error().what.find("did you mean"), std::string::npos);
}

struct Bad {
  const char* parameter;
  FrictionKind reader;
  double FrictionLaw::*member;
  std::vector<double> values;
};

const std::vector<Bad>& bad_values() {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  static const std::vector<Bad> all{
      {"stiffness", FrictionKind::dahl, &FrictionLaw::stiffness, {-1.0, nan, infinity}},
      {"damping", FrictionKind::lugre, &FrictionLaw::damping, {-1.0, nan, infinity}},
      {"viscosity", FrictionKind::viscous, &FrictionLaw::viscosity, {-1.0, nan, infinity}},
      {"break_away", FrictionKind::karnopp, &FrictionLaw::break_away, {-0.1, nan, infinity}},
      {"stick_speed", FrictionKind::karnopp, &FrictionLaw::stick_speed, {0.0, -1.0, nan, infinity}},
      {"stribeck_speed", FrictionKind::lugre, &FrictionLaw::stribeck_speed, {0.0, -1.0, nan, infinity}},
      {"exponent", FrictionKind::dahl, &FrictionLaw::exponent, {0.49, 4.1, nan, infinity}},
      {"adhesion", FrictionKind::hayward_armstrong, &FrictionLaw::adhesion, {-0.1, 0.91, nan}},
  };
  return all;
}

TEST(FrictionValidate, EveryBadValueIsNamed) {
  for (const Bad& bad : bad_values()) {
    for (const double value : bad.values) {
      FrictionLaw law = law_of(bad.reader);
      law.*bad.member = value;
      const Status status = validate(law);
      ASSERT_FALSE(status.ok()) << bad.parameter << " " << value;
      EXPECT_EQ(status.error().code, ErrorCode::bad_value);
      EXPECT_EQ(status.error().place, bad.parameter);
      EXPECT_EQ(status.error().what.substr(0, 3), "is ");
      EXPECT_FALSE(status.error().accepted.empty());
    }
  }
}

TEST(FrictionValidate, AParameterThatTheLawDoesNotReadIsRefused) {
  const FrictionLaw plain;
  for (const Bad& bad : bad_values()) {
    for (const FrictionKind kind : all_friction_kinds()) {
      FrictionLaw law = law_of(kind);
      law.*bad.member = 0.5 * plain.*bad.member + 0.5;
      const auto& read = friction_parameters(kind);
      const bool reads = std::find(read.begin(), read.end(), bad.parameter) != read.end();
      // exponent: 1 is its default, so move away from it.
      if (bad.member == &FrictionLaw::exponent) law.exponent = 2.0;
      const Status status = validate(law);
      EXPECT_EQ(status.ok(), reads) << friction_name(kind) << " " << bad.parameter;
      if (!status.ok()) {
        EXPECT_EQ(status.error().place, bad.parameter);
        EXPECT_NE(status.error().what.find("is not read"), std::string::npos);
        EXPECT_NE(status.error().accepted.find(read.front()), std::string::npos);
      }
    }
  }
}

/// Every parameter that a law says it reads changes its force somewhere on a path, and no other does.
TEST(FrictionValidate, TheListIsWhatTheLawReads) {
  const auto path = [](const FrictionLaw& law) {
    FrictionRig rig = rig_of(law, 0.6, 0.4);
    std::vector<Vec3> forces;
    for (int tick = 0; tick < 400; ++tick) {
      const double speed = 0.03 * std::sin(tick * 0.02) * std::sin(tick * 0.02) - 0.004;
      forces.push_back(rig.move(Vec3(speed * 1e-3, 0.0, 0.0)));
    }
    return forces;
  };
  for (const Bad& bad : bad_values()) {
    for (const FrictionKind kind : all_friction_kinds()) {
      FrictionLaw law = law_of(kind);
      // Bristle damping and bristle speed show only where there is some.
      const FrictionLaw base = law;
      law.*bad.member = bad.member == &FrictionLaw::stiffness    ? 700.0
                        : bad.member == &FrictionLaw::exponent   ? 2.0
                        : bad.member == &FrictionLaw::adhesion   ? 0.5
                        : bad.member == &FrictionLaw::break_away ? 0.3
                                                                 : 0.02;
      const auto& read = friction_parameters(kind);
      const bool reads = std::find(read.begin(), read.end(), bad.parameter) != read.end();
      EXPECT_EQ(path(law) != path(base), reads) << friction_name(kind) << " " << bad.parameter;
    }
  }
}

TEST(FrictionValidate, ALiteralCoulombHasNoStickSpeed) {
  FrictionLaw law = law_of(FrictionKind::coulomb, Formulation::literal);
  law.stick_speed = 0.01;
  const Status status = validate(law);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().place, "stick_speed");
}

TEST(FrictionValidate, ALiteralKarnoppHasNoDamping) {
  FrictionLaw law = law_of(FrictionKind::karnopp, Formulation::literal);
  law.damping = 0.5;
  const Status status = validate(law);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().place, "damping");
  law.formulation = Formulation::consistent;
  EXPECT_TRUE(validate(law).ok());
}

TEST(MaterialValidate, FrictionIsCheckedUnderItsOwnPlace) {
  Material material;
  EXPECT_TRUE(validate(material).ok());
  material.friction.kind = FrictionKind::dahl;
  material.friction.exponent = 9.0;
  const Status status = validate(material);
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().place, "friction.exponent");
}

TEST(MaterialValidate, EveryFieldIsChecked) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  const auto refused = [](const std::function<void(Material&)>& change) {
    Material material;
    material.static_friction = 0.5;
    material.dynamic_friction = 0.3;
    change(material);
    const Status status = validate(material);
    return status.ok() ? std::string() : status.error().place;
  };
  for (const double bad : {-1.0, nan, infinity}) {
    EXPECT_EQ(refused([&](Material& m) { m.stiffness = bad; }), "stiffness");
    EXPECT_EQ(refused([&](Material& m) { m.damping = bad; }), "damping");
    EXPECT_EQ(refused([&](Material& m) { m.static_friction = bad; }), "static_friction");
    EXPECT_EQ(refused([&](Material& m) { m.dynamic_friction = bad; }), "dynamic_friction");
  }
  EXPECT_EQ(refused([](Material& m) { m.stiffness = 0.0; }), "stiffness");
  EXPECT_EQ(refused([](Material& m) { m.dynamic_friction = 0.6; }), "dynamic_friction");
  EXPECT_EQ(refused([](Material&) {}), "");
}

}  // namespace
}  // namespace asperity::friction_names_test
