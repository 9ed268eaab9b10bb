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
  if (!std::isfinite(material.static_friction) || material.static_friction < 0.0) {
    return Error{ErrorCode::bad_value,
                 fmt::format("is {}", material.static_friction),
                 {},
                 "static_friction",
                 "a coefficient of 0 or more"};
  }
  if (!(material.dynamic_friction >= 0.0 && material.dynamic_friction <= material.static_friction)) {
    return Error{ErrorCode::bad_value,
                 fmt::format("is {}", material.dynamic_friction),
                 {},
                 "dynamic_friction",
                 "a coefficient from 0 to static_friction"};
  }
  if (Status friction = validate(material.friction); !friction) return std::move(friction).error().at("friction");
  return success();
}

}  // namespace asperity
