// Volumes, isosurfaces, their laws and field effects in scene files.

#include <bit>
#include <cstring>

#include "asperity/field/brick/file.h"
#include "asperity/field/volume/derived_fields.h"
#include "asperity/field/volume/generators.h"
#include "asperity/io/volume_io.h"
#include "tests/io/experiment_fixture.h"

namespace asperity::volume_scene_test {
namespace {

class VolumeScene : public ExperimentTest {
 protected:
  void SetUp() override {
    ExperimentTest::SetUp();
    // A ball of radius 1.5 around (3, 2.25, 2.25): 1.5 - distance, on 9 x 7 x 7 nodes.
    std::vector<float> ball;
    std::vector<float> flow;
    for (int k = 0; k < 7; ++k) {
      for (int j = 0; j < 7; ++j) {
        for (int i = 0; i < 9; ++i) {
          const Vec3 p(0.75 * i, 0.75 * j, 0.75 * k);
          ball.push_back(static_cast<float>(1.5 - (p - Vec3(3.0, 2.25, 2.25)).norm()));
          // Solid rotation about z at 2 rad/s, with a sheared stream along z. Differences of second order are exact.
          const double stream = 0.1 * p.x() * p.x() + 0.5 * p.x();
          flow.insert(flow.end(),
                      {static_cast<float>(-2.0 * p.y()), static_cast<float>(2.0 * p.x()), static_cast<float>(stream)});
        }
      }
    }
    write_raw("ball.raw", ball);
    write_raw("flow.raw", flow);
    write("ball.json", sidecar("ball.raw", 1));
    write("flow.json", sidecar("flow.raw", 3));
  }
  void write_raw(const std::string& name, const std::vector<float>& values) const {
    std::string bytes(values.size() * sizeof(float), '\0');
    std::memcpy(bytes.data(), values.data(), bytes.size());
    write(name, bytes);
  }
  static std::string sidecar(const std::string& file, int components) {
    return R"({"asperity_volume":1,"file":")" + file +
           R"(","size":[9,7,7],"type":"float32","byte_order":"little","spacing":[0.75,0.75,0.75],"components":)" +
           std::to_string(components) + "}";
  }
  static const IsoSurface& iso(const Experiment& experiment, std::size_t index = 0) {
    return *iso_of(experiment.scene.instances()[index].surface);
  }
  /// The error that a scene is expected to have.
  [[nodiscard]] Error bad(const std::string& json) const {
    const Result<Experiment> result = parse(json);
    if (result) throw std::runtime_error("accepted: " + json);
    return result.error();
  }
};

TEST_F(VolumeScene, AVolumeIsFittedToTheWorkspaceAndSaysSo) {
  const Experiment e = good(R"({"surfaces":[{"volume":"ball.json"}],"device":"phantom-desktop"})");
  const IsoSurface& surface = iso(e);
  EXPECT_NEAR(surface.field().bounds().extent().maxCoeff(), e.device.workspace_radius, 1e-12);
  EXPECT_NEAR(surface.field().bounds().centre().norm(), 0.0, 1e-12);
  EXPECT_TRUE(has_note(e, "its file states no unit"));
  EXPECT_TRUE(has_note(e, "no threshold given"));
  EXPECT_EQ(surface.inside(), Inside::high);
  EXPECT_EQ(e.scene.facts(0).sides, Sides::both);
  EXPECT_EQ(e.scene.instances()[0].name, "ball");
  EXPECT_DOUBLE_EQ(surface.threshold(), otsu_threshold(*surface.field().grid()));
}

