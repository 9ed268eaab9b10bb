// Fine features and friction in scene files: heterogeneous-features-2008.

#include <fmt/format.h>

#include <numbers>

#include "tests/io/experiment_fixture.h"

namespace asperity::fine_scene_test {
namespace {

using std::numbers::pi;

class FineScene : public ExperimentTest {
 protected:
  static const Instance& instance(const Experiment& e) { return e.scene.instances()[0]; }
  static const FineSettings& fine(const Experiment& e) {
    if (instance(e).fine == nullptr) throw std::runtime_error("nothing fine is there");
    return instance(e).fine->settings();
  }
  [[nodiscard]] Error bad(const std::string& json) const {
    const Result<Experiment> result = parse(json);
    if (result) throw std::runtime_error("accepted: " + json);
    EXPECT_FALSE(result.error().what.empty());
    EXPECT_FALSE(result.error().accepted.empty()) << result.error().message();
    return result.error();
  }
  /// A box of 40 mm, its middle in the origin.
  static std::string box(const std::string& more) {
    return R"({"surfaces":[{"mesh":{"generator":"box","size":[0.04,0.04,0.04]},)" + more + "}]}";
  }
  /// A sheet of 100 mm x 60 mm, facing up.
  static std::string sheet(const std::string& more) {
    return R"({"surfaces":[{"mesh":{"generator":"plane","width":0.1,"depth":0.06,"columns":5,"rows":3},)" + more +
           "}]}";
  }
  static std::string formula(const std::string& shape, const std::string& more = "") {
    return R"({"surfaces":[{"parametric":{"shape":)" + shape + "}" + (more.empty() ? "" : "," + more) + "}]}";
  }
  static std::string texture(const std::string& features, const std::string& more = "") {
    return R"("texture":{"features":)" + features + (more.empty() ? "" : "," + more) + "}";
  }
  static std::string material(const std::string& more) {
    return box(R"("material":{"static_friction":0.5,)" + more + "}");
  }
  void refused(const std::string& json, const std::string& place, const std::string& part = {}) const {
    const Error error = bad(json);
    EXPECT_EQ(error.place, "surfaces[0]." + place) << error.message();
    EXPECT_NE(error.message().find(part), std::string::npos) << error.message();
  }
  /// The canonical copy is its own canonical copy.
  void comes_back(const Experiment& e) const {
    const Experiment again = good(e.canonical_json);
    EXPECT_EQ(again.canonical_json, e.canonical_json);
    EXPECT_EQ(short_run(again, 200), short_run(e, 200));
  }
};

constexpr const char* millimetre = R"({"type":"grating","amplitude":"0.1 mm","wavelength":"1 mm"})";

// ---- surfaces given by formulas ----

TEST_F(FineScene, AFormulaIsASurface) {
  const Experiment e = good(formula(R"("vase","radius":"25 mm","height":"90 mm","neck":"40 %")", R"("name":"urn")"));
  const ParametricSurface* vase = parametric_of(instance(e).surface);
  ASSERT_NE(vase, nullptr);
  EXPECT_EQ(vase->settings().shape, ParametricShape::vase);
  EXPECT_DOUBLE_EQ(vase->settings().radius, 0.025);
  EXPECT_DOUBLE_EQ(vase->settings().height, 0.09);
  EXPECT_DOUBLE_EQ(vase->settings().neck, 0.4);
  EXPECT_EQ(instance(e).name, "urn");
  EXPECT_EQ(instance(e).fine, nullptr);
  // Its axis stands upright.
  const Vec3 top = instance(e).world_from_object.apply(Vec3(0.0, 0.0, 0.09));
  EXPECT_LT((top - Vec3(0.0, 0.09, 0.0)).norm(), 1e-12);
  comes_back(e);
}

TEST_F(FineScene, EveryShapeIsRead) {
  for (const std::string& shape : parametric_names()) {
    const Experiment e = good(formula("\"" + shape + "\""));
    ASSERT_NE(parametric_of(instance(e).surface), nullptr) << shape;
    EXPECT_EQ(parametric_name(parametric_of(instance(e).surface)->settings().shape), shape);
    EXPECT_GT(e.path.length(), 0.0) << shape;
  }
  const Experiment torus = good(formula(R"("torus","radius":"20 mm","tube":"5 mm")", R"("up":"x","sides":"front")"));
  EXPECT_DOUBLE_EQ(parametric_of(instance(torus).surface)->settings().tube, 0.005);
  EXPECT_EQ(instance(torus).sides, Sides::front);
  EXPECT_LT((instance(torus).world_from_object.rotate(Vec3::UnitX()) - Vec3::UnitY()).norm(), 1e-12);
  const Experiment ramp = good(formula(R"("ramp","scale":"2 mm")"));
  EXPECT_DOUBLE_EQ(parametric_of(instance(ramp).surface)->settings().scale, 0.002);
}

TEST_F(FineScene, FormulasRefuseWhatTheyDoNotTake) {
  refused(formula(R"("vaze")"), "parametric.shape", "did you mean \"vase\"");
  refused(formula(R"("plane","radius":0.01)"), "parametric.radius");
  refused(formula(R"("sphere","radius":0)"), "parametric.radius");
  refused(formula(R"("vase","neck":0.01)"), "parametric.neck");
  refused(formula(R"("plane")", R"("coat":{"height_map":"map.png"})"), "coat", "parametric");
  refused(formula(R"("plane")", R"("mesh":"sheet.obj")"), "mesh");
  refused(R"({"surfaces":[{"parametric":{}}]})", "parametric.shape", "is missing");
  refused(R"({"surfaces":[{"parametric":"vase"}]})", "parametric");
}

// ---- features ----

TEST_F(FineScene, EveryFeatureIsRead) {
  const Experiment e = good(sheet(texture(R"([
      {"type":"grating","amplitude":"0.1 mm","wavelength":"2 mm","direction":"30 deg","phase":"90 deg"},
      {"type":"circular-grating","amplitude":1e-4,"wavelength":"1 mm","phase":0.5,"centre":["1 mm",0.002]},
      {"type":"grid","amplitude":1e-4,"wavelength":["1 mm","2 mm"],"direction":0.1},
      {"type":"triangular","amplitude":1e-4,"wavelength":"3 mm"},
      {"type":"serrated","amplitude":1e-4,"wavelength":"3 mm","wall":"10 %"},
      {"type":"noise","roughness":"20 um","correlation_length":"0.5 mm","seed":9,"period":"40 mm"},
      {"type":"map","height_map":"map.png","height":"0.1 mm","offset":"-0.05 mm","white_is":"deep","channel":"luminance",
       "filter":"bilinear","wavelength":"16 mm","direction":"90 deg"}])",
                                          R"("as":"texture","formulation":"literal")")));
  const std::vector<SurfaceFeature>& read = fine(e).texture;
  ASSERT_EQ(read.size(), 7U);
  EXPECT_EQ(fine(e).formulation, Formulation::literal);
  EXPECT_DOUBLE_EQ(read[0].spec().amplitude, 1e-4);
  EXPECT_DOUBLE_EQ(read[0].spec().wavelength.x(), 0.002);
  EXPECT_NEAR(read[0].spec().direction, pi / 6.0, 1e-15);
  EXPECT_NEAR(read[0].spec().phase, pi / 2.0, 1e-15);
  EXPECT_EQ(read[1].spec().centre, Vec2(0.001, 0.002));
  EXPECT_EQ(read[2].spec().wavelength, Vec2(0.001, 0.002));
  EXPECT_EQ(read[3].spec().kind, FeatureKind::triangular);
  EXPECT_DOUBLE_EQ(read[4].spec().wall, 0.1);
  EXPECT_DOUBLE_EQ(read[5].spec().roughness, 2e-5);
  EXPECT_DOUBLE_EQ(read[5].spec().correlation_length, 5e-4);
  EXPECT_EQ(read[5].spec().seed, 9U);
  EXPECT_EQ(read[5].spec().period, Vec2(0.04, 0.04));
  // 16 x 8 pixels stay square; white is 0.1 mm below black.
  EXPECT_EQ(read[6].spec().wavelength, Vec2(0.016, 0.008));
  EXPECT_NEAR(read[6].spec().heights->highest(), -5e-5, 1e-9);
  EXPECT_NEAR(read[6].spec().heights->lowest(), -1.5e-4, 1e-9);
  comes_back(e);
}

