// Rows of heterogeneous-features-2008 on the paper's own scenes: Y-2, Y-3, Y-5, Y-6, Y-7. Forces are compared with
// slopes of potentials, spectra and counts that are made here.

#include <fmt/format.h>

#include <map>
#include <numbers>
#include <set>

#include "tests/io/experiment_fixture.h"

namespace asperity::fine_rows_test {
namespace {

using std::numbers::pi;

Experiment scene_of(const std::string& json) {
  Result<Experiment> experiment = parse_experiment(json, {}, "scene.json");
  if (!experiment) throw std::runtime_error(experiment.error().message());
  return std::move(*experiment);
}

std::string builtin(const char* name) {
  return builtin_scene_json(name).value();
}

std::string changed(std::string json, const std::string& from, const std::string& to) {
  const std::size_t at = json.find(from);
  if (at == std::string::npos) throw std::runtime_error("no " + from);
  return json.replace(at, from.size(), to);
}

const Instance& first(const Experiment& e) {
  return e.scene.instances()[0];
}

bool has_note(const Experiment& e, const std::string& part) {
  for (const std::string& note : e.notes) {
    if (note.find(part) != std::string::npos) return true;
  }
  return false;
}

/// One probe that is led, in the surface's own frame.
class Led {
 public:
  explicit Led(const Experiment& e) : e_(e), dt_(1.0 / e.rate) {}
  ForceSample to(const Vec3& place) {
    ProbeSample probe;
    probe.pose.position = first(e_).world_from_object.apply(place);
    if (begun_) probe.twist.linear = (probe.pose.position - last_) / dt_.count();
    last_ = probe.pose.position;
    begun_ = true;
    return step(e_.scene, state_, cache_, probe, dt_);
  }
  /// Of the force, in the surface's frame.
  Vec3 force_at(const Vec3& place) { return first(e_).world_from_object.rotate_inverse(to(place).wrench.force); }
  [[nodiscard]] const ProxyState& state() const { return state_; }

