#include "asperity/material/material.h"

#include <fmt/format.h>

#include <cmath>

namespace asperity {

Status validate(const Material& material) {
  if (!std::isfinite(material.stiffness) || material.stiffness <= 0.0) {
    return Error{ErrorCode::bad_value,
                 fmt::format("is {}", material.stiffness),
                 {},
                 "stiffness",
                 "a stiffness above 0 (N/m, N/mm)"};
  }
  if (!std::isfinite(material.damping) || material.damping < 0.0) {
    return Error{
        ErrorCode::bad_value, fmt::format("is {}", material.damping), {}, "damping", "a damping of 0 or more (N s/m)"};
  }
  return success();
}

}  // namespace asperity