TEST_F(FineScene, OneFeatureStandsAlone) {
  const Experiment one = good(sheet(texture(millimetre)));
  const Experiment array = good(sheet(texture(fmt::format("[{}]", millimetre))));
  EXPECT_EQ(one.canonical_json, array.canonical_json);
  EXPECT_EQ(fine(one).texture.size(), 1U);
}

TEST_F(FineScene, FeaturesRefuseWhatIsWrong) {
  const auto feature = [&](const std::string& members, const std::string& key, const std::string& part = {}) {
    refused(sheet(texture("{" + members + "}")), "texture.features" + (key.empty() ? "" : "." + key), part);
  };
  feature(R"("type":"gratting","amplitude":1e-4,"wavelength":1e-3)", "type", "did you mean \"grating\"");
  feature(R"("amplitude":1e-4,"wavelength":1e-3)", "type", "is missing");
  feature(R"("type":"grating","amplitude":1e-4)", "wavelength", "is missing");
  feature(R"("type":"grating","wavelength":1e-3)", "amplitude", "is missing");
  feature(R"("type":"grating","amplitude":1e-4,"wavelength":-1e-3)", "wavelength", "above 0");
  feature(R"("type":"grating","amplitude":0,"wavelength":1e-3)", "amplitude", "above 0");
  feature(R"("type":"grating","amplitude":1e-4,"wavelength":[1e-3,1e-3])", "wavelength");
  feature(R"("type":"grid","amplitude":1e-4,"wavelength":[1e-3,1e-3,1e-3])", "wavelength", "3 lengths");
  feature(R"("type":"grid","amplitude":1e-4,"wavelength":[1e-3,-1])", "wavelength[1]");
  feature(R"("type":"grating","amplitude":1e-4,"wavelength":1e-3,"wall":0.2)", "wall", "by the feature \"grating\"");
  feature(R"("type":"noise","roughness":1e-5,"correlation_length":1e-3,"amplitude":1e-3)", "amplitude");
  feature(R"("type":"noise","roughness":1e-5,"correlation_length":1e-3,"period":1e-3)", "period");
  feature(R"("type":"serrated","amplitude":1e-4,"wavelength":1e-3,"wall":0.7)", "wall");
  feature(R"("type":"map","wavelength":1e-2,"height":1e-4)", "height_map", "is missing");
  feature(R"("type":"map","height_map":"map.png","wavelength":1e-2)", "height", "is missing");
  feature(R"("type":"map","height_map":"map.png","height":"10 %","wavelength":1e-2)", "height");
  feature(R"("type":"map","height_map":"map.png","height":1e-4)", "wavelength", "is missing");
  feature(R"("type":"grating","amplitude":1e-4,"wavelength":1e-3,"height_map":"map.png")", "height_map");
  feature(R"("type":"grating","amplitude":1e-4,"count":10)", "count", "does not go around");
  feature(R"("type":"grating","amplitude":1e-4,"wavelength":1e-3,"as":"geometri")", "as", "did you mean");
  feature(R"("type":"grating","amplitude":1e-4,"wavelength":1e-3,"colour":1)", "colour");
  refused(sheet(texture("[]")), "texture.features", "has 0");
  refused(sheet(texture("3")), "texture.features", "is a number");
  refused(sheet(R"("texture":{})"), "texture.features", "has no features");
  refused(sheet(R"("texture":"rough")"), "texture");
  std::string many = millimetre;
  for (int i = 0; i < 16; ++i) many += fmt::format(",{}", millimetre);
  refused(sheet(texture(fmt::format("[{}]", many))), "texture.features", "has 17");
}

