// Scene files: defaults, what each key does, built-in scenes, the canonical copy.

#include <nlohmann/json.hpp>
#include <set>

#include "asperity/field/conversion/mesh_conversion.h"
#include "asperity/render/law_registry.h"
#include "tests/io/experiment_fixture.h"

namespace asperity::experiment_scene_test {
namespace {

using Json = nlohmann::ordered_json;

class ExperimentScene : public ExperimentTest {};

TEST_F(ExperimentScene, AMeshAloneIsAScene) {
  const Experiment e = good(R"({"surfaces":[{"mesh":"sphere.ply"}]})");
  ASSERT_EQ(e.scene.instances().size(), 1u);
  EXPECT_EQ(e.name, "scene");
  EXPECT_EQ(e.scene.instances()[0].name, "sphere");
  EXPECT_EQ(e.device.name, "phantom-desktop");
  EXPECT_EQ(law_name(e.scene.instances()[0].law), "proxy");
  EXPECT_EQ(e.scene.facts(0).sides, Sides::front);
  EXPECT_EQ(e.scene.instances()[0].material.stiffness, 1000.0);
  // 6 units across become the workspace radius of 0.1 m, around the origin, and a note says so.
  const Box& bounds = base_mesh(e.scene.instances()[0].surface).bounds();
  EXPECT_NEAR(bounds.extent().maxCoeff(), 0.1, 1e-12);
  EXPECT_NEAR(bounds.centre().norm(), 0.0, 1e-12);
  EXPECT_TRUE(has_note(e, "states no unit"));
  EXPECT_EQ(e.stroke.type, StrokeType::line);
}

TEST_F(ExperimentScene, UnitsAndFitDecideTheSize) {
  const auto extent = [&](const std::string& keys) {
    const Experiment e = good(R"({"surfaces":[{"mesh":"sphere.ply")" + keys + "}]}");
    EXPECT_FALSE(has_note(e, "states no unit"));
    return base_mesh(e.scene.instances()[0].surface).bounds().extent().maxCoeff();
  };
  EXPECT_NEAR(extent(R"(,"units":"cm")"), 0.06, 1e-12);
  EXPECT_NEAR(extent(R"(,"units":"in")"), 6.0 * 0.0254, 1e-12);
  EXPECT_NEAR(extent(R"(,"fit":"none")"), 6.0, 1e-12);
  EXPECT_NEAR(extent(R"(,"fit":"50 mm")"), 0.05, 1e-12);
  EXPECT_NEAR(extent(R"(,"units":"mm","fit":0.02)"), 0.02, 1e-12);
}

TEST_F(ExperimentScene, TheUpAxisTurnsExactly) {
  // A flat sheet stays exactly flat whichever way it is turned, and its normals point to +y.
  for (const char* up : {"x", "y", "z", "-x", "-y", "-z"}) {
    const Experiment e =
        good(std::string(R"({"surfaces":[{"mesh":{"generator":"box","size":[0.01,0.02,0.03]},"up":")") + up + "\"}]}");
    const TriangleMesh& mesh = base_mesh(e.scene.instances()[0].surface);
    EXPECT_GT(mesh.report().signed_volume, 0.0) << up;
    const int axis = up[up[0] == '-' ? 1 : 0] - 'x';
    const double sizes[] = {0.01, 0.02, 0.03};
    EXPECT_DOUBLE_EQ(mesh.bounds().extent().y(), sizes[axis]) << up;
  }
  const Experiment sheet = good(R"({"surfaces":[{"mesh":{"generator":"M_a"}}]})");
  const TriangleMesh& mesh = base_mesh(sheet.scene.instances()[0].surface);
  for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face)
    ASSERT_EQ(mesh.face_normal(face), Vec3(0.0, 1.0, 0.0));
}

TEST_F(ExperimentScene, ThePosePlacesAndTurns) {
  const Experiment e = good(
      R"({"surfaces":[{"mesh":{"generator":"box"},"pose":{"position":["10mm",0,0],"axis":[0,0,2],"angle":"90deg"}}]})");
  const Pose& pose = e.scene.instances()[0].world_from_object;
  EXPECT_NEAR((pose.apply(Vec3(1.0, 0.0, 0.0)) - Vec3(0.01, 1.0, 0.0)).norm(), 0.0, 1e-12);
  const Experiment q = good(R"({"surfaces":[{"mesh":{"generator":"box"},"pose":{"orientation":[2,0,0,0]}}]})");
  EXPECT_EQ(q.scene.instances()[0].world_from_object.orientation.w(), 1.0);
}

TEST_F(ExperimentScene, ACoatChoosesItsMappingAndLaw) {
  const Experiment bare =
      good(R"({"surfaces":[{"mesh":"sphere.ply","coat":{"height_map":"map.png","height":"1mm"}}]})");
  EXPECT_EQ(coat_of(bare).settings().mapping, Mapping::triplanar);
  EXPECT_EQ(law_name(bare.scene.instances()[0].law), "proxy");
  EXPECT_NEAR(coat_of(bare).maps().tile().x(), 0.025, 1e-12);   // a quarter of the object
  EXPECT_NEAR(coat_of(bare).maps().tile().y(), 0.0125, 1e-12);  // square pixels of a 16 x 8 map
  EXPECT_TRUE(has_note(bare, "triplanar"));
  const Experiment mapped =
      good(R"({"surfaces":[{"mesh":"sheet.obj","coat":{"height_map":"map.png","height":"1mm"}}]})");
  EXPECT_EQ(coat_of(mapped).settings().mapping, Mapping::uv);
}

TEST_F(ExperimentScene, HeightsAreReadInEveryWay) {
  const auto heights = [&](const std::string& keys) {
    const Experiment e =
        good(R"({"surfaces":[{"mesh":"sphere.ply","coat":{"filter":"nearest","height_map":"map.png",)" + keys + "}}]}");
    return std::pair(coat_of(e).lowest(), coat_of(e).highest());
  };
  const auto expect_range = [&](const std::string& keys, double low, double high) {
    const auto [lowest, highest] = heights(keys);
    EXPECT_NEAR(lowest, low, 1e-9) << keys;
    EXPECT_NEAR(highest, high, 1e-9) << keys;
  };
  expect_range(R"("height":"2mm")", 0.0, 2e-3);
  expect_range(R"("height":"2mm","offset":"-0.5mm")", -0.5e-3, 1.5e-3);
  expect_range(R"("height":"2mm","white_is":"deep")", -2e-3, 0.0);
  expect_range(R"("height_range":["-1mm",0.0005])", -1e-3, 0.5e-3);
  expect_range(R"("height_range":["-1mm",0.0005],"white_is":"deep")", -1e-3, 0.5e-3);
  expect_range(R"("height":"20um","offset":"10um","magnify":100)", 1e-3, 3e-3);
  const Experiment plain = good(R"({"surfaces":[{"mesh":"sphere.ply"}]})");
  const double edge = base_mesh(plain.scene.instances()[0].surface).mean_edge();
  expect_range(R"("height":"10%")", 0.0, 0.1 * edge);
}

TEST_F(ExperimentScene, ASidecarGivesTheScale) {
  const std::string scene =
      R"({"surfaces":[{"mesh":"sphere.ply","coat":{"height_map":"map.png","filter":"nearest","magnify":1000}}]})";
  write("map.json", R"({"width":16,"height":8,"pixel_size_m":[2e-6,1e-6],"height_min_m":-1e-6,"height_max_m":2e-6})");
  const Experiment e = good(scene);
  EXPECT_NEAR(coat_of(e).lowest(), -1e-3, 1e-9);
  EXPECT_NEAR(coat_of(e).highest(), 2e-3, 1e-9);
  EXPECT_NEAR(coat_of(e).maps().tile().x(), 32e-3, 1e-12);
  EXPECT_NEAR(coat_of(e).maps().tile().y(), 8e-3, 1e-12);
  EXPECT_TRUE(has_note(e, "map.json"));
  // Its numbers are in the canonical copy, so the copy does not need it.
  std::filesystem::remove(folder_ / "map.json");
  EXPECT_EQ(short_run(good(e.canonical_json), 500), short_run(e, 500));
  write("map.json", R"({"width":17,"height":8,"pixel_size_m":[2e-6,1e-6],"height_min_m":-1e-6,"height_max_m":2e-6})");
  const Result<Experiment> wrong = parse(scene);
  ASSERT_FALSE(wrong.ok());
  EXPECT_EQ(wrong.error().code, ErrorCode::mismatch);
  EXPECT_NE(wrong.error().message().find("16 x 8"), std::string::npos) << wrong.error().message();
  write("map.json", R"({"colour":"grey"})");
  EXPECT_TRUE(parse(scene).ok());
}

TEST_F(ExperimentScene, AFlatNormalMapUnderARampIsNoted) {
  const Experiment e = good(
      R"({"surfaces":[{"mesh":"sheet.obj","coat":{"height_map":{"generator":"H_3","size":64},"height":"1mm","normal_map":"normal.png"}}]})");
  EXPECT_TRUE(coat_of(e).maps().has_normal_map());
  EXPECT_TRUE(has_note(e, "normal"));
}

TEST_F(ExperimentScene, ATallReliefIsNoted) {
  EXPECT_TRUE(has_note(good(R"({"surfaces":[{"mesh":"sphere.ply","coat":{"height_map":"map.png","height":"60%"}}]})"),
                       "mean edge"));
  EXPECT_FALSE(has_note(good(R"({"surfaces":[{"mesh":"sphere.ply","coat":{"height_map":"map.png","height":"5%"}}]})"),
                        "mean edge"));
}

TEST_F(ExperimentScene, AReliefForWhichTheMeshIsTooCoarseIsNotedFromFifteenPercent) {
  // hrm-2010, 5.4.1: "mesh zones where surface variation exceeds 15% of average edge size are thus candidates for finer
  // remeshing". The reconstruction "nearest" keeps to the map's heights.
  const auto noted = [&](const std::string& height) {
    return has_note(
        good(R"({"surfaces":[{"mesh":"sphere.ply","coat":{"height_map":"map.png","filter":"nearest","height":")" +
             height + R"("}}]})"),
        "mean edge");
  };
  EXPECT_FALSE(noted("14%"));
  EXPECT_FALSE(noted("15%"));
  EXPECT_TRUE(noted("16%"));
  EXPECT_TRUE(noted("20%"));
}