// A ball whose top the volume cuts off: over the top the stroke of a point would come in through the volume's border,
// behind the rim, where nobody knows inside from outside. (A probe with a radius meets the rim; its stroke is the
// same.)
TEST_F(VolumeScene, AStrokeThatNobodyHasPlacedMeetsWhatIsThere) {
  std::vector<float> cut;
  for (int k = 0; k < 7; ++k) {
    for (int j = 0; j < 7; ++j) {
      for (int i = 0; i < 9; ++i)
        cut.push_back(static_cast<float>(1.5 - (Vec3(0.75 * i, 0.75 * j, 0.75 * k) - Vec3(3.0, 4.0, 2.25)).norm()));
    }
  }
  write_raw("cut.raw", cut);
  write("cut.json", sidecar("cut.raw", 1));
  const auto contact = [](const Experiment& e) {
    IdealProbe probe = IdealProbe::build(e.path, e.ideal).value();
    ProxyState state;
    ProxyCache cache;
    int all = 0;
    int touched = 0;
    const Seconds dt(1.0 / e.rate);
    while (!probe.finished()) {
      const ProbeSample sample = probe.read();
      const ForceSample force = step(e.scene, state, cache, sample, dt);
      if (e.path.pose(sample.time).phase == StrokePhase::contact) {
        ++all;
        touched += force.flags.has(TickFlag::contact) ? 1 : 0;
      }
      probe.apply(force.wrench.force, dt);
    }
    return static_cast<double>(touched) / all;
  };
  const std::string surface = R"("volume":"cut.json","iso":{"threshold":0,"inside":"high"})";
  const Experiment top =
      good(R"({"surfaces":[{)" + surface +
           R"(}],"stroke":{"start":["30%","100%","50%"],"end":["70%","100%","50%"]},"probe":{"radius":0}})");
  EXPECT_LT(contact(top), 0.25);
  EXPECT_FALSE(has_note(top, "stroke:"));
  for (const auto& [law, stroke] : {std::pair("proxy", "{}"), std::pair("cross-uncross", R"({"normal_force":0.5})"),
                                    std::pair("avila", R"({"normal_force":0.5})")}) {
    SCOPED_TRACE(law);
    const Experiment e = good(R"({"surfaces":[{)" + surface + R"(,"law":")" + law + R"("}],"stroke":)" + stroke + "}");
    EXPECT_GT(contact(e), 0.9);
    // Pressed, a probe finds the rim of the cut.
    EXPECT_TRUE(law != std::string_view("proxy") || has_note(e, "stroke: where it is laid by default"));
    const Experiment again = good(e.canonical_json);
    EXPECT_EQ(again.canonical_json, e.canonical_json);
    EXPECT_EQ(again.stroke.start, e.stroke.start);
  }
  // Whole, it is met over the top, and nothing is said.
  const Experiment whole = good(R"({"surfaces":[{"volume":"ball.json","iso":{"threshold":0}}]})");
  EXPECT_FALSE(has_note(whole, "stroke:"));
  EXPECT_GT(contact(whole), 0.9);
}

TEST_F(VolumeScene, UnitsFitAndPoseAreThoseOfMeshes) {
  const Experiment mm = good(R"({"surfaces":[{"volume":"ball.json","units":"mm","iso":{"threshold":0}}]})");
  EXPECT_NEAR(iso(mm).field().bounds().upper.x(), 0.006, 1e-15);
  EXPECT_NEAR(iso(mm).field().bounds().lower.x(), 0.0, 1e-15);
  const Experiment fitted = good(R"({"surfaces":[{"volume":"ball.json","fit":"8cm","iso":{"threshold":0},
                                                  "pose":{"position":[0.01,0,0]}}]})");
  EXPECT_NEAR(iso(fitted).field().bounds().extent().maxCoeff(), 0.08, 1e-12);
  EXPECT_EQ(fitted.scene.instances()[0].world_from_object.position.x(), 0.01);
  EXPECT_FALSE(has_note(fitted, "states no unit"));
  // The ball's surface is where it was put: radius 1.5 of a box of 6.
  SurfaceCache cache;
  const Foot foot = iso(fitted).view(cache).nearest(Vec3(0.03, 0.0, 0.0), 1.0);
  ASSERT_TRUE(foot.found());
  EXPECT_NEAR(foot.point.x(), 0.02, 0.0005);
}