 private:
  const Experiment& e_;
  Seconds dt_;
  ProxyState state_;
  ProxyCache cache_;
  Vec3 last_ = Vec3::Zero();
  bool begun_ = false;
};

/// Minus the gradient of k p^2 / 2 (N), p the penetration (m) to a relief.
template <class Penetration>
Vec3 slope_force(double stiffness, const Vec3& at, const Penetration& penetration) {
  constexpr double h = 1e-7;
  const auto energy = [&](const Vec3& place) {
    const double p = std::max(0.0, penetration(place));
    return 0.5 * stiffness * p * p;
  };
  Vec3 force;
  for (int k = 0; k < 3; ++k) force[k] = -(energy(at + h * Vec3::Unit(k)) - energy(at - h * Vec3::Unit(k))) / (2.0 * h);
  return force;
}

// The engine finds feet of perpendiculars to 10 nm: as much times the stiffness.
double foot_error(const Experiment& e) {
  return 1e-8 * first(e).material.stiffness;
}

// ---- Y-2: the example, as it is felt ----

constexpr double unit = 3e-3;  // m: 1 of the example

/// Penetration to h = 0.01 cos(20 theta / pi) on S = (r cos t, r sin t, r^3 + 3 t), its crests on S; from a guess of r
/// and theta, which becomes the foot.
double ramp_penetration(const Vec3& at, Vec2& foot) {
  Vec3 s, normal;
  for (int i = 0; i < 50; ++i) {
    const double r = foot.x();
    const double c = std::cos(foot.y());
    const double n = std::sin(foot.y());
    s = unit * Vec3(r * c, r * n, r * r * r + 3.0 * foot.y());
    const Vec3 by_r = unit * Vec3(c, n, 3.0 * r * r);
    const Vec3 by_t = unit * Vec3(-r * n, r * c, 3.0);
    normal = by_t.cross(by_r).normalized();
    if (normal.z() < 0.0) normal = -normal;
    const Vec3 miss = s - at;
    Eigen::Matrix2d hessian;
    hessian(0, 0) = by_r.squaredNorm() + miss.dot(unit * Vec3(0.0, 0.0, 6.0 * r));
    hessian(0, 1) = hessian(1, 0) = by_r.dot(by_t) + miss.dot(unit * Vec3(-n, c, 0.0));
    hessian(1, 1) = by_t.squaredNorm() + miss.dot(unit * Vec3(-r * c, -r * n, 0.0));
    const Vec2 change = hessian.inverse() * Vec2(miss.dot(by_r), miss.dot(by_t));
    foot -= change;
    if (change.norm() < 1e-15) break;
  }
  return std::abs((s - at).dot(normal)) + 0.01 * unit * (std::cos(20.0 * foot.y() / pi) - 1.0);
}

TEST(Rows, Y2_TheRampIsFeltAsThePaperWrapsIt) {
  const Experiment e = scene_of(builtin("ramp"));
  const FeatureMappingSettings& mapping = first(e).fine->settings().mapping.settings();
  ASSERT_EQ(mapping.surface, IntermediateSurface::cylinder);
  ASSERT_TRUE(mapping.range.has_value());
  Led probe(e);
  Vec2 foot(2.0, 0.3);
  std::vector<double> crossings;
  std::vector<double> expected;
  double last = 0.0;
  double before = 0.0;
  int ticks = 0;
  for (Seconds time{0.0}; time < e.path.contact_end(); time += Seconds(1.0 / e.rate)) {
    const StrokePose pose = e.path.pose(time);
    const Vec3 at = first(e).world_from_object.apply_inverse(pose.target);
    const Vec3 force = probe.force_at(at);
    if (pose.phase != StrokePhase::contact) {
      if (foot == Vec2(2.0, 0.3)) foot.y() = std::atan2(at.y(), at.x());
      continue;
    }
    Vec2 here = foot;
    const auto penetration = [&](const Vec3& place) {
      here = foot;
      return ramp_penetration(place, here);
    };
    penetration(at);
    foot = here;
    const Vec3 wanted = slope_force(first(e).material.stiffness, at, penetration);
    ASSERT_NEAR((force - wanted).norm(), 0.0, foot_error(e)) << "theta " << foot.y() << " r " << foot.x();
    // Along theta at a given r, where the slope of the relief alone pushes: it turns where 20 theta / pi is a whole
    // number of half turns.
    const Vec3 along = Vec3(-foot.x() * std::sin(foot.y()), foot.x() * std::cos(foot.y()), 3.0).normalized();
    const double lateral = force.dot(along);
    if (ticks++ > 0 && lateral * last < 0.0) crossings.push_back(0.5 * (foot.y() + before));
    const double turns = 20.0 * foot.y() / (pi * pi);
    if (ticks > 1 && std::floor(turns) != std::floor(20.0 * before / (pi * pi)))
      expected.push_back(std::round(turns) * pi * pi / 20.0);
    last = lateral;
    before = foot.y();
  }
  ASSERT_GT(ticks, 1000);
  // 6.37 waves a turn.
  ASSERT_EQ(crossings.size(), expected.size());
  ASSERT_GE(expected.size(), 4U);
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_NEAR(crossings[i], expected[i], 4e-3);
}

/// A cylinder of 10 mm under 6.37 gratings a turn.
std::string wrapped(const std::string& mapping, const std::string& more = "") {
  return R"({"surfaces":[{"name":"rod","parametric":{"shape":"cylinder","radius":"10 mm","height":"40 mm"},"texture":{)"
         R"("features":{"type":"grating","amplitude":"0.1 mm","wavelength":"9.8696044 mm"},"as":"texture","mapping":{)"
         R"("surface":"cylinder","radius":"10 mm")" +
         mapping + "}" + more + R"(}}],"probe":{"radius":0}})";
}

TEST(Rows, Y2_APartialWrapIsRefusedUntilARangeSaysWhereItsSeamIs) {
  const Result<Experiment> refused = parse_experiment(wrapped(""), {}, "scene.json");
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().place, "surfaces[0].texture.features.wavelength");
  EXPECT_NE(refused.error().what.find("6.3662 wavelengths go once around"), std::string::npos);
  EXPECT_NE(refused.error().accepted.find("range"), std::string::npos) << refused.error().message();
  const Experiment e = scene_of(wrapped(R"(,"range":["0 deg","180 deg"])"));
  // From cos 30 to cos 10 (as on the ramp: u from -1/2 to 3/2 of the range).
  const double stepped = 0.1e-3 * (std::cos(10.0) - std::cos(30.0));
  EXPECT_TRUE(
      has_note(e, fmt::format("a seam 270 deg from the reference: what lies there is felt as a step of up to {}",
                              format_length(std::abs(stepped)))))
      << ::testing::PrintToString(e.notes);
  // Half way around through the seam, 1 mm deep: the push is k (depth + h - c), and jumps there alone.
  Led probe(e);
  const auto at = [](double theta, double radius) {
    return Vec3(radius * std::cos(theta), radius * std::sin(theta), 0.02);
  };
  probe.to(at(pi, 12e-3));
  constexpr int steps = 4000;
  double before = 0.0;
  int jumps = 0;
  for (int i = 0; i <= steps; ++i) {
    const double theta = pi + pi * (i + 0.5) / steps;
    const Vec3 force = probe.force_at(at(theta, 9e-3));
    const double wrapped_by = theta < 1.5 * pi ? theta : theta - 2.0 * pi;
    const double push = 1000.0 * (1e-3 + 0.1e-3 * (std::cos(20.0 * wrapped_by / pi) - 1.0));
    const double felt = force.dot(Vec3(std::cos(theta), std::sin(theta), 0.0));
    ASSERT_NEAR(felt, push, 1e-5) << theta;
    if (i > 0 && std::abs(felt - before) > 1000.0 * 0.1e-3 * 20.0 / pi * pi / steps * 1.01) {
      ++jumps;
      EXPECT_NEAR(theta, 1.5 * pi, pi / steps);
    }
    before = felt;
  }
  EXPECT_EQ(jumps, 1);
  // Around and around, up the step and down: the hand gets nothing but what the hold over a tick gives
  // (docs/methods/energy.md: 1/2 L |dp|^2).
  for (const double way : {1.0, -1.0}) {
    Led round(e);
    double work = 0.0;
    double most = -infinity;
    Vec3 last = at(0.0, 12e-3);
    Vec3 pushed = round.force_at(last);
    for (int i = 0; i <= 10 * 2000; ++i) {
      const Vec3 next = at(way * 2.0 * pi * i / 2000.0, 9e-3 + 0.3e-3 * std::sin(7.0 * pi * i / 2000.0));
      work += pushed.dot(next - last);
      pushed = round.force_at(next);
      work -= 0.5 * round.state().account.stiffness() * (next - last).squaredNorm();
      most = std::max(most, work);
      last = next;
    }
    EXPECT_LE(most, 1e-9) << way;
    // Down the step nothing is asked for; up it more than was put in, which is not rendered.
    const EnergyAccount::Flow& flow = round.state().account.flow(Giver::spring);
    EXPECT_EQ(flow.asked > 0.0, way < 0.0);
    EXPECT_LE(flow.paid, flow.asked);
  }
}

/// A ball of 40 mm under gratings, wrapped by a cylinder over a range of angles.
std::string ranged(double wavelength, const char* range, const char* as) {
  return fmt::format(
      R"({{"surfaces":[{{"mesh":{{"generator":"icosphere","subdivisions":4,"radius":0.04}},"texture":{{"as":"{}",)"
      R"("mapping":{{"surface":"cylinder","radius":"40 mm","range":{}}},)"
      R"("features":{{"type":"grating","amplitude":"0.1 mm","wavelength":{:.17g}}}}}}}]}})",
      as, range, wavelength);
}

TEST(Rows, Y2_ARangeIsReadAndItsSeamTold) {
  const Experiment e = scene_of(ranged(1e-3, R"(["-30 deg","150 deg"])", "texture"));
  const Vec2 range = first(e).fine->settings().mapping.settings().range.value();
  EXPECT_NEAR(range.x(), -pi / 6.0, 1e-15);
  EXPECT_NEAR(range.y(), pi * 5.0 / 6.0, 1e-15);
  EXPECT_TRUE(has_note(e, "a seam 240 deg from the reference"));
  EXPECT_EQ(scene_of(e.canonical_json).canonical_json, e.canonical_json);
  // What happens to close does not step; and nothing is counted around that need not come back.
  const std::string closes = ranged(0.08 * pi / 100.0, R"(["-30 deg","150 deg"])", "texture");
  EXPECT_FALSE(has_note(scene_of(closes), "seam"));
  const std::string count = closes.substr(0, closes.find(R"("wavelength")")) + R"("count":40}}}]})";
  const Result<Experiment> counted = parse_experiment(count, {}, "scene.json");
  ASSERT_FALSE(counted.ok());
  EXPECT_EQ(counted.error().place, "surfaces[0].texture.features.count");
}

TEST(Rows, Y2_GeometryStepsAtTheSeamOfItsRangeAlone) {
  // 3.25 waves around half of the ball: at the seam, opposite the middle of the range, 4.875 waves from its beginning
  // meet 1.625 before it, 0.1 mm (cos 315 deg - cos 135 deg).
  const double wavelength = 0.04 * pi / 3.25;
  const Experiment e = scene_of(ranged(wavelength, R"(["-90 deg","90 deg"])", "geometry"));
  EXPECT_TRUE(has_note(e, "a seam 180 deg from the reference: what lies there is felt as a step of up to 141 um"))
      << ::testing::PrintToString(e.notes);
  const auto& ball = *std::get<std::shared_ptr<const ReliefSurface>>(first(e).surface);
  const MeshSurface& base = *base_of(first(e).surface);
  SurfaceCache cache;
  SurfaceCache bare;
  int looked_at = 0;
  for (int i = 0; i < 180; ++i) {
    const double angle = 2.0 * pi * (i + 0.5) / 180.0 - pi;
    // Within an edge of the seam a face may go on with the other side's pattern.
    if (pi - std::abs(angle) < 0.12) continue;
    const Vec3 out(std::cos(angle), 0.0, -std::sin(angle));
    const Segment ray{0.05 * out, 0.03 * out};
    const double outer = 0.05 - 0.02 * ball.view(cache).first_touch(ray, Sides::both).t;
    const double inner = 0.05 - 0.02 * base.view(bare).first_touch(ray, Sides::both).t;
    const double u = 0.04 * (angle + 0.5 * pi);
    EXPECT_NEAR(outer - inner, 1e-4 * std::cos(2.0 * pi * u / wavelength), 1e-5) << angle;
    ++looked_at;
  }
  EXPECT_GT(looked_at, 150);
}

// ---- Y-3: a smooth plane ----

/// The force that is sent to the device, every tick of a session.
std::vector<TraceRecord> session(const Experiment& e) {
  SimulatedDevice device = SimulatedDevice::build(e.path, e.device, e.hand, e.simulated).value();
  SafetyStage safety = SafetyStage::build(SafetySettings::from_profile(e.device)).value();
  ProxyState state;
  ProxyCache cache;
  SessionSettings settings;
  settings.dt = Seconds(1.0 / e.rate);
  std::vector<TraceRecord> records;
  run_session([&](const ProbeSample& probe, Seconds dt) { return step(e.scene, state, cache, probe, dt); }, device,
              safety, settings, [&](const TraceRecord& record) { records.push_back(record); });
  return records;
}

/// Amplitude at a frequency (Hz) of samples at 1 kHz about their mean. The window of Blackman and Harris: a line
/// reaches four bins to either side, and 92 dB below itself beyond.
double line_at(const std::vector<double>& samples, double frequency) {
  const double count = static_cast<double>(samples.size());
  double mean = 0.0;
  for (const double sample : samples) mean += sample / count;
  double cosine = 0.0;
  double sine = 0.0;
  double gain = 0.0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double x = 2.0 * pi * static_cast<double>(i) / count;
    const double window = 0.35875 - 0.48829 * std::cos(x) + 0.14128 * std::cos(2.0 * x) - 0.01168 * std::cos(3.0 * x);
    const double angle = 2.0 * pi * frequency * static_cast<double>(i) / 1000.0;
    cosine += window * (samples[i] - mean) * std::cos(angle);
    sine += window * (samples[i] - mean) * std::sin(angle);
    gain += 0.5 * window;
  }
  return std::hypot(cosine, sine) / gain;
}

