#include "asperity/core/result.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>

namespace asperity::result_test {
namespace {

Result<std::string> failed() {
  return Error{ErrorCode::bad_value, "is negative", "scene.json", "surfaces[0].coat.height", "a length above 0"};
}

constexpr const char* words =
    "failed result was asked for: scene.json: surfaces\\[0\\]\\.coat\\.height: is negative; accepted: a length above 0 "
    "\\(bad_value\\)";

TEST(Result, HoldsAValueOrAnError) {
  const Result<std::string> good = std::string("fine");
  ASSERT_TRUE(good.ok());
  EXPECT_EQ(*good, "fine");
  EXPECT_EQ(good->size(), 4U);
  EXPECT_FALSE(failed().ok());
  EXPECT_EQ(failed().error().what, "is negative");
}

TEST(Result, MovesOutWhatCannotBeCopied) {
  Result<std::unique_ptr<int>> made = std::make_unique<int>(3);
  const std::unique_ptr<int> taken = std::move(made).value();
  EXPECT_EQ(*taken, 3);
}

TEST(Result, MayHoldAnErrorAsItsValuesNeighbour) {
  Result<int> number = 3;
  *number += 1;
  EXPECT_EQ(number.value(), 4);
  number = Error{ErrorCode::mismatch, "no longer", {}, {}, {}};
  EXPECT_EQ(number.error().code, ErrorCode::mismatch);
}

TEST(ResultDeathTest, TheValueOfAnErrorEndsWithTheErrorsWords) {
  EXPECT_DEATH((void)failed().value(), words);
  Result<std::string> named = failed();
  EXPECT_DEATH((void)named.value(), words);
  EXPECT_DEATH((void)*named, words);
  EXPECT_DEATH((void)named->size(), words);
  const Result<std::string> fixed = failed();
  EXPECT_DEATH((void)fixed.value(), words);
  EXPECT_DEATH((void)*fixed, words);
  EXPECT_DEATH((void)fixed->size(), words);
  const Status status = Error{ErrorCode::too_large, "is too much", {}, {}, {}};
  EXPECT_DEATH((void)status.value(), "is too much \\(too_large\\)");
}

TEST(ResultDeathTest, TheErrorOfASuccessEndsWithWords) {
  Result<int> good = 3;
  EXPECT_DEATH((void)good.error(), "error of a result that went well");
  EXPECT_DEATH((void)std::move(good).error(), "error of a result that went well");
  const Status fine = success();
  EXPECT_DEATH((void)fine.error(), "error of a result that went well");
}

}  // namespace
}  // namespace asperity::result_test
