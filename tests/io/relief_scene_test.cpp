// What coats have beside their heights, closing, glTF materials, views, motions and changes in scene files.

#include <fmt/format.h>

#include <numbers>

#include "asperity/io/gltf_material.h"
#include "tests/io/experiment_fixture.h"

namespace asperity::relief_scene_test {
namespace {

const std::filesystem::path shared = ASPERITY_SHARED_DATA;

class ReliefScene : public ExperimentTest {
 protected:
  static const Instance& instance(const Experiment& e) { return e.scene.instances()[0]; }
  static const Coat& coat(const Experiment& e) {
    const ReliefSurface* relief = relief_of(instance(e));
    if (relief == nullptr) throw std::runtime_error("no relief");
    return relief->coat();
  }
  [[nodiscard]] Error bad(const std::string& json) const {
    const Result<Experiment> result = parse(json);
    if (result) throw std::runtime_error("accepted: " + json);
    EXPECT_FALSE(result.error().accepted.empty()) << result.error().message();
    return result.error();
  }
  /// A sheet of 80 mm x 80 mm with a coat, and more keys of the scene.
  static std::string scene(const std::string& coat_keys, const std::string& surface = "",
                           const std::string& more = "") {
    const std::string probe = more.find("\"probe\"") == std::string::npos ? R"(,"probe":{"radius":0})" : "";
    return R"({"surfaces":[{"mesh":{"generator":"plane","width":0.08,"depth":0.08,"columns":4,"rows":4},"coat":{)" +
           coat_keys + "}" + (surface.empty() ? "" : "," + surface) + "}]" + probe + (more.empty() ? "" : "," + more) +
           "}";
  }
  static std::string ramp_coat(const std::string& more = "") {
    return R"("height_map":"map.png","height":"0.4 mm","mapping":"triplanar","tile":"20 mm")" +
           (more.empty() ? "" : "," + more);
  }
  void comes_back(const Experiment& e) const {
    const Experiment again = good(e.canonical_json);
    EXPECT_EQ(again.canonical_json, e.canonical_json);
    EXPECT_EQ(short_run(again, 200), short_run(e, 200));
  }
  static bool noted(const Experiment& e, const std::string& part) {
    for (const std::string& note : e.notes) {
      if (note.find(part) != std::string::npos) return true;
    }
    return false;
  }
  void refused(const std::string& json, const std::string& place, const std::string& part = {}) const {
    const Error error = bad(json);
    EXPECT_EQ(error.place, place) << error.message();
    EXPECT_NE(error.message().find(part), std::string::npos) << error.message();
  }
};

TEST_F(ReliefScene, GroupsOfFacesWearMapsOfTheirOwn) {
  const std::string flat = R"("height_map":{"generator":"H_0","size":16},"height":0,"mapping":"per_face")";
  const std::string high = R"("height_map":{"generator":"H_0","size":16},"height":"0.3 mm")";
  const Experiment some = good(scene(flat + R"(,"groups":[{"faces":[[0,3],[8,8]],)" + high + "}]"));
  const TriangleMesh& mesh = base_of(instance(some).surface)->mesh();
  ASSERT_EQ(mesh.triangles().size(), 32U);
  const Vec3 middle = Vec3::Constant(1.0 / 3.0);
  for (std::uint32_t face = 0; face < 32; ++face) {
    const double height = face <= 3 || face == 8 ? 0.3e-3 : 0.0;
    EXPECT_NEAR(coat(some).sample(mesh, face, middle).height, height, 1e-9) << face;
  }
  comes_back(some);
  // To the forces: a group of all faces is the coat itself, and what groups overlap the last one has.
  const std::uint64_t whole = short_run(good(scene(high + R"(,"mapping":"per_face")")), 1500);
  EXPECT_EQ(short_run(good(scene(flat + R"(,"groups":[{"faces":[[0,31]],)" + high + "}]")), 1500), whole);
  const std::string twice = R"(,"groups":[{"faces":[[0,31]],"height_map":"map.png","height":0},{"faces":[[0,31]],)";
  EXPECT_EQ(short_run(good(scene(flat + twice + high + "}]")), 1500), whole);
  EXPECT_NE(short_run(good(scene(flat)), 1500), whole);
}

TEST_F(ReliefScene, WrongGroupsAreRefusedByName) {
  const auto group = [&](const std::string& keys, const std::string& place, const std::string& part) {
    refused(scene(ramp_coat(R"("groups":[{)" + keys + "}]")), "surfaces[0].coat.groups" + place, part);
  };
  const std::string map = R"("height_map":"map.png","height":"0.1 mm")";
  group(map, "[0].faces", "is missing");
  group(R"("faces":[[0,3]])", "[0].height_map", "is missing");
  group(R"("faces":[],)" + map, "[0].faces", "has 0 ranges");
  group(R"("faces":[3],)" + map, "[0].faces[0]", "two faces [first, last]");
  group(R"("faces":[[0,1.5]],)" + map, "[0].faces[0][1]", "whole number");
  group(R"("faces":[[3,2]],)" + map, "[0].faces[0]", "the first one first");
  group(R"("faces":[[0,1],[30,32]],)" + map, "[0].faces[1]", "faces from 0 to 31");
  group(R"("faces":[[0,1]],"tile":1,)" + map, "[0].tile", "is not a key of a face group");
  group(R"("faces":[[0,1]],"height_map":"map.png","height":"1 m")", "[0].height", "half the diagonal");
  refused(scene(ramp_coat(R"("groups":[])")), "surfaces[0].coat.groups", "1 to 254");
}

TEST_F(ReliefScene, LayersAreSummed) {
  const Experiment one = good(scene(ramp_coat()));
  const Experiment two = good(scene(ramp_coat(
      R"("layers":[{"height_map":"map.png","height":"0.2 mm","tile":"10 mm"},{"solid":"waves","amplitude":"0.1 mm","wavelength":"8 mm","direction":[1,0,0],"frequency":"2 Hz"}])")));
  ASSERT_EQ(coat(two).layers().size(), 2U);
  EXPECT_FALSE(coat(one).moves());
  EXPECT_TRUE(coat(two).moves());
  const TriangleMesh& mesh = base_mesh(instance(two).surface);
  const Vec3 place(0.3, 0.5, 0.2);
  for (const double time : {0.0, 0.13}) {
    const double sum = coat(two).sample(mesh, 3, place, {0.0, time}).height;
    const auto [a, b, c] = mesh.corners(3);
    const Vec3 p = place[0] * a + place[1] * b + place[2] * c;
    const double waves = 1e-4 * std::cos(2.0 * std::numbers::pi * (p.x() / 8e-3 - 2.0 * time));
    const double maps = coat(one).sample(mesh, 3, place).height;
    const HeightMap& half = coat(two).layers()[0].maps->heights();
    // The sheet faces +y: s along z, t along x.
    const double more = half.height_at(Vec2(p.z() / 0.01, p.x() / 0.01));
    EXPECT_NEAR(sum, maps + more + waves, 1e-9) << time;
  }
  comes_back(two);
}

TEST_F(ReliefScene, DetailMapsAndMaterialComeBack) {
  const Experiment e = good(scene(
      ramp_coat(
          R"("detail":{"kind":"dilation","levels":3},"maps":{"stiffness":{"image":"map.png","low":"0.4 N/mm","high":"1 N/mm"},"friction":{"image":{"generator":"H_3","size":32},"low":0.5,"high":1},"viscosity":{"image":"map.png","low":0,"high":"2 N s/m"},"lay":{"image":"normal.png"}})"),
      R"("material":{"static_friction":0.4,"viscosity":"1 N s/m","magnetism":"0.2 N/mm","magnetic_band":"1 mm","stickiness":"0.1 N"})",
      R"("probe":{"tip":"1 mm"})"));
  EXPECT_EQ(coat(e).levels(), 3);
  ASSERT_NE(coat(e).materials(), nullptr);
  EXPECT_TRUE(coat(e).materials()->has(MaterialChannel::stiffness));
  EXPECT_TRUE(coat(e).materials()->has_lay());
  EXPECT_FALSE(coat(e).materials()->has(MaterialChannel::magnetism));
  EXPECT_EQ(instance(e).material.stickiness, 0.1);
  EXPECT_EQ(e.scene.settings().tip_radius, 1e-3);
  comes_back(e);
}

TEST_F(ReliefScene, TheTipChoosesTheLevel) {
  // A ball of 4 mm does not follow waves of 5 mm and 0.5 mm (R = 1.27 mm) as a point does.
  const std::string coat_keys = ramp_coat(R"("detail":"dilation")");
  const auto span = [&](const std::string& probe) {
    const Experiment e = good(scene(coat_keys, "", R"("probe":)" + probe));
    ProxyState state;
    ProxyCache cache;
    double low = infinity;
    double high = -infinity;
    for (int i = 0; i < 1600; ++i) {
      ProbeSample sample;
      const double up = i < 100 ? 2e-3 - 2.5e-5 * i : -5e-4;
      sample.pose.position = Vec3(0.003, up, -0.03 + (i < 100 ? 0.0 : 4e-5 * (i - 100)));
      const ForceSample force = step(e.scene, state, cache, sample, Seconds(1e-3));
      if (i < 400) continue;
      low = std::min(low, force.proxy.y());
      high = std::max(high, force.proxy.y());
    }
    return high - low;
  };
  const double point = span(R"({"tip":0})");
  const double ball = span(R"({"tip":"8 mm"})");
  EXPECT_GT(point, 0.37e-3);
  EXPECT_LT(ball, 0.8 * point);
}

TEST_F(ReliefScene, ALibraryReliefIsLaidAtItsSize) {
  const Experiment e = good(scene(R"("height_map":{"library":"linen","size":128},"mapping":"triplanar")"));
  EXPECT_NEAR(coat(e).maps().tile().x(), 11.2e-3, 1e-6);
  EXPECT_NEAR(coat(e).highest() - coat(e).lowest(), 0.35e-3, 0.1e-3);
  comes_back(e);
  const Experiment flat = good(scene(R"("height_map":{"library":"linen","size":128},"mapping":"uv")"));
  EXPECT_TRUE(noted(flat, "so that one repeat is 11.2 mm"));
  refused(scene(R"("height_map":{"library":"linnen"})"), "surfaces[0].coat.height_map.library", "linen");
}

TEST_F(ReliefScene, ClosingFillsAndSaysWhere) {
  // A groove across the sheet, narrower than the ball.
  const std::string groove = R"("height_map":{"generator":"H_6","size":128},"height":"0.6 mm","mapping":"uv")";
  const Experiment open = good(scene(groove));
  const Experiment closed = good(scene(groove + R"(,"closing":{"radius":"4 mm","texels":24})"));
  ASSERT_NE(instance(closed).closed_from, nullptr);
  EXPECT_EQ(instance(open).closed_from, nullptr);
  EXPECT_GT(instance(closed).closed_from->closed.report.changed_texels, 0U);
  EXPECT_TRUE(noted(closed, "clos"));
  EXPECT_GT(instance(closed).closed_from->closed.report.largest_rise, 0.05e-3);
  comes_back(closed);
  refused(scene(groove + R"(,"closing":{"radius":0})"), "surfaces[0].coat.closing.radius");
  const Experiment levels = good(scene(groove + R"(,"detail":"low_pass","closing":{"radius":"4 mm","texels":16})"));
  EXPECT_GT(coat(levels).levels(), 1);
  EXPECT_GT(instance(levels).closed_from->closed.report.changed_texels, 0U);
  comes_back(levels);
  const std::string moving =
      R"(,"layers":[{"solid":"waves","amplitude":"0.1 mm","wavelength":"8 mm","direction":[1,0,0],"frequency":"2 Hz"}])";
  const std::string soft =
      R"(,"maps":{"stiffness":{"image":{"generator":"H_3","size":32},"low":"0.4 N/mm","high":"1 N/mm"}})";
  const std::string closing = R"(,"closing":{"radius":"4 mm","texels":16})";
  EXPECT_EQ(coat(good(scene(groove + moving))).layers().size(), 1U);
  EXPECT_NE(coat(good(scene(groove + soft))).materials(), nullptr);
  refused(scene(groove + moving + closing), "surfaces[0].coat.closing", "changes with time");
  refused(scene(groove + soft + closing), "surfaces[0].coat.closing", "maps of the material");
}

TEST_F(ReliefScene, FilletsAreReadAndTheLiteralTestOfNeighbours) {
  const Experiment e = good(
      R"({"surfaces":[{"mesh":{"generator":"M_e","rings":2,"mean_edge":0.01},"law":{"type":"mesostructure-literal","test_neighbours":true},"coat":{"height_map":{"generator":"H_0"},"height":0,"mapping":"uv","stitching":{"folds":"fillet","fillet_radius":"1 mm"}}}]})");
  EXPECT_EQ(coat(e).settings().stitching.folds, FoldMode::fillet);
  EXPECT_EQ(coat(e).settings().stitching.fillet_radius, 1e-3);
  EXPECT_TRUE(instance(e).law.as<MesostructureLaw>()->test_neighbours);
  comes_back(e);
  refused(scene(ramp_coat(R"("stitching":{"fillet_radius":"1 mm"})")), "surfaces[0].coat.stitching.fillet_radius");
}

TEST_F(ReliefScene, AViewMovesStrokesIntoTheScene) {
  const std::string stroke =
      R"("stroke":{"type":"line","start":["20%","50%","50%"],"end":["80%","50%","50%"],"speed":0.1,"depth":"0.3 mm"})";
  const Experiment plain = good(scene(ramp_coat(), "", stroke));
  const Experiment zoomed = good(scene(
      ramp_coat(R"("detail":"low_pass")"), "",
      stroke +
          R"(,"view":{"zoom":2,"camera":{"pixels":800,"field_of_view":"40 deg"}},"change":{"handover":"5 ms","power":0.01,"level_rate":4})"));
  EXPECT_EQ(zoomed.scene.settings().view.zoom, 2.0);
  EXPECT_EQ(zoomed.scene.settings().view.camera.pixels, 800);
  EXPECT_EQ(zoomed.scene.settings().handover.count(), 5e-3);
  EXPECT_EQ(zoomed.scene.settings().change_power, 0.01);
  EXPECT_EQ(zoomed.scene.settings().level_rate, 4.0);
  // The default stroke's shares are of what the hand can reach: twice as long.
  EXPECT_NEAR(zoomed.path.length(), 2.0 * plain.path.length(), 1e-3 * plain.path.length());
  comes_back(zoomed);
  refused(scene(ramp_coat(), "", R"("view":{"zoom":0})"), "view.zoom");
  refused(scene(ramp_coat(), "", R"("view":{"zom":2})"), "view.zom", "zoom");
  refused(scene(ramp_coat(), "", R"("view":{"camera":{"field_of_view":"200 deg"}})"), "view.camera.field_of_view");
}

TEST_F(ReliefScene, AMotionIsReadAndFelt) {
  const Experiment e = good(scene(ramp_coat(), R"("motion":{"velocity":[0.01,0,0],"angular_velocity":[0,0,1]})"));
  EXPECT_TRUE(instance(e).motion.moves());
  EXPECT_EQ(instance(e).motion.velocity.linear, Vec3(0.01, 0.0, 0.0));
  comes_back(e);
  refused(scene(ramp_coat(), R"("motion":{"velocity":[1,2]})"), "surfaces[0].motion.velocity");
  refused(R"({"surfaces":[{"volume":{"generator":"sphere"},"motion":{"velocity":[1,0,0]}}]})", "surfaces[0].motion");
}

TEST_F(ReliefScene, WrongLayersAndMapsAreRefusedByName) {
  refused(scene(ramp_coat(R"("layers":[{"solid":"wave"}])")), "surfaces[0].coat.layers[0].solid", "waves");
  refused(scene(ramp_coat(R"("layers":[{"solid":"noise","frequency":"1 Hz"}])")),
          "surfaces[0].coat.layers[0].frequency");
  refused(scene(ramp_coat(R"("layers":[{"height_map":"map.png","amplitude":1}])")),
          "surfaces[0].coat.layers[0].amplitude");
  refused(scene(ramp_coat(R"("layers":[{"height_map":"map.png","repeat":2}])")), "surfaces[0].coat.layers[0].repeat");
  refused(scene(ramp_coat(R"("layers":{})")), "surfaces[0].coat.layers");
  refused(scene(ramp_coat(R"("detail":"mip")")), "surfaces[0].coat.detail");
  refused(scene(ramp_coat(R"("maps":{"stiffness":{"image":"map.png","high":1}})")),
          "surfaces[0].coat.maps.stiffness.low");
  refused(scene(ramp_coat(R"("maps":{"stiffness":{"image":"map.png","low":0,"high":1}})")),
          "surfaces[0].coat.maps.stiffness.low");
  refused(scene(ramp_coat(R"("maps":{"friktion":{}})")), "surfaces[0].coat.maps.friktion", "friction");
  refused(scene(ramp_coat(R"("maps":{"lay":{"image":"none.png"}})")), "", "none.png");
  refused(scene(ramp_coat(), R"("material":{"stickiness":-1})"), "surfaces[0].material.stickiness");
  refused(scene(ramp_coat(), R"("law":"god-object","material":{"stickiness":1})"), "surfaces[0].material.stickiness");
  refused(scene(R"("from":"gltf")"), "surfaces[0].coat.from");
}

TEST_F(ReliefScene, GltfMaterialsAreWorn) {
  // A sheet whose material has heights in metres and a map of stiffness.
  MeshSource source = plane_grid(0.08, 0.08, 2, 2);
  GltfMaterial material;
  material.name = "tiles";
  GltfHeight height;
  height.texture.image = std::make_shared<const Image>(ramp(32, 32));
  height.amplitude = 0.5e-3;
  material.height = height;
  GltfValueMap stiffness;
  stiffness.texture.image = std::make_shared<const Image>(ramp(32, 32));
  stiffness.black = 400.0;
  stiffness.white = 900.0;
  stiffness.stated = true;
  material.stiffness = stiffness;
  ASSERT_TRUE(write_gltf(folder_ / "tiles.glb", source, {}, std::span(&material, 1)).ok());
  const Experiment e = good(R"({"surfaces":[{"mesh":"tiles.glb","fit":"none","units":"m"}]})");
  EXPECT_NEAR(coat(e).highest(), 0.5e-3, 0.1e-3);  // where the ramp jumps the spline overshoots
  ASSERT_NE(coat(e).materials(), nullptr);
  EXPECT_NEAR(coat(e).materials()->most(MaterialChannel::stiffness), 900.0, 1.0);
  EXPECT_TRUE(noted(e, "1 materials of the glTF file, 1 with heights"));
  comes_back(e);
  refused(R"({"surfaces":[{"mesh":"tiles.glb","coat":{"from":"gltf","height":1}}]})", "surfaces[0].coat.height");
}

TEST_F(ReliefScene, FlightHelmetWearsItsNormals) {
  const std::filesystem::path file = shared / "meshes/FlightHelmet/FlightHelmet.gltf";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << "no FlightHelmet in the shared data";
  const Experiment e = good(fmt::format(R"({{"surfaces":[{{"mesh":"{}","law":"force-shading"}}]}})", file.string()));
  EXPECT_TRUE(noted(e, "with normals"));
  EXPECT_TRUE(coat(e).maps().has_normal_map());
  EXPECT_NE(short_run(e, 200), 0U);
}

TEST_F(ReliefScene, ExrHeightsAreMetresOrStretched) {
  const std::filesystem::path file = shared / "textures/exr-height/acrylic1.exr";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << "no EXR heights in the shared data";
  const std::string map = fmt::format(R"("height_map":"{}","mapping":"triplanar","tile":"20 mm")", file.string());
  const Experiment e = good(scene(map + R"(,"height":"0.5 mm")"));
  EXPECT_NEAR(coat(e).highest() - coat(e).lowest(), 0.5e-3, 0.2e-3);
  comes_back(e);
  // Without a height the values are metres: a brush of grey values is no relief of a sheet of 80 mm.
  refused(scene(map), "surfaces[0].coat.height_map", "relief of");
}

}  // namespace
}  // namespace asperity::relief_scene_test