TEST_F(ExperimentScene, DeviceHandAndProbeTakeNamesOrObjects) {
  const Experiment e =
      good(R"({"surfaces":[{"mesh":{"generator":"box"}}],"device":{"profile":"falcon","max_force":"6 N"},
    "hand":{"preset":"firm","mass":"300 g"},"probe":{"kind":"dynamic","radius":"1mm","rate":"2kHz","dynamic":{"tremor":"20um","seed":9}}})");
  EXPECT_EQ(e.device.max_force, 6.0);
  EXPECT_EQ(e.device.max_stiffness, find_profile("falcon")->max_stiffness);
  EXPECT_EQ(e.hand.mass, 0.3);
  EXPECT_EQ(e.hand.stiffness, find_hand("firm")->stiffness);
  EXPECT_EQ(e.probe, ProbeKind::dynamic);
  EXPECT_EQ(e.scene.probe_radius(), 0.001);
  EXPECT_EQ(e.rate, 2000.0);
  EXPECT_NEAR(e.simulated.tremor, 20e-6, 1e-18);
  EXPECT_EQ(e.simulated.seed, 9u);
  const Experiment soft = good(R"({"surfaces":[{"mesh":{"generator":"box"}}],"device":"touch"})");
  EXPECT_EQ(soft.scene.instances()[0].material.stiffness, 400.0);
  EXPECT_EQ(soft.ideal.stiffness_estimate, 400.0);
  EXPECT_TRUE(has_note(
      good(R"({"surfaces":[{"mesh":{"generator":"box"},"material":{"stiffness":900}}],"device":"touch"})"), "900"));
}