TEST_F(VolumeScene, ThresholdsAsNumbersAndShares) {
  const Experiment number = good(R"({"surfaces":[{"volume":"ball.json","iso":{"threshold":0.25,"inside":"low"}}]})");
  EXPECT_EQ(iso(number).threshold(), 0.25);
  EXPECT_EQ(iso(number).inside(), Inside::low);
  const Experiment share =
      good(R"({"surfaces":[{"volume":"ball.json","iso":{"threshold":"50 %","threshold_speed":"10 mm/s"}}]})");
  const ScalarField& field = iso(share).field();
  EXPECT_NEAR(iso(share).threshold(), 0.5 * (field.lowest() + field.highest()), 1e-12);
  EXPECT_DOUBLE_EQ(iso(share).threshold_speed(), 0.01);
  for (const char* threshold : {"\"50\"", "\"120 %\"", "\"-1%\"", "\"half\"", "[]", "true", "1e30", "-99"}) {
    const Error error =
        bad(std::string(R"({"surfaces":[{"volume":"ball.json","iso":{"threshold":)") + threshold + "}}]}");
    EXPECT_EQ(error.place, "surfaces[0].iso.threshold") << threshold << ": " << error.message();
  }
}

TEST_F(VolumeScene, SchedulesOfThresholdsAreReadAndTouched) {
  const auto with = [](const std::string& schedule) {
    return R"({"surfaces":[{"volume":"ball.json","iso":{"threshold":"50 %","schedule":)" + schedule + "}}]}";
  };
  const Experiment e = good(with(R"([{"time":"500 ms","threshold":"60 %"},{"time":2,"threshold":0.1}])"));
  const ScalarField& field = iso(e).field();
  ASSERT_EQ(iso(e).schedule().size(), 2U);
  EXPECT_EQ(iso(e).schedule()[0].time.count(), 0.5);
  EXPECT_NEAR(iso(e).schedule()[0].threshold, field.lowest() + 0.6 * (field.highest() - field.lowest()), 1e-12);
  EXPECT_EQ(iso(e).schedule()[1].threshold, 0.1);
  const Experiment again = good(e.canonical_json);
  EXPECT_EQ(again.canonical_json, e.canonical_json);
  EXPECT_EQ(short_run(again, 1500), short_run(e, 1500));
  EXPECT_NE(short_run(e, 1500),
            short_run(good(R"({"surfaces":[{"volume":"ball.json","iso":{"threshold":"50 %"}}]})"), 1500));
  const std::pair<const char*, const char*> refused[] = {
      {"[]", ""},
      {R"([{"threshold":"60 %"}])", "[0].time"},
      {R"([{"time":"1 s"}])", "[0].threshold"},
      {R"([{"time":0,"threshold":"60 %"}])", "[0].time"},
      {R"([{"time":"1 mm","threshold":"60 %"}])", "[0].time"},
      {R"([{"time":1,"threshold":"60 %"},{"time":1,"threshold":"50 %"}])", "[1].time"},
      {R"([{"time":1,"threshold":1e30}])", "[0].threshold"},
      {R"([{"time":1,"treshold":"60 %"}])", "[0].treshold"},
      {R"({"time":1})", ""}};
  for (const auto& [schedule, place] : refused) {
    const Error error = bad(with(schedule));
    EXPECT_EQ(error.place, std::string("surfaces[0].iso.schedule") + place) << schedule << ": " << error.message();
    EXPECT_FALSE(error.accepted.empty()) << schedule;
  }
}