// ---- mappings ----

TEST_F(FineScene, MappingsStartFromTheObject) {
  // A sheet lies across its shortest side, which points up.
  const FeatureMappingSettings flat = fine(good(sheet(texture(millimetre)))).mapping.settings();
  EXPECT_EQ(flat.surface, IntermediateSurface::plane);
  EXPECT_EQ(flat.axis, Vec3::UnitY());
  EXPECT_EQ(flat.reference, Vec3::UnitX());
  EXPECT_LT(flat.origin.norm(), 1e-12);
  const auto mapped = [&](const std::string& mapping) {
    return fine(good(box(texture(millimetre, R"("mapping":)" + mapping)))).mapping.settings();
  };
  const FeatureMappingSettings cylinder = mapped(
      R"({"surface":"cylinder","radius":0.02228169203286535,"axis":[0,2,0],"reference":[1,1,0],"origin":[0,"1 mm",0]})");
  EXPECT_EQ(cylinder.axis, Vec3::UnitY());
  EXPECT_LT((cylinder.reference - Vec3::UnitX()).norm(), 1e-12);
  EXPECT_EQ(cylinder.origin, Vec3(0.0, 0.001, 0.0));
  const FeatureMappingSettings six = mapped(R"({"surface":"box"})");
  EXPECT_LT((six.half_extent - Vec3::Constant(0.02)).norm(), 1e-12);
  EXPECT_EQ(mapped(R"({"surface":"box","half_extent":["2 cm",0.03,0.04]})").half_extent, Vec3(0.02, 0.03, 0.04));
  // OBJ files carry texture coordinates.
  const std::string uv = R"({"surfaces":[{"mesh":"sheet.obj","units":"m",)" +
                         texture(millimetre, R"("mapping":{"surface":"uv","tile":["1 m",2]})") + "}]}";
  EXPECT_EQ(fine(good(uv)).mapping.settings().tile, Vec2(1.0, 2.0));
  // Of a formula: what one unit measures where it is widest.
  const Experiment ball =
      good(formula(R"("sphere","radius":0.02)", texture(R"({"type":"grating","amplitude":1e-4,"count":100})")));
  EXPECT_EQ(fine(ball).mapping.settings().surface, IntermediateSurface::uv);
  EXPECT_NEAR(fine(ball).mapping.settings().tile.x(), 0.02, 1e-9);
  EXPECT_NEAR(fine(ball).mapping.settings().tile.y(), 0.02, 1e-9);
  EXPECT_NEAR(fine(ball).texture[0].spec().wavelength.x(), 2.0 * pi * 0.02 / 100.0, 1e-9);
  comes_back(ball);
}

TEST_F(FineScene, WavesAreCountedAroundACylinder) {
  const Experiment e = good(box(texture(R"({"type":"grating","amplitude":1e-4,"count":40})",
                                        R"("mapping":{"surface":"cylinder","radius":"20 mm"})")));
  EXPECT_NEAR(fine(e).texture[0].spec().wavelength.x(), 2.0 * pi * 0.02 / 40.0, 1e-15);
  comes_back(e);
  // R_a of a Gaussian surface in place of R_q.
  const Experiment average = good(box(texture(R"({"type":"noise","average_roughness":1e-5,"correlation_length":1e-3})",
                                              R"("mapping":{"surface":"plane"})")));
  EXPECT_NEAR(fine(average).texture[0].spec().roughness, 1e-5 * std::sqrt(0.5 * pi), 1e-12);
  refused(box(texture(R"({"type":"noise","average_roughness":1e-5,"roughness":1e-5,"correlation_length":1e-3})")),
          "texture.features.roughness");
  // Noise goes around by itself.
  const Experiment noise = good(box(texture(R"({"type":"noise","roughness":1e-5,"correlation_length":1e-3})",
                                            R"("mapping":{"surface":"sphere","radius":"20 mm"},"as":"texture")")));
  EXPECT_NEAR(fine(noise).texture[0].spec().period.x(), 2.0 * pi * 0.02, 1e-12);
  comes_back(noise);
}