TEST_F(ExperimentScene, StrokesTakeSharesOfTheBounds) {
  const Experiment e = good(R"({"surfaces":[{"mesh":{"generator":"box","size":[0.1,0.2,0.3]}}],
    "stroke":{"type":"line","start":["0%","100%","50%"],"end":["10mm",0.1,"75%"],"normal_force":"2 N","speed":"5mm/s"}})");
  EXPECT_NEAR((e.stroke.start - Vec3(-0.05, 0.1, 0.0)).norm(), 0.0, 1e-15);
  EXPECT_NEAR((e.stroke.end - Vec3(0.01, 0.1, 0.075)).norm(), 0.0, 1e-15);
  EXPECT_EQ(e.stroke.press, PressMode::force);
  EXPECT_EQ(e.stroke.normal_force, 2.0);
  const Experiment circle = good(
      R"({"surfaces":[{"mesh":{"generator":"box","size":[0.1,0.2,0.3]}}],"stroke":{"type":"circle","radius":"10%"}})");
  EXPECT_NEAR(circle.stroke.radius, 0.03, 1e-15);
  EXPECT_TRUE(circle.path.closed());
  // Strokes lie on the surface, normals outward.
  for (std::size_t i = 0; i < circle.path.points().size(); ++i) {
    ASSERT_NEAR(circle.path.points()[i].y(), 0.1, 1e-12);
    ASSERT_GT(circle.path.normals()[i].y(), 0.99);
  }
}