TEST_F(VolumeScene, FieldsAreDerivedInTheFilesUnits) {
  // curl = (0, -(0.2 x + 0.5), 4), u . curl = x, x from 0 to 6; fitting to the workspace does not change them.
  const auto field = [&](const std::string& derive, const std::string& threshold) {
    const Experiment e = good(R"({"surfaces":[{"volume":{"file":"flow.json","derive":")" + derive +
                              R"(","reconstruction":"trilinear"},"iso":{"threshold":)" + threshold + "}}]}");
    EXPECT_NEAR(iso(e).field().bounds().extent().maxCoeff(), e.device.workspace_radius, 1e-12);
    return std::pair(iso(e).field().lowest(), iso(e).field().highest());
  };
  const auto [weakest, strongest] = field("vorticity_magnitude", "4.2");
  EXPECT_NEAR(weakest, std::sqrt(16.0 + 0.25), 1e-5);
  EXPECT_NEAR(strongest, std::sqrt(16.0 + 1.7 * 1.7), 1e-5);
  const auto [least, most] = field("helicity", "3");
  EXPECT_NEAR(least, 0.0, 1e-5);
  EXPECT_NEAR(most, 6.0, 1e-4);
  EXPECT_EQ(bad(R"({"surfaces":[{"volume":{"file":"ball.json","derive":"helicity"}}]})").place,
            "surfaces[0].volume.derive");
  const Experiment slope =
      good(R"({"surfaces":[{"volume":{"file":"ball.json","derive":"gradient_magnitude"},"iso":{"threshold":"50%"}}]})");
  EXPECT_NEAR(iso(slope).field().highest(), 1.0, 0.2);
}

TEST_F(VolumeScene, VectorsNeedAComponentOrADerivative) {
  const Error error = bad(R"({"surfaces":[{"volume":"flow.json"}]})");
  EXPECT_EQ(error.place, "surfaces[0].volume");
  EXPECT_NE(error.accepted.find("vorticity_magnitude"), std::string::npos);
  const Experiment x = good(R"({"surfaces":[{"volume":{"file":"flow.json","component":"x"},"iso":{"threshold":-4}}]})");
  EXPECT_NEAR(iso(x).field().lowest(), -9.0, 1e-6);
  const Experiment second =
      good(R"({"surfaces":[{"volume":{"file":"flow.json","component":1},"iso":{"threshold":4}}]})");
  EXPECT_NEAR(iso(second).field().highest(), 12.0, 1e-6);
  const Experiment size =
      good(R"({"surfaces":[{"volume":{"file":"flow.json","component":"magnitude"},"iso":{"threshold":4}}]})");
  EXPECT_NEAR(iso(size).field().highest(), std::sqrt(144.0 + 81.0 + 6.6 * 6.6), 1e-4);
  EXPECT_EQ(bad(R"({"surfaces":[{"volume":{"file":"ball.json","component":"x"}}]})").place,
            "surfaces[0].volume.component");
}

TEST_F(VolumeScene, GeneratorsTakeTheirOwnKeys) {
  const Experiment e = good(R"({"surfaces":[{"volume":{"generator":"sphere","size":[24,24,24],"radius":"30mm",
                                "extent":["10cm","10cm","10cm"]},"iso":{"threshold":0}}]})");
  EXPECT_NEAR(iso(e).field().bounds().upper.x(), 0.05, 1e-12);
  SurfaceCache cache;
  const Foot foot = iso(e).view(cache).nearest(Vec3(0.04, 0.0, 0.0), 1.0);
  ASSERT_TRUE(foot.found());
  EXPECT_NEAR(foot.point.norm(), 0.03, 0.0003);
  const Experiment cavity = good(R"({"surfaces":[{"volume":{"generator":"cavity","size":[24,16,16],
                                     "derive":"vorticity_magnitude"},"iso":{"threshold":"30%"}}]})");
  EXPECT_GT(iso(cavity).field().highest(), 0.0);
  EXPECT_EQ(bad(R"({"surfaces":[{"volume":{"generator":"sphere","wavelength":1}}]})").code, ErrorCode::bad_key);
  EXPECT_EQ(bad(R"({"surfaces":[{"volume":{"generator":"spere"}}]})").place, "surfaces[0].volume.generator");
  EXPECT_EQ(bad(R"({"surfaces":[{"volume":{"generator":"sphere","size":[1,24,24]}}]})").place,
            "surfaces[0].volume.size[0]");
  EXPECT_EQ(bad(R"({"surfaces":[{"volume":{"generator":"sphere"},"units":"mm"}]})").place, "surfaces[0].units");
  EXPECT_EQ(bad(R"({"surfaces":[{"volume":{"file":"ball.json","radius":1}}]})").place, "surfaces[0].volume.radius");
}

