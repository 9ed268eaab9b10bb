#pragma once
// Whether a relief can be felt on a device, and what would have to change (formulation D5, amendment 10).

#include <string>
#include <vector>

#include "asperity/core/names.h"
#include "asperity/device/hand.h"
#include "asperity/device/profile.h"
#include "asperity/study/relief_shape.h"

namespace asperity {

/// How a relief is touched.
struct TouchConditions {
  DeviceProfile device;
  HandImpedance hand;
  double force = 1.0;         ///< F: pressed with (N), above 0
  double speed = 0.02;        ///< v: along the surface (m/s), above 0
  double stiffness = 1000.0;  ///< k: of the contact (N/m), above 0
  double rate = 1000.0;       ///< 1/T: force updates a second (Hz), above 0
  double tip_radius = 0.0;    ///< of the probe (m); it makes crests rounder by so much
};

/// Smallest force that a hand notices (N) and smallest share of a force by which a change is noticed (docs:
/// methods/renderability.md, where they come from).
inline constexpr double noticed_force = 0.03;
inline constexpr double noticed_share = 0.10;

/// What has to hold. Each is value <= limit.
enum class Criterion {
  stiffness,   ///< k <= the device's
  force,       ///< F <= the device's
  fidelity,    ///< F / k <= R: the contact is less deep than crests are round
  hand,        ///< F (1/k + 1/k_h) <= R: a crest does not push the hand off
  sampling,    ///< v T <= lambda / 8: eight ticks a wave
  resolution,  ///< Delta <= lambda / 25: 25 steps of the encoder a wave
  perception,  ///< max(0.03 N, 10 % of F) <= k c: the relief changes the force by what is noticed
  steps,       ///< k times the map's step <= 0.03 N: its own levels are not noticed
};
/// As in `--json`.
template <>
struct Names<Criterion> {
  static constexpr auto table = std::to_array<Named<Criterion>>({{Criterion::stiffness, "stiffness"},
                                                                 {Criterion::force, "force"},
                                                                 {Criterion::fidelity, "fidelity"},
                                                                 {Criterion::hand, "hand"},
                                                                 {Criterion::sampling, "sampling"},
                                                                 {Criterion::resolution, "resolution"},
                                                                 {Criterion::perception, "perception"},
                                                                 {Criterion::steps, "steps"}});
};
inline constexpr int criterion_count = 8;
/// "fidelity", ... [any]
const char* criterion_name(Criterion criterion);

/// One criterion on one relief. R is that of the sharpest percent of the crests and the tip's radius together.
struct RenderFinding {
  Criterion criterion = Criterion::stiffness;
  double value = 0.0;  ///< SI
  double limit = 0.0;  ///< SI
  bool passes = false;
  std::string text;  ///< one sentence with the numbers
};

/// What can be changed.
enum class Knob {
  height,     ///< of the relief: its range (m)
  width,      ///< of the relief: its wave (m)
  force,      ///< N
  speed,      ///< m/s
  stiffness,  ///< N/m
};
/// As in `--json`, with their units.
template <>
struct Names<Knob> {
  static constexpr auto table = std::to_array<Named<Knob>>({{Knob::height, "height_m"},
                                                            {Knob::width, "wave_m"},
                                                            {Knob::force, "force_n"},
                                                            {Knob::speed, "speed_m_s"},
                                                            {Knob::stiffness, "stiffness_n_m"}});
};
inline constexpr int knob_count = 5;

/// One change of a suggestion; `to` is the boundary itself, rounded to three digits towards what passes.
struct KnobChange {
  Knob knob = Knob::height;
  double from = 0.0;  ///< SI
  double to = 0.0;    ///< SI
};

/// Changes that together make everything pass.
struct RenderSuggestion {
  std::vector<KnobChange> changes;
  std::string text;  ///< "lower it from 1.0 mm to 0.30 mm"
};

/// The answer.
struct Renderability {
  std::vector<RenderFinding> findings;  ///< in the order of Criterion
  bool renderable = false;              ///< all pass
  /// Nearest first, by the sum of the changes' absolute logarithms; at most five. Two at once where that is nearer than
  /// any single one, three where nothing less helps. Empty where everything passes, and where three do not help.
  std::vector<RenderSuggestion> suggestions;

  [[nodiscard]] const RenderFinding& of(Criterion criterion) const {
    return findings[static_cast<std::size_t>(criterion)];
  }
};

/// Judges a relief. Conditions must be in their ranges. [any]
Renderability judge_relief(const ReliefShape& shape, const TouchConditions& conditions);

/// Relief and conditions after a suggestion. [any]
struct ChangedTouch {
  ReliefShape shape;
  TouchConditions conditions;
};
ChangedTouch apply_suggestion(const RenderSuggestion& suggestion, const ReliefShape& shape,
                              const TouchConditions& conditions);

/// Stiffness (N/m) from which on a force F (N) renders crests of radius R (m) faithfully: F / R. [any]
double least_stiffness(double force, double crest_radius) noexcept;

/// A built-in device's answer.
struct DeviceAnswer {
  DeviceProfile device;
  double stiffness = 0.0;  ///< of the conditions, or the device's own where that is less (N/m)
  Renderability answer;
};
/// Every built-in profile at its own rate and resolution, in their order. `conditions.device` and `rate` are not read.
/// [any]
std::vector<DeviceAnswer> judge_on_devices(const ReliefShape& shape, const TouchConditions& conditions);

}  // namespace asperity