TEST_F(ExperimentScene, ARecordedPathIsFollowed) {
  write("path.csv", "time [s],x [mm],y [mm],z [mm]\n0,0,45,0\n0.5,1,39.5,0\n1,2,39.5,0\n");
  const Experiment e =
      good(R"({"surfaces":[{"mesh":{"generator":"icosphere"}}],"stroke":{"type":"recorded","path":"path.csv"}})");
  EXPECT_TRUE(e.path.recorded());
  EXPECT_NEAR(e.path.duration().count(), 1.0, 1e-12);
}

TEST_F(ExperimentScene, LawsTakeNamesOrObjects) {
  const auto law = [&](const std::string& text) {
    return good(R"({"surfaces":[{"mesh":"sheet.obj","coat":{"height_map":{"generator":"H_2"},"height":"1mm"},"law":)" +
                text + "}]}")
        .scene.instances()[0]
        .law;
  };
  EXPECT_EQ(law_name(law("\"height-field-literal\"")), "height-field-literal");
  const Law meso = law(R"({"type":"mesostructure","formulation":"literal","rho":0.1,"blend":"linear"})");
  EXPECT_EQ(law_name(meso), "mesostructure-literal");
  EXPECT_EQ(meso.as<MesostructureLaw>()->rho, 0.1);
  EXPECT_EQ(meso.as<MesostructureLaw>()->blend, Blend::linear);
  EXPECT_EQ(law(R"({"type":"height-field","edge_taper":0.2})").as<HeightFieldLaw>()->edge_taper, 0.2);
  const Law image = law(R"({"type":"mesostructure-literal","blend":{"image":"map.png"}})");
  EXPECT_EQ(image.as<MesostructureLaw>()->blend, Blend::image);
  ASSERT_EQ(image.as<MesostructureLaw>()->blend_map.size(), 16u);
  EXPECT_EQ(image.as<MesostructureLaw>()->blend_map.front(), 0.0);
  EXPECT_NEAR(image.as<MesostructureLaw>()->blend_map.back(), 1.0, 1e-6);
}

TEST_F(ExperimentScene, WithLawChangesEverySurface) {
  const Result<std::string> json = builtin_scene_json("M_a-H_3");
  ASSERT_TRUE(json.ok());
  const Experiment e = good(*json);
  const Result<Experiment> changed = with_law(e, *law_by_name("height-field"));
  ASSERT_TRUE(changed.ok());
  EXPECT_EQ(law_name(changed->scene.instances()[0].law), "height-field");
  EXPECT_EQ(short_run(good(changed->canonical_json), 1500), short_run(*changed, 1500));
  EXPECT_NE(short_run(e, 1500), short_run(*changed, 1500));
  const Result<Experiment> bare =
      with_law(good(R"({"surfaces":[{"mesh":{"generator":"box"}}]})"), *law_by_name("mesostructure"));
  ASSERT_FALSE(bare.ok());
  EXPECT_EQ(bare.error().code, ErrorCode::unsupported_pair);
  EXPECT_EQ(bare.error().place, "surfaces[0].law");
}