TEST_F(VolumeScene, KeysOfMeshesAreRefusedBesideAVolume) {
  for (const char* key : {R"("mesh":"sphere.ply")", R"("coat":{})", R"("up":"z")", R"("search":"bvh")",
                          R"("on_overlap":"cure")", R"("shell_directions":"relaxed")"}) {
    const Error error = bad(std::string(R"({"surfaces":[{"volume":"ball.json",)") + key + "}]}");
    EXPECT_EQ(error.code, ErrorCode::bad_key) << key;
    EXPECT_NE(error.what.find("beside a volume"), std::string::npos) << error.message();
  }
  EXPECT_EQ(bad(R"({"surfaces":[{"mesh":"sphere.ply","iso":{}}]})").place, "surfaces[0].iso");
  EXPECT_EQ(bad(R"({"surfaces":[{"volume":{"file":"ball.json","residency":"64 MB"}}]})").place,
            "surfaces[0].volume.residency");
}

TEST_F(VolumeScene, BrickedFilesTakeAResidencyAndNoUnits) {
  write("a.aspvol", "not one");
  const auto scene = [](const std::string& words, const std::string& beside = {}) {
    return R"({"surfaces":[{"volume":{"file":"a.aspvol")" + words + "}" + beside + "}]}";
  };
  EXPECT_NE(bad(scene("")).file.find("a.aspvol"), std::string::npos);
  const std::size_t size = 24;
  std::vector<float> ramp(size * size * size);
  for (std::size_t i = 0; i < ramp.size(); ++i) ramp[i] = static_cast<float>(i / (size * size));
  const Result<GridAxis> axis = GridAxis::uniform(0.0, 0.001, size);
  ASSERT_TRUE(axis.ok());
  Result<ScalarGrid> grid = ScalarGrid::build({*axis, *axis, *axis}, std::move(ramp), "ramp");
  ASSERT_TRUE(grid.ok() && write_brick_file(folder_ / "a.aspvol", *grid).ok());
  const Experiment bricked = good(scene(R"(,"residency":"64 MB")", R"(,"iso":{"threshold":7.5})"));
  ASSERT_NE(iso(bricked).field().bricks(), nullptr);
  EXPECT_NEAR(iso(bricked).surface_bounds().centre().z(), 0.0075, 0.001);
  EXPECT_EQ(good(bricked.canonical_json).canonical_json, bricked.canonical_json);
  EXPECT_EQ(bad(scene("", R"(,"units":"mm")")).place, "surfaces[0].units");
  EXPECT_EQ(bad(scene("", R"(,"fit":"none")")).place, "surfaces[0].fit");
  EXPECT_EQ(bad(scene(R"(,"array":"a")")).place, "surfaces[0].volume.array");
  for (const char* text : {R"("64 XB")", R"("MB")", "0", "-1", "[]", R"("1 kB")"})
    EXPECT_EQ(bad(scene(std::string(R"(,"residency":)") + text)).place, "surfaces[0].volume.residency") << text;
}

TEST_F(VolumeScene, LawsOfIsosurfaces) {
  const auto law = [&](const std::string& json) {
    return good(R"({"surfaces":[{"volume":"ball.json","iso":{"threshold":0},"law":)" + json + "}]}")
        .scene.instances()[0]
        .law;
  };
  const Law layer =
      law(R"({"type":"avila","formulation":"literal","band":0.5,"largest_force":"2 N","retarding":0.25})");
  const auto* avila = layer.as<AvilaLaw>();
  ASSERT_NE(avila, nullptr);
  EXPECT_EQ(avila->formulation, Formulation::literal);
  EXPECT_EQ(avila->band, 0.5);
  EXPECT_EQ(avila->largest_force, 2.0);
  EXPECT_EQ(avila->retarding, 0.25);
  const Law crossing = law(R"({"type":"cross-uncross-literal","retarding":0.5,"reach":"4mm"})");
  const auto* cross = crossing.as<CrossUncrossLaw>();
  ASSERT_NE(cross, nullptr);
  EXPECT_EQ(cross->formulation, Formulation::literal);
  EXPECT_DOUBLE_EQ(cross->reach, 0.004);
  EXPECT_TRUE(law(R"("cross-uncross")").is<CrossUncrossLaw>());
  const auto wrong = [&](const std::string& json) {
    return bad(R"({"surfaces":[{"volume":"ball.json","iso":{"threshold":0},"law":)" + json + "}]}").place;
  };
  EXPECT_EQ(wrong(R"({"type":"avila","reach":1})"), "surfaces[0].law.reach");
  EXPECT_EQ(wrong(R"({"type":"cross-uncross","reach":1})"), "surfaces[0].law.reach");
  EXPECT_EQ(wrong(R"({"type":"avila","largest_force":0})"), "surfaces[0].law.largest_force");
  EXPECT_EQ(wrong(R"({"type":"proxy","band":1})"), "surfaces[0].law.band");
  EXPECT_EQ(wrong(R"("height-field")"), "surfaces[0].law");
  EXPECT_EQ(bad(R"({"surfaces":[{"mesh":"sphere.ply","law":"avila"}]})").code, ErrorCode::unsupported_pair);
}

