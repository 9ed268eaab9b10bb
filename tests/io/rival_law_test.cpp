// The laws that feel a relief as geometry, in scene files.

#include "tests/io/experiment_fixture.h"

namespace asperity::rival_law_test {
namespace {

class RivalLaw : public ExperimentTest {
 protected:
  [[nodiscard]] static std::string scene_with(const std::string& law) {
    return R"({"surfaces":[{"mesh":"sheet.obj","coat":{"height_map":"map.png","height":"1mm"},"law":)" + law + "}]}";
  }
  [[nodiscard]] Law law_of(const std::string& law) const { return good(scene_with(law)).scene.instances()[0].law; }
  void expect_refused(const std::string& law, const std::string& place, ErrorCode code) const {
    const Result<Experiment> scene = parse(scene_with(law));
    ASSERT_FALSE(scene.ok()) << law;
    EXPECT_EQ(scene.error().place, place) << scene.error().message();
    EXPECT_EQ(scene.error().code, code) << scene.error().message();
    EXPECT_FALSE(scene.error().accepted.empty()) << law;
  }
};

TEST_F(RivalLaw, OptionsAreRead) {
  const Law plain = law_of(R"("generated-geometry")");
  EXPECT_EQ(plain.as<GeneratedGeometryLaw>()->subdivisions, GeneratedGeometryLaw{}.subdivisions);
  EXPECT_EQ(plain.as<GeneratedGeometryLaw>()->influence_radius, 0.0);
  const Law generated = law_of(R"({"type":"generated-geometry","subdivisions":48,"influence_radius":"0.3 mm"})");
  EXPECT_EQ(generated.as<GeneratedGeometryLaw>()->subdivisions, 48);
  EXPECT_DOUBLE_EQ(generated.as<GeneratedGeometryLaw>()->influence_radius, 3e-4);
  EXPECT_EQ(law_of(R"("dense-mesh")").as<DenseMeshLaw>()->subdivisions, 0);
  EXPECT_EQ(law_of(R"({"type":"dense-mesh","subdivisions":5})").as<DenseMeshLaw>()->subdivisions, 5);
}

TEST_F(RivalLaw, CanonicalCopiesFeelTheSame) {
  for (const char* law : {R"("generated-geometry")", R"("dense-mesh")", R"({"type":"dense-mesh","subdivisions":5})",
                          R"({"type":"generated-geometry","subdivisions":9,"influence_radius":"2 mm"})"}) {
    const Experiment once = good(scene_with(law));
    const Experiment again = good(once.canonical_json);
    EXPECT_EQ(again.canonical_json, once.canonical_json) << law;
    EXPECT_EQ(short_run(again, 2000), short_run(once, 2000)) << law;
  }
}

TEST_F(RivalLaw, EachBadOptionIsNamed) {
  const std::string law = "surfaces[0].law";
  expect_refused(R"({"type":"generated-geometry","subdivisions":0})", law + ".subdivisions", ErrorCode::bad_value);
  expect_refused(R"({"type":"generated-geometry","subdivisions":4097})", law + ".subdivisions", ErrorCode::bad_value);
  expect_refused(R"({"type":"generated-geometry","influence_radius":0})", law + ".influence_radius",
                 ErrorCode::bad_value);
  expect_refused(R"({"type":"generated-geometry","rho":0.1})", law + ".rho", ErrorCode::bad_key);
  expect_refused(R"({"type":"dense-mesh","subdivisions":0})", law + ".subdivisions", ErrorCode::bad_value);
  expect_refused(R"({"type":"dense-mesh","subdivisions":4096})", law + ".subdivisions", ErrorCode::too_large);
  expect_refused(R"({"type":"dense-mesh","influence_radius":1})", law + ".influence_radius", ErrorCode::bad_key);
  expect_refused(R"({"type":"god-object","subdivisions":4})", law + ".subdivisions", ErrorCode::bad_key);
  expect_refused(R"({"type":"height-field","subdivisions":4})", law + ".subdivisions", ErrorCode::bad_key);
  expect_refused(R"({"type":"mesostructure","influence_radius":1})", law + ".influence_radius", ErrorCode::bad_key);
}

TEST_F(RivalLaw, ABareMeshHasNoReliefToCut) {
  for (const char* law : {"generated-geometry", "dense-mesh"}) {
    const Result<Experiment> scene =
        parse(std::string(R"({"surfaces":[{"mesh":"sphere.ply","law":")") + law + R"("}]})");
    ASSERT_FALSE(scene.ok());
    EXPECT_EQ(scene.error().code, ErrorCode::unsupported_pair);
    EXPECT_EQ(scene.error().place, "surfaces[0].law");
  }
}

}  // namespace
}  // namespace asperity::rival_law_test
