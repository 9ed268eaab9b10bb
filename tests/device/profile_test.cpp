#include "asperity/device/profile.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>

#include "asperity/core/suggest.h"
#include "asperity/device/hand.h"

namespace asperity::profile_test {
namespace {

TEST(Profile, EveryNameOfTheVocabularyIsThereOnceAndValid) {
  const std::set<std::string> expected{"omega.3",  "omega.6", "omega.7",      "delta.3",      "sigma.7",
                                       "lambda.7", "falcon",  "touch",        "phantom-omni", "phantom-desktop",
                                       "inverse3", "ideal",   "hapticmaster", "premium-1.5",  "premium-3.0"};
  std::set<std::string> names;
  for (const DeviceProfile& profile : device_profiles()) {
    EXPECT_TRUE(names.insert(profile.name).second) << profile.name;
    EXPECT_TRUE(validate_profile(profile).ok()) << profile.name;
  }
  EXPECT_EQ(names, expected);
  EXPECT_EQ(device_profile_names().size(), expected.size());
}

TEST(Profile, SourcedNumbersStand) {
  const auto check = [](const char* name, double force, double stiffness, double damping, double radius) {
    const DeviceProfile p = find_profile(name).value();
    EXPECT_EQ(p.max_force, force) << name;
    EXPECT_EQ(p.max_stiffness, stiffness) << name;
    EXPECT_EQ(p.max_damping, damping) << name;
    EXPECT_EQ(p.workspace_radius, radius) << name;
  };
  check("omega.3", 12, 5000, 30, 0.075);
  check("omega.6", 12, 5000, 30, 0.075);
  check("omega.7", 12, 5000, 30, 0.075);
  check("delta.3", 20, 5000, 30, 0.15);
  check("sigma.7", 12, 4000, 30, 0.075);
  check("lambda.7", 12, 8000, 30, 0.1125);
  check("falcon", 8, 3000, 20, 0.04);
  check("touch", 3.3, 400, 4, 0.075);
  check("phantom-omni", 3.3, 700, 5, 0.10);
  check("phantom-desktop", 7.9, 1000, 5, 0.10);
  check("premium-1.5", 8.5, 800, 5, 0.12);
  check("premium-3.0", 22, 1000, 5, 0.25);
  check("inverse3", 10, 1000, 6, 0.15);
  EXPECT_EQ(find_profile("phantom-desktop")->position_resolution, 20e-6);
  EXPECT_EQ(find_profile("hapticmaster")->max_force, 250.0);
  EXPECT_TRUE(find_profile("hapticmaster")->admittance);
}

TEST(Profile, NameIsFoundInAnyCase) {
  EXPECT_EQ(find_profile("Omega.7")->name, "omega.7");
}

TEST(Profile, UnknownNameListsAllAndSuggestsTheNearest) {
  const auto result = find_profile("phantom-desk");
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().code, ErrorCode::bad_value);
  EXPECT_NE(result.error().what.find("did you mean \"phantom-desktop\""), std::string::npos) << result.error().what;
  for (const std::string& name : device_profile_names()) {
    EXPECT_NE(result.error().accepted.find(name), std::string::npos) << name;
  }
  EXPECT_EQ(find_profile("toaster-oven").error().what.find("did you mean"), std::string::npos);
}

TEST(Profile, EachBadNumberIsNamed) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto place = [](void (*change)(DeviceProfile&)) {
    DeviceProfile profile = find_profile("touch").value();
    change(profile);
    const Status status = validate_profile(profile);
    return status ? std::string("accepted") : status.error().place;
  };
  EXPECT_EQ(place([](DeviceProfile& p) { p.max_force = 0.0; }), "max_force");
  EXPECT_EQ(place([](DeviceProfile& p) { p.max_stiffness = -1.0; }), "max_stiffness");
  EXPECT_EQ(place([](DeviceProfile& p) { p.max_damping = -1.0; }), "max_damping");
  EXPECT_EQ(place([](DeviceProfile& p) { p.workspace_radius = 0.0; }), "workspace_radius");
  EXPECT_EQ(place([](DeviceProfile& p) { p.position_resolution = -1e-6; }), "position_resolution");
  EXPECT_EQ(place([](DeviceProfile& p) { p.mass = -0.1; }), "mass");
  EXPECT_EQ(place([](DeviceProfile& p) { p.damping = -0.1; }), "damping");
  EXPECT_EQ(place([](DeviceProfile& p) { p.friction = -0.1; }), "friction");
  EXPECT_EQ(place([](DeviceProfile& p) { p.slew_limit = 0.0; }), "slew_limit");
  EXPECT_EQ(place([](DeviceProfile& p) { p.rate = 0.0; }), "rate");
  DeviceProfile profile;
  profile.max_force = nan;
  EXPECT_FALSE(validate_profile(profile).ok());
}

TEST(Hand, PresetsAreValidAndTheDefaultIsTheDocumentedOne) {
  for (const HandImpedance& hand : hand_presets()) EXPECT_TRUE(validate_hand(hand).ok()) << hand.name;
  const HandImpedance hand = find_hand("default").value();
  EXPECT_EQ(hand.mass, 0.15);
  EXPECT_EQ(hand.damping, 6.0);
  EXPECT_EQ(hand.stiffness, 400.0);
  EXPECT_EQ(find_hand("paper")->mass, 0.25);
  EXPECT_EQ(find_hand("paper")->damping, 6.5);
  EXPECT_LT(find_hand("light")->stiffness, hand.stiffness);
  EXPECT_GT(find_hand("firm")->stiffness, hand.stiffness);
}

TEST(Hand, UnknownNameAndBadNumbersAreRefused) {
  EXPECT_NE(find_hand("frim").error().what.find("did you mean \"firm\""), std::string::npos);
  HandImpedance hand;
  hand.mass = 0.0;
  EXPECT_EQ(validate_hand(hand).error().place, "mass");
  hand = {};
  hand.damping = -1.0;
  EXPECT_EQ(validate_hand(hand).error().place, "damping");
  hand = {};
  hand.stiffness = 0.0;
  EXPECT_EQ(validate_hand(hand).error().place, "stiffness");
  hand = {};
  hand.lateral_limit = 0.0;
  EXPECT_EQ(validate_hand(hand).error().place, "lateral_limit");
}

TEST(Suggest, EditDistanceCountsSingleChanges) {
  EXPECT_EQ(edit_distance("", "abc"), 3U);
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3U);
  EXPECT_EQ(edit_distance("depht", "depth"), 1U);
  EXPECT_EQ(edit_distance("Depth", "dEPTH"), 0U);
  EXPECT_EQ(edit_distance("abc", "abc"), 0U);
}

TEST(Suggest, NearestNameIsEmptyWhenNothingIsNear) {
  const std::vector<std::string> names{"stiffness", "damping", "friction"};
  EXPECT_EQ(nearest_name("stifness", names), "stiffness");
  EXPECT_EQ(nearest_name("fricton", names), "friction");
  EXPECT_EQ(nearest_name("colour", names), "");
  EXPECT_EQ(nearest_name("x", {}), "");
}

}  // namespace
}  // namespace asperity::profile_test
