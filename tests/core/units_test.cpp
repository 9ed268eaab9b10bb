#include "asperity/core/units.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>

#include "asperity/core/fixed_vector.h"
#include "asperity/core/frames.h"
#include "asperity/core/samples.h"

namespace asperity::units_test {
namespace {

TEST(Units, EveryUnitBecomesSi) {
  EXPECT_DOUBLE_EQ(parse_quantity("2mm", Dimension::length).value(), 0.002);
  EXPECT_DOUBLE_EQ(parse_quantity(" 2.5 um ", Dimension::length).value(), 2.5e-6);
  EXPECT_DOUBLE_EQ(parse_quantity("1in", Dimension::length).value(), 0.0254);
  EXPECT_DOUBLE_EQ(parse_quantity("0.5 N/mm", Dimension::stiffness).value(), 500.0);
  EXPECT_DOUBLE_EQ(parse_quantity("+15mm/s", Dimension::speed).value(), 0.015);
  EXPECT_DOUBLE_EQ(parse_quantity("1kHz", Dimension::frequency).value(), 1000.0);
  EXPECT_DOUBLE_EQ(parse_quantity("10%", Dimension::ratio).value(), 0.1);
  EXPECT_DOUBLE_EQ(parse_quantity("-1e-3", Dimension::length).value(), -1e-3);
  EXPECT_NEAR(parse_quantity("180deg", Dimension::angle).value(), 3.14159265358979, 1e-12);
}

TEST(Units, BadQuantitiesSayWhatWouldBeAccepted) {
  for (const char* text : {"", "mm", "2 furlongs", "nan", "inf mm", "1e999", "2mm3", "1,5mm"}) {
    const auto result = parse_quantity(text, Dimension::length);
    ASSERT_FALSE(result.ok()) << text;
    EXPECT_EQ(result.error().code, ErrorCode::bad_value);
    EXPECT_NE(result.error().accepted.find("mm"), std::string::npos) << text;
  }
}

TEST(Units, LengthsAreWrittenWithTheUnitThatSuits) {
  EXPECT_EQ(format_length(0.002), "2 mm");
  EXPECT_EQ(format_length(3.5e-4), "350 um");
  EXPECT_EQ(format_length(1.5), "1.5 m");
  EXPECT_EQ(format_length(-2.1e-8), "-21 nm");
  EXPECT_EQ(format_length(0.9999e-3), "1 mm");
  EXPECT_EQ(format_length(0.0), "0 mm");
}

TEST(Error, MessageNamesFilePlaceCauseAndCure) {
  const Error error = Error{ErrorCode::bad_value, "is negative", {}, "height", "a length above 0"}
                          .at("surfaces[0].coat")
                          .in_file("scene.json");
  EXPECT_EQ(error.message(), "scene.json: surfaces[0].coat.height: is negative; accepted: a length above 0");
  EXPECT_STREQ(to_string(error.code), "bad_value");
}

TEST(Result, TryReturnsTheFirstError) {
  const auto inner = [](bool ok) -> Result<int> {
    if (ok) return 4;
    return Error{ErrorCode::bad_type, "no", {}, {}, {}};
  };
  const auto outer = [&](bool ok) -> Result<int> {
    ASPERITY_TRY(const int value, inner(ok));
    return value + 1;
  };
  EXPECT_EQ(outer(true).value(), 5);
  EXPECT_EQ(outer(false).error().code, ErrorCode::bad_type);
}

TEST(FixedVector, RefusesWhatDoesNotFitAndCopiesWhatItHolds) {
  FixedVector<int, 3> values;
  EXPECT_TRUE(values.push_back(1) && values.push_back(2) && values.push_back(3));
  EXPECT_FALSE(values.push_back(4));
  EXPECT_EQ(values.emplace_back(), nullptr);
  FixedVector<int, 3> copy = values;
  copy.swap_remove(0);
  ASSERT_EQ(copy.size(), 2u);
  EXPECT_EQ(copy[0], 3);
  EXPECT_EQ(values[0], 1);
}

TEST(Flags, HoldSeveralAtOnce) {
  Flags flags;
  flags.set(TickFlag::contact);
  flags.set(TickFlag::force_limited);
  flags.set(TickFlag::contact, false);
  EXPECT_FALSE(flags.has(TickFlag::contact));
  EXPECT_TRUE(flags.has(TickFlag::force_limited));
  EXPECT_EQ(Flags::from_bits(flags.bits()).bits(), flags.bits());
}

RC_GTEST_PROP(Pose, InverseUndoesItself, (int a, int b, int c)) {
  Pose pose;
  pose.position = Vec3(a % 100, b % 100, c % 100) * 0.01;
  pose.orientation = Quat(Eigen::AngleAxisd(0.01 * (a % 300), Vec3(1.0 + std::abs(b % 7), c % 5, 0.3).normalized()));
  const Vec3 p(0.1, -0.2, 0.3);
  RC_ASSERT((pose.apply_inverse(pose.apply(p)) - p).norm() < 1e-14);
  RC_ASSERT((pose.rotate_inverse(pose.rotate(p)) - p).norm() < 1e-14);
}

}  // namespace
}  // namespace asperity::units_test