TEST_F(ExperimentScene, BuiltinScenesReadAndTouch) {
  ASSERT_GE(builtin_scenes().size(), 9u);
  for (const BuiltinScene& scene : builtin_scenes()) {
    if (scene.name.starts_with("implicit") && !has_mesh_voxelizer()) continue;
    EXPECT_FALSE(scene.summary.empty()) << scene.name;
    const Result<std::string> json = builtin_scene_json(scene.name);
    ASSERT_TRUE(json.ok());
    const Experiment e = good(*json);
    EXPECT_EQ(e.name, scene.name);
    // The hand meets the surface within the first second and a half of every scene.
    ProxyState state;
    ProxyCache cache;
    bool touched = false;
    for (int tick = 0; tick < 1500; ++tick) {
      const StrokePose pose = e.path.pose(Seconds(tick * 1e-3));
      ProbeSample probe;
      probe.pose.position = pose.target;
      probe.twist.linear = pose.velocity;
      const ForceSample force = step(e.scene, state, cache, probe, Seconds(1e-3));
      EXPECT_TRUE(force.wrench.force.allFinite());
      touched = touched || force.flags.has(TickFlag::contact) || force.flags.has(TickFlag::field_force);
    }
    EXPECT_TRUE(touched) << scene.name;
    EXPECT_LT(e.path.duration().count(), 20.0) << scene.name;
  }
}

TEST_F(ExperimentScene, AnUnknownBuiltinSuggests) {
  const Result<std::string> json = builtin_scene_json("icospher");
  ASSERT_FALSE(json.ok());
  EXPECT_NE(json.error().message().find("did you mean \"icosphere\""), std::string::npos) << json.error().message();
}

TEST_F(ExperimentScene, TheCanonicalCopyIsTheSameExperiment) {
  std::vector<std::string> scenes{
      R"({"surfaces":[{"mesh":"sphere.ply"}]})",
      R"({"surfaces":[{"mesh":"sphere.ply","fit":"70mm","up":"-z","pose":{"axis":[1,2,3],"angle":0.7,"position":[0.001,0,0]},
          "coat":{"height_map":"map.png","height":"7%","white_is":"deep","magnify":1.5,"tile":["9mm","7mm"]},"law":"height-field"}],
          "stroke":{"type":"spiral","turns":3}})",
      R"({"surfaces":[{"mesh":"sheet.obj","coat":{"height_map":"map.png","height":"1mm","repeat":[2,3],"normal_map":"normal.png","green":"down"},
          "law":{"type":"mesostructure-literal","blend":{"image":"map.png"},"rho":0.2}}],"stroke":{"type":"raster","rows":3,"normal_force":1}})",
  };
  for (const BuiltinScene& scene : builtin_scenes()) {
    if (!scene.name.starts_with("implicit") || has_mesh_voxelizer()) scenes.push_back(*builtin_scene_json(scene.name));
  }
  for (const std::string& scene : scenes) {
    const Experiment e = good(scene);
    // Every path in it is absolute: it is read from another folder.
    const Result<Experiment> again = parse_experiment(e.canonical_json, "/", "canonical.json");
    ASSERT_TRUE(again.ok()) << again.error().message();
    EXPECT_EQ(again->canonical_json, e.canonical_json);
    EXPECT_EQ(short_run(*again, 1200), short_run(e, 1200)) << scene;
  }
}

TEST_F(ExperimentScene, TheSameSceneInMillimetresFeelsTheSame) {
  // Row "the scene in metres or millimetres feels the same": fit brings both files to the same size.
  MeshSource sphere = icosphere(2, 3.0);
  for (Vec3& p : sphere.positions) p *= 1024.0;  // a power of two keeps every bit
  ASSERT_TRUE(write_ply(folder_ / "large.ply", sphere).ok());
  sphere = icosphere(2, 3.0);
  ASSERT_TRUE(write_ply(folder_ / "small.ply", sphere).ok());
  const std::uint64_t small = short_run(good(R"({"surfaces":[{"mesh":"small.ply"}]})"), 3000);
  const std::uint64_t large = short_run(good(R"({"surfaces":[{"mesh":"large.ply"}]})"), 3000);
  EXPECT_EQ(small, large);
}

// ---- the papers' generators

