// A law's form is told by its name or by "formulation": the same law either way.

#include <gtest/gtest.h>

#include "asperity/io/detail/scene_reader.h"
#include "asperity/render/law_registry.h"

namespace asperity::law_spelling_test {
namespace {

/// The law of a scene file with every option written out.
std::string written(const SceneJson& json) {
  Result<ScenePart<Law>> law = read_law(json, "law", SceneContext{});
  EXPECT_TRUE(law.ok()) << json.dump() << ": " << (law.ok() ? "" : law.error().message());
  return law ? law_json(law->value).dump() : "";
}

TEST(LawSpelling, BothSpellingsOfAFormMakeTheSameLaw) {
  int forms = 0;
  for (const std::string& name : law_names()) {
    const Law law = law_by_name(name).value();
    const std::string expected = law_json(law).dump();
    EXPECT_EQ(written(name), expected);
    EXPECT_EQ(written({{"type", name}}), expected);
    EXPECT_EQ(written(law_json(law)), expected);
    const std::optional<Formulation> form = law.formulation();
    if (!form) continue;
    ++forms;
    const char* told = *form == Formulation::literal ? "literal" : "consistent";
    const std::string plain = law_name(law.in_form(Formulation::consistent));
    EXPECT_EQ(written({{"type", plain}, {"formulation", told}}), expected) << name;
    EXPECT_EQ(written({{"type", plain + "-literal"}, {"formulation", told}}), expected) << name;
  }
  EXPECT_EQ(forms, 14);
}

TEST(LawSpelling, TheTaperOfTheLiteralHeightFieldCanBeTurnedOff) {
  for (const SceneJson& json : {SceneJson{{"type", "height-field-literal"}, {"edge_taper", 0}},
                                SceneJson{{"type", "height-field"}, {"formulation", "literal"}, {"edge_taper", 0}}}) {
    const Result<ScenePart<Law>> law = read_law(json, "law", SceneContext{});
    ASSERT_TRUE(law.ok());
    EXPECT_EQ(law->value.as<HeightFieldLaw>()->edge_taper, 0.0);
    EXPECT_EQ(law->value.as<HeightFieldLaw>()->formulation, Formulation::literal);
  }
}

TEST(LawSpelling, AFormThatALawDoesNotHaveIsRefused) {
  for (const char* name : {"proxy", "god-object", "generated-geometry", "dense-mesh", "normal-perturbation"}) {
    const Result<ScenePart<Law>> law = read_law({{"type", name}, {"formulation", "literal"}}, "law", SceneContext{});
    ASSERT_FALSE(law.ok()) << name;
    EXPECT_EQ(law.error().place, "law.formulation");
    EXPECT_EQ(law.error().code, ErrorCode::bad_key);
  }
}

}  // namespace
}  // namespace asperity::law_spelling_test
