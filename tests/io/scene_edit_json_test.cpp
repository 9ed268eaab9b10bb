#include "asperity/io/scene_edit_json.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <bit>
#include <cmath>

namespace asperity::scene_edit_json_test {
namespace {

RC_GTEST_PROP(SceneEditJson, ComesBackToTheLastBit, ()) {
  SceneEdit edit;
  const auto kinds = static_cast<std::size_t>(Names<SceneEditKind>::table.size());
  edit.kind = Names<SceneEditKind>::table[*rc::gen::inRange<std::size_t>(0, kinds)].value;
  edit.instance = *rc::gen::element<std::string>("", "dragon", "a \"quoted\" name.2", "\xC3\xA9");
  if (edit.kind == SceneEditKind::law) {
    edit.law = "height-field-literal";
  } else {
    edit.value = std::bit_cast<double>(*rc::gen::arbitrary<std::uint64_t>());
    RC_PRE(std::isfinite(edit.value));
  }
  const Result<SceneEdit> back = parse_scene_edit(to_json(edit));
  RC_ASSERT(back.ok());
  RC_ASSERT(*back == edit);
  RC_ASSERT(std::bit_cast<std::uint64_t>(back->value) == std::bit_cast<std::uint64_t>(edit.value));
}

TEST(SceneEditJson, EachBadTextHasItsError) {
  const auto code_of = [](const char* text) {
    const Result<SceneEdit> edit = parse_scene_edit(text);
    EXPECT_FALSE(edit.ok()) << text;
    return edit ? ErrorCode::mismatch : edit.error().code;
  };
  EXPECT_EQ(code_of(""), ErrorCode::file_malformed);
  EXPECT_EQ(code_of("[1]"), ErrorCode::file_malformed);
  EXPECT_EQ(code_of(R"({"value":1})"), ErrorCode::bad_value);
  EXPECT_EQ(code_of(R"({"kind":"colour","value":1})"), ErrorCode::bad_value);
  EXPECT_EQ(code_of(R"({"kind":3,"value":1})"), ErrorCode::bad_type);
  EXPECT_EQ(code_of(R"({"kind":"zoom"})"), ErrorCode::bad_type);
  EXPECT_EQ(code_of(R"({"kind":"zoom","value":null})"), ErrorCode::bad_type);
  EXPECT_EQ(code_of(R"({"kind":"zoom","value":2,"instance":7})"), ErrorCode::bad_type);
  EXPECT_EQ(code_of(R"({"kind":"law"})"), ErrorCode::bad_type);
  EXPECT_EQ(code_of(R"({"kind":"law","law":"proxy","value":2})"), ErrorCode::bad_key);
  EXPECT_EQ(code_of(R"({"kind":"zoom","value":2,"speed":1})"), ErrorCode::bad_key);
}

}  // namespace
}  // namespace asperity::scene_edit_json_test