TEST_F(FineScene, MappingsRefuseWhatIsWrong) {
  const auto mapping = [&](const std::string& members, const std::string& key, const std::string& part = {}) {
    refused(box(texture(millimetre, R"("mapping":{)" + members + "}")), "texture.mapping." + key, part);
  };
  mapping(R"("surface":"cilinder")", "surface", "did you mean \"cylinder\"");
  mapping(R"("radius":0.01)", "radius", "by the mapping \"plane\"");
  mapping(R"("tile":0.01)", "tile");
  mapping(R"("surface":"uv","axis":[0,0,1])", "axis");
  mapping(R"("axis":[0,0,0])", "axis");
  mapping(R"("axis":[0,1,0],"reference":[0,3,0])", "reference", "along the axis");
  mapping(R"("surface":"cylinder","radius":-1)", "radius");
  mapping(R"("surface":"cylinder","range":["10 deg","10 deg"])", "range", "the second above it");
  mapping(R"("surface":"cylinder","range":[0,6.3])", "range", "one turn");
  mapping(R"("surface":"cylinder","range":"90 deg")", "range", "two angles");
  mapping(R"("surface":"plane","range":[0,1])", "range", "by the mapping \"plane\"");
  mapping(R"("surface":"box","half_extent":[0.01,0,0.01])", "half_extent");
  mapping(R"("origin":[0,0])", "origin");
  refused(R"({"surfaces":[{"mesh":"sphere.ply",)" + texture(millimetre, R"("mapping":{"surface":"uv"})") + "}]}",
          "texture.mapping.surface", "no texture coordinates");
  // Waves that do not fit around would step.
  refused(box(texture(millimetre, R"("mapping":{"surface":"cylinder","radius":"20 mm"})")),
          "texture.features.wavelength", "once around");
  refused(formula(R"("cylinder","radius":0.02)", texture(millimetre)), "texture.features.wavelength", "once around");
  refused(
      formula(R"("torus")", texture(R"({"type":"grating","amplitude":1e-4,"wavelength":1e-3,"direction":"90 deg"})")),
      "texture.features.wavelength", "once around");
  refused(box(texture(R"({"type":"circular-grating","amplitude":1e-4,"wavelength":1e-3})",
                      R"("mapping":{"surface":"cylinder"})")),
          "texture.features.type");
}

// ---- what a feature is felt as (Tab. 1) ----

