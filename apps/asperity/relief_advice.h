#pragma once
// What of a scene's reliefs can be felt on which device, and the nearest change that would let it be.

#include <optional>
#include <string>
#include <vector>

#include "apps/asperity/command.h"
#include "asperity/io/experiment.h"
#include "asperity/study/renderability.h"

namespace asperity::program {

/// Everything that is said about one relief.
struct ReliefAdvice {
  std::string surface;  ///< whose relief it is
  TouchConditions conditions;
  ReliefShape shape;
  Renderability answer;
  std::vector<DeviceAnswer> devices;
  std::optional<BaseMeshAdvice> base;  ///< of a relief on a mesh
};

/// How the experiment touches things of this stiffness. A stroke without a force presses by depth and stiffness, one
/// that does neither with 1 N. [any]
TouchConditions touch_conditions(const Experiment& experiment, double stiffness);
/// A relief judged on its own. [any]
ReliefAdvice advise_on(std::string surface, const ReliefShape& shape, TouchConditions conditions);
/// Every relief of a scene: coats, and features on surfaces by formula. [main]
std::vector<ReliefAdvice> advise_on(const Experiment& experiment);

/// Sentences with their numbers: criteria, suggestions, base mesh. [any]
std::vector<std::string> advice_lines(const ReliefAdvice& advice);
/// One line a device, with a head. [any]
std::string device_table(const ReliefAdvice& advice);
/// [any]
Json advice_json(const ReliefAdvice& advice);

}  // namespace asperity::program