TEST_F(VolumeScene, CanonicalCopiesReadBackAsTheSame) {
  for (const char* json :
       {R"({"surfaces":[{"volume":"ball.json"}]})",
        R"({"surfaces":[{"volume":{"file":"flow.json","derive":"helicity"},"iso":{"threshold":"50 %"},"fit":"5cm",
            "law":{"type":"avila","band":1}}]})",
        R"({"surfaces":[{"volume":{"generator":"gyroid","size":[16,16,16],"wavelength":0.05},"iso":{"threshold":0},
            "law":"cross-uncross-literal"}],"effects":[{"volume":"ball.json","type":"viscosity","transfer":[[0,1]]}]})",
        R"({"effects":[{"volume":{"file":"ball.json","reconstruction":"trilinear"},"type":"iwata","direction":[1,0,0],
            "transfer":[[-1,0],[1,1]]}]})"}) {
    const Experiment first = good(json);
    const Experiment second = good(first.canonical_json);
    EXPECT_EQ(first.canonical_json, second.canonical_json);
    EXPECT_EQ(short_run(first, 200), short_run(second, 200)) << json;
  }
}

TEST_F(VolumeScene, EntriesThatSayTheSameShareOneVolume) {
  const Experiment e = good(R"({"surfaces":[{"volume":"ball.json","iso":{"threshold":0}},
                                            {"volume":"ball.json","iso":{"threshold":0.5}},
                                            {"volume":"ball.json","fit":"2cm","iso":{"threshold":0}}]})");
  EXPECT_EQ(iso(e, 0).shared_field(), iso(e, 1).shared_field());
  EXPECT_NE(iso(e, 0).shared_field(), iso(e, 2).shared_field());
}

TEST_F(VolumeScene, EffectsAreReadWithTheirKeys) {
  const Experiment e = good(R"({"effects":[
      {"volume":"ball.json","type":"viscosity","transfer":[[-1,0],[0,2],[1,3]],"name":"honey","largest_force":"1 N"},
      {"volume":"ball.json","type":"pao","formulation":"literal","transfer":[[0,1]]},
      {"volume":"ball.json","type":"gravity-scalars","value":0.5,"transfer":[[0,0],[1,1]]},
      {"volume":"ball.json","type":"iwata","direction":[0,0,2],"transfer":[[0,1]],"pose":{"position":[0,0.01,0]}}]})");
  ASSERT_EQ(e.scene.effects().size(), 4U);
  EXPECT_TRUE(e.scene.instances().empty());
  const FieldEffect& honey = e.scene.effects()[0];
  EXPECT_EQ(honey.name, "honey");
  EXPECT_EQ(honey.kind, FieldEffectKind::viscosity);
  EXPECT_DOUBLE_EQ(honey.transfer(-0.5), 1.0);
  EXPECT_EQ(honey.largest_force, 1.0);
  EXPECT_EQ(e.scene.effects()[1].formulation, Formulation::literal);
  EXPECT_EQ(e.scene.effects()[2].value, 0.5);
  EXPECT_EQ(e.scene.effects()[3].direction, Vec3::UnitZ());
  EXPECT_EQ(e.scene.effects()[3].world_from_object.position.y(), 0.01);
  EXPECT_EQ(e.scene.effects()[0].field, e.scene.effects()[1].field);
}

