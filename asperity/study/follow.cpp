#include "asperity/study/follow.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "asperity/core/rng.h"
#include "asperity/render/step.h"

namespace asperity {
namespace {

constexpr double no_reading = std::numeric_limits<double>::quiet_NaN();

Error bad(double value, std::string place, const char* accepted) {
  return bad_value(fmt::format("is {}", value), std::move(place), accepted);
}

Status check(const DetectionSettings& settings) {
  const auto positive = [](double value) { return value > 0.0 && std::isfinite(value); };
  for (std::size_t i = 0; i < settings.thicknesses.size(); ++i) {
    if (!positive(settings.thicknesses[i]))
      return bad(settings.thicknesses[i], fmt::format("thicknesses[{}]", i), "a length above 0 (m)");
  }
  for (std::size_t i = 0; i < settings.speeds.size(); ++i) {
    if (!positive(settings.speeds[i]))
      return bad(settings.speeds[i], fmt::format("speeds[{}]", i), "a speed above 0 (m/s)");
  }
  if (!positive(settings.rate)) return bad(settings.rate, "rate", "a frequency above 0 (Hz)");
  if (settings.passages < 1 || settings.passages > 1000000) return bad(settings.passages, "passages", "1 to 1,000,000");
  return success();
}

/// One layer and one speed, ready to be passed.
struct Passage {
  double thickness = 0.0;
  double advance = 0.0;  ///< of the probe in a tick (m)
  double speed = 0.0;
  double rate = 0.0;
};

/// phi falls along x from 1 to -1 over a cube around the origin, whatever its size, so that the isosurface is x = 0,
/// within a cell.
Result<std::shared_ptr<const IsoSurface>> wall(double half) {
  GridAxes axes;
  for (GridAxis& axis : axes) {
    ASPERITY_TRY(axis, GridAxis::build({-half, -0.25 * half, half}));
  }
  std::vector<float> samples;
  for (int i = 0; i < 9; ++i) samples.insert(samples.end(), {1.0F, 0.25F, -1.0F});
  ASPERITY_TRY(ScalarGrid grid, ScalarGrid::build(std::move(axes), std::move(samples), "wall"));
  ASPERITY_TRY(IsoSurface surface,
               IsoSurface::build(std::make_shared<const ScalarField>(std::move(grid)), 0.0, Inside::low));
  return std::make_shared<const IsoSurface>(std::move(surface));
}

/// Whether a law says "contact" on a way that starts `offset` ahead of the surface and ends a tick beyond the layer.
bool detects(const Scene& scene, const Passage& passage, double offset) {
  ProxyState state;
  ProxyCache cache;
  ProbeSample probe;
  probe.twist.linear = Vec3(passage.speed, 0.0, 0.0);
  const Seconds dt(1.0 / passage.rate);
  for (int k = 0;; ++k) {
    const double x = -offset + k * passage.advance;
    probe.pose.position = Vec3(x, 0.0, 0.0);
    probe.time = k * dt;
    if (step(scene, state, cache, probe, dt).flags.has(TickFlag::contact)) return true;
    if (x > passage.thickness) return false;
  }
}

Result<double> share_detected(const std::shared_ptr<const IsoSurface>& surface, const Law& law, const Passage& passage,
                              const std::vector<double>& starts) {
  std::vector<Instance> instances(1);
  instances[0].name = "wall";
  instances[0].surface = surface;
  instances[0].law = law;
  ASPERITY_TRY(const Scene scene, Scene::build(std::move(instances), 0.0));
  std::size_t detected = 0;
  for (const double start : starts) detected += detects(scene, passage, (1.0 + start) * passage.advance) ? 1U : 0U;
  return static_cast<double>(detected) / static_cast<double>(starts.size());
}

}  // namespace

const Instance* followed_instance(const Scene& scene) noexcept {
  for (const Instance& instance : scene.instances()) {
    // An implicit surface follows its mesh.
    if (iso_of(instance.surface) != nullptr && implicit_of(instance.surface) == nullptr) return &instance;
  }
  return nullptr;
}

double largest_deviation(const IsoView& surface) noexcept {
  const ScalarField& field = *surface.field;
  return std::max(std::abs(field.highest() - surface.threshold), std::abs(surface.threshold - field.lowest()));
}

double follow_error(const IsoView& surface, const Vec3& p) noexcept {
  FieldJet jet;
  const double largest = largest_deviation(surface);
  if (!p.allFinite() || !(largest > 0.0) || !surface.field->contains(p) || !surface.sample(p, jet)) return no_reading;
  // Between its samples a smooth field reaches a little beyond them.
  return std::min(1.0, std::abs(jet.value - surface.threshold) / largest);
}

FollowMetrics measure_follow(std::span<const double> errors, std::span<const Vec3> path) {
  FollowMetrics m;
  double sum = 0.0;
  double weighted = 0.0;
  double length = 0.0;
  m.min = infinity;
  const std::size_t count = std::min(errors.size(), path.size());
  for (std::size_t k = 0; k < count; ++k) {
    if (!std::isfinite(errors[k])) {
      ++m.excluded;
      continue;
    }
    ++m.samples;
    sum += errors[k];
    m.min = std::min(m.min, errors[k]);
    m.max = std::max(m.max, errors[k]);
    if (k == 0) continue;
    const double way = (path[k] - path[k - 1]).norm();
    weighted += errors[k] * way;
    length += way;
  }
  if (m.samples == 0) {
    m.mean = m.min = m.max = m.global = no_reading;
    return m;
  }
  m.mean = sum / static_cast<double>(m.samples);
  // A probe that never moves has no path to integrate over: what is left is the mean over time.
  m.global = length > 0.0 ? weighted / length : m.mean;
  return m;
}

Result<std::vector<DetectionRow>> detection_table(const DetectionSettings& settings) {
  ASPERITY_CHECK(check(settings));
  Rng rng(settings.seed);
  std::vector<double> starts(static_cast<std::size_t>(settings.passages));
  for (double& start : starts) start = rng.uniform(0.0, 1.0);
  std::vector<DetectionRow> rows;
  for (const double thickness : settings.thicknesses) {
    for (const double speed : settings.speeds) {
      Passage passage{thickness, speed / settings.rate, speed, settings.rate};
      const double half = 4.0 * passage.advance + 2.0 * thickness;
      ASPERITY_TRY(const std::shared_ptr<const IsoSurface> surface, wall(half));
      DetectionRow row;
      row.thickness = thickness;
      row.speed = speed;
      row.expected = std::min(1.0, thickness / passage.advance);
      AvilaLaw avila;
      avila.band = thickness / half;
      ASPERITY_TRY(row.avila, share_detected(surface, avila, passage, starts));
      ASPERITY_TRY(row.cross_uncross, share_detected(surface, CrossUncrossLaw{}, passage, starts));
      ASPERITY_TRY(row.proxy, share_detected(surface, ProxyLaw{}, passage, starts));
      rows.push_back(row);
    }
  }
  return rows;
}

}  // namespace asperity
