#include "asperity/material/material.h"

#include <fmt/format.h>

#include <cmath>

namespace asperity {

Status validate(const Material& material) {
  if (!std::isfinite(material.stiffness) || material.stiffness <= 0.0) {
    return bad_value(fmt::format("is {}", material.stiffness), "stiffness", "a stiffness above 0 (N/m, N/mm)");
  }
  if (!std::isfinite(material.damping) || material.damping < 0.0) {
    return Error{
        ErrorCode::bad_value, fmt::format("is {}", material.damping), {}, "damping", "a damping of 0 or more (N s/m)"};
  }
  if (!std::isfinite(material.static_friction) || material.static_friction < 0.0) {
    return bad_value(fmt::format("is {}", material.static_friction), "static_friction", "a coefficient of 0 or more");
  }
  if (!(material.dynamic_friction >= 0.0 && material.dynamic_friction <= material.static_friction)) {
    return bad_value(fmt::format("is {}", material.dynamic_friction), "dynamic_friction",
                     "a coefficient from 0 to static_friction");
  }
  const auto not_negative = [](double value, const char* name, const char* accepted) -> Status {
    if (std::isfinite(value) && value >= 0.0) return success();
    return bad_value(fmt::format("is {}", value), name, accepted);
  };
  ASPERITY_CHECK(not_negative(material.viscosity, "viscosity", "a viscosity of 0 or more (N s/m)"));
  ASPERITY_CHECK(not_negative(material.magnetism, "magnetism", "a stiffness of 0 or more (N/m, N/mm)"));
  ASPERITY_CHECK(not_negative(material.stickiness, "stickiness", "a force of 0 or more (N)"));
  if (!std::isfinite(material.magnetic_band) || material.magnetic_band <= 0.0) {
    return bad_value(fmt::format("is {}", material.magnetic_band), "magnetic_band", "a length above 0 (m, mm)");
  }
  if (Status friction = validate(material.friction); !friction) return std::move(friction).error().at("friction");
  return success();
}

}  // namespace asperity
