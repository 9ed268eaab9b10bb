// Texture force: heterogeneous-features-2008, eq. 10 to 12, row Y-4, errata c, k, l.

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/field/sparse_grids.h"
#include "tests/render/textures.h"
#include "tests/render/volumes.h"

namespace asperity::test::texture_test {
namespace {

constexpr double pi = std::numbers::pi;
constexpr double depth = 1e-3;  // m: 1 N

/// Down onto z = -depth, then along x.
std::vector<Vec3> along_x(double from, double to, int count) {
  std::vector<Vec3> path = line({from, 0.0, 0.001}, {from, 0.0, -depth}, 20);
  const std::vector<Vec3> rest = line({from, 0.0, -depth}, {to, 0.0, -depth}, count);
  path.insert(path.end(), rest.begin() + 1, rest.end());
  return path;
}

TEST(Texture, Y_4_lateral_force_over_push_peaks_at_the_steepest_slope) {
  double peaks[2];
  int k = 0;
  for (const double wavelength : {5e-3, 2.5e-3}) {
    Instance instance = instance_of(flat_square());
    instance.fine = fine(fine_settings({grating(0.5e-3, wavelength)}, Formulation::literal));
    const Scene scene = scene_with(instance);
    double peak = 0.0;
    int crossings = 0;
    double last = 0.0;
    for (const ForceSample& sample : stroke(scene, along_x(-0.02, 0.02, 8000))) {
      if (!sample.flags.has(TickFlag::contact)) continue;
      const double push = sample.wrench.force.z();
      // Eq. 1: what is neither texture nor friction is the smooth plane's.
      const Vec3 constraint = sample.wrench.force - sample.parts.texture;
      EXPECT_NEAR(constraint.head<2>().norm(), 0.0, 1e-12);
      EXPECT_NEAR(sample.parts.texture.z(), 0.0, 1e-12);
      peak = std::max(peak, std::abs(sample.wrench.force.x()) / push);
      crossings += last * sample.wrench.force.x() < 0.0 ? 1 : 0;
      last = sample.wrench.force.x();
    }
    EXPECT_NEAR(peak, 2.0 * pi * 0.5e-3 / wavelength, 1e-4);
    // Two changes of sign a wavelength.
    EXPECT_NEAR(crossings, 2.0 * 0.04 / wavelength, 1.0);
    peaks[k++] = peak;
  }
  EXPECT_NEAR(peaks[0], 0.628, 1e-3);
  EXPECT_NEAR(peaks[1], 1.257, 1e-3);
  EXPECT_NEAR(peaks[1] / peaks[0], 2.0, 1e-3);
}

TEST(Texture, Consistent_force_is_the_slope_of_the_spring_pressed_into_the_relief) {
  const double amplitude = 0.2e-3;
  const double wavelength = 4e-3;
  Instance instance = instance_of(flat_square());
  instance.fine = fine(fine_settings({grating(amplitude, wavelength)}));
  const Scene scene = scene_with(instance);
  const std::vector<Vec3> path = along_x(-0.01, 0.01, 4000);
  const std::vector<ForceSample> samples = stroke(scene, path);
  const double w = 2.0 * pi / wavelength;
  for (std::size_t i = 30; i < samples.size(); i += 7) {
    const double x = path[i].x();
    // The crests lie on the plane.
    const double penetration = depth + amplitude * (std::cos(w * x) - 1.0);
    const double slope = -amplitude * w * std::sin(w * x);
    EXPECT_NEAR(samples[i].wrench.force.z(), stiffness * penetration, 1e-9);
    EXPECT_NEAR(samples[i].wrench.force.x(), -stiffness * penetration * slope, 1e-9);
    EXPECT_NEAR(samples[i].contact.penetration, penetration, 1e-12);
  }
}

TEST(Texture, Consistent_valleys_are_not_touched_by_a_light_probe) {
  Instance instance = instance_of(flat_square());
  instance.fine = fine(fine_settings({grating(0.2e-3, 4e-3)}));
  const Scene scene = scene_with(instance);
  ProxyState state;
  // 0.1 mm under the plane, in the valley of 0.4 mm; then over the crest.
  EXPECT_TRUE(touch(scene, state, {2e-3, 0.0, 1e-3}).wrench.force.isZero(0.0));
  const ForceSample valley = touch(scene, state, {2e-3, 0.0, -1e-4});
  EXPECT_TRUE(valley.wrench.force.isZero());
  EXPECT_FALSE(valley.flags.has(TickFlag::contact));
  const ForceSample crest = touch(scene, state, {4e-3, 0.0, -1e-4});
  EXPECT_NEAR(crest.wrench.force.z(), 0.1, 1e-9);
}

/// Into the valley at one depth, out at another: once around (J).
double rectangle_work(Formulation formulation) {
  Instance instance = instance_of(flat_square());
  instance.fine = fine(fine_settings({grating(0.5e-3, 5e-3)}, formulation));
  const Scene scene = scene_with(instance);
  // dh = 1 mm from crest to valley, dd = 1 mm.
  const Vec3 corners[] = {{0.0, 0.0, -2e-3}, {2.5e-3, 0.0, -2e-3}, {2.5e-3, 0.0, -3e-3}, {0.0, 0.0, -3e-3}};
  std::vector<Vec3> loop;
  for (int k = 0; k < 4; ++k) {
    const std::vector<Vec3> side = line(corners[k], corners[(k + 1) % 4], 2500);
    loop.insert(loop.end(), side.begin(), side.end() - 1);
  }
  return loop_work(scene, loop, {0.0, 0.0, 1e-3});
}

TEST(Texture, Erratum_k_the_printed_force_feeds_a_millijoule_a_loop) {
  EXPECT_NEAR(std::abs(rectangle_work(Formulation::literal)), stiffness * 1e-3 * 1e-3, 2e-5);
  EXPECT_NEAR(rectangle_work(Formulation::consistent), 0.0, 1e-8);
}

RC_GTEST_PROP(Texture, T1_consistent_loops_do_no_work, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint64_t>());
  Instance instance = instance_of(flat_square());
  FeatureSpec grid;
  grid.kind = FeatureKind::grid;
  grid.amplitude = rng.uniform(0.05e-3, 0.2e-3);
  grid.wavelength = {rng.uniform(2e-3, 6e-3), rng.uniform(2e-3, 6e-3)};
  grid.direction = rng.uniform(0.0, pi);
  instance.fine = fine(fine_settings({must(SurfaceFeature::build(grid)), grating(0.1e-3, 3e-3, rng.uniform(0.0, pi))}));
  const Scene scene = scene_with(instance);
  const std::vector<Vec3> loop = random_loop(rng, {0.0, 0.0, -2e-3}, 5e-3, 0.3e-3, 6000);
  const double work = loop_work(scene, loop, loop.front() + Vec3(0.0, 0.0, 0.01));
  RC_ASSERT(std::abs(work) <= 1e-6 * stiffness * loop_area(loop) + 1e-9);
}

TEST(Texture, A_loop_around_a_ball_gives_nothing) {
  // The foot runs ahead of the probe below a convex surface.
  Instance instance = instance_of(bare(icosphere(4, 0.03)));
  FeatureMappingSettings mapping;
  mapping.surface = IntermediateSurface::cylinder;
  mapping.radius = 0.03;
  instance.sides = Sides::front;
  instance.fine = fine(fine_settings({grating(0.1e-3, 2.0 * pi * 0.03 / 40.0)}, Formulation::consistent, mapping));
  const Scene scene = scene_with(instance);
  ProxyState state;
  double work = 0.0;
  double absorbed = 0.0;
  Vec3 force = Vec3::Zero();
  Vec3 before(0.035, 0.0, 0.002);
  for (int i = 0; i <= 60000; ++i) {
    const double a = 2.0 * pi * i / 6000.0;
    const double radius = i == 0 ? 0.035 : 0.0285 + 0.0004 * std::sin(7.3 * a);
    const Vec3 position(radius * std::cos(0.4 * std::sin(a)), radius * std::sin(0.4 * std::sin(a)),
                        0.002 * std::cos(a));
    const Vec3 now = touch(scene, state, position).wrench.force;
    work += 0.5 * (now + force).dot(position - before);
    absorbed = std::min(absorbed, work);
    force = now;
    before = position;
  }
  // Ten rounds: it may hold what the spring holds, and give back no more than that.
  EXPECT_LT(absorbed, -1e-4);
  EXPECT_LT(work, 2e-5);
}

/// Work done on a probe led along a closed path again and again, more than it took (J).
double given_in_rounds(const Scene& scene, std::span<const Vec3> round, int rounds) {
  ProxyState state;
  double work = 0.0;
  double most = -infinity;
  Vec3 before = round.front();
  Vec3 force = touch(scene, state, before).wrench.force;
  for (int i = 0; i < rounds; ++i) {
    for (const Vec3& position : round) {
      const Vec3 now = touch(scene, state, position).wrench.force;
      work += 0.5 * (now + force).dot(position - before);
      force = now;
      before = position;
    }
    most = std::max(most, work);
  }
  return most;
}

TEST(Texture, Touching_again_and_again_gives_nothing) {
  // A ball that rolls over the edges of a coarse sphere, lifts off and comes again: the foot is not where the potential
  // has it, and what it gives must not start anew with every touch.
  Instance coarse = instance_of(bare(icosphere(2, 0.03)));
  coarse.sides = Sides::front;
  coarse.fine = fine(fine_settings({grating(0.1e-3, 2e-3)}));
  const Scene ball = scene_with(coarse, 0.01);
  std::vector<Vec3> round;
  for (int i = 0; i < 2000; ++i) {
    const double a = 2.0 * pi * i / 2000.0;
    const double reach = 0.0395 + 0.0012 * std::sin(17.0 * a);
    round.emplace_back(reach * std::cos(0.5 * std::sin(a)), reach * std::sin(0.5 * std::sin(a)), 0.003 * std::cos(a));
  }
  EXPECT_LT(given_in_rounds(ball, round, 10), 1.5e-5);
  // A texture on a relief: press, slide, lift, return.
  Instance wavy = instance_of(coated(plane_grid(0.04, 0.04, 8, 8), wavy_map(0.2e-3, 64), Mapping::uv, 0.04));
  wavy.fine = fine(fine_settings({grating(0.02e-3, 1e-3)}));
  const Scene rough = scene_with(wavy);
  std::vector<Vec3> press = line({0.001, 0.0005, 0.001}, {0.001, 0.0005, -0.0005}, 300);
  for (const auto& [from, to] : {std::pair{Vec3(0.001, 0.0005, -0.0005), Vec3(0.0043, 0.0013, -0.0005)},
                                 {Vec3(0.0043, 0.0013, -0.0005), Vec3(0.0043, 0.0013, 0.001)},
                                 {Vec3(0.0043, 0.0013, 0.001), Vec3(0.001, 0.0005, 0.001)}}) {
    const std::vector<Vec3> part = line(from, to, 300);
    press.insert(press.end(), part.begin() + 1, part.end());
  }
  EXPECT_LT(given_in_rounds(rough, press, 20), 1.5e-5);
}

TEST(Texture, Where_a_mapping_crowds_the_force_stays_bounded) {
  // The axis of the cylinder goes through the plane: waves get as fine as one likes.
  FeatureMappingSettings mapping;
  mapping.surface = IntermediateSurface::cylinder;
  mapping.radius = 0.02;
  Instance instance = instance_of(flat_square());
  instance.fine = fine(fine_settings({grating(0.2e-3, 2.0 * pi * 0.02 / 20.0)}, Formulation::consistent, mapping));
  const Scene scene = scene_with(instance);
  ProxyState state;
  touch(scene, state, {-5e-3, 1e-5, 1e-3});
  for (int i = 0; i <= 2000; ++i) {
    const ForceSample sample = touch(scene, state, {-5e-3 + 5e-6 * i, 1e-5, -depth});
    EXPECT_LE(sample.wrench.force.norm(), 4.2 * stiffness * depth);
  }
}

TEST(Texture, Slopes_beyond_what_can_be_rendered_are_refused) {
  const auto built = FineFeatures::build(fine_settings({grating(5e-3, 1e-3)}));
  ASSERT_FALSE(built);
  EXPECT_NE(built.error().message().find("slopes"), std::string::npos) << built.error().message();
}

TEST(Texture, Erratum_c_the_printed_gradient_counts_the_angle_twice) {
  // The ramp of section 3.1.3, in units of 10 mm: along theta the printed slope is (1 + 1/r) times the true one.
  ParametricSettings formula;
  formula.shape = ParametricShape::ramp;
  formula.scale = 0.01;
  const auto ramp = std::make_shared<const ParametricSurface>(must(ParametricSurface::build(formula)));
  FeatureMappingSettings mapping;
  mapping.surface = IntermediateSurface::cylinder;
  mapping.radius = 0.01 / pi;
  mapping.range = Vec2(0.0, pi);
  const SurfaceFeature waves = grating(0.02e-3, 2.0 * pi * 0.01 / 20.0);
  for (const double r : {1.2, 2.0, 2.7}) {
    const ParametricJet jet = ramp->jet({0.77, r});
    const Vec3 way = jet.u.normalized();
    const Vec3 normal = ramp->normal(jet);
    double lateral[2];
    int k = 0;
    for (const Formulation formulation : {Formulation::literal, Formulation::consistent}) {
      Instance instance = instance_of(ramp);
      instance.fine = fine(fine_settings({waves}, formulation, mapping));
      const Scene scene = scene_with(instance);
      // So little pressed that the curve under the probe does not matter.
      const ForceSample sample = poke(scene, jet.point + 1e-3 * normal, jet.point - 6e-5 * normal);
      const double push =
          formulation == Formulation::literal ? stiffness * 6e-5 : stiffness * sample.contact.penetration;
      lateral[k++] = sample.wrench.force.dot(way) / push;
    }
    EXPECT_NEAR(lateral[0] / lateral[1], 1.0 + 1.0 / r, 0.02) << r;
  }
}

TEST(Texture, The_same_on_every_provider) {
  // A plane z = 0 as mesh, relief, isosurface, potential and formula; lateral force of the same grating.
  const double amplitude = 0.1e-3;
  const double wavelength = 5e-3;
  const auto volume =
      volumes::surface_of(volumes::sampled(volumes::cube(0.03, 31), [](const Vec3& p) { return p.z(); }), 0.0);
  ImplicitParts parts;
  parts.grid = test::sparse_grid([](const Vec3& p) { return p.z(); }, Box{Vec3::Constant(-0.02), Vec3::Constant(0.02)},
                                 1e-3, 6e-3, 6e-3);
  const auto potential = std::make_shared<const ImplicitSurface>(must(ImplicitSurface::build(parts)));
  ParametricSettings formula;
  formula.shape = ParametricShape::plane;
  const auto parametric = std::make_shared<const ParametricSurface>(must(ParametricSurface::build(formula)));
  const auto relief = coated(plane_grid(0.1, 0.1, 8, 8), flat_map(0.0), Mapping::uv, 0.1);
  const std::vector<std::pair<Surface, std::string>> all{{flat_square(), "proxy"},
                                                         {flat_square(), "god-object"},
                                                         {relief, "proxy"},
                                                         {relief, "mesostructure"},
                                                         {relief, "height-field"},
                                                         {volume, "proxy"},
                                                         {volume, "cross-uncross"},
                                                         {potential, "proxy"},
                                                         {potential, "virtual-contact-point"},
                                                         {parametric, "proxy"},
                                                         {flat_square(), "force-shading"}};
  const double w = 2.0 * pi / wavelength;
  for (const auto& [surface, law] : all) {
    SCOPED_TRACE(std::string(surface_kind(surface)) + "/" + law);
    Instance instance = instance_of(surface, named(law));
    instance.fine = fine(fine_settings({grating(amplitude, wavelength)}));
    const Scene scene = scene_with(instance);
    ProxyState state;
    touch(scene, state, {0.001, 0.002, 0.003});
    for (int i = 0; i < 200; ++i) {
      const Vec3 position(0.001 + 2e-5 * i, 0.002 + 1e-5 * i, i < 5 ? 0.001 - 3e-4 * i : -5e-4);
      const ForceSample sample = touch(scene, state, position);
      if (i < 6) continue;
      const double penetration = 5e-4 + amplitude * (std::cos(w * position.x()) - 1.0);
      EXPECT_NEAR(sample.wrench.force.z(), stiffness * penetration, 1e-6);
      EXPECT_NEAR(sample.wrench.force.x(), stiffness * penetration * amplitude * w * std::sin(w * position.x()), 1e-6);
      EXPECT_NEAR(sample.wrench.force.y(), 0.0, 1e-6);
    }
  }
}

TEST(Texture, Erratum_l_too_fine_for_the_speed_is_faded_and_told) {
  Instance instance = instance_of(flat_square());
  instance.fine = fine(fine_settings({grating(0.1e-3, 1e-3)}));
  const Scene scene = scene_with(instance);
  // At 1 kHz: 0.1 m/s are ten samples a wavelength, 0.3 m/s three and a third, 0.6 m/s fewer than two.
  for (const auto& [speed, least, most] : {std::tuple{0.1, 0.99, 1.0}, {0.3, 0.3, 0.95}, {0.6, 0.0, 0.0}}) {
    const int count = static_cast<int>(0.06 / (speed * 1e-3));
    std::vector<Vec3> path{{-0.03, 0.0, 0.001}};
    const std::vector<Vec3> rest = line({-0.03, 0.0, -depth}, {0.03, 0.0, -depth}, count);
    path.insert(path.end(), rest.begin(), rest.end());
    const std::vector<ForceSample> samples = stroke(scene, path);
    double largest = 0.0;
    bool faded = false;
    for (std::size_t i = 4; i < samples.size(); ++i) {
      // Of the lateral force over the push, which an alias would keep.
      largest = std::max(largest, std::abs(samples[i].wrench.force.x()) / samples[i].wrench.force.z());
      faded = faded || samples[i].flags.has(TickFlag::texture_faded);
    }
    const double whole = 2.0 * pi * 0.1e-3 / 1e-3;
    EXPECT_GE(largest, 0.9 * least * whole) << speed;
    EXPECT_LE(largest, most * whole * 1.001) << speed;
    EXPECT_EQ(faded, speed > 0.2) << speed;
  }
}

TEST(Texture, Along_the_grooves_speed_fades_nothing) {
  Instance instance = instance_of(flat_square());
  instance.fine = fine(fine_settings({grating(0.1e-3, 1e-3)}));
  const Scene scene = scene_with(instance);
  std::vector<Vec3> path{{2.5e-4, -0.03, 0.001}};
  const std::vector<Vec3> rest = line({2.5e-4, -0.03, -depth}, {2.5e-4, 0.03, -depth}, 60);
  path.insert(path.end(), rest.begin(), rest.end());
  const std::vector<ForceSample> samples = stroke(scene, path);
  for (std::size_t i = 4; i < samples.size(); ++i) {
    EXPECT_FALSE(samples[i].flags.has(TickFlag::texture_faded));
    EXPECT_GT(samples[i].wrench.force.x(), 0.5);
  }
}

TEST(Texture, Erratum_l_share_of_a_wavelength) {
  EXPECT_EQ(texture_share(1e-3, 0.0, Seconds(1e-3), 0.0), 1.0);
  EXPECT_EQ(texture_share(1e-3, 0.5, Seconds(1e-3), 0.0), 0.0);
  EXPECT_EQ(texture_share(1e-3, 0.25, Seconds(1e-3), 0.0), 1.0);
  EXPECT_NEAR(texture_share(1e-3, 1.0 / 3.0, Seconds(1e-3), 0.0), 0.5, 1e-12);
  // The same wavelength at ten times the rate.
  EXPECT_EQ(texture_share(1e-3, 0.5, Seconds(1e-4), 0.0), 1.0);
  // Steps of the device: 0.02 mm.
  EXPECT_EQ(texture_share(0.1e-3, 0.0, Seconds(1e-3), 0.02e-3), 1.0);
  EXPECT_EQ(texture_share(0.04e-3, 0.0, Seconds(1e-3), 0.02e-3), 0.0);
}

TEST(Texture, A_share_that_changes_with_speed_gives_no_energy) {
  Instance instance = instance_of(flat_square());
  instance.fine = fine(fine_settings({grating(0.2e-3, 1e-3)}));
  const Scene scene = scene_with(instance);
  ProxyState state;
  Rng rng(3);
  double work = 0.0;
  double pressed = 0.0;
  double most = 0.0;
  ProbeSample probe = probe_at({0.0, 0.0, 0.001});
  step(scene, state, probe, tick);
  Vec3 force = Vec3::Zero();
  for (int i = -2000; i < 40000; ++i) {
    const Vec3 before = probe.pose.position;
    // Pressed in first, then fast down the slopes and slow up them, the speed told being what it likes.
    probe.pose.position = {1e-3 * std::sin(0.01 * std::max(0, i)), 0.0, -1.2e-3 - 1.1e-6 * std::min(0, i)};
    probe.twist.linear = {rng.uniform(0.0, 0.6), 0.0, 0.0};
    const Vec3 now = step(scene, state, probe, tick).wrench.force;
    work += 0.5 * (now + force).dot(probe.pose.position - before);
    if (i == 0) pressed = work;
    most = std::max(most, work);
    force = now;
  }
  EXPECT_LT(pressed, -5e-4);
  EXPECT_LT(most, 1e-6);
}

TEST(Texture, From_the_coat_of_a_mesh_felt_bare) {
  // Normal map + lateral force: the god-object's push on the bare mesh, the lateral force of the coat's normals.
  const auto relief = coated(plane_grid(0.04, 0.04, 4, 4), wavy_map(0.05e-3, 64), Mapping::uv, 0.04);
  for (const Formulation formulation : {Formulation::literal, Formulation::consistent}) {
    Instance instance = instance_of(relief, named("god-object"));
    FineSettings settings = fine_settings({}, formulation);
    settings.source = TextureSource::coat;
    instance.fine = fine(settings);
    const Scene scene = scene_with(instance);
    ProxyState state;
    touch(scene, state, {0.0031, 0.0012, 0.001});
    const ForceSample sample = touch(scene, state, {0.0031, 0.0012, -depth});
    const TriangleMesh& mesh = relief->base().mesh();
    const std::uint32_t face = sample.contact.element;
    ASSERT_LT(face, mesh.triangles().size());
    const CoatSample coat =
        relief->coat().sample(mesh, face, barycentric_frame(mesh, face).coordinates({0.0031, 0.0012, 0.0}));
    const double push = formulation == Formulation::literal
                            ? stiffness * depth
                            : stiffness * (depth + coat.height - relief->coat().highest());
    EXPECT_NEAR(sample.wrench.force.z(), push, 1e-6);
    EXPECT_NEAR(sample.wrench.force.x(), -push * coat.gradient.x(), 1e-4 * push);
    EXPECT_NEAR(sample.wrench.force.y(), -push * coat.gradient.y(), 1e-4 * push);
    EXPECT_GT(sample.wrench.force.head<2>().norm(), 1e-3);
    // From behind the same sheet is seen from its other side: bumps are hollows.
    ProxyState behind;
    touch(scene, behind, {0.0031, 0.0012, -0.001});
    const ForceSample back = touch(scene, behind, {0.0031, 0.0012, depth});
    const double pull = formulation == Formulation::literal
                            ? stiffness * depth
                            : stiffness * (depth - coat.height + relief->coat().lowest());
    EXPECT_NEAR(back.wrench.force.z(), -pull, 1e-6);
    EXPECT_NEAR(back.wrench.force.x(), pull * coat.gradient.x(), 1e-4 * pull);
  }
}

TEST(Texture, What_is_felt_already_is_not_added_again) {
  Instance instance = instance_of(coated(plane_grid(0.04, 0.04, 4, 4), wavy_map(0.05e-3), Mapping::uv, 0.04));
  FineSettings settings = fine_settings({});
  settings.source = TextureSource::coat;
  instance.fine = fine(settings);
  std::vector<Instance> instances{instance};
  const auto scene = Scene::build(instances, 0.0);
  ASSERT_FALSE(scene);
  EXPECT_EQ(scene.error().code, ErrorCode::unsupported_pair);
  EXPECT_NE(scene.error().message().find("feels already"), std::string::npos) << scene.error().message();
}

TEST(Texture, Bad_settings_are_named) {
  const auto refused = [](FineSettings settings) {
    const auto built = FineFeatures::build(std::move(settings));
    return built ? std::string("accepted") : built.error().message();
  };
  FineSettings settings = fine_settings({});
  settings.lay.still_ratio = 1.5;
  EXPECT_NE(refused(settings).find("still_ratio"), std::string::npos);
  settings = fine_settings({});
  settings.lay.sliding_ratio = -0.1;
  EXPECT_NE(refused(settings).find("sliding_ratio"), std::string::npos);
  settings = fine_settings({});
  settings.resolution = std::nan("");
  EXPECT_NE(refused(settings).find("resolution"), std::string::npos);
  settings = fine_settings({grating(1e-4, 1e-3)});
  settings.source = TextureSource::coat;
  EXPECT_NE(refused(settings).find("coat"), std::string::npos);
  settings = fine_settings(std::vector<SurfaceFeature>(17, grating(1e-4, 1e-3)));
  EXPECT_NE(refused(settings).find("at most 16"), std::string::npos);
  // Mapping by UVs needs some.
  FeatureMappingSettings uv;
  uv.surface = IntermediateSurface::uv;
  Instance instance = instance_of(
      volumes::surface_of(volumes::sampled(volumes::cube(0.03, 5), [](const Vec3& p) { return p.z(); }), 0.0));
  instance.fine = fine(fine_settings({grating(1e-4, 1e-3)}, Formulation::consistent, uv));
  EXPECT_FALSE(Scene::build({instance}, 0.0));
}

}  // namespace
}  // namespace asperity::test::texture_test
