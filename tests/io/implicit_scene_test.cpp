// Implicit surfaces and the laws that are felt on them in scene files.

#include "asperity/field/conversion/mesh_conversion.h"
#include "asperity/io/sparse_io.h"
#include "asperity/render/law_registry.h"
#include "tests/field/sparse_grids.h"
#include "tests/io/experiment_fixture.h"

namespace asperity::implicit_scene_test {
namespace {

class ImplicitScene : public ExperimentTest {
 protected:
  void SetUp() override {
    ExperimentTest::SetUp();
    if (!has_mesh_voxelizer()) GTEST_SKIP() << "OpenVDB is not here: potentials cannot be made of meshes";
  }
  static const ImplicitSurface& implicit(const Experiment& experiment) {
    return *implicit_of(experiment.scene.instances()[0].surface);
  }
  [[nodiscard]] Error bad(const std::string& json) const {
    const Result<Experiment> result = parse(json);
    if (result) throw std::runtime_error("accepted: " + json);
    return result.error();
  }
  static std::string box(const std::string& implicit, const std::string& more = "") {
    return R"({"surfaces":[{"mesh":{"generator":"box","size":[0.04,0.04,0.04]},"implicit":)" + implicit + more + "}]}";
  }
  static bool noted(const Experiment& experiment, const char* text) {
    return std::any_of(experiment.notes.begin(), experiment.notes.end(),
                       [&](const std::string& note) { return note.find(text) != std::string::npos; });
  }
};

TEST_F(ImplicitScene, AMeshIsFeltThroughItsPotential) {
  const Experiment e = good(box(R"({"resolution":40})"));
  const ImplicitSurface& surface = implicit(e);
  EXPECT_NEAR(surface.grid().voxel(), 0.001, 1e-12);
  EXPECT_TRUE(surface.grid().has_faces());
  ASSERT_NE(surface.mesh(), nullptr);
  EXPECT_EQ(e.scene.facts(0).sides, Sides::front);
  SurfaceCache cache;
  EXPECT_NEAR(surface.eval(Vec3(0.0, 0.021, 0.004), cache).value, 0.001, 1e-7);
  EXPECT_NEAR(surface.eval(Vec3(0.0, 0.018, 0.004), cache).value, -0.002, 1e-7);
  // As deep as the device can press, and more.
  const double deepest = 1.5 * e.device.max_force / e.scene.instances()[0].material.stiffness;
  EXPECT_GE(surface.reach_inside(), deepest);
}

TEST_F(ImplicitScene, FinenessIsGivenInOneOfThreeWays) {
  EXPECT_NEAR(implicit(good(box(R"({"voxel":"0.8 mm"})"))).grid().voxel(), 0.0008, 1e-12);
  const Experiment e = good(box(R"({"budget":"4 MB","band_inside":"3 mm"})"));
  EXPECT_LE(implicit(e).grid().memory_bytes(), 4000000U);
  EXPECT_GE(implicit(e).grid().memory_bytes(), 1000000U);
  const Error both = bad(box(R"({"voxel":"1 mm","resolution":64})"));
  EXPECT_EQ(both.place, "surfaces[0].implicit.resolution");
}

TEST_F(ImplicitScene, LawsThatReachOutGetABandForIt) {
  for (const char* law :
       {R"({"type":"magnetic","band":"3 mm"})", R"({"type":"virtual-contact-point","offset":"3 mm"})"}) {
    const Experiment e = good(box(R"({"resolution":40})", R"(,"law":)" + std::string(law)));
    EXPECT_GE(implicit(e).reach_outside(), 0.003) << law;
  }
  const Experiment ball =
      good(R"({"surfaces":[{"mesh":{"generator":"box","size":[0.04,0.04,0.04]},"implicit":{"resolution":40},
               "law":{"type":"virtual-contact-point","offset":"3 mm"}}],"probe":{"radius":"2.5 mm"}})");
  EXPECT_GE(implicit(ball).reach_outside(), 0.0055);
  EXPECT_TRUE(noted(ball, "for the probe's ball"));
  const Error narrow =
      bad(box(R"({"resolution":40,"band_outside":"4 mm"})", R"(,"law":{"type":"magnetic","band":"3 mm"})"));
  EXPECT_EQ(narrow.place, "surfaces[0].law.band");
  EXPECT_NE(narrow.accepted.find("band_outside"), std::string::npos);
}