constexpr double tremor_rms = 20e-6;  // m
constexpr double settled = 1.5;       // s after the stroke has come down

/// Tangential and normal force of two seconds of a stroke by a trembling hand; mass (kg) and damping (N s/m) of hand
/// and device together.
struct Felt {
  std::vector<double> lateral, normal;
  double mass = 0.0, damping = 0.0, approach = 0.0;
};
Felt trembling(const std::string& scene, const char* speed, const char* press) {
  // A device without friction and steps of its own: all that is linear but the surface.
  const std::string hand = R"("probe":{"kind":"dynamic","dynamic":{"tremor":"20 um"}},)"
                           R"("device":{"profile":"omega.3","friction":0,"position_resolution":0},)";
  const std::string json = R"({)" + hand +
                           R"("surfaces":[{"parametric":{"shape":"plane","width":"100 mm","depth":"60 mm"})" + scene +
                           R"(}],"stroke":{"type":"line","start":["10%","100%","50%"],"end":["90%","100%","50%"],)" +
                           R"("speed":")" + speed + R"(",)" + press + "}}";
  const Experiment e = scene_of(json);
  EXPECT_DOUBLE_EQ(e.simulated.tremor, tremor_rms);
  Felt felt{{}, {}, e.hand.mass + e.device.mass, e.hand.damping + e.device.damping, e.path.approach_speed()};
  for (const TraceRecord& record : session(e)) {
    const Seconds since = record.probe.time - e.path.contact_begin();
    if (since < Seconds(settled) || felt.normal.size() == 2000) continue;
    felt.lateral.push_back(record.commanded.x());
    felt.normal.push_back(record.commanded.y());
  }
  EXPECT_EQ(felt.normal.size(), 2000U);
  return felt;
}

