#include "asperity/study/metrics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>

#include "asperity/study/detail/metric_rows.h"

namespace asperity {
namespace {

constexpr double not_measured = std::numeric_limits<double>::quiet_NaN();
constexpr double bins_per_decade = 10.0;
constexpr double fastest_bin = 1e-8;  // s; the histogram's first edge at the lowest

bool in_contact(const TraceRecord& tick) {
  return tick.rendered.flags.has(TickFlag::contact) || tick.rendered.flags.has(TickFlag::field_force);
}

TickMetrics measure_ticks(std::span<const TraceRecord> records, const RunSeries& series) {
  TickMetrics m;
  m.ticks = records.size();
  for (const TraceRecord& tick : records) {
    m.contact += in_contact(tick) ? 1U : 0U;
    m.duration += tick.dt.count();
    for (std::size_t bit = 0; bit < m.flags.size(); ++bit) m.flags[bit] += (tick.rendered.flags.bits() >> bit) & 1u;
    const Vec3 change = tick.commanded - tick.rendered.wrench.force;
    if (change.isZero(0.0)) continue;
    ++m.safety_interventions;
    m.largest_intervention = std::max(m.largest_intervention, change.norm());
  }
  m.rate = m.duration > 0.0 ? static_cast<double>(m.ticks) / m.duration : 0.0;
  for (const double distance : series.distance) {
    if (std::isfinite(distance)) m.length = std::max(m.length, distance);
  }
  return m;
}

ForceMetrics measure_force(std::span<const TraceRecord> records, const RunSeries& series) {
  ForceMetrics m;
  m.jump_distance = not_measured;
  double squares = 0.0;
  double count = 0.0;
  for (std::size_t i = 0; i < records.size(); ++i) {
    const double jump = i > 0 ? (records[i].commanded - records[i - 1].commanded).norm() : 0.0;
    if (jump > m.largest_jump) {
      m.largest_jump = jump;
      m.jump_tick = records[i].tick;
      m.jump_distance = series.distance[i];
    }
    if (!in_contact(records[i])) continue;
    count += 1.0;
    m.mean += series.force[i];
    m.mean_normal += series.normal[i];
    m.max = std::max(m.max, series.force[i]);
    squares += series.force[i] * series.force[i];
  }
  if (count == 0.0) return m;
  m.mean /= count;
  m.mean_normal /= count;
  m.rms = std::sqrt(squares / count);
  return m;
}

TorqueMetrics measure_torque(std::span<const TraceRecord> records) {
  TorqueMetrics m;
  double count = 0.0;
  for (const TraceRecord& record : records) {
    if (!in_contact(record)) continue;
    const double torque = record.rendered.wrench.torque.norm();
    count += 1.0;
    m.mean += torque;
    m.max = std::max(m.max, torque);
  }
  if (count > 0.0) m.mean /= count;
  return m;
}

/// Of all ticks, or of those near a sharp edge or away from all of them.
enum class Where { everywhere, near_edges, elsewhere };

DirectionMetrics measure_direction(const RunSeries& series, Where where) {
  std::vector<double> angles;
  for (std::size_t i = 0; i < series.size(); ++i) {
    if (!series.stroking[i]) continue;
    const bool near = i < series.near_edge.size() && series.near_edge[i] != 0;
    if (where == Where::everywhere || near == (where == Where::near_edges)) angles.push_back(series.direction_error[i]);
  }
  return measure_angles(angles);
}

/// Highest minus lowest of the values it has seen; 0 for none.
struct Range {
  double low = infinity;
  double high = -infinity;
  void include(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  [[nodiscard]] double size() const { return high >= low ? high - low : 0.0; }
};

HeightMetrics measure_height(const RunSeries& series) {
  HeightMetrics m;
  Range followed;
  Range relief;
  double squares = 0.0;
  for (std::size_t i = 0; i < series.size(); ++i) {
    if (!series.stroking[i] || !std::isfinite(series.followed[i])) continue;
    followed.include(series.followed[i]);
    relief.include(series.relief[i]);
    if (series.near_step[i]) {
      ++m.excluded;
      continue;
    }
    const double error = series.followed[i] - series.relief[i];
    ++m.samples;
    squares += error * error;
    m.max_error = std::max(m.max_error, std::abs(error));
  }
  m.amplitude = relief.size();
  m.excursion = followed.size();
  m.rms_error = m.samples > 0 ? std::sqrt(squares / static_cast<double>(m.samples)) : not_measured;
  m.relative_error = m.amplitude > 0.0 ? m.rms_error / m.amplitude : not_measured;
  return m;
}

SpectrumMetrics measure_spectrum(const RunSeries& series, const TickMetrics& ticks) {
  std::vector<double> x;
  std::vector<double> normal;
  std::vector<double> tangential;
  for (std::size_t i = 0; i < series.size(); ++i) {
    if (!series.stroking[i]) continue;
    x.push_back(series.distance[i]);
    normal.push_back(series.normal[i]);
    tangential.push_back(series.tangential[i]);
  }
  SpectrumMetrics m;
  if (x.size() < 2 || ticks.rate <= 0.0) return m;
  const double dt = 1.0 / ticks.rate;
  const double dx = ticks.length / static_cast<double>(x.size() - 1);
  m.normal_time = power_spectrum(normal, dt);
  m.tangential_time = power_spectrum(tangential, dt);
  m.normal_distance = power_spectrum(resample(x, normal, dx), dx);
  m.tangential_distance = power_spectrum(resample(x, tangential, dx), dx);
  return m;
}

UpdateMetrics measure_update(const RunSeries& series) {
  UpdateMetrics m;
  const std::vector<double>& times = series.update;
  if (times.empty()) return m;
  for (const double t : times) m.mean += t;
  m.mean /= static_cast<double>(times.size());
  m.p50 = percentile(times, 0.5);
  m.p99 = percentile(times, 0.99);
  m.p999 = percentile(times, 0.999);
  m.max = percentile(times, 1.0);
  const auto bin = [](double t) {
    return static_cast<int>(std::floor(bins_per_decade * std::log10(std::max(t, fastest_bin))));
  };
  const int first = bin(*std::min_element(times.begin(), times.end()));
  const int last = bin(m.max);
  for (int k = first; k <= last + 1; ++k) m.edges.push_back(std::pow(10.0, k / bins_per_decade));
  m.counts.assign(m.edges.size() - 1, 0);
  for (const double t : times) ++m.counts[static_cast<std::size_t>(std::clamp(bin(t), first, last) - first)];
  return m;
}

/// A column over distance: the ticks at which the probe advances.
class OverDistance {
 public:
  OverDistance(std::span<const double> distance, std::span<const double> values) {
    for (std::size_t i = 0; i < distance.size(); ++i) {
      if (!std::isfinite(distance[i]) || (!x_.empty() && distance[i] <= x_.back())) continue;
      x_.push_back(distance[i]);
      y_.push_back(values[i]);
    }
  }
  /// Straight between ticks. The stroke's ends lie between ticks as well: lines go on for one tick and a half beyond.
  [[nodiscard]] double at(double distance) const {
    if (x_.size() < 2) return not_measured;
    const auto above = std::upper_bound(x_.begin() + 1, x_.end() - 1, distance);
    const auto i = static_cast<std::size_t>(above - x_.begin());
    const double u = (distance - x_[i - 1]) / (x_[i] - x_[i - 1]);
    return u >= -1.5 && u <= 2.5 ? y_[i - 1] + u * (y_[i] - y_[i - 1]) : not_measured;
  }

