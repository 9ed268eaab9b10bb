// Bad scenes one by one: each has one error that names the file, the key and what would be accepted.

#include "tests/io/experiment_fixture.h"

namespace asperity::experiment_errors_test {
namespace {

class ExperimentErrors : public ExperimentTest {
 protected:
  void expect(const std::string& json, ErrorCode code, const std::string& place, const std::string& part) {
    const Result<Experiment> experiment = parse(json);
    ASSERT_FALSE(experiment.ok()) << json;
    const Error& error = experiment.error();
    EXPECT_EQ(to_string(error.code), std::string(to_string(code))) << error.message();
    EXPECT_EQ(error.place, place) << error.message();
    EXPECT_NE(error.message().find(part), std::string::npos) << error.message();
    EXPECT_FALSE(error.file.empty()) << error.message();
    EXPECT_FALSE(error.accepted.empty()) << error.message();
  }
  /// A key of the only surface, a box.
  void surface(const std::string& keys, ErrorCode code, const std::string& place, const std::string& part) {
    expect(R"({"surfaces":[{"mesh":{"generator":"box"},)" + keys + "}]}", code, place, part);
  }
  void coat(const std::string& keys, ErrorCode code, const std::string& place, const std::string& part) {
    expect(R"({"surfaces":[{"mesh":"sphere.ply","coat":{)" + keys + "}}]}", code,
           place.empty() ? place : "surfaces[0].coat" + place, part);
  }
  void stroke(const std::string& keys, ErrorCode code, const std::string& place, const std::string& part) {
    expect(R"({"surfaces":[{"mesh":{"generator":"box"}}],"stroke":{)" + keys + "}}", code, place, part);
  }
  void root(const std::string& keys, ErrorCode code, const std::string& place, const std::string& part) {
    expect(R"({"surfaces":[{"mesh":{"generator":"box"}}],)" + keys + "}", code, place, part);
  }
};

TEST_F(ExperimentErrors, Files) {
  const auto message = [](const Result<Experiment>& result) {
    return result.ok() ? std::string() : result.error().message();
  };
  const Result<Experiment> missing = read_experiment(folder_ / "absent.json");
  ASSERT_FALSE(missing.ok());
  EXPECT_EQ(missing.error().code, ErrorCode::file_missing);
  EXPECT_NE(message(missing).find("absent.json"), std::string::npos);
  EXPECT_EQ(read_experiment(folder_).error().code, ErrorCode::file_missing);
  write("empty.json", " \n");
  EXPECT_EQ(read_experiment(folder_ / "empty.json").error().code, ErrorCode::file_empty);
  write("truncated.json", "{\n  \"surfaces\": [{\"mesh\":");
  const Result<Experiment> truncated = read_experiment(folder_ / "truncated.json");
  EXPECT_EQ(truncated.error().code, ErrorCode::file_malformed);
  EXPECT_EQ(truncated.error().place.substr(0, 6), "line 2") << message(truncated);
}

TEST_F(ExperimentErrors, Syntax) {
  expect("{\n  \"surfaces\": [,]\n}", ErrorCode::file_malformed, "line 2, column 16", "is not JSON");
  expect("nonsense", ErrorCode::file_malformed, "line 1, column 2", "is not JSON");
  expect(R"({"name":"a","name":"b"})", ErrorCode::file_malformed, "", "\"name\" is given twice");
  expect("[]", ErrorCode::bad_type, "", "is an array; accepted: an object");
  expect("3", ErrorCode::bad_type, "", "is a number");
}

TEST_F(ExperimentErrors, UnknownKeysSuggest) {
  root(R"("strok":{})", ErrorCode::bad_key, "strok", "did you mean \"stroke\"?");
  surface(R"("fitt":"none")", ErrorCode::bad_key, "surfaces[0].fitt", "did you mean \"fit\"?");
  coat(R"("heigth":1)", ErrorCode::bad_key, ".heigth", "did you mean \"height\"?");
  stroke(R"("spede":1)", ErrorCode::bad_key, "stroke.spede", "did you mean \"speed\"?");
  surface(R"("material":{"stifness":1})", ErrorCode::bad_key, "surfaces[0].material.stifness",
          "did you mean \"stiffness\"?");
  surface(R"("wholly_unlike_any":1)", ErrorCode::bad_key, "surfaces[0].wholly_unlike_any", "accepted: name, mesh");
}

TEST_F(ExperimentErrors, Root) {
  expect("{}", ErrorCode::bad_value, "surfaces", "is missing");
  expect(R"({"surfaces":[]})", ErrorCode::bad_value, "surfaces", "has 0 entries");
  expect(R"({"surfaces":{}})", ErrorCode::bad_type, "surfaces", "is an object; accepted: an array");
  expect(R"({"surfaces":[3]})", ErrorCode::bad_type, "surfaces[0]", "is a number");
  root(R"("asperity":2)", ErrorCode::file_unsupported, "asperity", "newer format");
  root(R"("name":3)", ErrorCode::bad_type, "name", "is a number; accepted: a text");
  root(R"("device":"omega.8")", ErrorCode::bad_value, "device", "did you mean \"omega");
  root(R"("device":7)", ErrorCode::bad_type, "device", "is a number");
  root(R"("device":{"max_force":-1})", ErrorCode::bad_value, "device.max_force", "above 0 (N, mN)");
  root(R"("device":{"profile":"falcn"})", ErrorCode::bad_value, "device.profile", "did you mean \"falcon\"");
  root(R"("hand":"firmm")", ErrorCode::bad_value, "hand", "did you mean \"firm\"");
  root(R"("hand":{"mass":0})", ErrorCode::bad_value, "hand.mass", "above 0 (kg, g)");
  root(R"("probe":{"radius":"-1mm"})", ErrorCode::bad_value, "probe.radius", "0 or more");
  root(R"("probe":{"radius":"1 parsec"})", ErrorCode::bad_value, "probe.radius", "unknown unit \"parsec\"");
  root(R"("probe":{"rate":0})", ErrorCode::bad_value, "probe.rate", "(Hz, kHz)");
  root(R"("probe":{"kind":"ideel"})", ErrorCode::bad_value, "probe.kind", "did you mean \"ideal\"");
  root(R"("probe":{"ideal":{"bandwidth":0}})", ErrorCode::bad_value, "probe.ideal.bandwidth", "above 0");
  root(R"("probe":{"dynamic":{"seed":-1}})", ErrorCode::bad_value, "probe.dynamic.seed", "whole number");
}

TEST_F(ExperimentErrors, Surfaces) {
  expect(R"({"surfaces":[{}]})", ErrorCode::bad_value, "surfaces[0].mesh", "is missing");
  expect(R"({"surfaces":[{"mesh":3}]})", ErrorCode::bad_type, "surfaces[0].mesh", "is a number");
  expect(R"({"surfaces":[{"mesh":"absent.obj"}]})", ErrorCode::file_missing, "surfaces[0].mesh", "absent.obj");
  expect(R"({"surfaces":[{"mesh":{"generator":"icosphare"}}]})", ErrorCode::bad_value, "surfaces[0].mesh.generator",
         "did you mean \"icosphere\"");
  expect(R"({"surfaces":[{"mesh":{}}]})", ErrorCode::bad_value, "surfaces[0].mesh.generator", "is missing");
  expect(R"({"surfaces":[{"mesh":{"generator":"box","radius":1}}]})", ErrorCode::bad_key, "surfaces[0].mesh.radius",
         "is not read by this generator");
  expect(R"({"surfaces":[{"mesh":{"generator":"icosphere","subdivisions":10}}]})", ErrorCode::bad_value,
         "surfaces[0].mesh.subdivisions", "0 to 9");
  expect(R"({"surfaces":[{"mesh":{"generator":"icosphere","subdivisions":1.5}}]})", ErrorCode::bad_value,
         "surfaces[0].mesh.subdivisions", "whole number");
  surface(R"("units":"mm")", ErrorCode::bad_key, "surfaces[0].units", "generated mesh");
  surface(R"("fit":"workspce")", ErrorCode::bad_value, "surfaces[0].fit", "\"workspace\", \"none\"");
  surface(R"("fit":0)", ErrorCode::bad_value, "surfaces[0].fit", "above 0");
  surface(R"("fit":[])", ErrorCode::bad_type, "surfaces[0].fit", "is an array");
  surface(R"("up":"w")", ErrorCode::bad_value, "surfaces[0].up", "\"y\"");
  surface(R"("sides":"back")", ErrorCode::bad_value, "surfaces[0].sides", "\"front\"");
  surface(R"("search":"grid")", ErrorCode::bad_value, "surfaces[0].search", "\"octree\"");
  surface(R"("pose":{"position":[1,2]})", ErrorCode::bad_value, "surfaces[0].pose.position", "has 2 numbers");
  surface(R"("pose":{"position":[1,"2 N",3]})", ErrorCode::bad_value, "surfaces[0].pose.position[1]",
          "unknown unit \"N\"");
  surface(R"("pose":{"orientation":[0,0,0,0]})", ErrorCode::bad_value, "surfaces[0].pose.orientation", "no rotation");
  surface(R"("pose":{"axis":[0,0,0],"angle":1})", ErrorCode::bad_value, "surfaces[0].pose.axis", "no direction");
  surface(R"("material":{"stiffness":0})", ErrorCode::bad_value, "surfaces[0].material.stiffness",
          "above 0 (N/m, N/mm)");
  surface(R"("material":{"damping":"x"})", ErrorCode::bad_value, "surfaces[0].material.damping",
          "does not start with a number");
  surface(R"("law":"mesostructur")", ErrorCode::bad_value, "surfaces[0].law", "did you mean \"mesostructure\"?");
  surface(R"("law":"mesostructure")", ErrorCode::unsupported_pair, "surfaces[0].law", "needs a coat");
  surface(R"("law":{"type":"god-object","rho":0.1})", ErrorCode::bad_key, "surfaces[0].law.rho",
          "is not read by the law");
  surface(R"("law":{"type":"mesostructure-literal","rho":0.5})", ErrorCode::bad_value, "surfaces[0].law.rho", "0.3333");
  surface(R"("law":{"type":"mesostructure-literal","blend":"cubic"})", ErrorCode::bad_value, "surfaces[0].law.blend",
          "s_shape");
  surface(R"("law":{"type":"mesostructure-literal","blend":[0.5]})", ErrorCode::bad_value, "surfaces[0].law.blend",
          "two");
}

TEST_F(ExperimentErrors, Meshes) {
  write("empty.obj", "");
  expect(R"({"surfaces":[{"mesh":"empty.obj"}]})", ErrorCode::file_empty, "surfaces[0].mesh", "empty.obj");
  write("nan.obj", "v 0 0 0\nv 1 0 0\nv 0 nan 0\nf 1 2 3\n");
  EXPECT_FALSE(parse(R"({"surfaces":[{"mesh":"nan.obj"}]})").ok());
  write("index.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n");
  EXPECT_FALSE(parse(R"({"surfaces":[{"mesh":"index.obj"}]})").ok());
  write("point.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n");
  const Result<Experiment> point = parse(R"({"surfaces":[{"mesh":"point.obj"}]})");
  ASSERT_FALSE(point.ok());
  EXPECT_EQ(point.error().code, ErrorCode::bad_mesh);
  EXPECT_NE(point.error().file.find("point.obj"), std::string::npos);
}

TEST_F(ExperimentErrors, Coats) {
  coat("", ErrorCode::bad_value, ".height_map", "is missing");
  coat(R"("height_map":3)", ErrorCode::bad_type, ".height_map", "is a number");
  coat(R"("height_map":"absent.png")", ErrorCode::file_missing, ".height_map", "absent.png");
  coat(R"("height_map":{"generator":"H_9"})", ErrorCode::bad_value, ".height_map.generator", "H_9");
  coat(R"("height_map":{"generator":"H_3","count":3})", ErrorCode::bad_key, ".height_map.count",
       "is not read by this generator");
  coat(R"("height_map":{"generator":"H_3"},"channel":"red")", ErrorCode::bad_key, ".channel", "generated height map");
  coat(R"("height_map":"map.png","channel":"red")", ErrorCode::bad_map, ".channel", "map.png");
  coat(R"("height_map":"map.png","height":-1)", ErrorCode::bad_value, ".height", "0 or more");
  coat(R"("height_map":"map.png","height":"2 N")", ErrorCode::bad_value, ".height", "unknown unit");
  coat(R"("height_map":"map.png","height":"x%")", ErrorCode::bad_value, ".height", "share of the mean edge");
  coat(R"("height_map":"map.png","height":"1m")", ErrorCode::bad_value, ".height", "half the diagonal");
  coat(R"("height_map":"map.png","height_range":[0,1])", ErrorCode::bad_value, ".height_range", "half the diagonal");
  coat(R"("height_map":"map.png","height_range":[1,0])", ErrorCode::bad_value, ".height_range", "higher end first");
  coat(R"("height_map":"map.png","height_range":[0,"x"])", ErrorCode::bad_value, ".height_range[1]", "number");
  coat(R"("height_map":"map.png","height_range":[0,1e-3],"height":1)", ErrorCode::bad_key, ".height",
       "beside height_range");
  coat(R"("height_map":"map.png","tile":0)", ErrorCode::bad_value, ".tile", "above 0");
  coat(R"("height_map":"map.png","tile":[1e-3])", ErrorCode::bad_value, ".tile", "has 1 lengths");
  coat(R"("height_map":"map.png","repeat":2)", ErrorCode::bad_key, ".repeat", "triplanar");
  coat(R"("height_map":"map.png","mapping":"uv")", ErrorCode::mismatch, ".mapping", "no texture coordinates");
  coat(R"("height_map":"map.png","mapping":"per_face","tile":1)", ErrorCode::bad_key, ".tile", "repeat");
  coat(R"("height_map":"map.png","mapping":"per_face","repeat":0)", ErrorCode::bad_value, ".repeat", "above 0");
  coat(R"("height_map":"map.png","filter":"cubic")", ErrorCode::bad_value, ".filter", "bspline");
  coat(R"("height_map":"map.png","magnify":0)", ErrorCode::bad_value, ".magnify", "above 0");
  coat(R"("height_map":"map.png","green":"up")", ErrorCode::bad_key, ".green", "without normal_map");
  coat(R"("height_map":"map.png","normal_map":"absent.png")", ErrorCode::file_missing, ".normal_map", "absent.png");
  coat(R"("height_map":"map.png","normal_map":"map.png")", ErrorCode::bad_map, ".normal_map", "map.png");
  write("broken.png", "no picture at all");
  EXPECT_FALSE(parse(R"({"surfaces":[{"mesh":"sphere.ply","coat":{"height_map":"broken.png"}}]})").ok());
}

TEST_F(ExperimentErrors, Heights) {
  const std::string accepted = "a length of 0 or more (m, cm, mm, um, nm, in), or a share of the mean edge (\"10 %\")";
  coat(R"("height_map":"map.png","height":-1)", ErrorCode::bad_value, ".height", accepted);
  coat(R"("height_map":"map.png","height":"-3 %")", ErrorCode::bad_value, ".height", accepted);
  coat(R"("height_map":"map.png","height":"3 N")", ErrorCode::bad_value, ".height", accepted);
  coat(R"("height_map":"map.png","height":[1])", ErrorCode::bad_type, ".height", accepted);
  coat(R"("height_map":"map.png","height":"1mm","offset":"x %")", ErrorCode::bad_value, ".offset", "or a share");
  coat(R"("height_map":"map.png","height_range":[0,"3 Hz"])", ErrorCode::bad_value, ".height_range[1]", "or a share");
}

TEST_F(ExperimentErrors, Generators) {
  const auto map = [&](const std::string& keys, ErrorCode code, const std::string& place, const std::string& part) {
    coat(R"("height_map":{)" + keys + R"(},"height":"0.1mm")", code, ".height_map." + place, part);
  };
  // Every key that a generator does not take.
  const std::vector<std::pair<std::string, std::string>> taken{
      {"H_0", ""},
      {"H_1", "count wall"},
      {"H_2", "count width"},
      {"H_3", "number"},
      {"H_4", "number radius seed"},
      {"H_5", "number radius rim field flank overlap seed"},
      {"H_6", "width flank radius"},
      {"H_7", "hurst octaves seed"},
  };
  for (const auto& [generator, keys] : taken) {
    for (const char* key : {"count", "number", "wall", "width", "flank", "radius", "rim", "field", "overlap", "hurst",
                            "octaves", "seed"}) {
      if (keys.find(key) != std::string::npos) continue;
      map(R"("generator":")" + generator + R"(",")" + key + R"(":1)", ErrorCode::bad_key, key, "is not read by");
    }
  }
  map(R"("generator":"H_3","seed":2)", ErrorCode::bad_key, "seed", "number");
  map(R"("generator":"H_1","count":300)", ErrorCode::bad_value, "count", "1 to 256");
  map(R"("generator":"H_1","wall":0.7)", ErrorCode::bad_value, "wall", "0 to 0.5");
  map(R"("generator":"H_1","wall":"3mm")", ErrorCode::bad_value, "wall", "unknown unit");
  map(R"("generator":"H_2","width":0.001)", ErrorCode::bad_value, "width", "0.01562 to 0.9844");
  map(R"("generator":"H_4","number":1.5)", ErrorCode::bad_value, "number", "whole number");
  map(R"("generator":"H_4","number":1000)", ErrorCode::bad_value, "number", "find a place");
  map(R"("generator":"H_4","radius":[0.1])", ErrorCode::bad_value, "radius", "two [smallest, largest]");
  map(R"("generator":"H_4","radius":[0.1,0.05])", ErrorCode::bad_value, "radius", "0.1 to 0.25");
  map(R"("generator":"H_5","number":300)", ErrorCode::bad_value, "number", "1 to 200");
  map(R"("generator":"H_5","rim":0.2)", ErrorCode::bad_value, "rim", "flat coins have no rim");
  map(R"("generator":"H_5","flank":0.05)", ErrorCode::bad_value, "flank", "0 to 0.045");
  map(R"("generator":"H_5","field":0.6,"flank":0.01)", ErrorCode::bad_value, "flank", "0 to 0.0054");
  map(R"("generator":"H_6","radius":[0.1,0.1])", ErrorCode::bad_type, "radius", "0.001 to 0.25");
  map(R"("generator":"H_6","radius":0.25)", ErrorCode::bad_value, "radius", "0.05 to 0.22");
  map(R"("generator":"H_7","hurst":2)", ErrorCode::bad_value, "hurst", "0.05 to 1");
  map(R"("generator":"H_7","octaves":9)", ErrorCode::bad_value, "octaves", "1 to 8");
  coat(R"("height_map":"map.png","normals":"image")", ErrorCode::bad_value, ".normals", "\"map\"");
  coat(R"("height_map":"map.png","normals":"map","normal_map":"normal.png")", ErrorCode::bad_key, ".normals",
       "beside normal_map");
}

TEST_F(ExperimentErrors, TrialMeshes) {
  const auto mesh = [&](const std::string& keys, ErrorCode code, const std::string& place, const std::string& part) {
    expect(R"({"surfaces":[{"mesh":{)" + keys + "}}]}", code, "surfaces[0].mesh" + place, part);
  };
  mesh(R"("generator":"M_a","fold_angles":[1])", ErrorCode::bad_key, ".fold_angles", "by this generator");
  mesh(R"("generator":"M_c","fold_angles":1)", ErrorCode::bad_type, ".fold_angles", "10 to 180 degrees");
  mesh(R"("generator":"M_c","fold_angles":[])", ErrorCode::bad_value, ".fold_angles", "has 0 angles");
  mesh(R"("generator":"M_c","fold_angles":[1,"5 deg"])", ErrorCode::bad_value, ".fold_angles[1]", "rad, deg");
  mesh(R"("generator":"M_e","grading":0.5)", ErrorCode::bad_key, ".grading", "by this generator");
  mesh(R"("generator":"M_f","grading":1)", ErrorCode::bad_value, ".grading", "0.1 to 0.9");
  mesh(R"("generator":"M_f","grading":0.1,"triangles":13)", ErrorCode::bad_value, ".triangles", "1 to 12");
  mesh(R"("generator":"M_b","mesostructure":{})", ErrorCode::bad_key, ".mesostructure", "by this generator");
  mesh(R"("generator":"M_G")", ErrorCode::bad_value, ".mesostructure", "is missing");
  mesh(R"("generator":"M_G","mesostructure":3)", ErrorCode::bad_type, ".mesostructure", "is a number");
  mesh(R"("generator":"M_G","mesostructure":{"height_map":{"generator":"H_9"}})", ErrorCode::bad_value,
       ".mesostructure.height_map.generator", "fractal (H_7)");
  mesh(R"("generator":"M_G","subdivisions":8,"mesostructure":{"height_map":{"generator":"H_3"}})", ErrorCode::too_large,
       ".subdivisions", "4194304");
  for (const char* key : {"normals", "normal_map", "green"}) {
    mesh(std::string(R"("generator":"M_G","mesostructure":{"height_map":{"generator":"H_3"},")") + key + R"(":"map"})",
         ErrorCode::bad_key, std::string(".mesostructure.") + key, "follows the heights");
  }
}

TEST_F(ExperimentErrors, ProbesWithRadiusNeedALawThatTakesThem) {
  expect(
      R"({"surfaces":[{"mesh":"sphere.ply","coat":{"height_map":"map.png"},"law":"height-field"}],"probe":{"radius":"1mm"}})",
      ErrorCode::unsupported_pair, "surfaces[0].law", "touches with a point");
}

TEST_F(ExperimentErrors, Strokes) {
  stroke(R"("type":"circel")", ErrorCode::bad_value, "stroke.type", "did you mean \"circle\"?");
  stroke(R"("turns":2)", ErrorCode::bad_key, "stroke.turns", "is not read by a line stroke");
  stroke(R"("type":"circle","rows":2)", ErrorCode::bad_key, "stroke.rows", "is not read by a circle stroke");
  stroke(R"("start":[0,1])", ErrorCode::bad_value, "stroke.start", "has 2 coordinates");
  stroke(R"("start":["1 N",0,0])", ErrorCode::bad_value, "stroke.start[0]", "unknown unit");
  stroke(R"("start":[true,0,0])", ErrorCode::bad_type, "stroke.start[0]", "is a boolean");
  stroke(R"("start":[0,0.04,0],"end":[0,0.04,0])", ErrorCode::bad_value, "stroke.line", "no length");
  stroke(R"("speed":0)", ErrorCode::bad_value, "stroke.speed", "above 0 (m/s, cm/s, mm/s)");
  stroke(R"("normal_force":1,"depth":1)", ErrorCode::bad_key, "stroke.depth", "beside normal_force");
  stroke(R"("type":"polyline")", ErrorCode::bad_value, "stroke.points", "is missing");
  stroke(R"("type":"polyline","points":[[0,0,0]])", ErrorCode::bad_value, "stroke.points", "two points or more");
  stroke(R"("type":"recorded")", ErrorCode::bad_value, "stroke.path", "is missing");
  stroke(R"("type":"recorded","path":"absent.csv")", ErrorCode::file_missing, "stroke.path", "absent.csv");
  stroke(R"("repeats":3)", ErrorCode::bad_value, "stroke.repeats", "back_and_forth");
  stroke(R"("back_and_forth":1)", ErrorCode::bad_type, "stroke.back_and_forth", "true or false");
}

}  // namespace
}  // namespace asperity::experiment_errors_test