TEST(Rows, Y3_ASmoothPlaneHasNoSpectralLineButTheTremors) {
  const char* deep = R"("depth":"1 mm")";
  const Felt slow = trembling("", "15 mm/s", deep);
  const Felt fast = trembling("", "22 mm/s", deep);
  const Felt rough = trembling(
      R"(,"texture":{"features":{"type":"grating","amplitude":"0.25 mm","wavelength":"5 mm"},"as":"texture"})",
      "20 mm/s", deep);
  // The tremor: four tones between 8 and 12 Hz, each rms / sqrt 2 in size. Hand, device and plane are a body on springs
  // of 400 and 1000 N/m, which even in resonance answers with no more than the hand's spring over omega b.
  const double tone = 1000.0 * 400.0 * tremor_rms / std::sqrt(2.0) / (2.0 * pi * 8.0 * slow.damping);
  double tremor = 0.0;
  for (double f = 6.0; f <= 14.0; f += 0.5) tremor = std::max(tremor, line_at(slow.normal, f));
  EXPECT_GT(tremor, 0.1 * tone);
  const double floor = 4.0 * std::pow(10.0, -92.0 / 20.0) * tone;
  for (double f = 2.5; f < 500.0; f += 0.5) {
    if (f > 5.5 && f < 14.5) continue;
    ASSERT_LT(line_at(slow.normal, f), floor) << f;
    ASSERT_LT(line_at(fast.normal, f), floor) << f;
  }
  // Nor is one hidden among the tremor's: what is felt does not know how fast the plane goes by.
  for (std::size_t i = 0; i < slow.normal.size(); ++i) {
    ASSERT_NEAR(slow.lateral[i], 0.0, 1e-12);
    ASSERT_NEAR(slow.normal[i], fast.normal[i], floor);
  }
  // The same hand over gratings of 5 mm feels their line, at speed / wavelength.
  EXPECT_GT(line_at(rough.normal, 20.0 / 5.0), 1000.0 * floor);
  EXPECT_GT(line_at(rough.lateral, 20.0 / 5.0), 1000.0 * floor);
  // A hand that presses with 1 N feels 1 N, however it trembles along the plane: what is left of its push that sets in,
  // and of the bounce that it comes down with, has died away by exp(-b / 2m t).
  const Felt pressed = trembling("", "20 mm/s", R"("normal_force":"1 N")");
  const double bounce = 1.0 + pressed.approach * std::sqrt(1000.0 * pressed.mass);
  const double left = bounce * std::exp(-settled * pressed.damping / (2.0 * pressed.mass));
  EXPECT_LT(left, 1e-5);
  for (const double force : pressed.normal) ASSERT_NEAR(force, 1.0, left);
}

