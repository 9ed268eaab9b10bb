#pragma once

#include "asperity/core/result.h"

namespace asperity {

/// What a surface is made of, as far as the hand can tell. Friction and texture forces join it with their laws.
struct Material {
  double stiffness = 1000.0;  ///< N/m, above 0
  double damping = 0.0;       ///< N·s/m along the normal, not negative; it never pulls the probe inward
};

/// Errors: bad_value, naming the field and what would be accepted. [build]
Status validate(const Material& material);

}  // namespace asperity