TEST_F(ExperimentScene, EveryMesostructureIsASceneKeyAway) {
  const auto coat = [&](const std::string& map) {
    return good(R"({"surfaces":[{"mesh":"sheet.obj","coat":{"filter":"nearest","height":"1mm","height_map":)" + map +
                "}}]}");
  };
  const auto expect_range = [&](const std::string& map, double low, double high) {
    const Experiment e = coat(map);
    EXPECT_NEAR(coat_of(e).lowest(), low, 2e-5) << map;
    EXPECT_NEAR(coat_of(e).highest(), high, 2e-5) << map;
    // What was decided is in the canonical copy, and reads back as the same relief.
    const Experiment again = good(e.canonical_json);
    EXPECT_EQ(again.canonical_json, e.canonical_json);
    for (int i = 0; i < 200; ++i) {
      const Vec2 st(0.317 * i, 0.173 * i);
      ASSERT_EQ(coat_of(again).maps().heights().height_at(st), coat_of(e).maps().heights().height_at(st)) << map;
    }
  };
  expect_range(R"({"generator":"H_1","size":500,"count":5,"wall":"20%"})", 0.0, 1e-3);
  expect_range(R"({"generator":"H_2","size":100,"count":5,"width":0.5})", 0.0, 1e-3);
  expect_range(R"({"generator":"H_3","size":400,"number":6,"seed":4})", 0.0, 1e-3);
  expect_range(R"({"generator":"H_3","size":400})", 0.0, 1e-3);
  expect_range(R"({"generator":"H_4","size":400,"number":6,"seed":4,"radius":[0.02,0.1]})", 0.0, 1e-3);
  expect_range(R"({"generator":"H_4","size":400})", 0.0, 1e-3);
  expect_range(R"({"generator":"H_5","size":400})", 0.0, 1e-3);
  expect_range(R"({"generator":"coins","size":400,"number":3,"seed":8,"radius":"20%","rim":0.2,"field":0.3,"flank":"1%",
                   "overlap":0.5})",
               0.0, 1e-3);
  expect_range(R"({"generator":"H_6","size":400,"width":0.1,"flank":0.02,"radius":0.18})", -1e-3, 0.0);
  expect_range(R"({"generator":"H_6","size":400,"width":"2%"})", -1e-3, 0.0);
  expect_range(R"({"generator":"H_7","size":400,"hurst":0.5,"octaves":4,"seed":3})", 0.0, 1e-3);
}

TEST_F(ExperimentScene, MesostructureKeysReachTheFormula) {
  // Each key, one at a time, gives another map than its absence.
  const auto texels = [&](const std::string& map) {
    const Experiment e = good(
        R"({"surfaces":[{"mesh":"sheet.obj","coat":{"filter":"nearest","height":"1mm","height_map":)" + map + "}}]}");
    std::vector<double> heights;
    for (int y = 0; y < 96; ++y) {
      for (int x = 0; x < 96; ++x) {
        heights.push_back(coat_of(e).maps().heights().height_at(Vec2((x + 0.5) / 96.0, (y + 0.5) / 96.0)));
      }
    }
    return heights;
  };
  const std::vector<std::pair<std::string, std::vector<std::string>>> keys{
      {"H_1", {R"("count":3)", R"("wall":0.3)"}},
      {"H_2", {R"("count":3)", R"("width":0.6)"}},
      {"H_3", {R"("number":4)", R"("number":4,"seed":2)"}},
      {"H_4", {R"("number":4)", R"("seed":2)", R"("radius":0.1)", R"("radius":[0.02,0.1])"}},
      {"H_5",
       {R"("number":4)", R"("seed":2)", R"("radius":0.1)", R"("field":0.3)", R"("field":0.3,"rim":0.3)",
        R"("flank":0.005)"}},
      {"H_6", {R"("width":0.05)", R"("flank":0)", R"("radius":0.1)"}},
      {"H_7", {R"("hurst":0.5)", R"("octaves":2)", R"("seed":2)"}},
  };
  for (const auto& [generator, changes] : keys) {
    const std::string start = R"({"generator":")" + generator + R"(","size":96)";
    std::set<std::vector<double>> different{texels(start + "}")};
    for (const std::string& change : changes) different.insert(texels(start + "," + change + "}"));
    EXPECT_EQ(different.size(), changes.size() + 1) << generator;
  }
}