TEST_F(FineScene, ScaleDecides) {
  const Experiment e = good(sheet(texture(R"([{"type":"grating","amplitude":"0.2 um","wavelength":"3 um"},
      {"type":"grating","amplitude":"40 um","wavelength":"1 mm"},
      {"type":"grating","amplitude":"0.4 mm","wavelength":"6 mm"}])")));
  ASSERT_EQ(fine(e).micro.size(), 1U);
  ASSERT_EQ(fine(e).texture.size(), 1U);
  EXPECT_DOUBLE_EQ(fine(e).micro[0].wavelength(), 3e-6);
  EXPECT_DOUBLE_EQ(fine(e).texture[0].wavelength(), 1e-3);
  ASSERT_TRUE(std::holds_alternative<std::shared_ptr<const ReliefSurface>>(instance(e).surface));
  EXPECT_NEAR(coat_of(e).highest(), 0.4e-3, 1e-5);
  EXPECT_TRUE(has_note(e, "grating of 3 um is felt as friction"));
  EXPECT_TRUE(has_note(e, "grating of 1 mm is felt as texture"));
  EXPECT_TRUE(has_note(e, "grating of 6 mm is felt as geometry (5 mm and more is shape)"));
  EXPECT_DOUBLE_EQ(fine(e).resolution, e.device.position_resolution);
  comes_back(e);
}

TEST_F(FineScene, TheSceneMayDecide) {
  const char* wide = R"({"type":"grating","amplitude":"0.2 mm","wavelength":"8 mm"})";
  const Experiment texture_of_it = good(sheet(texture(wide, R"("as":"texture")")));
  EXPECT_EQ(fine(texture_of_it).texture.size(), 1U);
  EXPECT_TRUE(std::holds_alternative<std::shared_ptr<const MeshSurface>>(instance(texture_of_it).surface));
  EXPECT_TRUE(has_note(texture_of_it, "as the scene asks"));
  // A feature's own word goes before the texture's.
  const Experiment geometry = good(sheet(
      texture(R"({"type":"grating","amplitude":"0.1 mm","wavelength":"2 mm","as":"geometry"})", R"("as":"friction")")));
  EXPECT_EQ(instance(geometry).fine, nullptr);
  EXPECT_NEAR(coat_of(geometry).highest(), 1e-4, 1e-6);
  const Experiment rough = good(sheet(texture(millimetre, R"("as":"friction")")));
  EXPECT_EQ(fine(rough).micro.size(), 1U);
  comes_back(geometry);
}

TEST_F(FineScene, GeometryIsRefusedWhereNothingCarriesIt) {
  const char* wide = R"({"type":"grating","amplitude":"0.2 mm","wavelength":"8 mm"})";
  refused(R"({"surfaces":[{"volume":{"generator":"sphere","size":[16,16,16]},"iso":{"threshold":0},)" + texture(wide) +
              "}]}",
          "texture.features", "a volume");
  refused(box(R"("coat":{"height_map":{"generator":"H_2"},"height":"0.1 mm"},)" + texture(wide)), "texture.features",
          "a coated mesh");
  refused(formula(R"("plane")", texture(wide, R"("mapping":{"surface":"plane"})")), "texture.features", "uv");
  refused(box(texture(wide, R"("mapping":{"surface":"box"})")), "texture.features", "box");
  refused(sheet(texture(wide) + R"(,"law":"god-object")"), "texture.features", "god-object");
  // On a volume a texture force is well.
  const Experiment e =
      good(R"({"surfaces":[{"volume":{"generator":"sphere","size":[16,16,16]},"iso":{"threshold":0},)" +
           texture(wide, R"("as":"texture")") + "}]}");
  EXPECT_EQ(fine(e).texture.size(), 1U);
  comes_back(e);
}

/// Where a stroke's ray from above meets the surface.
double height_at(const Instance& instance, double x, double z) {
  SurfaceCache cache;
  const Segment down{Vec3(x, 0.01, z), Vec3(x, -0.01, z)};
  const auto touch = [&](const auto& view) { return view.first_touch(down, Sides::both); };
  const auto hit = std::visit(
      [&](const auto& surface) {
        if constexpr (requires { surface->view(); }) {
          return touch(surface->view());
        } else {
          return touch(surface->view(cache));
        }
      },
      instance.surface);
  return 0.01 - 0.02 * hit.t;
}

TEST_F(FineScene, BakedFeaturesHaveTheHeightsOfTheFormula) {
  // Oblique, so that both sides of the map repeat; the phase tells directions apart.
  const Experiment e = good(sheet(
      texture(R"({"type":"grating","amplitude":"0.2 mm","wavelength":"6 mm","direction":"30 deg","phase":"40 deg"})")));
  FeatureMappingSettings upright;
  upright.axis = Vec3::UnitY();
  const FeatureMapping mapping = FeatureMapping::build(upright).value();
  FeatureSpec spec;
  spec.amplitude = 2e-4;
  spec.wavelength = Vec2(0.006, 0.0);
  spec.direction = pi / 6.0;
  spec.phase = 40.0 * pi / 180.0;
  const SurfaceFeature feature = SurfaceFeature::build(spec).value();
  for (int i = 0; i < 40; ++i) {
    const double x = -0.041 + 0.0021 * i;
    const double z = 0.023 - 0.0011 * i;
    MappedPlaces places;
    mapping.map(Vec3(x, 0.0, z), places);
    EXPECT_NEAR(height_at(instance(e), x, z), feature.sample(places[0].uv).height, 2e-6) << x << " " << z;
  }
}

TEST_F(FineScene, WhatDoesNotRepeatIsBakedOnce) {
  const Experiment e = good(sheet(texture(R"([{"type":"circular-grating","amplitude":"0.2 mm","wavelength":"8 mm"},
                  {"type":"noise","roughness":"20 um","correlation_length":"3 mm","seed":4,"period":"100 mm"}])")));
  FeatureSpec circles;
  circles.kind = FeatureKind::circular_grating;
  circles.amplitude = 2e-4;
  circles.wavelength = Vec2(0.008, 0.0);
  FeatureSpec noise;
  noise.kind = FeatureKind::noise;
  noise.roughness = 2e-5;
  noise.correlation_length = 0.003;
  noise.seed = 4;
  noise.period = Vec2(0.1, 0.1);
  const SurfaceFeature both[] = {SurfaceFeature::build(circles).value(), SurfaceFeature::build(noise).value()};
  for (int i = 0; i < 30; ++i) {
    const Vec2 uv(0.047 - 0.0031 * i, -0.027 + 0.0018 * i);  // v runs along -z
    EXPECT_NEAR(height_at(instance(e), uv.x(), -uv.y()), both[0].sample(uv).height + both[1].sample(uv).height, 5e-6);
  }
}

TEST_F(FineScene, GratingsAreBakedAroundAMesh) {
  // 24 waves around a ball of 40 mm; along its equator they come back without a seam.
  const Experiment e = good(R"({"surfaces":[{"mesh":{"generator":"icosphere","subdivisions":4,"radius":0.04},)" +
                            texture(R"({"type":"grating","amplitude":"0.1 mm","count":24})",
                                    R"("mapping":{"surface":"cylinder","radius":"40 mm"})") +
                            "}]}");
  ASSERT_TRUE(std::holds_alternative<std::shared_ptr<const ReliefSurface>>(instance(e).surface));
  const auto& ball = *std::get<std::shared_ptr<const ReliefSurface>>(instance(e).surface);
  const MeshSurface& base = *base_of(instance(e).surface);
  SurfaceCache cache;
  SurfaceCache bare;
  double largest = 0.0;
  for (int i = 0; i < 144; ++i) {
    const double angle = 2.0 * pi * (i + 0.5) / 144.0;
    const Vec3 out(std::cos(angle), 0.0, -std::sin(angle));
    const Segment ray{0.05 * out, 0.03 * out};
    const double outer = 0.05 - 0.02 * ball.view(cache).first_touch(ray, Sides::both).t;
    const double inner = 0.05 - 0.02 * base.view(bare).first_touch(ray, Sides::both).t;
    largest = std::max(largest, std::abs(outer - inner - 1e-4 * std::cos(24.0 * angle)));
  }
  EXPECT_LT(largest, 1e-5);
}

TEST_F(FineScene, TooFineGeometryIsRefused) {
  const Error error =
      bad(sheet(texture(R"({"type":"circular-grating","amplitude":"1 um","wavelength":"0.1 mm","as":"geometry"})")));
  EXPECT_EQ(error.code, ErrorCode::too_large);
  EXPECT_EQ(error.place, "surfaces[0].texture.features");
  EXPECT_NE(error.accepted.find("4096"), std::string::npos);
}

TEST_F(FineScene, FormulasWearGeometryInTheirParameters) {
  const Experiment e = good(formula(R"("cylinder","radius":0.02,"height":0.06)",
                                    texture(R"({"type":"grating","amplitude":"0.1 mm","count":16})")));
  const ParametricSurface* surface = parametric_of(instance(e).surface);
  ASSERT_EQ(surface->settings().features.size(), 1U);
  EXPECT_EQ(instance(e).fine, nullptr);
  for (const double angle : {0.3, 1.0, 2.5}) {
    EXPECT_NEAR(surface->jet(Vec2(angle, 0.02)).point.head<2>().norm(), 0.02 + 1e-4 * std::cos(16.0 * angle), 1e-9);
  }
  // A stroke runs along what carries the features.
  for (const Vec3& point : e.path.points()) EXPECT_NEAR(std::hypot(point.x(), point.z()), 0.02, 1e-8);
  comes_back(e);
}

TEST_F(FineScene, TheCoatCanBeTheTexture) {
  const std::string coat =
      R"("coat":{"height_map":{"generator":"H_2","size":64},"height":"0.2 mm"},"texture":{"source":"coat"})";
  const Experiment e = good(sheet(coat + R"(,"law":"god-object")"));
  EXPECT_EQ(fine(e).source, TextureSource::coat);
  comes_back(e);
  // The proxy follows the relief already.
  refused(sheet(coat), "texture.source", "proxy");
  refused(sheet(R"("texture":{"source":"coat"},"law":"god-object")"), "texture.source", "has none");
  refused(
      sheet(R"("coat":{"height_map":{"generator":"H_2"},"height":"0.2 mm"},"texture":{"source":"coat","features":)" +
            std::string(millimetre) + R"(},"law":"god-object")"),
      "texture.features");
}

TEST_F(FineScene, WhatCannotBeRenderedIsSaid) {
  const Experiment e = good(
      R"({"device":{"profile":"phantom-desktop","position_resolution":"20 um"},"stroke":{"speed":"100 mm/s"},"surfaces":[{"parametric":{"shape":"plane"},)" +
      texture(
          R"([{"type":"grating","amplitude":"10 um","wavelength":"0.25 mm"},{"type":"grating","amplitude":"0.1 mm","wavelength":"2 mm"}])") +
      "}]}");
  // 0.25 mm at 0.1 m/s and 1 kHz: 2.5 samples a wave, between the 2 that alias and the 4 that do not.
  EXPECT_TRUE(has_note(e, "12.5 levels of 20 um and 2.5 samples"));
  EXPECT_TRUE(has_note(e, "faded to"));
  EXPECT_TRUE(has_note(e, "100 levels of 20 um and 20 samples of the shortest wave"));
}

TEST_F(FineScene, WavesAreToldAsTheMappingLaysThem) {
  // Texture coordinates from 0 to 1 over 100 mm x 60 mm: tiles of 200 mm x 60 mm halve waves along x.
  const Experiment halved = good(sheet(texture(millimetre, R"("mapping":{"surface":"uv","tile":[0.2,0.06]})")));
  EXPECT_TRUE(has_note(halved, "grating of 500 um under the stroke"));
  // A plane at right angles to the sheet: u runs out of it.
  const Experiment upright =
      good(sheet(texture(millimetre, R"("mapping":{"surface":"plane","axis":[1,0,0],"reference":[0,1,0]})")));
  EXPECT_TRUE(has_note(upright, "does not change along the surface under the stroke"));
  EXPECT_FALSE(has_note(upright, "levels"));
}

TEST_F(FineScene, WhatCannotCarryGeometryIsNamedAsWritten) {
  const char* wide = R"({"type":"grating","amplitude":"0.2 mm","wavelength":"8 mm","direction":"90 deg"})";
  refused(sheet(texture(wide, R"("mapping":{"surface":"sphere"})")), "texture.mapping.surface", "\"sphere\"");
  refused(formula(R"("sphere","radius":0.03)",
                  texture(R"({"type":"grating","amplitude":"0.2 mm","count":20,"as":"geometry"})")),
          "texture.features", "poles");
}

// ---- friction ----

TEST_F(FineScene, FrictionIsANameOrAnObject) {
  const Experiment plain = good(box(R"("material":{"static_friction":0.5})"));
  EXPECT_FALSE(instance(plain).material.friction_named);
  EXPECT_EQ(instance(plain).material.friction, FrictionLaw{});
  for (const std::string& name : friction_names()) {
    const Experiment e = good(material(R"("friction":")" + name + "\""));
    EXPECT_TRUE(instance(e).material.friction_named);
    EXPECT_EQ(friction_name(instance(e).material.friction.kind), name);
    EXPECT_EQ(good(material(R"("friction":{"law":")" + name + "\"}")).canonical_json, e.canonical_json);
    comes_back(e);
  }
}