TEST_F(ImplicitScene, ACoatIsTheTextureOfThePotential) {
  const char* scene =
      R"({"surfaces":[{"mesh":{"generator":"box","size":[0.04,0.04,0.04]},"coat":{"height_map":{"generator":"H_2","size":64},
          "height":"0.4 mm","mapping":"triplanar","tile":"40 mm"},"implicit":{"resolution":80}}]})";
  const Experiment e = good(scene);
  const ImplicitSurface& surface = implicit(e);
  EXPECT_TRUE(surface.textured());
  EXPECT_TRUE(noted(e, "redistanced"));
  // On a face the height that the relief has there, wherever it is.
  const Experiment relief = good(
      R"({"surfaces":[{"mesh":{"generator":"box","size":[0.04,0.04,0.04]},"coat":{"height_map":{"generator":"H_2","size":64},
          "height":"0.4 mm","mapping":"triplanar","tile":"40 mm"}}]})");
  const auto& coat = **std::get_if<std::shared_ptr<const ReliefSurface>>(&relief.scene.instances()[0].surface);
  SurfaceCache cache;
  SurfaceCache other;
  double largest = 0.0;
  double squares = 0.0;
  int samples = 0;
  for (double x = -0.012; x < 0.012; x += 0.0007) {
    for (double z = -0.012; z < 0.012; z += 0.0007) {
      const Segment down{Vec3(x, 0.025, z), Vec3(x, 0.015, z)};
      const SweptHit here = surface.view(cache).first_touch(down, Sides::front);
      const SweptHit there = coat.view(other).first_touch(down, Sides::front);
      ASSERT_TRUE(here.hit && there.hit);
      const double off = 0.01 * (here.t - there.t);
      largest = std::max(largest, std::abs(off));
      squares += off * off;
      ++samples;
    }
  }
  EXPECT_LT(std::sqrt(squares / samples), 0.04e-3);
  EXPECT_LT(largest, 0.2e-3);
}

TEST_F(ImplicitScene, NoiseIsOfTheAmplitudeAskedFor) {
  const Experiment e = good(
      box(R"({"resolution":80,"redistance":"none","texture":{"amplitude":"0.3 mm","wavelength":"6 mm","seed":7}})"));
  const ImplicitSurface& surface = implicit(e);
  SurfaceCache cache;
  double low = 0.0;
  double high = 0.0;
  for (double x = -0.015; x < 0.015; x += 0.0005) {
    for (double z = -0.015; z < 0.015; z += 0.0005) {
      const SweptHit hit = surface.view(cache).first_touch({Vec3(x, 0.025, z), Vec3(x, 0.015, z)}, Sides::front);
      ASSERT_TRUE(hit.hit);
      low = std::min(low, hit.contact.point.y() - 0.02);
      high = std::max(high, hit.contact.point.y() - 0.02);
    }
  }
  EXPECT_LT(high, 0.00031);
  EXPECT_GT(low, -0.00031);
  EXPECT_GT(high - low, 0.0002);
  EXPECT_NE(
      short_run(e, 800),
      short_run(
          good(box(
              R"({"resolution":80,"redistance":"none","texture":{"amplitude":"0.3 mm","wavelength":"6 mm","seed":8}})")),
          800));
}

TEST_F(ImplicitScene, BrushesLayMaterials) {
  const Experiment e = good(box(
      R"({"resolution":40,"materials":[{"centre":[0,0.02,0],"radius":"5 mm","falloff":"1 mm","stiffness":"0.2 N/mm"}]})"));
  SparseHint hint;
  PointMaterial own;
  own.stiffness = 1000.0F;
  EXPECT_NEAR(implicit(e).grid().material(Vec3(0.0, 0.02, 0.0), own, hint).stiffness, 200.0, 1e-3);
  EXPECT_NEAR(implicit(e).grid().material(Vec3(0.01, 0.02, 0.0), own, hint).stiffness, 1000.0, 1e-3);
}