TEST_F(VolumeScene, EffectsThatAreWrongAreRefused) {
  const auto place = [&](const std::string& rest) {
    return bad(R"({"effects":[{"volume":"ball.json",)" + rest + "}]}").place;
  };
  EXPECT_EQ(place(R"("transfer":[[0,1]])"), "effects[0].type");
  EXPECT_EQ(place(R"("type":"viscous","transfer":[[0,1]])"), "effects[0].type");
  EXPECT_EQ(place(R"("type":"viscosity")"), "effects[0].transfer");
  EXPECT_EQ(place(R"("type":"viscosity","transfer":[])"), "effects[0].transfer");
  EXPECT_EQ(place(R"("type":"viscosity","transfer":[[0,1],[0,2]])"), "effects[0].transfer[1]");
  EXPECT_EQ(place(R"("type":"viscosity","transfer":[[0]])"), "effects[0].transfer[0]");
  EXPECT_EQ(place(R"("type":"viscosity","transfer":[["a",1]])"), "effects[0].transfer[0][0]");
  EXPECT_EQ(place(R"("type":"viscosity","transfer":[[0,1]],"direction":[1,0,0])"), "effects[0].direction");
  EXPECT_EQ(place(R"("type":"iwata","transfer":[[0,1]],"direction":[0,0,0])"), "effects[0].direction");
  EXPECT_EQ(place(R"("type":"iwata","transfer":[[0,1]],"value":1)"), "effects[0].value");
  EXPECT_EQ(place(R"("type":"gradient","transfer":[[0,1]],"largest_force":0)"), "effects[0].largest_force");
  EXPECT_EQ(place(R"("type":"gradient","transfer":[[0,1]],"formulation":"literal")"), "effects[0].formulation");
  EXPECT_EQ(bad(R"({"effects":[]})").place, "surfaces");
  EXPECT_EQ(bad(R"({"effects":{}})").place, "effects");
  EXPECT_EQ(bad(R"({"effects":[{"type":"viscosity","transfer":[[0,1]]}]})").place, "effects[0].volume");
}

TEST_F(VolumeScene, FilesThatAreWrongAreNamed) {
  EXPECT_NE(bad(R"({"surfaces":[{"volume":"absent.json"}]})").file.find("absent.json"), std::string::npos);
  EXPECT_EQ(bad(R"({"surfaces":[{"volume":{"file":"ball.json","array":"bal"}}]})").code, ErrorCode::bad_value);
  EXPECT_EQ(bad(R"({"surfaces":[{"volume":{}}]})").place, "surfaces[0].volume.file");
  EXPECT_EQ(bad(R"({"surfaces":[{"volume":7}]})").place, "surfaces[0].volume");
  EXPECT_EQ(bad(R"({"surfaces":[{}]})").place, "surfaces[0].mesh");
}

TEST_F(VolumeScene, AnIsosurfaceIsTouched) {
  for (const char* law : {"proxy", "avila", "cross-uncross"}) {
    const Experiment e = good(std::string(R"({"surfaces":[{"volume":{"generator":"sphere","size":[32,32,32]},
                                "iso":{"threshold":0},"law":")") +
                              law + R"("}],"stroke":{"depth":"1mm"}})");
    ProxyState state;
    ProxyCache cache;
    double strongest = 0.0;
    for (int i = 0; i < 400; ++i) {
      // Straight down into the ball.
      const double y = 0.036 - 1e-5 * i;
      ProbeSample probe;
      probe.pose.position = Vec3(0.0, y, 0.0);
      probe.twist.linear = Vec3(0.0, -0.01, 0.0);
      strongest = std::max(strongest, step(e.scene, state, cache, probe, Seconds(1e-3)).wrench.force.norm());
    }
    EXPECT_GT(strongest, 0.5) << law;
  }
}

}  // namespace
}  // namespace asperity::volume_scene_test