TEST_F(FineScene, EveryMemberOfAFrictionLawIsRead) {
  const FrictionLaw karnopp =
      instance(
          good(material(
              R"("friction":{"law":"karnopp","formulation":"literal","stiffness":"0.25 N/mm","break_away":"0.4 N","stick_speed":"6 mm/s","viscosity":0.1})")))
          .material.friction;
  EXPECT_EQ(karnopp.kind, FrictionKind::karnopp);
  EXPECT_EQ(karnopp.formulation, Formulation::literal);
  EXPECT_DOUBLE_EQ(karnopp.stiffness, 250.0);
  EXPECT_DOUBLE_EQ(karnopp.break_away, 0.4);
  EXPECT_DOUBLE_EQ(karnopp.stick_speed, 0.006);
  EXPECT_DOUBLE_EQ(karnopp.viscosity, 0.1);
  const FrictionLaw lugre =
      instance(good(material(R"("friction":{"law":"lugre","damping":2,"stribeck_speed":"20 mm/s"})")))
          .material.friction;
  EXPECT_DOUBLE_EQ(lugre.damping, 2.0);
  EXPECT_DOUBLE_EQ(lugre.stribeck_speed, 0.02);
  EXPECT_DOUBLE_EQ(instance(good(material(R"("friction":{"law":"dahl","exponent":2})"))).material.friction.exponent,
                   2.0);
  EXPECT_DOUBLE_EQ(instance(good(material(R"("friction":{"law":"hayward-armstrong","adhesion":"20 %"})")))
                       .material.friction.adhesion,
                   0.2);
}

