#include "asperity/study/renderability.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>

#include "asperity/core/units.h"

namespace asperity {
namespace {

constexpr double ticks_per_wave = 8.0;    // formulation D5 (iii)
constexpr double nyquist = 2.0;           // ticks a wave below which it is another wave
constexpr double levels_per_wave = 25.0;  // formulation D5 (iii), hrm-2010
constexpr double slowest_stroke = 1e-3;   // m/s: nobody is asked to move slower
constexpr std::size_t most_suggestions = 5;

constexpr std::array<Knob, knob_count> knobs{Knob::height, Knob::width, Knob::force, Knob::speed, Knob::stiffness};

double radius_of(const ReliefShape& shape, const TouchConditions& t) {
  return shape.crests.sharpest_percent() + t.tip_radius;
}

double value_of(Criterion criterion, const ReliefShape& shape, const TouchConditions& t) {
  switch (criterion) {
    case Criterion::stiffness: return t.stiffness;
    case Criterion::force: return t.force;
    case Criterion::fidelity: return t.force / t.stiffness;
    case Criterion::hand: return t.force * (1.0 / t.stiffness + 1.0 / t.hand.stiffness);
    case Criterion::sampling: return t.speed / t.rate;
    case Criterion::resolution: return t.device.position_resolution;
    case Criterion::perception: return std::max(noticed_force, noticed_share * t.force);
    case Criterion::steps: return t.stiffness * shape.step;
  }
  return 0.0;
}

double limit_of(Criterion criterion, const ReliefShape& shape, const TouchConditions& t) {
  switch (criterion) {
    case Criterion::stiffness: return t.device.max_stiffness;
    case Criterion::force: return t.device.max_force;
    case Criterion::fidelity:
    case Criterion::hand: return radius_of(shape, t);
    case Criterion::sampling: return shape.wave / ticks_per_wave;
    case Criterion::resolution: return shape.wave / levels_per_wave;
    case Criterion::perception: return t.stiffness * shape.amplitude();
    case Criterion::steps: return noticed_force;
  }
  return 0.0;
}

bool passes(Criterion criterion, const ReliefShape& shape, const TouchConditions& t) {
  return value_of(criterion, shape, t) <= limit_of(criterion, shape, t);
}

/// Factors on a knob's present value.
struct Factors {
  double low = 0.0;
  double high = infinity;
  [[nodiscard]] bool empty() const { return !(low <= high); }
};
constexpr Factors anything{};
constexpr Factors nothing{1.0, 0.0};

Factors at_most(double factor) {
  return factor > 0.0 ? Factors{0.0, factor} : nothing;
}
Factors at_least(double factor) {
  return std::isfinite(factor) ? Factors{factor, infinity} : nothing;
}

bool reads(Criterion criterion, Knob knob) {
  switch (criterion) {
    case Criterion::stiffness: return knob == Knob::stiffness;
    case Criterion::force: return knob == Knob::force;
    case Criterion::fidelity:
    case Criterion::hand: return knob != Knob::speed;
    case Criterion::sampling: return knob == Knob::speed || knob == Knob::width;
    case Criterion::resolution: return knob == Knob::width;
    case Criterion::perception: return knob == Knob::height || knob == Knob::force || knob == Knob::stiffness;
    case Criterion::steps: return knob == Knob::height || knob == Knob::stiffness;
  }
  return false;
}

/// R alone, without the tip: it has to be `needed` and is `own`.
Factors factors_of_roundness(Knob knob, double needed, double own) {
  if (needed <= 0.0 || !std::isfinite(own)) return anything;
  if (knob == Knob::height) return at_most(own / needed);
  return at_least(own > 0.0 ? std::sqrt(needed / own) : infinity);
}

/// Factors on a knob with which a criterion that reads it passes.
Factors factors(Criterion criterion, Knob knob, const ReliefShape& shape, const TouchConditions& t) {
  const double value = value_of(criterion, shape, t);
  const double limit = limit_of(criterion, shape, t);
  const bool of_relief = knob == Knob::height || knob == Knob::width;
  switch (criterion) {
    case Criterion::stiffness:
    case Criterion::force: return at_most(limit / value);
    case Criterion::fidelity:
      if (of_relief) return factors_of_roundness(knob, value - t.tip_radius, shape.crests.sharpest_percent());
      return knob == Knob::force ? at_most(limit / value) : at_least(limit > 0.0 ? value / limit : infinity);
    case Criterion::hand: {
      if (of_relief) return factors_of_roundness(knob, value - t.tip_radius, shape.crests.sharpest_percent());
      if (knob == Knob::force) return at_most(limit / value);
      // What the hand alone leaves for the contact's own depth.
      const double depth = limit - t.force / t.hand.stiffness;
      return at_least(depth > 0.0 ? t.force / (t.stiffness * depth) : infinity);
    }
    case Criterion::sampling: return knob == Knob::speed ? at_most(limit / value) : at_least(value / limit);
    case Criterion::resolution: return at_least(value / limit);
    case Criterion::perception:
      if (knob != Knob::force) return at_least(limit > 0.0 ? value / limit : infinity);
      return limit < noticed_force ? nothing : at_most(limit / (noticed_share * t.force));
    case Criterion::steps: return value > 0.0 ? at_most(limit / value) : anything;
  }
  return anything;
}

/// What nobody is asked for.
Factors sensible(Knob knob, const TouchConditions& t) {
  if (knob == Knob::force) return at_least(std::min(1.0, noticed_force / t.force));
  if (knob == Knob::speed) return at_least(std::min(1.0, slowest_stroke / t.speed));
  return anything;
}

double knob_value(Knob knob, const ReliefShape& shape, const TouchConditions& t) {
  switch (knob) {
    case Knob::height: return shape.range();
    case Knob::width: return shape.wave;
    case Knob::force: return t.force;
    case Knob::speed: return t.speed;
    case Knob::stiffness: return t.stiffness;
  }
  return 0.0;
}

void turn(const KnobChange& change, ReliefShape& shape, TouchConditions& t) {
  switch (change.knob) {
    case Knob::height: shape = scaled(shape, change.to / change.from, 1.0); break;
    case Knob::width: shape = scaled(shape, 1.0, change.to / change.from); break;
    case Knob::force: t.force = change.to; break;
    case Knob::speed: t.speed = change.to; break;
    case Knob::stiffness: t.stiffness = change.to; break;
  }
}

/// To three significant digits, up or down.
double rounded(double value, bool up) {
  const double unit = std::pow(10.0, std::floor(std::log10(value)) - 2.0);
  const double digits = value / unit;
  // A boundary that is round already stays, whatever its last bits say.
  const double near = std::round(digits);
  const double whole = std::abs(digits - near) < 1e-9 ? near : up ? std::ceil(digits) : std::floor(digits);
  return whole * unit;
}

/// The nearest value in `range` to the present one; nothing when the range is empty.
std::optional<KnobChange> nearest(Knob knob, const Factors& range, const ReliefShape& shape, const TouchConditions& t) {
  const double from = knob_value(knob, shape, t);
  if (range.empty() || !(from > 0.0)) return std::nullopt;
  if (range.low <= 1.0 && range.high >= 1.0) return KnobChange{knob, from, from};
  const bool up = range.low > 1.0;
  const double boundary = from * (up ? range.low : range.high);
  double to = rounded(boundary, up);
  // A hair inside, so that rounding of the boundary itself cannot undo it.
  const double inside = boundary * (up ? 1.0 + 1e-12 : 1.0 - 1e-12);
  if (up ? to < inside : to > inside) to = inside;
  if (to < from * range.low || to > from * range.high) to = inside;
  return KnobChange{knob, from, to};
}

bool all_pass(const ReliefShape& shape, const TouchConditions& t) {
  for (int c = 0; c < criterion_count; ++c) {
    if (!passes(static_cast<Criterion>(c), shape, t)) return false;
  }
  return true;
}

bool reads_any(Criterion criterion, std::span<const Knob> later) {
  return std::any_of(later.begin(), later.end(), [&](Knob knob) { return reads(criterion, knob); });
}

/// Turns the knobs one after the other, each as little as what no later one can change asks for.
std::optional<RenderSuggestion> solve(std::span<const Knob> order, ReliefShape shape, TouchConditions t) {
  RenderSuggestion suggestion;
  for (std::size_t i = 0; i < order.size(); ++i) {
    Factors range = sensible(order[i], t);
    for (int c = 0; c < criterion_count; ++c) {
      const auto criterion = static_cast<Criterion>(c);
      if (reads_any(criterion, order.subspan(i + 1)) || !reads(criterion, order[i])) continue;
      const Factors one = factors(criterion, order[i], shape, t);
      range.low = std::max(range.low, one.low);
      range.high = std::min(range.high, one.high);
    }
    const std::optional<KnobChange> change = nearest(order[i], range, shape, t);
    if (!change || change->to == change->from) return std::nullopt;
    turn(*change, shape, t);
    suggestion.changes.push_back(*change);
  }
  return all_pass(shape, t) ? std::optional(suggestion) : std::nullopt;
}

double size_of(const RenderSuggestion& suggestion) {
  double sum = 0.0;
  for (const KnobChange& change : suggestion.changes) sum += std::abs(std::log(change.to / change.from));
  return sum;
}

bool same_knobs(const RenderSuggestion& a, const RenderSuggestion& b) {
  if (a.changes.size() != b.changes.size()) return false;
  return std::all_of(a.changes.begin(), a.changes.end(), [&](const KnobChange& change) {
    return std::any_of(b.changes.begin(), b.changes.end(),
                       [&](const KnobChange& other) { return other.knob == change.knob; });
  });
}

/// Every order of `count` different knobs.
void try_orders(std::vector<Knob>& order, std::size_t count, const ReliefShape& shape, const TouchConditions& t,
                std::vector<RenderSuggestion>& found) {
  if (order.size() == count) {
    if (auto suggestion = solve(order, shape, t)) found.push_back(std::move(*suggestion));
    return;
  }
  for (const Knob knob : knobs) {
    if (std::count(order.begin(), order.end(), knob) > 0) continue;
    order.push_back(knob);
    try_orders(order, count, shape, t, found);
    order.pop_back();
  }
}

std::string change_text(const KnobChange& change) {
  const bool up = change.to > change.from;
  const auto length = [](double metres) {
    return metres >= 1e-3 ? fmt::format("{:.3g} mm", metres * 1e3) : fmt::format("{:.3g} um", metres * 1e6);
  };
  switch (change.knob) {
    case Knob::height:
      return fmt::format("{} it from {} to {}", up ? "raise" : "lower", length(change.from), length(change.to));
    case Knob::width:
      return fmt::format("{} its waves from {} to {} (tile times {:.3g})", up ? "widen" : "narrow", length(change.from),
                         length(change.to), change.to / change.from);
    case Knob::force: return fmt::format("press with {:.3g} N in place of {:.3g} N", change.to, change.from);
    case Knob::speed:
      return fmt::format("move at {:.3g} mm/s in place of {:.3g} mm/s", change.to * 1e3, change.from * 1e3);
    case Knob::stiffness:
      return fmt::format("make it {:.3g} N/mm stiff in place of {:.3g} N/mm", change.to * 1e-3, change.from * 1e-3);
  }
  return {};
}

std::vector<RenderSuggestion> suggest(const ReliefShape& shape, const TouchConditions& t) {
  std::vector<RenderSuggestion> found;
  for (std::size_t count = 1; count <= 3; ++count) {
    if (count == 3 && !found.empty()) break;
    std::vector<RenderSuggestion> more;
    std::vector<Knob> order;
    try_orders(order, count, shape, t, more);
    double nearest_so_far = infinity;
    for (const RenderSuggestion& one : found) nearest_so_far = std::min(nearest_so_far, size_of(one));
    std::erase_if(more, [&](const RenderSuggestion& one) { return size_of(one) >= nearest_so_far; });
    found.insert(found.end(), more.begin(), more.end());
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const RenderSuggestion& a, const RenderSuggestion& b) { return size_of(a) < size_of(b); });
  std::vector<RenderSuggestion> kept;
  for (RenderSuggestion& suggestion : found) {
    const auto same = [&](const RenderSuggestion& other) { return same_knobs(suggestion, other); };
    if (kept.size() == most_suggestions || std::any_of(kept.begin(), kept.end(), same)) continue;
    for (const KnobChange& change : suggestion.changes)
      suggestion.text += (suggestion.text.empty() ? "" : ", and ") + change_text(change);
    kept.push_back(std::move(suggestion));
  }
  return kept;
}

std::string radius_text(double radius) {
  return std::isfinite(radius) ? format_length(radius) : std::string("endless");
}

std::string crest_text(const ReliefShape& shape, const TouchConditions& t) {
  std::string text = fmt::format(
      "crests: the sharpest percent has radii below {} (the sharpest {}, half of them below "
      "{})",
      radius_text(shape.crests.sharpest_percent()), radius_text(shape.crests.smallest()),
      radius_text(shape.crests.median()));
  if (t.tip_radius > 0.0) text += fmt::format(", and the tip adds {}", format_length(t.tip_radius));
  return text;
}

/// How much of the surface is sharper than the contact is deep.
std::string sharp_text(const ReliefShape& shape, const TouchConditions& t) {
  const double share = shape.crests.share_sharper(t.force / t.stiffness - t.tip_radius);
  return fmt::format("on {:.2g} % of the surface the force turns faster than the shape", 100.0 * share);
}

std::string sampling_text(const ReliefShape& shape, const TouchConditions& t, bool good) {
  const double ticks = shape.wave * t.rate / t.speed;
  const double finest = shape.finest_wave * t.rate / t.speed;
  std::string text = fmt::format("a wave of {} takes {:.3g} ticks at {:.3g} mm/s and {:g} Hz",
                                 format_length(shape.wave), ticks, t.speed * 1e3, t.rate);
  if (ticks < nyquist) {
    text += ", less than 2: it is felt as another wave";
  } else if (!good) {
    text += fmt::format(", {:g} are needed for its shape: it is felt as vibration", ticks_per_wave);
  } else {
    text += fmt::format(", {:g} are needed", ticks_per_wave);
  }
  if (shape.finest_wave > 0.0 && good && finest < ticks_per_wave)
    text += fmt::format("; its finest detail, {}, has {:.2g} and is {}", format_length(shape.finest_wave), finest,
                        finest < nyquist ? "lost" : "felt as vibration");
  return text;
}

std::string resolution_text(const ReliefShape& shape, const TouchConditions& t, bool good) {
  const double step = t.device.position_resolution;
  if (step == 0.0) return fmt::format("{} has no steps", t.device.name);
  std::string text = fmt::format("{} steps of {} ({}) lie in a wave of {}, {:g} are needed; {:.3g} in its height",
                                 static_cast<long>(shape.wave / step), t.device.name, format_length(step),
                                 format_length(shape.wave), levels_per_wave, shape.range() / step);
  if (good && shape.finest_wave > 0.0 && shape.finest_wave < levels_per_wave * step)
    text += fmt::format("; its finest detail, {}, is finer than that resolves", format_length(shape.finest_wave));
  return text;
}

std::string steps_text(const ReliefShape& shape, double value, bool good) {
  if (shape.step == 0.0) return "its heights have no steps";
  std::string text =
      fmt::format("the map's own steps of {} change the force by {:.2g} N", format_length(shape.step), value);
  if (good) return text + fmt::format(", below the {:g} N that are noticed", noticed_force);
  const double bits = std::ceil(std::log2(shape.range() / shape.step * value / noticed_force + 1.0));
  return text + fmt::format(": they are felt as such; {:.0f} bits would do", bits);
}

std::string text_of(const RenderFinding& found, const ReliefShape& shape, const TouchConditions& t) {
  const bool good = found.passes;
  switch (found.criterion) {
    case Criterion::stiffness:
      return fmt::format("{:.3g} N/mm is {} the {:g} N/mm of {}", t.stiffness * 1e-3, good ? "within" : "stiffer than",
                         found.limit * 1e-3, t.device.name);
    case Criterion::force:
      return fmt::format("{:.3g} N is {} the {:g} N of {}", t.force, good ? "within" : "more than", found.limit,
                         t.device.name);
    case Criterion::fidelity:
      return fmt::format("the contact is {} deep ({:.3g} N at {:.3g} N/mm); {}: {}", format_length(found.value),
                         t.force, t.stiffness * 1e-3, crest_text(shape, t),
                         good ? std::string("shapes are rendered faithfully") : sharp_text(shape, t));
    case Criterion::hand:
      return fmt::format("contact and hand ({}, {:.3g} N/mm) yield {} together, {} those crests: {}", t.hand.name,
                         t.hand.stiffness * 1e-3, format_length(found.value), good ? "less than" : "more than",
                         good ? "the hand stays on them" : "they push the hand off");
    case Criterion::sampling: return sampling_text(shape, t, good);
    case Criterion::resolution: return resolution_text(shape, t, good);
    case Criterion::perception:
      return fmt::format(
          "half its height, {}, changes the force by {:.3g} N, {} the {:.3g} N that are noticed at "
          "{:.3g} N",
          format_length(shape.amplitude()), found.limit, good ? "above" : "less than", found.value, t.force);
    case Criterion::steps: return steps_text(shape, found.value, good);
  }
  return {};
}

}  // namespace

