#pragma once

#include <string>
#include <vector>

#include "asperity/io/experiment.h"

namespace asperity::program {

/// Force with which the stroke presses on the plain surface (N). [main]
double stroke_force(const Experiment& experiment, double stiffness);

/// What of a surface can be felt on the experiment's device, and what cannot: sentences with the numbers they rest on.
/// Of a relief its height alone; whether it can be felt as it is: relief_advice.h. [main]
std::vector<std::string> feel_of(const Experiment& experiment, const Instance& instance);

}  // namespace asperity::program