TEST_F(ImplicitScene, AFileIsReadInPlaceOfTheConversion) {
  const Experiment made = good(R"({"surfaces":[{"mesh":"sphere.ply","fit":"60 mm","implicit":{"resolution":40}}]})");
  const std::size_t faces = implicit(made).mesh()->mesh().triangles().size();
  ASSERT_TRUE(write_sparse(folder_ / "made.vdb", implicit(made).grid(), faces).ok());
  // Alone, in metres as it was written.
  const Experiment alone = good(R"({"surfaces":[{"implicit":{"file":"made.vdb"},"units":"m"}]})");
  EXPECT_EQ(implicit(alone).mesh(), nullptr);
  SurfaceCache cache;
  SurfaceCache other;
  for (const Vec3& p : {Vec3(0.0, 0.0295, 0.0), Vec3(0.02, 0.02, 0.001), Vec3(-0.031, 0.0, 0.0)}) {
    EXPECT_NEAR(implicit(alone).eval(p, cache).value, implicit(made).eval(p, other).value, 1e-8);
  }
  // Fitted to another size, as other files are.
  const Experiment larger = good(R"({"surfaces":[{"implicit":{"file":"made.vdb"},"fit":"120 mm"}]})");
  EXPECT_NEAR(implicit(larger).grid().voxel(), 2.0 * implicit(made).grid().voxel(),
              0.02 * implicit(made).grid().voxel());
  // With another mesh beside it.
  const Error other_mesh = bad(R"({"surfaces":[{"mesh":"sheet.obj","implicit":{"file":"made.vdb"}}]})");
  EXPECT_EQ(other_mesh.code, ErrorCode::mismatch);
  const Error missing = bad(R"({"surfaces":[{"implicit":{"file":"missing.vdb"}}]})");
  EXPECT_EQ(missing.code, ErrorCode::file_missing);
}

TEST_F(ImplicitScene, OpenSheetsGetAShellAndSaySo) {
  const Experiment e = good(R"({"surfaces":[{"mesh":"sheet.obj","fit":"80 mm","implicit":{"resolution":80}}]})");
  EXPECT_TRUE(noted(e, "shell"));
  SurfaceCache cache;
  const double above = implicit(e).eval(Vec3(0.0, 0.0, 0.002), cache).value;
  const double below = implicit(e).eval(Vec3(0.0, 0.0, -0.002), cache).value;
  EXPECT_NEAR(above, below, 1e-6);
  EXPECT_LT(implicit(e).eval(Vec3(0.0, 0.0, 0.0), cache).value, 0.0);
}

struct Refused {
  const char* scene;
  const char* place;
};

TEST_F(ImplicitScene, WrongKeysAreNamed) {
  const Refused cases[] = {
      {R"({"resolution":4})", "surfaces[0].implicit.resolution"},
      {R"({"voxel":"-1 mm"})", "surfaces[0].implicit.voxel"},
      {R"({"voxel":"1 nm"})", "surfaces[0].implicit.voxel"},
      {R"({"budget":"lots"})", "surfaces[0].implicit.budget"},
      {R"({"inside":"somewhere"})", "surfaces[0].implicit.inside"},
      {R"({"band_inside":"most"})", "surfaces[0].implicit.band_inside"},
      {R"({"inside":"flood","shell_thickness":"1 mm"})", "surfaces[0].implicit.shell_thickness"},
      {R"({"grid":"distance"})", "surfaces[0].implicit.grid"},
      {R"({"offset":"-1 mm"})", "surfaces[0].implicit.offset"},
      {R"({"redistance":"none"})", "surfaces[0].implicit.redistance"},
      {R"({"resolution":40,"texture":{"amplitude":0}})", "surfaces[0].implicit.texture.amplitude"},
      {R"({"resolution":40,"texture":{"amplitude":2.5}})", "surfaces[0].implicit.texture.amplitude"},
      {R"({"resolution":40,"texture":{"type":"gaussian","wavelength":1}})", "surfaces[0].implicit.texture.wavelength"},
      {R"({"resolution":40,"materials":[{"centre":[0,0.02,0]}]})", "surfaces[0].implicit.materials[0].stiffness"},
      {R"({"resolution":40,"materials":[{"centre":[0,0.02,0],"radius":"1 mm","falloff":"2 mm","stiffness":1}]})",
       "surfaces[0].implicit.materials[0].falloff"},
      {R"({"resolution":40,"materials":[{"centre":[0,0.02,0],"roughness":2}]})",
       "surfaces[0].implicit.materials[0].roughness"},
      {R"({"resolution":40,"materials":[{"centre":[5,0,0],"stiffness":1}]})", "surfaces[0].implicit.materials[0]"},
      {R"({"file":"a.vdb","voxel":"1 mm"})", "surfaces[0].implicit.voxel"},
  };
  for (const Refused& refused : cases) {
    const Error error = bad(box(refused.scene));
    EXPECT_EQ(error.place.substr(0, std::string(refused.place).size()), refused.place)
        << refused.scene << ": " << error.message();
    EXPECT_FALSE(error.accepted.empty()) << refused.scene;
  }
}

