// large-data-2008 on its own task: who notices the isosurface, who stays on it, by how
// much, and what of it is felt (rows M-3, M-5, M-6).

#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <numbers>

#include "asperity/core/rng.h"
#include "asperity/device/ideal_probe.h"
#include "asperity/device/simulated_device.h"
#include "asperity/field/volume/generators.h"
#include "asperity/io/experiment.h"
#include "asperity/render/laws.h"
#include "asperity/render/step.h"
#include "asperity/servo/session.h"
#include "asperity/study/follow.h"
#include "asperity/study/metrics.h"
#include "asperity/study/spectrum.h"
#include "tests/render/volumes.h"

namespace asperity::large_data_test {
namespace {

// --- M-3: who notices ---

constexpr int passages = 1500;
constexpr double loop_rate = 1400.0;  // Hz, the paper's

/// An isosurface as M1 feels it, with a layer of `band`, M2 and the proxy.
std::vector<Scene> three_laws(const std::shared_ptr<const IsoSurface>& surface, double band, const Pose& pose = {}) {
  std::vector<Scene> scenes;
  AvilaLaw m1;
  m1.band = band;
  for (const Law& law : {Law(m1), Law(CrossUncrossLaw{}), Law(ProxyLaw{})}) {
    std::vector<Instance> instances(1);
    instances[0].name = "sheet";
    instances[0].surface = surface;
    instances[0].law = law;
    instances[0].world_from_object = pose;
    scenes.push_back(Scene::build(std::move(instances), 0.0).value());
  }
  return scenes;
}

/// Along y over 20 mm, where `height(y)` is the sheet's x.
template <class Height>
StrokePath over(const Height& height, const Pose& pose = {}) {
  StrokeSettings settings;
  settings.start = pose.apply(Vec3(0.0, -0.01, 0.0));
  settings.end = pose.apply(Vec3(0.0, 0.01, 0.0));
  return build_stroke(
             settings,
             [&](const Vec3& p) {
               const Vec3 at = pose.apply_inverse(p);
               return SurfacePoint{pose.apply(Vec3(height(at.y()), at.y(), at.z())), pose.rotate(Vec3::UnitX())};
             })
      .value();
}

std::vector<DetectionRow> detected(const std::vector<Scene>& scenes, const StrokePath& path) {
  DetectionSettings settings;
  settings.speeds = {0.02, 0.2, 0.5, 5.0};
  settings.rate = loop_rate;
  settings.passages = passages;
  return detection_table(scenes, path, settings).value();
}

/// Four standard deviations of a share of so many passages; none where the share is certain.
void expect_share(double share, double law, double slack = 0.0) {
  EXPECT_NEAR(share, law, 4.0 * std::sqrt(law * (1.0 - law) / passages) + slack + 1e-12);
}

TEST(Rows, M3_M1MissesFlatSheetsAsTheSamplingSaysAndM2None) {
  constexpr double slope = 1e4;
  constexpr double thickness = 0.05e-3;
  const auto surface =
      volumes::surface_of(volumes::sampled(volumes::cube(0.02, 8), [](const Vec3& p) { return slope * p.x(); }), 0.0);
  // Wherever it lies.
  const Pose pose{Vec3(0.1, -0.2, 0.3), Quat(Eigen::AngleAxisd(0.7, Vec3(1.0, 2.0, -1.0).normalized()))};
  const auto rows = detected(three_laws(surface, slope * thickness, pose), over([](double) { return 0.0; }, pose));
  ASSERT_EQ(rows.size(), 4U);
  // The checklist's figures: 0.35 at 0.2 m/s, 0.14 at 0.5 m/s.
  const double figures[] = {1.0, 0.35, 0.14, 0.014};
  for (std::size_t i = 0; i < rows.size(); ++i) {
    SCOPED_TRACE(rows[i].speed);
    EXPECT_NEAR(rows[i].layer, thickness, 1e-3 * thickness);
    EXPECT_NEAR(rows[i].expected, figures[i], 1e-3 * figures[i]);
    expect_share(rows[i].share[0], figures[i]);
    EXPECT_EQ(rows[i].share[1], 1.0);
    EXPECT_EQ(rows[i].share[2], 1.0);
  }
}

TEST(Rows, M3_M1MissesCurvedSheetsAsTheSamplingSaysAndM2None) {
  // A ball of 15 mm in a field of distances: the layer is as thick as its band.
  constexpr double thickness = 0.05e-3;
  constexpr double radius = 0.015;
  const auto surface =
      volumes::surface_of(volumes::sampled(volumes::cube(0.025, 101), [](const Vec3& p) { return p.norm(); }), radius);
  const auto height = [](double y) { return std::sqrt(radius * radius - y * y); };
  for (const DetectionRow& row : detected(three_laws(surface, thickness), over(height))) {
    SCOPED_TRACE(row.speed);
    const double law = std::min(1.0, thickness * loop_rate / row.speed);
    // Cells of 0.5 mm on a radius of 15 mm: the sampled distance's slope is off by (h / r)^2 = 0.1 %.
    expect_share(row.share[0], law, 2e-3 * law);
    EXPECT_EQ(row.share[1], 1.0);
    EXPECT_EQ(row.share[2], 1.0);
  }
}

TEST(Rows, M3_M1MissesNoisySheetsAsTheSamplingSaysAndM2None) {
  // x = n(y, z), eight random waves of 3 to 10 mm and slopes up to 1, in a field whose slope varies with the noise too.
  struct Wave {
    double ky, kz, phase;
  };
  std::vector<Wave> waves;
  Rng rng(5);
  for (int i = 0; i < 8; ++i) {
    const double k = 2.0 * std::numbers::pi / rng.uniform(3e-3, 10e-3);
    const double turn = rng.uniform(0.0, 2.0 * std::numbers::pi);
    waves.push_back({k * std::cos(turn), k * std::sin(turn), rng.uniform(0.0, 2.0 * std::numbers::pi)});
  }
  const auto height = [&](double y, double z) {
    double sum = 0.0;
    for (const Wave& w : waves) sum += 1e-4 * std::cos(w.ky * y + w.kz * z + w.phase);
    return sum;
  };
  const auto slope = [](double y) { return 1e4 * (1.0 + 0.8 * std::sin(900.0 * y)); };
  const auto surface = volumes::surface_of(
      volumes::sampled(
          {GridAxis::uniform(-0.005, 0.25e-3, 41).value(), GridAxis::uniform(-0.0125, 0.25e-3, 101).value(),
           GridAxis::uniform(-0.0025, 0.25e-3, 21).value()},
          [&](const Vec3& p) { return slope(p.y()) * (p.x() - height(p.y(), p.z())); }),
      0.0);
  constexpr double band = 0.5;
  const StrokePath path = over([&](double y) { return height(y, 0.0); });
  const auto rows = detected(three_laws(surface, band), path);
  ASSERT_EQ(rows.size(), 4U);
  for (const DetectionRow& row : rows) {
    SCOPED_TRACE(row.speed);
    // Over the way: the layer is band / |grad phi| thick, |grad phi| = slope sqrt(1 + |grad n|^2) on the sheet.
    double law = 0.0;
    double spread = 0.0;
    for (const Vec3& p : path.points()) {
      Vec2 gradient = Vec2::Zero();
      for (const Wave& w : waves) gradient -= 1e-4 * std::sin(w.ky * p.y() + w.kz * p.z() + w.phase) * Vec2(w.ky, w.kz);
      const double thickness = band / (slope(p.y()) * std::sqrt(1.0 + gradient.squaredNorm()));
      const double one = std::min(1.0, thickness * loop_rate / row.speed);
      law += one / static_cast<double>(path.points().size());
      spread += one * one / static_cast<double>(path.points().size());
    }
    EXPECT_GT(spread - law * law, row.speed > 0.1 && row.speed < 1.0 ? 1e-3 : 0.0) << "layers differ along the way";
    // Waves of 12 cells and more: the sampled slope is off by (k h)^2 / 6 at most, of the noise's share.
    expect_share(row.share[0], law, 0.02 * law);
    EXPECT_NEAR(row.expected, law, 0.05 * law);
    EXPECT_EQ(row.share[1], 1.0);
    EXPECT_EQ(row.share[2], 1.0);
  }
}

TEST(Rows, M3_SheetsWithinACellArePassedByM1AndM2AsTheSamplingSaysAndByTheProxyNever) {
  // Low within 50 um of x = 0, in cells of 1 mm: both faces in neighbouring cells. Whoever crosses and uncrosses within
  // a tick is outside again, so that M2 has nothing left to feel (large-data-2008, section 4.2): it notices the sheet
  // where a tick ends in it, as M1 does.
  constexpr double half = 0.05e-3;
  auto grid = volumes::sampled(volumes::cube(0.02, 41), [](const Vec3& p) { return std::abs(p.x()); });
  const auto surface = volumes::surface_of(
      std::make_shared<const ScalarField>(ScalarGrid(*grid->grid()), CellReconstruction::trilinear), half);
  const auto rows = detected(three_laws(surface, 1.0), over([](double) { return half; }));
  ASSERT_EQ(rows.size(), 4U);
  for (const DetectionRow& row : rows) {
    SCOPED_TRACE(row.speed);
    const double law = std::min(1.0, 2.0 * half * loop_rate / row.speed);
    EXPECT_NEAR(row.layer, 2.0 * half, 1e-3 * half);
    expect_share(row.share[0], law);
    expect_share(row.share[1], law);
    EXPECT_EQ(row.share[2], 1.0);
  }
}

// --- M-5: who stays on it ---

Experiment scene(const char* name, const Law& law) {
  return with_law(parse_experiment(builtin_scene_json(name).value(), ".", name).value(), law).value();
}

template <class Probe>
std::vector<TraceRecord> run_with(const Experiment& experiment, Probe probe) {
  SafetyStage safety = SafetyStage::build(SafetySettings::from_profile(experiment.device)).value();
  SessionSettings settings;
  settings.dt = Seconds(1.0 / experiment.rate);
  ProxyState state;
  ProxyCache cache;
  std::vector<TraceRecord> records;
  run_session([&](const ProbeSample& p, Seconds dt) { return step(experiment.scene, state, cache, p, dt); }, probe,
              safety, settings, [&](const TraceRecord& record) { records.push_back(record); });
  return records;
}

/// As `asperity touch` runs it.
std::vector<TraceRecord> run(const Experiment& experiment) {
  if (experiment.probe == ProbeKind::ideal)
    return run_with(experiment, IdealProbe::build(experiment.path, experiment.ideal).value());
  return run_with(
      experiment,
      SimulatedDevice::build(experiment.path, experiment.device, experiment.hand, experiment.simulated).value());
}

/// The scene's stroke turned about z by `heading` and put `beside` the strip's middle, over the plane z = 0.
StrokePath headed(const Experiment& experiment, double heading, double beside) {
  StrokeSettings stroke = experiment.stroke;
  const double half = 0.5 * (stroke.end - stroke.start).norm();
  const Vec3 way(std::cos(heading), std::sin(heading), 0.0);
  stroke.start = Vec3(0.0, beside, 0.0) - half * way;
  stroke.end = Vec3(0.0, beside, 0.0) + half * way;
  return build_stroke(stroke,
                      [](const Vec3& p) {
                        return SurfacePoint{Vec3(p.x(), p.y(), 0.0), Vec3::UnitZ()};
                      })
      .value();
}

double deepest(const std::vector<TraceRecord>& records) {
  double depth = 0.0;
  for (const TraceRecord& record : records) depth = std::max(depth, -record.probe.pose.position.z());
  return depth;
}

// The task of section 5.1, M1 against M2, at the paper's bounds. What the bounds rest on (docs/volumes.md):
//   the hand aims a = 2 mm below the sheet by a spring K = 100 N/m, the surface answers with k = 4 N/mm: it gives way
//   by a K / (k + K) = 49 um, under 0.2 N; where the strip is steepest the field's largest deviation over its slope is
//   half the box's height, 50 mm.
// So M2 errs by 49 um / 50 mm = 0.098 % there. To the paper's 0.15 % = 75 um are left 26 um, for: what is left of
// touching down at 5 mm/s, v sqrt(m / k) = 40 um with the 0.25 kg of hand and device, damped by 3 N s/m for the 0.4 s
// until the hand aims at its depth: 40 um exp(-0.4 s 3 N s/m / 0.5 kg) = 4 um; the encoder's 10 um; and the inertia
// over undulations of 30 um and 6 mm at 40 mm/s, m a w^2 / k = 3 um. M1's layer, 3 N of the material's stiffness where
// the slope is typical, is under 10 um thick there, one step of the encoder. Once it is lost the hand comes to rest at
// its aim: 2 mm / 50 mm = 4 % in the middle of the strip.
TEST(Rows, M5_M2StaysWithinThePapersBoundWhereM1Falls) {
  const Experiment m1 = scene("follow", AvilaLaw{});
  const Experiment m2 = scene("follow", CrossUncrossLaw{});
  const double aim = m2.stroke.depth;
  const double rest = aim * m2.hand.stiffness / (m2.scene.instances()[0].material.stiffness + m2.hand.stiffness);
  for (const double degrees : {0.0, 15.0, 45.0, 90.0}) {
    for (const double beside : {0.0, 3e-3}) {
      const auto followed = [&](Experiment experiment) {
        experiment.path = headed(experiment, degrees * std::numbers::pi / 180.0, beside);
        const std::vector<TraceRecord> records = run(experiment);
        // The arm's stop is at 10 mm: what M1's error comes from is the hand's spring, which overshoots.
        EXPECT_LT(deepest(records), 2.0 * aim);
        return measure_run(records, experiment.scene, experiment.path).follow;
      };
      SCOPED_TRACE(testing::Message() << degrees << " degrees, " << 1e3 * beside << " mm beside");
      const FollowMetrics avila = followed(m1);
      const FollowMetrics cross = followed(m2);
      ASSERT_GT(cross.samples, 1000U);
      EXPECT_EQ(cross.excluded, 0U);
      EXPECT_LE(cross.max, 0.15e-2);
      EXPECT_GE(avila.global, 1.18e-2);
      EXPECT_GE(avila.max, 1.18e-2);
      if (degrees == 0.0 && beside == 0.0) {
        // The whole way where the strip is steepest.
        EXPECT_NEAR(cross.mean, rest / 0.05, 0.05 * rest / 0.05);
        EXPECT_NEAR(avila.global, aim / 0.05, 0.1 * aim / 0.05);
      }
    }
  }
}

/// The cavity's vorticity by its formula, in the scene, where the box is centred.
class Vorticity {
 public:
  Vorticity() : flow_(CavityFlow::build({.kind = VolumeKind::cavity}).value()) {}
  [[nodiscard]] double at(const Vec3& p) const {
    const Mat3 g = flow_.gradient(p + Vec3(0.1, 0.05, 0.05));
    return Vec3(g(2, 1) - g(1, 2), g(0, 2) - g(2, 0), g(1, 0) - g(0, 1)).norm();
  }
  [[nodiscard]] Vec3 slope(const Vec3& p) const {
    constexpr double h = 1e-6;
    Vec3 out;
    for (int k = 0; k < 3; ++k) out[k] = (at(p + h * Vec3::Unit(k)) - at(p - h * Vec3::Unit(k))) / (2.0 * h);
    return out;
  }