 private:
  std::vector<double> x_;
  std::vector<double> y_;
};

/// Length of one loop of a stroke that comes back to where it was (m); 0 for one that does not.
double loop_length(const StrokePath& path, double travelled) {
  if (path.recorded()) return path.closed() ? path.length() : 0.0;
  if (path.closed()) return path.length();
  // An open stroke repeats only there and back.
  return travelled > 1.5 * path.length() ? 2.0 * path.length() : 0.0;
}

EnergyMetrics measure_energy(std::span<const TraceRecord> records, const RunSeries& series, const StrokePath& path,
                             double travelled) {
  EnergyMetrics m;
  m.mean_loop = not_measured;
  if (records.empty()) return m;
  std::vector<double> total(series.size());
  double lowest = infinity;
  for (std::size_t i = 0; i < series.size(); ++i) {
    total[i] = series.work[i] + series.stored[i];
    lowest = std::min(lowest, total[i]);
    m.generated = std::max(m.generated, total[i] - lowest);
    m.absorbed = std::max(m.absorbed, -series.work[i]);
    if (i == 0) continue;
    const double held =
        records[i - 1].commanded.dot(records[i].probe.pose.position - records[i - 1].probe.pose.position);
    if (std::isfinite(held)) m.held_work += held;
  }
  m.work = series.work.back();
  const double loop = loop_length(path, travelled);
  if (loop <= 0.0) return m;
  const OverDistance energy(series.distance, total);
  for (double begin = 0.0; begin < travelled; begin += loop) {
    const double gained = energy.at(begin + loop) - energy.at(begin);
    if (std::isfinite(gained)) m.loops.push_back(gained);
  }
  if (m.loops.empty()) return m;
  m.mean_loop = 0.0;
  for (const double gained : m.loops) m.mean_loop += gained / static_cast<double>(m.loops.size());
  return m;
}

FollowMetrics follow_of_run(std::span<const TraceRecord> records, const RunSeries& series) {
  std::vector<double> errors;
  std::vector<Vec3> path;
  for (std::size_t i = 0; i < series.size(); ++i) {
    if (!series.stroking[i]) continue;
    errors.push_back(series.follow[i]);
    path.push_back(records[i].probe.pose.position);
  }
  return measure_follow(errors, path);
}

}  // namespace

RunMetrics measure_run(std::span<const TraceRecord> records, const RunSeries& series, const StrokePath& path) {
  RunMetrics m;
  m.ticks = measure_ticks(records, series);
  m.force = measure_force(records, series);
  m.torque = measure_torque(records);
  m.direction = measure_direction(series, Where::everywhere);
  m.direction_near = measure_direction(series, Where::near_edges);
  m.direction_far = measure_direction(series, Where::elsewhere);
  m.height = measure_height(series);
  m.spectrum = measure_spectrum(series, m.ticks);
  m.update = measure_update(series);
  m.energy = measure_energy(records, series, path, m.ticks.length);
  m.follow = follow_of_run(records, series);
  return m;
}

RunMetrics measure_run(std::span<const TraceRecord> records, const Scene& scene, const StrokePath& path) {
  return measure_run(records, derive_series(records, scene, path), path);
}

const char* flag_name(std::size_t bit) {
  return bit < 32 ? to_string(static_cast<TickFlag>(std::uint32_t{1} << bit)) : "unknown";
}

DirectionMetrics measure_angles(std::span<const double> angles) {
  DirectionMetrics m;
  for (const double angle : angles) {
    if (!std::isfinite(angle)) continue;
    ++m.samples;
    m.mean += angle;
  }
  if (m.samples == 0) return m;
  m.mean /= static_cast<double>(m.samples);
  m.p99 = percentile(angles, 0.99);
  m.max = percentile(angles, 1.0);
  return m;
}

double percentile(std::span<const double> values, double p) {
  std::vector<double> finite;
  for (const double value : values) {
    if (std::isfinite(value)) finite.push_back(value);
  }
  if (finite.empty()) return not_measured;
  const double rank = std::ceil(std::clamp(p, 0.0, 1.0) * static_cast<double>(finite.size()));
  const std::size_t index = rank < 1.0 ? 0 : std::min(finite.size() - 1, static_cast<std::size_t>(rank) - 1);
  std::nth_element(finite.begin(), finite.begin() + static_cast<std::ptrdiff_t>(index), finite.end());
  return finite[index];
}

std::vector<MetricRow> metric_rows(const RunMetrics& m) {
  constexpr double milli = 1e3;
  constexpr double micro = 1e6;
  constexpr double percent = 1e2;
  constexpr double degrees = 180.0 / std::numbers::pi;
  return {{"/ticks/count", "ticks", m.ticks.ticks},
          {"/ticks/contact", "contact_ticks", m.ticks.contact},
          {"/ticks/duration", "duration_s", m.ticks.duration},
          {"/ticks/rate", "rate_hz", m.ticks.rate},
          {"/ticks/length", "length_mm", m.ticks.length, milli},
          {"/ticks/safety_interventions", "interventions", m.ticks.safety_interventions},
          {"/ticks/largest_intervention", "largest_intervention_n", m.ticks.largest_intervention},
          {"/force/mean", "force_mean_n", m.force.mean},
          {"/force/max", "force_max_n", m.force.max},
          {"/force/rms", "force_rms_n", m.force.rms},
          {"/force/mean_normal", "force_normal_n", m.force.mean_normal},
          {"/force/largest_jump", "jump_n", m.force.largest_jump},
          {"/force/jump_tick", "jump_tick", m.force.jump_tick},
          {"/force/jump_distance", "jump_mm", m.force.jump_distance, milli},
          {"/torque/mean", "torque_mean_mnm", m.torque.mean, milli},
          {"/torque/max", "torque_max_mnm", m.torque.max, milli},
          {"/direction/samples", "direction_samples", m.direction.samples},
          {"/direction/mean", "direction_mean_deg", m.direction.mean, degrees},
          {"/direction/p99", "direction_p99_deg", m.direction.p99, degrees},
          {"/direction/max", "direction_max_deg", m.direction.max, degrees},
          {"/height/samples", "height_samples", m.height.samples},
          {"/height/excluded", "height_excluded", m.height.excluded},
          {"/height/rms_error", "height_rms_um", m.height.rms_error, micro},
          {"/height/max_error", "height_max_um", m.height.max_error, micro},
          {"/height/amplitude", "relief_um", m.height.amplitude, micro},
          {"/height/relative_error", "height_relative", m.height.relative_error},
          {"/height/excursion", "excursion_um", m.height.excursion, micro},
          {"/update/mean", "update_mean_us", m.update.mean, micro},
          {"/update/p50", "update_p50_us", m.update.p50, micro},
          {"/update/p99", "update_p99_us", m.update.p99, micro},
          {"/update/p999", "update_p999_us", m.update.p999, micro},
          {"/update/max", "update_max_us", m.update.max, micro},
          {"/energy/work", "work_mj", m.energy.work, milli},
          {"/energy/held_work", "held_work_mj", m.energy.held_work, milli},
          {"/energy/absorbed", "absorbed_mj", m.energy.absorbed, milli},
          {"/energy/generated", "generated_mj", m.energy.generated, milli},
          {"/energy/mean_loop", "mean_loop_mj", m.energy.mean_loop, milli},
          {"/follow/samples", "follow_samples", m.follow.samples},
          {"/follow/excluded", nullptr, m.follow.excluded},
          {"/follow/mean", "follow_mean_percent", m.follow.mean, percent},
          {"/follow/min", "follow_min_percent", m.follow.min, percent},
          {"/follow/max", "follow_max_percent", m.follow.max, percent},
          {"/follow/global", "follow_global_percent", m.follow.global, percent},
          {nullptr, "direction_near_deg", m.direction_near.mean, degrees},
          {nullptr, "direction_far_deg", m.direction_far.mean, degrees},
          {nullptr, "peak_normal_hz", m.spectrum.normal_time.peak_frequency},
          {nullptr, "peak_tangential_hz", m.spectrum.tangential_time.peak_frequency},
          {nullptr, "peak_normal_per_mm", m.spectrum.normal_distance.peak_frequency / milli},
          {nullptr, "peak_tangential_per_mm", m.spectrum.tangential_distance.peak_frequency / milli}};
}

std::vector<EnergyMetrics::Asked> account_rows(const EnergyAccount& account) {
  std::vector<EnergyMetrics::Asked> rows;
  for (const auto& [giver, name] : Names<Giver>::table) {
    const EnergyAccount::Flow& flow = account.flow(giver);
    if (flow.asked > 0.0) rows.push_back({name, flow.asked, flow.paid});
  }
  return rows;
}

std::string metrics_json(const RunMetrics& m) {
  // What is no number is written as null.
  nlohmann::json json;
  for (const MetricRow& row : metric_rows(m)) {
    if (row.path != nullptr) json[nlohmann::json::json_pointer(row.path)] = row.value;
  }
  for (std::size_t bit = 0; bit < m.ticks.flags.size(); ++bit)
    json["ticks"]["flags"][flag_name(bit)] = m.ticks.flags[bit];
  json["energy"]["loops"] = m.energy.loops;
  json["energy"]["account"] = nlohmann::json::array();
  for (const EnergyMetrics::Asked& row : m.energy.account) {
    json["energy"]["account"].push_back(
        {{"giver", row.giver}, {"asked", row.asked}, {"paid", row.paid}, {"refused", row.asked - row.paid}});
  }
  const auto direction = [](const DirectionMetrics& d) {
    return nlohmann::json{{"samples", d.samples}, {"mean", d.mean}, {"p99", d.p99}, {"max", d.max}};
  };
  json["direction"]["near_edges"] = direction(m.direction_near);
  json["direction"]["elsewhere"] = direction(m.direction_far);
  const auto peaks = [](const Spectrum& s) {
    return nlohmann::json{{"peak_frequency", s.peak_frequency}, {"peak_density", s.peak_density}};
  };
  json["spectrum"] = {{"normal_time", peaks(m.spectrum.normal_time)},
                      {"tangential_time", peaks(m.spectrum.tangential_time)},
                      {"normal_distance", peaks(m.spectrum.normal_distance)},
                      {"tangential_distance", peaks(m.spectrum.tangential_distance)}};
  return json.dump(2);
}

}  // namespace asperity