/// Every law, on surfaces of every kind that it can be felt on: told that a coefficient is not read where, and only
/// where, it changes no force.
TEST_F(ImplicitScene, CoefficientsThatALawDoesNotReadAreTold) {
  const std::string surfaces[] = {R"("mesh":"sphere.ply","fit":"10cm")",
                                  R"("mesh":"sheet.obj","fit":"10cm","coat":{"height_map":"map.png","height":"1mm"})",
                                  R"("volume":{"generator":"sphere","size":[24,24,24]},"iso":{"threshold":0})",
                                  R"("mesh":{"generator":"box","size":[0.04,0.04,0.04]},"implicit":{"resolution":20})"};
  int neither = 0;
  int static_alone = 0;
  int both = 0;
  for (const std::string& surface : surfaces) {
    for (const std::string& law : law_names()) {
      SCOPED_TRACE(law + " on " + surface);
      const auto with = [&](const char* material) {
        return parse(R"({"surfaces":[{)" + surface + R"(,"law":")" + law + R"(","material":)" + material + "}]}");
      };
      const auto smooth = with("{}");
      if (!smooth) continue;
      const auto rough = with(R"({"static_friction":0.4,"dynamic_friction":0.2})").value();
      const auto sliding = with(R"({"static_friction":0.2,"dynamic_friction":0.2})").value();
      const auto hash = [](const Experiment& e) { return short_run(e, 1200); };
      const bool reads_any = hash(sliding) != hash(*smooth);
      EXPECT_EQ(noted(rough, "reads neither static_friction nor dynamic_friction"), !reads_any);
      EXPECT_EQ(noted(sliding, "reads neither static_friction nor dynamic_friction"), !reads_any);
      EXPECT_FALSE(noted(*smooth, "friction"));
      const bool told = noted(rough, "does not read the static_friction");
      if (told) {
        EXPECT_EQ(hash(rough), hash(sliding));
      }
      EXPECT_FALSE(noted(sliding, "does not read the static_friction"));
      neither += reads_any ? 0 : 1;
      static_alone += told ? 1 : 0;
      both += reads_any && !told ? 1 : 0;
      // Where a friction law is named every law feels it, and nothing is said.
      const auto named =
          with(R"({"static_friction":0.4,"dynamic_friction":0.2,"friction":"implicit-coulomb"})").value();
      // (As printed some push nothing out here: there is nothing to rub by.)
      if (!law.ends_with("-literal")) {
        EXPECT_NE(hash(named), hash(*smooth));
      }
      EXPECT_FALSE(noted(named, "reads neither"));
      EXPECT_FALSE(noted(named, "does not read"));
    }
  }
  // avila and cross-uncross, and the laws of meshes without a proxy on the surface; virtual contact points and magnets;
  // the proxy.
  EXPECT_GE(neither, 8);
  EXPECT_GE(static_alone, 4);
  EXPECT_GE(both, 4);
}

TEST_F(ImplicitScene, LawsAndSurfacesThatDoNotGoTogetherAreNamed) {
  for (const char* law : {"god-object", "force-shading", "mesostructure", "height-field"}) {
    const Error error = bad(box(R"({"resolution":20})", R"(,"law":")" + std::string(law) + "\""));
    EXPECT_EQ(error.code, ErrorCode::unsupported_pair) << law;
    EXPECT_NE(error.accepted.find("virtual-contact-point"), std::string::npos) << law;
  }
  for (const char* law : {"virtual-contact-point", "magnetic", "normal-perturbation"}) {
    const Error error = bad(R"({"surfaces":[{"mesh":{"generator":"box"},"law":")" + std::string(law) + "\"}]}");
    EXPECT_EQ(error.code, ErrorCode::unsupported_pair) << law;
  }
  EXPECT_EQ(bad(box(R"({"resolution":20})", R"(,"law":"normal-perturbation")")).place, "surfaces[0].law");
  EXPECT_EQ(bad(box(R"({"resolution":20})", R"(,"volume":{"generator":"sphere"})")).place, "surfaces[0].volume");
  EXPECT_EQ(
      bad(box(R"({"resolution":20})", R"(,"law":{"type":"virtual-contact-point","magnitude":"potential"})")).place,
      "surfaces[0].law.magnitude");
}

}  // namespace
}  // namespace asperity::implicit_scene_test
