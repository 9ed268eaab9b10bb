#include "asperity/study/follow.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "asperity/core/rng.h"
#include "asperity/render/laws/avila.h"
#include "asperity/render/step.h"
#include "asperity/study/metrics.h"

namespace asperity {
namespace {

constexpr double no_reading = std::numeric_limits<double>::quiet_NaN();

Error bad(double value, std::string place, const char* accepted) {
  return bad_value(fmt::format("is {}", value), std::move(place), accepted);
}

Status check(const DetectionSettings& settings) {
  const auto positive = [](double value) { return value > 0.0 && std::isfinite(value); };
  for (std::size_t i = 0; i < settings.speeds.size(); ++i) {
    if (!positive(settings.speeds[i]))
      return bad(settings.speeds[i], fmt::format("speeds[{}]", i), "a speed above 0 (m/s)");
  }
  if (!positive(settings.rate)) return bad(settings.rate, "rate", "a frequency above 0 (Hz)");
  if (settings.passages < 1 || settings.passages > 1000000) return bad(settings.passages, "passages", "1 to 1,000,000");
  return success();
}

/// Where a passage meets the surface, object frame.
struct Gate {
  Vec3 point = Vec3::Zero();
  Vec3 outward = Vec3::Zero();
  double start = 0.0;  ///< how much of a tick's way ahead of the surface it begins, above 0 to 1
  double layer = 0.0;  ///< thickness of M1's layer (m)
};

/// How far the field is beyond the threshold at a point; positive inside. Not-a-number where nothing is known.
double inside_by(const IsoView& view, const Vec3& p) noexcept {
  FieldJet jet;
  return view.sample(p, jet) ? view.sigma * (view.threshold - jet.value) : no_reading;
}

/// How far in from the surface the field stays inside by less than `band`.
double layer_at(const IsoView& view, const Gate& gate, double band) noexcept {
  constexpr int most_steps = 4096;
  constexpr int halvings = 50;
  FieldJet jet;
  if (!view.sample(gate.point, jet) || !(jet.gradient.norm() > 0.0)) return 0.0;
  // Fine enough for what the field does within a cell, and for the layer itself.
  const double step = std::min(0.25 * view.field->narrowest_cell(), 0.25 * band / jet.gradient.norm());
  const auto within = [&](double depth) {
    const double by = inside_by(view, gate.point - depth * gate.outward);
    return by > 0.0 && by < band;
  };
  // The surface's own point may lie on either side of it by its rounding.
  double in = 1e-3 * step;
  if (!within(in)) return 0.0;
  double out = in;
  for (int k = 1; k <= most_steps; ++k) {
    out = k * step;
    if (!within(out)) break;
    in = out;
  }
  for (int k = 0; k < halvings && in < out; ++k) {
    const double middle = 0.5 * (in + out);
    (within(middle) ? in : out) = middle;
  }
  return in;
}

/// Random places of the stroke on the surface, with random starts; fewer where no surface is found.
std::vector<Gate> gates_along(const Instance& instance, const Scene& scene, const StrokePath& path,
                              std::optional<double> band, const DetectionSettings& settings) {
  const View& shown = scene.settings().view;
  const IsoSurface& surface = *iso_of(instance.surface);
  CellCache cells;
  const IsoView view = surface.view(cells);
  Rng rng(settings.seed);
  std::vector<Gate> gates;
  for (int i = 0; i < settings.passages; ++i) {
    Gate gate;
    gate.start = 1.0 - rng.uniform(0.0, 1.0);
    // Between two samples: a stroke may have few.
    const double at = rng.uniform(0.0, 1.0) * static_cast<double>(path.points().size() - 1);
    const auto first = std::min(static_cast<std::size_t>(at), path.points().size() - 2);
    const double share = at - static_cast<double>(first);
    const Vec3 hand = (1.0 - share) * path.points()[first] + share * path.points()[first + 1];
    const Vec3 p = shown.identity() ? hand : shown.to_scene(hand);
    const Foot foot = view.nearest(instance.world_from_object.apply_inverse(p), infinity);
    if (!foot.found()) continue;
    gate.point = foot.point;
    gate.outward = view.outward(foot.point);
    if (!(gate.outward.norm() > 0.0)) continue;
    gate.layer = band ? layer_at(view, gate, *band) : 0.0;
    gates.push_back(gate);
  }
  return gates;
}

/// Whether a scene says "contact" on a way through the gate that ends a tick beyond the layer. `advance`: of the probe
/// in a tick, object frame (m).
bool detects(const Scene& scene, const Instance& instance, const Gate& gate, double advance, Seconds dt) {
  const View& shown = scene.settings().view;
  ProxyState state;
  ProxyCache cache(scene);
  ProbeSample probe;
  const auto hand = [&](double depth) -> Vec3 {
    const Vec3 p = instance.world_from_object.apply(gate.point - depth * gate.outward);
    return shown.identity() ? p : shown.to_workspace(p);
  };
  probe.twist.linear = (hand(advance) - hand(0.0)) / dt.count();
  for (int k = 0;; ++k) {
    const double depth = (k - gate.start) * advance;
    probe.pose.position = hand(depth);
    probe.time = k * dt;
    if (step(scene, state, cache, probe, dt).flags.has(TickFlag::contact)) return true;
    if (depth > gate.layer) return false;
  }
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

Result<std::vector<DetectionRow>> detection_table(std::span<const Scene> felt, const StrokePath& path,
                                                  const DetectionSettings& settings) {
  ASPERITY_CHECK(check(settings));
  std::vector<DetectionRow> rows;
  const Instance* followed = felt.empty() ? nullptr : followed_instance(felt.front());
  if (followed == nullptr || path.points().size() < 2) return rows;
  const IsoSurface& surface = *iso_of(followed->surface);
  if (surface.field().bricks() != nullptr) return rows;
  std::optional<double> band;
  for (const Scene& scene : felt) {
    const Instance& instance = *followed_instance(scene);
    const AvilaLaw* law = instance.law.as<AvilaLaw>();
    if (law != nullptr && !band) band = law->layer(surface, instance.material);
  }
  const std::vector<Gate> gates = gates_along(*followed, felt.front(), path, band, settings);
  std::vector<double> layers;
  for (const Gate& gate : gates) layers.push_back(gate.layer);
  CellCache cells;
  const IsoView view = surface.view(cells);
  for (const double speed : settings.speeds) {
    const double advance = speed / settings.rate / felt.front().settings().view.zoom;
    DetectionRow row;
    row.speed = speed;
    row.layer = band ? percentile(layers, 0.5) : no_reading;
    row.share.assign(felt.size(), 0.0);
    std::size_t passages = 0;
    for (const Gate& gate : gates) {
      if (!(inside_by(view, gate.point + gate.start * advance * gate.outward) < 0.0)) continue;
      ++passages;
      row.expected += std::min(1.0, gate.layer / advance);
      for (std::size_t i = 0; i < felt.size(); ++i)
        row.share[i] += detects(felt[i], *followed_instance(felt[i]), gate, advance, Seconds(1.0 / settings.rate));
    }
    const auto count = static_cast<double>(passages);
    row.expected = band && passages > 0 ? row.expected / count : no_reading;
    for (double& share : row.share) share = passages > 0 ? share / count : no_reading;
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace asperity