// ---- Y-5: levels that a device displays ----

/// Different lateral forces that are sent to a Phantom Desktop, which tells places 20 um apart, within one wavelength
/// of a triangular profile that begins this share of a step beside one of its places; and the most at one place.
struct Levels {
  std::size_t forces = 0;
  std::size_t at_one_place = 0;
};
Levels device_levels(double wavelength, double amplitude, double share, const char* formulation) {
  constexpr double resolution = 20e-6;
  const std::string json = fmt::format(
      R"({{"probe":{{"kind":"dynamic"}},"device":{{"profile":"phantom-desktop","position_resolution":{}}},)"
      R"("surfaces":[{{"parametric":{{"shape":"plane"}},"texture":{{"formulation":"{}","as":"texture",)"
      R"("features":{{"type":"triangular","amplitude":{},"wavelength":{},"phase":{}}}}}}}],)"
      R"("stroke":{{"type":"line","start":["45%","100%","50%"],"end":["47%","100%","50%"],"speed":"1 mm/s",)"
      R"("depth":"1 mm"}}}})",
      resolution, formulation, amplitude, wavelength, 2.0 * pi * share * resolution / wavelength);
  Experiment e = scene_of(json);
  // Led firmly, so that it goes along at one depth.
  e.hand = {"vice", 0.15, 3000.0, 1e6, 1e3};
  std::map<long, std::set<long>> of_place;
  for (const TraceRecord& record : session(e)) {
    const Seconds since = record.probe.time - e.path.contact_begin();
    if (since < Seconds(0.5) || record.probe.time > e.path.contact_end()) continue;
    of_place[std::lround(record.probe.pose.position.x() / resolution)].insert(std::lround(record.commanded.x() / 1e-6));
  }
  Levels levels;
  std::set<long> forces;
  const long begin = of_place.begin()->first + 3;
  for (long place = begin; place < begin + std::lround(wavelength / resolution); ++place) {
    levels.at_one_place = std::max(levels.at_one_place, of_place[place].size());
    forces.insert(of_place[place].begin(), of_place[place].end());
  }
  levels.forces = forces.size();
  return levels;
}

