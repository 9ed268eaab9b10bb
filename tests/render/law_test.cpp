// What holds for every law: names and options, no force in the air, flat planes, cuts, units, determinism.

#include "asperity/render/laws.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "asperity/render/law_registry.h"
#include "tests/render/fixtures.h"

namespace asperity::law_test {
namespace {

using namespace test;

TEST(LawNames, every_name_makes_the_law_that_bears_it) {
  EXPECT_GE(law_names().size(), 7U);
  for (const std::string& name : law_names()) {
    const Law law = named(name);
    EXPECT_EQ(law_name(law), name);
    EXPECT_TRUE(validate(law).ok()) << name;
  }
}

TEST(LawNames, every_kind_of_law_is_listed_once_for_each_of_its_forms) {
  std::vector<const LawKind*> kinds;
  for (const std::string& name : law_names()) {
    const Law law = named(name);
    if (std::find(kinds.begin(), kinds.end(), &law.kind()) == kinds.end()) kinds.push_back(&law.kind());
    EXPECT_EQ(std::count(law_names().begin(), law_names().end(), name), 1) << name;
    const bool literal = name.ends_with("-literal");
    EXPECT_EQ(law.formulation().value_or(Formulation::consistent),
              literal ? Formulation::literal : Formulation::consistent)
        << name;
    const std::string other = literal ? name.substr(0, name.size() - 8) : name + "-literal";
    EXPECT_EQ(std::count(law_names().begin(), law_names().end(), other), law.formulation() ? 1 : 0) << name;
    if (law.formulation()) {
      EXPECT_EQ(law_name(law.in_form(Formulation::literal)), literal ? name : other);
      EXPECT_EQ(law_name(law.in_form(Formulation::consistent)), literal ? other : name);
    } else {
      EXPECT_EQ(law_name(law.in_form(Formulation::literal)), name);
    }
  }
  EXPECT_EQ(kinds, law_kinds());
  EXPECT_GE(kinds.size(), 13U);  // those built in, and what other tests of this program have registered
}

TEST(LawNames, what_is_no_name_is_refused) {
  for (const char* name :
       {"", "-literal", "proxy-literal", "god-object-literal", "Proxy", "height-field-literal-literal", "custom"}) {
    const Result<Law> law = law_by_name(name);
    ASSERT_FALSE(law.ok()) << name;
    EXPECT_EQ(law.error().code, ErrorCode::bad_value) << name;
  }
}

TEST(LawNames, the_literal_height_field_has_its_taper_however_it_is_made) {
  // 2005: heights are forced to 0 at the edges; a width is not given, the later paper's is taken.
  EXPECT_EQ(named("height-field-literal").as<HeightFieldLaw>()->edge_taper, 0.05);
  EXPECT_EQ(Law(HeightFieldLaw{}).in_form(Formulation::literal).as<HeightFieldLaw>()->edge_taper, 0.05);
  EXPECT_EQ(HeightFieldLaw{Formulation::literal}.edge_taper, 0.05);
  EXPECT_EQ(HeightFieldLaw{}.edge_taper, 0.0);
  EXPECT_EQ(HeightFieldLaw(HeightFieldLaw{Formulation::literal, 0.0}).edge_taper, 0.0);
}

TEST(LawNames, an_unknown_name_is_answered_with_the_nearest_and_the_list) {
  const std::pair<const char*, const char*> misspelt[] = {{"god-objct", "god-object"},
                                                          {"forceshading", "force-shading"},
                                                          {"hight-field", "height-field"},
                                                          {"mesostructure-litral", "mesostructure-literal"}};
  for (const auto& [wrong, right] : misspelt) {
    const auto law = law_by_name(wrong);
    ASSERT_FALSE(law.ok()) << wrong;
    EXPECT_EQ(law.error().code, ErrorCode::bad_value);
    EXPECT_NE(law.error().what.find(std::string("did you mean \"") + right + "\""), std::string::npos)
        << law.error().message();
    for (const std::string& name : law_names()) EXPECT_NE(law.error().accepted.find(name), std::string::npos);
  }
  EXPECT_EQ(law_by_name("x").error().what.find("did you mean"), std::string::npos);
}

void expect_refused(const Law& law, const std::string& place) {
  const Status status = validate(law);
  ASSERT_FALSE(status.ok()) << place;
  EXPECT_EQ(status.error().code, ErrorCode::bad_value);
  EXPECT_EQ(status.error().place, place);
  EXPECT_FALSE(status.error().accepted.empty());
}

TEST(LawOptions, each_bad_value_is_named) {
  for (const double bad : {-1e-9, 0.34, std::nan(""), infinity})
    expect_refused(HeightFieldLaw{Formulation::consistent, bad}, "edge_taper");
  for (const double bad : {0.0, -0.1, 0.34, std::nan(""), infinity}) {
    expect_refused(MesostructureLaw{Formulation::literal, bad, Blend::s_shape, {}}, "rho");
  }
  for (const std::vector<double>& bad :
       {std::vector<double>{}, {1.0}, {0.0, 1.1}, {-0.1, 1.0}, {0.0, std::nan(""), 1.0}, {1.0, 0.0}}) {
    expect_refused(MesostructureLaw{Formulation::literal, 0.05, Blend::image, bad}, "blend_map");
  }
  expect_refused(MesostructureLaw{Formulation::consistent, 0.1, Blend::s_shape, {}}, "rho");
  expect_refused(MesostructureLaw{Formulation::consistent, 0.05, Blend::linear, {}}, "blend");
  EXPECT_TRUE(validate(Law(MesostructureLaw{Formulation::literal, 1.0 / 3.0, Blend::image, {0.0, 1.0}})).ok());
  EXPECT_TRUE(validate(Law(HeightFieldLaw{Formulation::literal, 1.0 / 3.0})).ok());
}

TEST(BlendWeights, run_from_none_outside_the_band_to_all_inside_it) {
  for (const Blend blend : {Blend::none, Blend::linear, Blend::s_shape, Blend::quintic, Blend::image}) {
    const Stitching law{FoldMode::keep, blend, 0.1, {0.0, 0.3, 1.0}};
    EXPECT_EQ(blend_value(law, 0.1, -0.11).weight, 0.0);
    EXPECT_EQ(blend_value(law, 0.1, 0.11).weight, 1.0);
    EXPECT_EQ(blend_value(law, 0.1, 0.11).slope, 0.0);
    EXPECT_NEAR(blend_value(law, 0.1, 0.0).weight,
                blend == Blend::none    ? 1.0
                : blend == Blend::image ? 0.3
                                        : 0.5,
                1e-15);
  }
}

RC_GTEST_PROP(BlendWeights, slopes_agree_with_finite_differences, (std::uint64_t seed)) {
  Rng rng(seed);
  for (const Blend blend : {Blend::none, Blend::linear, Blend::s_shape, Blend::quintic, Blend::image}) {
    const Stitching law{FoldMode::keep, blend, rng.uniform(0.01, 1.0 / 3.0), {0.0, 0.1, 0.9, 1.0}};
    const double b = law.rho * rng.uniform(-0.99, 0.99);
    const double h = 1e-7 * law.rho;
    // Kinks and steps: the middle, and the image's thirds.
    for (const double kink : {0.0, -law.rho / 3.0, law.rho / 3.0}) RC_PRE(std::abs(b - kink) > 2.0 * h);
    const double slope =
        (blend_value(law, law.rho, b + h).weight - blend_value(law, law.rho, b - h).weight) / (2.0 * h);
    RC_ASSERT(std::abs(slope - blend_value(law, law.rho, b).slope) <= 1e-6 / law.rho);
    const double bend = (blend_value(law, law.rho, b + h).slope - blend_value(law, law.rho, b - h).slope) / (2.0 * h);
    RC_ASSERT(std::abs(bend - blend_value(law, law.rho, b).bend) <= 1e-6 / (law.rho * law.rho));
  }
}

RC_GTEST_PROP(BlendWeights, an_image_of_a_linear_ramp_is_linear, (std::uint64_t seed)) {
  Rng rng(seed);
  const double rho = rng.uniform(0.01, 1.0 / 3.0);
  std::vector<double> ramp;
  const int pixels = 2 + static_cast<int>(rng.below(60));
  for (int i = 0; i < pixels; ++i) ramp.push_back(static_cast<double>(i) / (pixels - 1));
  const Stitching image{FoldMode::keep, Blend::image, rho, ramp};
  const Stitching linear{FoldMode::keep, Blend::linear, rho, {}};
  const double b = rng.uniform(-1.5, 1.5) * rho;
  RC_ASSERT(std::abs(blend_value(image, rho, b).weight - blend_value(linear, rho, b).weight) <= 1e-12);
  RC_ASSERT(std::abs(blend_value(image, rho, b).slope - blend_value(linear, rho, b).slope) <= 1e-9 / rho);
}

/// Laws that feel facets in place of the relief: where these stand over it, and which of them holds a probe that comes
/// down on their common edge, is their own affair (rivals_test.cpp).
bool faceted(const std::string& name) {
  return name == "generated-geometry" || name == "dense-mesh";
}

/// Every law on one coated thing.
std::vector<std::pair<std::string, Scene>> scenes_of_every_law(const std::shared_ptr<const ReliefSurface>& surface) {
  std::vector<std::pair<std::string, Scene>> scenes;
  for (const std::string& name : relief_laws()) scenes.emplace_back(name, scene_of(surface, named(name)));
  return scenes;
}

void expect_no_force(const Scene& scene, ProxyState& state, const Vec3& p) {
  const ForceSample sample = touch(scene, state, p);
  RC_ASSERT(sample.wrench.force == Vec3::Zero());
  RC_ASSERT(!sample.flags.has(TickFlag::contact));
  RC_ASSERT(sample.contact.count == 0U);
  RC_ASSERT(sample.proxy == p);
}

RC_GTEST_PROP(NoForceInTheAir, over_a_relief_on_a_plane, (std::uint64_t seed)) {
  static const HeightMap map = wavy_map(1e-3);
  static const auto scenes = scenes_of_every_law(coated(plane_grid(0.04, 0.04, 4, 4), map, Mapping::uv));
  Rng rng(seed);
  for (const auto& [name, scene] : scenes) {
    if (faceted(name)) continue;
    ProxyState state;
    for (int i = 0; i < 20; ++i) {
      Vec3 p = random_point(rng, 0.018);
      // The literal laws render nothing below 0; the god-object feels the base at 0.
      const double top = std::max(0.0, map.height_at(Vec2(p.x() / 0.04 + 0.5, p.y() / 0.04 + 0.5)));
      p.z() = top + 1e-8 + rng.uniform(0.0, 3e-3) * rng.uniform();
      expect_no_force(scene, state, p);
    }
  }
}

RC_GTEST_PROP(NoForceInTheAir, around_a_closed_coated_mesh, (std::uint64_t seed)) {
  static const auto surface = coated(random_closed_mesh(5, 2, 0.02, 0.3), wavy_map(5e-4), Mapping::triplanar);
  static const auto scenes = scenes_of_every_law(surface);
  Rng rng(seed);
  SurfaceCache hint;
  for (const auto& [name, scene] : scenes) {
    for (int i = 0; i < 20; ++i) {
      const Vec3 p = random_point(rng, 0.03);
      // Over every height of the coat, wherever its foot may be.
      const FieldSample base = surface->base().eval(p, hint);
      if (base.value < 1.01 * surface->coat().amplitude_bound()) continue;
      ProxyState state;
      expect_no_force(scene, state, p);
      expect_no_force(scene, state, p + 0.005 * surface->coat().amplitude_bound() * base.gradient);
    }
  }
}

/// A pressed walk over a plane through the origin with this normal, a probe of this radius: largest lateral share of
/// the force.
double largest_lateral(const MeshSource& source, const Vec3& normal, double radius, Rng& rng) {
  const Scene scene = scene_of(bare(source), GodObjectLaw{}, stiffness, radius);
  const Vec3 u = normal.unitOrthogonal();
  const Vec3 v = normal.cross(u);
  ProxyState state;
  double largest = 0.0;
  Vec2 place(0.0, 0.0);
  touch(scene, state, (radius + 1e-3) * normal);
  for (int i = 0; i < 2000; ++i) {
    place += Vec2(rng.uniform(-1e-3, 1e-3), rng.uniform(-1e-3, 1e-3));
    place = place.cwiseMax(-0.012).cwiseMin(0.012);
    if (i % 50 == 0) place.setZero();  // a vertex of the mesh
    const double depth = rng.uniform(1e-6, 2e-3);
    const Vec3 force = touch(scene, state, place.x() * u + place.y() * v + (radius - depth) * normal).wrench.force;
    EXPECT_NEAR(force.dot(normal), stiffness * depth, 1e-9 * stiffness * depth + 1e-12);
    largest = std::max(largest, (force - force.dot(normal) * normal).norm() / force.norm());
  }
  return largest;
}

MeshSource turned(MeshSource source, const Quat& rotation) {
  for (Vec3& p : source.positions) p = rotation * p;
  return source;
}

TEST(FlatPlane, lateral_force_of_the_god_object_is_exactly_zero_at_every_tick) {
  Rng rng(12);
  for (const double radius : {0.0, 1.5e-3}) {
    for (int axis = 0; axis < 3; ++axis) {
      MeshSource source = plane_grid(0.04, 0.04, 4, 4);
      // Cyclic: keeps the orientation and the coordinates.
      for (Vec3& p : source.positions) p = Vec3(p[(3 - axis) % 3], p[(4 - axis) % 3], p[(5 - axis) % 3]);
      EXPECT_EQ(largest_lateral(source, Vec3::Unit((2 + axis) % 3), radius, rng), 0.0)
          << "axis " << axis << ", radius " << radius;
    }
  }
}

TEST(FlatPlane, lateral_force_of_the_god_object_is_rounding_on_a_tilted_one) {
  Rng rng(13);
  for (const double radius : {0.0, 1.5e-3}) {
    for (int i = 0; i < 8; ++i) {
      const Quat rotation(Eigen::AngleAxisd(rng.uniform(0.0, 6.0), random_direction(rng)));
      const Vec3 normal = rotation * Vec3::UnitZ();
      // Depths down to 1e-6 m on a plane whose corners are 0.03 m away carry the rounding of that distance.
      EXPECT_LT(largest_lateral(turned(plane_grid(0.04, 0.04, 4, 4), rotation), normal, radius, rng), 1e-12);
    }
  }
}

TEST(CutPlane, feels_the_same_in_2_to_32768_triangles_within_a_tenth_of_a_degree) {
  const HeightMap map = wavy_map(5e-4);
  const double tenth = 0.1 * std::numbers::pi / 180.0;
  for (const std::string& name : relief_laws()) {
    if (name == "height-field-literal") continue;  // heights fall to 0 at every edge: see the next test
    if (faceted(name)) continue;
    const auto scene_with = [&](std::uint32_t triangles) {
      return scene_of(coated(plane_grid(0.04, 0.04, triangles), map, Mapping::uv), named(name));
    };
    const Scene whole = scene_with(2);
    // The literal height laws feel only what is above the base, Algorithm 2 as it was meant only what its prisms hold.
    const bool literal = (name.find("literal") != std::string::npos && name != "force-shading-literal") ||
                         name == "mesostructure-intended";
    for (const std::uint32_t triangles : {8U, 512U, 32768U}) {
      const Scene cut = scene_with(triangles);
      Rng rng(21);
      int felt = 0;
      for (int i = 0; i < 300; ++i) {
        Vec3 p = random_point(rng, 0.018);
        p.z() = literal ? rng.uniform(0.0, 5e-4) : rng.uniform(-2e-3, -6e-4);
        const Vec3 outside(p.x(), p.y(), 2e-3);
        const Vec3 expected = poke(whole, outside, p).wrench.force;
        const Vec3 force = poke(cut, outside, p).wrench.force;
        ASSERT_NEAR(force.norm(), expected.norm(), 1e-4 * stiffness * 5e-4) << name << ", " << triangles;
        if (expected.norm() < 1e-3) continue;
        ++felt;
        ASSERT_LT(std::atan2(force.cross(expected).norm(), force.dot(expected)), tenth) << name << ", " << triangles;
      }
      EXPECT_GT(felt, literal ? 30 : 299) << name;
    }
  }
}

TEST(CutPlane, the_literal_height_field_feels_the_same_without_its_taper) {
  const HeightMap map = wavy_map(5e-4);
  const Law law = HeightFieldLaw{Formulation::literal, 0.0};
  const Scene whole = scene_of(coated(plane_grid(0.04, 0.04, 2U), map, Mapping::uv), law);
  const Scene cut = scene_of(coated(plane_grid(0.04, 0.04, 32768U), map, Mapping::uv), law);
  Rng rng(22);
  for (int i = 0; i < 500; ++i) {
    Vec3 p = random_point(rng, 0.018);
    p.z() = rng.uniform(0.0, 5e-4);
    ASSERT_LT((poke(whole, p, p).wrench.force - poke(cut, p, p).wrench.force).norm(), 1e-4 * stiffness * 5e-4);
  }
}

/// Through the shell of a sphere of 0.02 m: from over its relief to below it, all around.
std::vector<Vec3> path_around_sphere() {
  std::vector<Vec3> path;
  for (int i = 0; i < 3000; ++i) {
    const double a = 0.004 * i;
    path.emplace_back((0.0198 - 0.001 * std::sin(0.7 * a)) *
                      Vec3(std::cos(a), std::sin(a) * std::cos(0.3 * a), std::sin(a) * std::sin(0.3 * a)));
  }
  return path;
}

TEST(Units, a_mesh_in_millimetres_feels_as_the_same_mesh_in_metres) {
  for (const std::string& name : relief_laws()) {
    if (faceted(name)) continue;
    const Scene metres = scene_of(coated(icosphere(2, 0.02), wavy_map(5e-4), Mapping::triplanar), named(name));
    const Scene millimetres =
        scene_of(coated(icosphere(2, 20.0), wavy_map(5e-4), Mapping::triplanar, 0.01, 1e-3), named(name));
    const std::vector<Vec3> path = path_around_sphere();
    const auto expected = slide(metres, path, 1.2 * path.front());
    const auto forces = slide(millimetres, path, 1.2 * path.front());
    double strongest = 0.0;
    for (std::size_t i = 0; i < path.size(); ++i) {
      strongest = std::max(strongest, forces[i].norm());
      ASSERT_LT((forces[i] - expected[i]).norm(), 1e-6) << name << " at " << i;
    }
    EXPECT_GT(strongest, 0.01) << name;
  }
}

TEST(Determinism, the_same_path_twice_gives_the_same_bits) {
  const std::vector<Vec3> path = path_around_sphere();
  for (const auto& [name, scene] :
       scenes_of_every_law(coated(icosphere(2, 0.02), wavy_map(5e-4), Mapping::triplanar))) {
    const auto once = slide(scene, path);
    EXPECT_EQ(once, slide(scene, path)) << name;
    EXPECT_GT(largest_jump(once), 0.0) << name;
  }
}

}  // namespace
}  // namespace asperity::law_test