TEST_F(ExperimentScene, SharesOfTheMeanEdgeBecomeMetres) {
  // The papers' amplitudes; M_f has edges of many lengths, of which the mean counts.
  for (const char* mesh : {R"({"generator":"M_a","mean_edge":"10mm"})", R"({"generator":"M_f","mean_edge":"10mm"})"}) {
    for (const int percent : {1, 5, 10, 15, 20}) {
      for (const char* space : {"", " "}) {
        const Experiment e = good(std::string(R"({"surfaces":[{"mesh":)") + mesh +
                                  R"(,"coat":{"filter":"nearest","height_map":{"generator":"H_2"},"height":")" +
                                  std::to_string(percent) + space + R"(%"}}]})");
        EXPECT_NEAR(coat_of(e).highest(), percent * 1e-4, 1e-9);
        const Json coat = Json::parse(e.canonical_json)["surfaces"][0]["coat"];
        ASSERT_TRUE(coat["height"].is_number());
        EXPECT_NEAR(coat["height"].get<double>(), percent * 1e-4, 1e-12);
      }
    }
  }
  const auto flat = [&](const std::string& keys) {
    return coat_of(good(R"({"surfaces":[{"mesh":{"generator":"M_a"},"coat":{"height_map":{"generator":"H_0"},)" + keys +
                        "}}]}"))
        .highest();
  };
  EXPECT_NEAR(flat(R"("height":"-5%")"), -0.5e-3, 1e-9);
  EXPECT_EQ(flat(R"("height":"0%")"), 0.0);
  EXPECT_NEAR(flat(R"("height":"1mm","offset":"-5 %")"), 0.5e-3, 1e-9);
  const Experiment range = good(
      R"({"surfaces":[{"mesh":{"generator":"M_a"},"coat":{"filter":"nearest","height_map":"map.png","height_range":["-10%","0.2mm"]}}]})");
  EXPECT_NEAR(coat_of(range).lowest(), -1e-3, 1e-9);
  EXPECT_NEAR(coat_of(range).highest(), 0.2e-3, 1e-9);
}

TEST_F(ExperimentScene, NormalsMayBeMadeIntoAMap) {
  const auto scene = [&](const std::string& normals) {
    return good(
        R"({"surfaces":[{"mesh":{"generator":"M_a"},"coat":{"height_map":{"generator":"H_3","size":128},"height":"1mm")" +
        normals + R"(},"law":"force-shading"}]})");
  };
  EXPECT_FALSE(coat_of(scene("")).maps().has_normal_map());
  EXPECT_FALSE(coat_of(scene(R"(,"normals":"heights")")).maps().has_normal_map());
  const Experiment mapped = scene(R"(,"normals":"map")");
  const NormalMap* normals = coat_of(mapped).maps().normals();
  ASSERT_NE(normals, nullptr);
  EXPECT_EQ(normals->width(), 128);
  EXPECT_TRUE(coat_of(good(mapped.canonical_json)).maps().has_normal_map());
  // It is the normal of the heights: nearly that of the reconstruction at the texel centres of a gentle relief.
  const Experiment plain = scene("");
  for (int i = 0; i < 128; ++i) {
    const Vec2 st((i + 0.5) / 128.0, (0.7 * 128.0 + 0.1) / 128.0);
    EXPECT_LT((coat_of(mapped).maps().sample(st).normal - coat_of(plain).maps().sample(st).normal).norm(), 0.02);
  }
  EXPECT_NE(short_run(mapped, 1500), short_run(plain, 1500));
}

TEST_F(ExperimentScene, TrialMeshesTakeAllTheirParameters) {
  const auto mesh = [&](const std::string& keys) {
    const Experiment e = good(R"({"surfaces":[{"mesh":{)" + keys + "}}]}");
    EXPECT_EQ(good(e.canonical_json).canonical_json, e.canonical_json);
    return base_mesh(e.scene.instances()[0].surface).report();
  };
  EXPECT_EQ(mesh(R"("generator":"M_d","subdivisions":2)").triangles, 320u);
  EXPECT_NEAR(mesh(R"("generator":"M_d","subdivisions":2,"mean_edge":"7mm")").mean_edge, 0.007, 1e-9);
  // Flat angles leave M_a's area under a smaller height.
  const double rows = 6.0 * 0.01 * std::sqrt(3.0) / 2.0;
  EXPECT_EQ(mesh(R"("generator":"M_c","columns":3,"rows":6)").triangles, 36u);
  const Experiment folded = good(R"({"surfaces":[{"mesh":{"generator":"M_c","rows":6,"fold_angles":["120 deg"]}}]})");
  const Box& bounds = base_mesh(folded.scene.instances()[0].surface).bounds();
  EXPECT_NEAR(bounds.extent().z(), rows * std::cos(std::acos(-1.0) / 6.0), 1e-12);
  EXPECT_NEAR(bounds.extent().y(), rows / 6.0 * 0.5, 1e-12);
  const MeshReport graded = mesh(R"("generator":"M_f","triangles":5,"grading":0.8)");
  EXPECT_EQ(graded.triangles, 5u);
  EXPECT_LT(graded.max_edge / graded.min_edge, 5.0);
}