const char* criterion_name(Criterion criterion) {
  return to_string(criterion);
}

double least_stiffness(double force, double crest_radius) noexcept {
  return force / crest_radius;
}

Renderability judge_relief(const ReliefShape& shape, const TouchConditions& conditions) {
  Renderability answer;
  answer.renderable = true;
  for (int c = 0; c < criterion_count; ++c) {
    const auto criterion = static_cast<Criterion>(c);
    RenderFinding found{criterion,
                        value_of(criterion, shape, conditions),
                        limit_of(criterion, shape, conditions),
                        passes(criterion, shape, conditions),
                        {}};
    found.text = text_of(found, shape, conditions);
    answer.renderable = answer.renderable && found.passes;
    answer.findings.push_back(std::move(found));
  }
  if (!answer.renderable && shape.range() > 0.0) answer.suggestions = suggest(shape, conditions);
  return answer;
}

ChangedTouch apply_suggestion(const RenderSuggestion& suggestion, const ReliefShape& shape,
                              const TouchConditions& conditions) {
  ChangedTouch changed{shape, conditions};
  for (const KnobChange& change : suggestion.changes) turn(change, changed.shape, changed.conditions);
  return changed;
}

std::vector<DeviceAnswer> judge_on_devices(const ReliefShape& shape, const TouchConditions& conditions) {
  std::vector<DeviceAnswer> answers;
  for (const DeviceProfile& device : device_profiles()) {
    TouchConditions own = conditions;
    own.device = device;
    own.rate = device.rate;
    own.stiffness = std::min(conditions.stiffness, device.max_stiffness);
    answers.push_back({device, own.stiffness, judge_relief(shape, own)});
  }
  return answers;
}

}  // namespace asperity