 private:
  CavityFlow flow_;
};

// Why the cavity's own error is not 0.15 %: it is slope x force / (stiffness x largest deviation), and on the cavity
// the whole range of the vorticity lies within a layer of half thickness 3 mm (3 % of 100 mm), so that 200 um are 2 to
// 10 % of it. 0.15 % of a layer of 3 mm is 4.5 um: a quarter of an encoder's step, under a force of 4.5 mN.
TEST(Rows, M5_ErrorOnTheCavityIsItsSlopeTimesForceOverStiffness) {
  const Experiment cavity = scene("cavity", CrossUncrossLaw{});
  const IsoSurface& surface = *iso_of(cavity.scene.instances()[0].surface);
  const double stiffness = cavity.scene.instances()[0].material.stiffness;
  const double force = cavity.stroke.normal_force;
  ASSERT_EQ(force, 0.2);
  ASSERT_EQ(stiffness, 1000.0);
  constexpr double layer = 3e-3;
  const Vorticity vorticity;
  double largest = 0.0;
  const GridAxes& axes = surface.field().axes();
  for (const double x : axes[0].nodes()) {
    for (const double y : axes[1].nodes()) {
      for (const double z : axes[2].nodes())
        largest = std::max(largest, std::abs(vorticity.at({x, y, z}) - surface.threshold()));
    }
  }
  // The scene's field is of differences over cells of up to 0.3 mm across the layer: off by (h / layer)^2 / 3 of its
  // greatest value (tanh), three times that where the layer has rolled up.
  constexpr double sampling = 0.01;
  double least_room = infinity;
  double worst = 0.0;
  int count = 0;
  const std::vector<TraceRecord> records = run(cavity);
  for (std::size_t i = 0; i < records.size(); i += 20) {
    const Seconds time = records[i].probe.time;
    // From 0.1 s on the regulator of 20 Hz has settled.
    if (cavity.path.pose(time).phase != StrokePhase::contact || time < cavity.path.contact_begin() + Seconds(0.1))
      continue;
    const Vec3& p = records[i].probe.pose.position;
    CellCache cells;
    const double measured = follow_error(surface.view(cells), p);
    EXPECT_NEAR(measured, std::abs(vorticity.at(p) - surface.threshold()) / largest, sampling) << i;
    // `force / stiffness` out of the vortex, against the vorticity's slope half way, is the surface.
    const double depth = force / stiffness;
    const Vec3 middle = p - 0.5 * depth * vorticity.slope(p).normalized();
    const Vec3 slope = vorticity.slope(middle);
    EXPECT_NEAR(vorticity.at(p - depth * slope.normalized()), surface.threshold(), sampling * largest) << i;
    EXPECT_NEAR(measured, slope.norm() * force / (stiffness * largest), sampling) << i;
    least_room = std::min(least_room, 0.15e-2 * largest / slope.norm());
    worst = std::max(worst, measured);
    ++count;
  }
  ASSERT_GT(count, 200);
  EXPECT_LT(least_room, 0.15e-2 * layer);
  EXPECT_LT(least_room, 0.25 * cavity.device.position_resolution);
  EXPECT_GT(worst, force / stiffness / layer);
  std::cout << "cavity: at most " << 100.0 * worst << " %; the paper's 0.15 % would be " << 1e6 * least_room
            << " um under " << 1e3 * least_room * stiffness << " mN, steps of the encoder "
            << 1e6 * cavity.device.position_resolution << " um, narrowest cell "
            << 1e6 * surface.field().narrowest_cell() << " um\n";
}

// --- M-6: what is felt ---

/// Amplitude of the undulation in what is felt, over whole waves of the contact phase's second half.
double undulation(const Experiment& experiment, double wave) {
  std::vector<double> along;
  std::vector<double> height;
  for (const TraceRecord& record : run(experiment)) {
    if (experiment.path.pose(record.probe.time).phase != StrokePhase::contact) continue;
    along.push_back(record.probe.pose.position.x());
    height.push_back(record.rendered.proxy.z());
  }
  const double spacing = wave / 64.0;
  std::vector<double> even = resample(along, height, spacing);
  constexpr std::size_t samples = 5 * 64;
  EXPECT_GE(even.size(), samples);
  even.erase(even.begin(), even.end() - samples);
  Vec2 component = Vec2::Zero();
  for (std::size_t i = 0; i < samples; ++i) {
    const double phase = 2.0 * std::numbers::pi * static_cast<double>(i) / 64.0;
    component += even[i] * Vec2(std::cos(phase), std::sin(phase)) * 2.0 / static_cast<double>(samples);
  }
  return component.norm();
}

// The hand's aim is a straight line 2 mm under the crests, so that whatever undulates is the surface's. M1, whose layer
// is thinner than a step of the encoder there, is lost and leaves the hand to its aim; the encoder's steps of 10 um,
// spread over 320 samples, leave 10 um / sqrt(12) sqrt(2 / 320) = 0.2 um of any one wave.
TEST(Rows, M6_UndulationOfTheSceneIsInThePathOfM2AndNotOfM1) {
  constexpr double amplitude = 0.2e-3;
  constexpr double wave = 6e-3;
  EXPECT_NEAR(undulation(scene("undulations", CrossUncrossLaw{}), wave), amplitude, 0.05 * amplitude);
  EXPECT_NEAR(undulation(scene("undulations", ProxyLaw{}), wave), amplitude, 0.05 * amplitude);
  const Experiment m1 = scene("undulations", AvilaLaw{});
  EXPECT_LT(undulation(m1, wave), 0.02 * amplitude);
  EXPECT_LT(deepest(run(m1)), 2.0 * m1.stroke.depth) << "not at the arm's stop";
}

}  // namespace
}  // namespace asperity::large_data_test