TEST_F(ExperimentScene, MGFollowsWhatACoatWouldWear) {
  const std::string relief = R"({"height_map":{"generator":"H_3","size":64},"height":"10 %","mapping":"uv"})";
  const std::string sheet = R"("columns":4,"rows":4,"mean_edge":"10mm")";
  const Experiment coated =
      good(R"({"surfaces":[{"mesh":{"generator":"M_b",)" + sheet + R"(},"coat":)" + relief + "}]}");
  const Experiment dense = good(R"({"surfaces":[{"mesh":{"generator":"M_G",)" + sheet +
                                R"(,"subdivisions":3,"mesostructure":)" + relief + "}}]}");
  const TriangleMesh& base = base_mesh(coated.scene.instances()[0].surface);
  const TriangleMesh& geometry = base_mesh(dense.scene.instances()[0].surface);
  EXPECT_EQ(geometry.report().triangles, base.report().triangles * 64);
  EXPECT_EQ(geometry.report().components, 1u);
  // Every base vertex has moved by the coat's height, along its normal.
  for (std::uint32_t face = 0; face < base.triangles().size(); ++face) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t vertex = base.triangles()[face][k];
      const double height = coat_of(coated).sample(base, face, Vec3::Unit(static_cast<int>(k))).height;
      const Vec3 expected = base.positions()[vertex] + height * base.vertex_normal(vertex);
      double nearest = infinity;
      for (const Vec3& p : geometry.positions()) nearest = std::min(nearest, (p - expected).norm());
      ASSERT_LT(nearest, 1e-9);
    }
  }
  // The canonical copy holds metres, of M_b's edge, and makes the same geometry.
  const Json mesh = Json::parse(dense.canonical_json)["surfaces"][0]["mesh"];
  EXPECT_NEAR(mesh["mesostructure"]["height"].get<double>(), 1e-3, 1e-12);
  const Experiment again = good(dense.canonical_json);
  EXPECT_EQ(again.canonical_json, dense.canonical_json);
  EXPECT_EQ(short_run(again, 1500), short_run(dense, 1500));
}

TEST_F(ExperimentScene, RealMapsAndMeshes) {
  const std::filesystem::path data = ASPERITY_SHARED_DATA;
  if (!std::filesystem::exists(data / "meshes" / "spot.obj")) GTEST_SKIP() << "shared data absent: " << data;
  const auto file = [&](const char* name) { return (data / name).lexically_normal().string(); };
  const Experiment spot = good(R"({"surfaces":[{"mesh":")" + file("meshes/spot.obj") + R"(","coat":{"height_map":")" +
                               file("textures/ambientcg/rock023_alb_ht.png") + R"(","height":"0.5mm"}}]})");
  EXPECT_EQ(coat_of(spot).settings().mapping, Mapping::uv);
  EXPECT_EQ(coat_of(spot).maps().heights().channel().channel, Channel::alpha);
  EXPECT_TRUE(has_note(spot, "alpha"));
  const Experiment matrix = good(
      R"({"surfaces":[{"mesh":{"generator":"plane","width":"80mm","depth":"80mm"},"coat":{"mapping":"triplanar","height_map":")" +
      file("topography/matrix-2_height16.png") + R"(","magnify":300}}]})");
  EXPECT_TRUE(has_note(matrix, "matrix-2_height16.json"));
  EXPECT_NEAR(coat_of(matrix).maps().tile().x(), 650 * 3.69862e-07 * 300, 1e-9);
  EXPECT_LT(coat_of(matrix).lowest(), -0.9 * 300 * 2.1127745607575333e-06);
}

}  // namespace
}  // namespace asperity::experiment_scene_test