TEST_F(FineScene, LayAndMapOfFrictionNeedNoTexture) {
  const Experiment e = good(material(
      R"("lay":{"still_ratio":"50 %","sliding_ratio":0.25,"stiffness_ratio":0.4,"formulation":"literal","direction":"90 deg"},
         "friction_map":{"image":"map.png","low":0.5,"high":2,"tile":["8 mm","4 mm"]})"));
  EXPECT_DOUBLE_EQ(fine(e).lay.still_ratio, 0.5);
  EXPECT_DOUBLE_EQ(fine(e).lay.sliding_ratio, 0.25);
  EXPECT_DOUBLE_EQ(fine(e).lay.stiffness_ratio, 0.4);
  EXPECT_EQ(fine(e).lay.formulation, Formulation::literal);
  EXPECT_NEAR(fine(e).lay.direction.value_or(0.0), pi / 2.0, 1e-15);
  EXPECT_EQ(fine(e).friction_map.tile, Vec2(0.008, 0.004));
  EXPECT_NEAR(fine(e).friction_map.factors->lowest(), 0.5, 1e-6);
  EXPECT_NEAR(fine(e).friction_map.factors->highest(), 2.0, 1e-6);
  EXPECT_FALSE(instance(e).fine->has_texture());
  comes_back(e);
  // Black may be the rougher one, and a formula may be the map; the texture's mapping lays it.
  const Experiment turned = good(box(
      R"("texture":{"mapping":{"surface":"cylinder"}},"material":{"static_friction":0.5,"friction_map":{"image":{"generator":"H_2","size":64},"low":1,"high":0.25,"tile":"8 mm"}})"));
  EXPECT_NEAR(fine(turned).friction_map.factors->lowest(), 0.25, 1e-6);
  EXPECT_NEAR(fine(turned).friction_map.factors->highest(), 1.0, 1e-6);
  EXPECT_EQ(fine(turned).mapping.settings().surface, IntermediateSurface::cylinder);
  comes_back(turned);
}

TEST_F(FineScene, FrictionThatResistsNothingIsSaid) {
  for (const std::string& name : friction_names()) {
    EXPECT_TRUE(has_note(good(box(R"("material":{"friction":")" + name + "\"}")), "resists nothing")) << name;
    const Experiment resists = good(material(R"("friction":")" + name + "\""));
    EXPECT_EQ(has_note(resists, "resists nothing"), name == "viscous") << name;
    const bool unread = name == "coulomb" || name == "dahl" || name == "hayward-armstrong";
    EXPECT_EQ(has_note(resists, "does not read the static_friction"), unread) << name;
    EXPECT_EQ(has_note(resists, "reads neither"), name == "viscous") << name;
  }
  EXPECT_TRUE(has_note(good(box(R"("material":{"lay":{"still_ratio":0.5}})")), "the lay resists nothing"));
  for (const std::string& name : friction_names()) {
    const bool springless = name == "coulomb" || name == "viscous";
    EXPECT_EQ(has_note(good(material(R"("lay":{"stiffness_ratio":0.5},"friction":")" + name + "\"")),
                       "does not read the stiffness_ratio"),
              springless)
        << name;
  }
  EXPECT_FALSE(has_note(good(box(R"("material":{"friction":{"law":"karnopp","break_away":1}})")), "resists nothing"));
}