TEST(Rows, Y5_LevelsOfTheForceThatTheDeviceDisplays) {
  // 2 or 10 um of amplitude: flanks of 8 %. From one place to the next the push changes by 8 % of 20 um, 1.6 mN, and
  // the lateral force by 8 % of that, 0.128 mN: micronewtons tell levels apart.
  for (const double share : {0.0, 0.13, 0.25, 0.5, 0.77, 0.99}) {
    const Levels fine = device_levels(0.5e-3, 10e-6, share, "consistent");
    EXPECT_EQ(fine.at_one_place, 1U) << share;
    EXPECT_EQ(fine.forces, 25U) << share;
    const Levels finer = device_levels(0.1e-3, 2e-6, share, "consistent");
    EXPECT_EQ(finer.at_one_place, 1U) << share;
    EXPECT_EQ(finer.forces, 5U) << share;
    // By eq. 12 as printed both flanks push alike all along: there are two levels, however fine the device.
    EXPECT_EQ(device_levels(0.5e-3, 10e-6, share, "literal").forces, 2U) << share;
  }
}

// ---- Y-6: the vase ----

constexpr double widest = 30.08e-3;  // m, at 36 mm; a third of it at 96 mm
constexpr double crest = 0.25e-3;
constexpr double waves = 42.0;

