#pragma once

#include <string>
#include <vector>

#include "asperity/io/experiment.h"

namespace asperity::program {

/// What of a surface can be felt on the experiment's device, and what cannot: sentences with the numbers they rest on.
/// Amplitude against the force a hand notices, detail against encoder and rate, crests against the contact's own depth
/// (formulation D5). [main]
std::vector<std::string> feel_of(const Experiment& experiment, const Instance& instance);

}  // namespace asperity::program