TEST_F(FineScene, FrictionRefusesWhatIsWrong) {
  const auto friction = [&](const std::string& members, const std::string& key, const std::string& part = {}) {
    refused(material(members), "material." + key, part);
  };
  friction(R"("friction":"karnop")", "friction", "did you mean \"karnopp\"");
  friction(R"("friction":3)", "friction", "is a number");
  friction(R"("friction":{})", "friction.law", "is missing");
  friction(R"("friction":{"law":"dahl","stick_speed":0.1})", "friction.stick_speed", "by the friction law \"dahl\"");
  friction(R"("friction":{"law":"dahl","formulation":"literal"})", "friction.formulation");
  friction(R"("friction":{"law":"karnopp","stiffness":-1})", "friction.stiffness");
  friction(R"("friction":{"law":"karnopp","stick_speed":0})", "friction.stick_speed", "above 0");
  friction(R"("friction":{"law":"dahl","exponent":9})", "friction.exponent");
  friction(R"("friction":{"law":"hayward-armstrong","adhesion":1})", "friction.adhesion");
  friction(R"("friction":{"law":"coulomb","formulation":"literal","stick_speed":0.1})", "friction.stick_speed");
  friction(R"("lay":{"still_ratio":1.5})", "lay.still_ratio", "0 to 1");
  friction(R"("lay":{"sliding_ratio":-0.5})", "lay.sliding_ratio", "0 to 1");
  friction(R"("lay":{"stiffness_ratio":0})", "lay.stiffness_ratio", "0.01 to 1");
  friction(R"("lay":0.5)", "lay");
  friction(R"("friction_map":{"tile":0.01})", "friction_map.image", "is missing");
  friction(R"("friction_map":{"image":"map.png"})", "friction_map.tile", "is missing");
  friction(R"("friction_map":{"image":"map.png","tile":0})", "friction_map.tile", "above 0");
  friction(R"("friction_map":{"image":"map.png","tile":0.01,"low":-1})", "friction_map.low");
  friction(R"("friction_map":{"image":"nowhere.png","tile":0.01})", "friction_map.image");
}

// ---- built-in scenes ----

TEST_F(FineScene, BuiltInScenesAreTouched) {
  for (const char* name : {"smooth-plane", "gratings-5mm", "gratings-2.5mm", "vase", "ramp", "stick-slip",
                           "stick-slip-2", "anisotropic", "features-by-scale"}) {
    const Result<std::string> json = builtin_scene_json(name);
    ASSERT_TRUE(json.ok()) << name;
    const Experiment e = good(*json);
    EXPECT_EQ(e.name, name);
    const Seconds dt(2.0 / e.rate);
    ProxyState state;
    ProxyCache cache;
    int touching = 0;
    int asked = 0;
    for (Seconds time{0.0}; time < e.path.contact_end() && asked < 400; time += dt) {
      const StrokePose pose = e.path.pose(time);
      ProbeSample probe;
      // A stroke that presses has no depth of its own.
      const bool pressed = e.path.normal_force() > 0.0 && pose.phase == StrokePhase::contact;
      probe.pose.position = pose.target - (pressed ? 5e-4 : 0.0) * pose.normal;
      probe.twist.linear = pose.velocity;
      const ForceSample force = step(e.scene, state, cache, probe, dt);
      ASSERT_TRUE(force.wrench.force.allFinite()) << name;
      if (pose.phase != StrokePhase::contact) continue;
      ++asked;
      if (force.wrench.force.norm() > 0.05) ++touching;
    }
    ASSERT_GT(asked, 100) << name;
    EXPECT_GT(touching, asked * 9 / 10) << name;
  }
}

/// Runs a stroke and shows every tick of its contact: how far along (0 to 1), where, and what is felt.
template <class Visit>
void follow(const Experiment& e, Visit&& visit) {
  ProxyState state;
  ProxyCache cache;
  const Seconds begin = e.path.contact_begin();
  const Seconds span = e.path.contact_end() - begin;
  for (Seconds time{0.0}; time < e.path.contact_end(); time += Seconds(1.0 / e.rate)) {
    const StrokePose pose = e.path.pose(time);
    ProbeSample probe;
    probe.pose.position = pose.target;
    probe.twist.linear = pose.velocity;
    const ForceSample force = step(e.scene, state, cache, probe, Seconds(1.0 / e.rate));
    if (time > begin) visit((time - begin) / span, pose, force);
  }
}

/// Range of the texture force along a stroke (N), over the part of it between two shares.
std::pair<double, double> lateral_range(const Experiment& e, double from, double to) {
  std::pair<double, double> range{infinity, -infinity};
  follow(e, [&](double share, const StrokePose& pose, const ForceSample& force) {
    if (share < from || share > to) return;
    const double lateral = force.parts.texture.dot(pose.tangent);
    range = {std::min(range.first, lateral), std::max(range.second, lateral)};
  });
  return range;
}

TEST_F(FineScene, ShorterGratingsPushHarder) {
  // Row Y-4: twice the slope at half the wavelength.
  const auto wide = lateral_range(good(*builtin_scene_json("gratings-5mm")), 0.3, 0.6);
  const auto narrow = lateral_range(good(*builtin_scene_json("gratings-2.5mm")), 0.3, 0.6);
  EXPECT_GT(wide.second, 0.05);
  EXPECT_NEAR((narrow.second - narrow.first) / (wide.second - wide.first), 2.0, 0.02);
}

TEST_F(FineScene, TheLayIsFeltByDirection) {
  // Row Y-8: 0.6 N x 0.4 x (1 - angle / 90 degrees), in the middle of each stroke.
  const double expected[] = {0.24, 0.16, 0.08, 0.0};
  const Experiment e = good(*builtin_scene_json("anisotropic"));
  int seen[] = {0, 0, 0, 0};
  follow(e, [&](double share, const StrokePose&, const ForceSample& force) {
    const auto stroke = static_cast<std::size_t>(std::min(3.0, 4.0 * share));
    if (std::abs(4.0 * share - static_cast<double>(stroke) - 0.6) > 0.2) return;
    ++seen[stroke];
    EXPECT_NEAR(force.parts.friction.norm(), expected[stroke], 0.004) << "stroke " << stroke;
  });
  for (const int ticks : seen) EXPECT_GT(ticks, 100);
}

}  // namespace
}  // namespace asperity::fine_scene_test