double vase_radius(double z) {
  const double t = std::clamp((z - 36e-3) / 60e-3, 0.0, 1.0);
  return widest * (1.0 - 2.0 / 3.0 * t * t * t * (10.0 - 15.0 * t + 6.0 * t * t));
}

/// Distance (m) from a point inside to the wall, by golden sections of the height of the nearest place.
double vase_depth(const Vec3& at) {
  const double radial = at.head<2>().norm();
  const auto square = [&](double z) {
    const double out = vase_radius(z) - radial;
    return out * out + (z - at.z()) * (z - at.z());
  };
  constexpr double golden = 0.6180339887498949;
  double low = at.z() - 4e-3;
  double high = at.z() + 4e-3;
  for (int i = 0; i < 80; ++i) {
    const double a = high - golden * (high - low);
    const double b = low + golden * (high - low);
    (square(a) < square(b) ? high : low) = square(a) < square(b) ? b : a;
  }
  return std::sqrt(square(0.5 * (low + high)));
}

/// A point of the wall at a height, so far inside.
Vec3 inside_vase(double theta, double z, double depth) {
  constexpr double h = 1e-6;
  const double slope = (vase_radius(z + h) - vase_radius(z - h)) / (2.0 * h);
  const double length = std::hypot(1.0, slope);
  const double radial = vase_radius(z) - depth / length;
  return {radial * std::cos(theta), radial * std::sin(theta), z + depth * slope / length};
}

/// Once around at a depth: the amplitude of the lateral force's fundamental (N), its work from crest to valley (J), and
/// the mean distance on the wall between its changes of sign, times two (m).
struct Ring {
  double amplitude = 0.0;
  double work = 0.0;
  double wavelength = 0.0;
};
template <class Force>
Ring ring(double z, double depth, const Force& force) {
  constexpr int steps = 42 * 40;
  Ring out;
  double radial = 0.0;
  double last = 0.0;
  int turns = 0;
  for (int i = 0; i < steps; ++i) {
    const double theta = 2.0 * pi * (i + 0.5) / steps;
    const Vec3 at = inside_vase(theta, z, depth);
    radial = at.head<2>().norm();
    const double lateral = force(at).dot(Vec3(-std::sin(theta), std::cos(theta), 0.0));
    out.amplitude += 2.0 / steps * lateral * std::sin(waves * theta);
    // Midpoints of 20 parts of each half wave: the first half of every wave goes down.
    if (i % 40 < 20) out.work += lateral * radial * 2.0 * pi / steps / waves;
    if (i > 0 && lateral * last < 0.0) ++turns;
    last = lateral;
  }
  // It turns at every crest and valley; the first and the last change are one.
  out.wavelength = 2.0 * (2.0 * pi * vase_radius(z)) / (turns + 1);
  return out;
}

TEST(Rows, Y6_TheVaseIsThreeTimesAsSteepAtItsNeck) {
  const Experiment e = scene_of(builtin("vase"));
  EXPECT_TRUE(has_note(e, "grating of 1.5 mm to 4.5 mm under the stroke"));
  const Experiment printed =
      scene_of(changed(builtin("vase"), R"("texture": {)", R"("texture": {"formulation":"literal",)"));
  const double k = first(e).material.stiffness;
  constexpr double depth = 1e-3;
  const auto penetration = [](const Vec3& at) {
    return vase_depth(at) + crest * (std::cos(waves * std::atan2(at.y(), at.x())) - 1.0);
  };
  std::map<int, Ring> felt, literal;
  for (int z = 36; z <= 96; z += 12) {
    Led probe(e);
    Led other(printed);
    probe.to(inside_vase(0.0, 1e-3 * z, -2e-3));
    other.to(inside_vase(0.0, 1e-3 * z, -2e-3));
    felt[z] = ring(1e-3 * z, depth, [&](const Vec3& at) { return probe.force_at(at); });
    literal[z] = ring(1e-3 * z, depth, [&](const Vec3& at) { return other.force_at(at); });
    const Ring wanted = ring(1e-3 * z, depth, [&](const Vec3& at) { return slope_force(k, at, penetration); });
    EXPECT_NEAR(felt[z].amplitude, wanted.amplitude, 1e-4 * wanted.amplitude) << z;
    // From a crest, where it is pressed in by the depth, to a valley, 2 c less: the same work everywhere. The midpoint
    // rule over 20 parts of half a sine is off by (pi / 20)^2 / 24.
    const double valley = depth - 2.0 * crest;
    EXPECT_NEAR(felt[z].work, 0.5 * k * (depth * depth - valley * valley), 2e-3 * 0.5 * k * depth * depth) << z;
    // 42 waves.
    EXPECT_NEAR(felt[z].wavelength, 2.0 * pi * vase_radius(1e-3 * z) / 42.0, 1e-9) << z;
  }
  EXPECT_NEAR(felt[36].wavelength, 4.5e-3, 0.01e-3);
  EXPECT_NEAR(felt[96].wavelength, 1.5e-3, 0.01e-3);
  // Eq. 12 takes the slope on the wall: 3 : 1, as the radii are.
  EXPECT_NEAR(literal[96].amplitude / literal[36].amplitude, 3.0, 3e-4);
  // The same work over the way that the probe has inside, 1 mm nearer to the axis: 3.22 : 1.
  EXPECT_NEAR(felt[96].amplitude / felt[36].amplitude, (widest - depth) / (widest / 3.0 - depth), 1e-3);
}

// ---- Y-7: the hand that sticks and slips ----

TEST(Rows, Y7_TheHandSticksAndSlips) {
  // Sticks to F_s, drops to k_d N at N = 0.6 N, and again.
  const std::pair<const char*, double> scenes[] = {{"stick-slip", 0.4}, {"stick-slip-2", 0.6}};
  for (const auto& [name, break_away] : scenes) {
    const Experiment e = scene_of(builtin(name));
    ASSERT_EQ(e.probe, ProbeKind::dynamic);
    Result<SimulatedDevice> device = SimulatedDevice::build(e.path, e.device, e.hand, e.simulated);
    Result<SafetyStage> safety = SafetyStage::build(SafetySettings::from_profile(e.device));
    ASSERT_TRUE(device.ok() && safety.ok());
    ProxyState state;
    ProxyCache cache;
    SessionSettings settings;
    settings.dt = Seconds(1.0 / e.rate);
    settings.max_ticks = 5000;
    double most = 0.0;
    double last = 0.0;
    std::vector<double> after_drop;
    const auto tick = [&](const ProbeSample& probe, Seconds dt) {
      const ForceSample force = step(e.scene, state, cache, probe, dt);
      const double friction = force.parts.friction.norm();
      if (probe.time > e.path.contact_begin()) {
        most = std::max(most, friction);
        if (friction < last - 0.25 * break_away) after_drop.push_back(friction);
      }
      last = friction;
      return force;
    };
    run_session(tick, *device, *safety, settings, [](const TraceRecord&) {});
    ASSERT_GT(after_drop.size(), 3U) << name;
    EXPECT_NEAR(most, break_away, 0.02 * break_away) << name;
    for (const double friction : after_drop) EXPECT_NEAR(friction, 0.6 * break_away, 0.02 * break_away) << name;
  }
}

}  // namespace
}  // namespace asperity::fine_rows_test
