#include "asperity/material/material.h"

#include <fmt/format.h>

#include <cmath>

namespace asperity {

Status validate(const Material& material) {
  const auto check = [](double value, bool fits, const char* name, const char* accepted) -> Status {
    if (std::isfinite(value) && fits) return success();
    return bad_value(fmt::format("is {}", value), name, accepted);
  };
  const Material& m = material;
  ASPERITY_CHECK(check(m.stiffness, m.stiffness > 0.0, "stiffness", "a stiffness above 0 (N/m, N/mm)"));
  ASPERITY_CHECK(check(m.damping, m.damping >= 0.0, "damping", "a damping of 0 or more (N s/m)"));
  ASPERITY_CHECK(check(m.static_friction, m.static_friction >= 0.0, "static_friction", "a coefficient of 0 or more"));
  ASPERITY_CHECK(check(m.dynamic_friction, m.dynamic_friction >= 0.0 && m.dynamic_friction <= m.static_friction,
                       "dynamic_friction", "a coefficient from 0 to static_friction"));
  ASPERITY_CHECK(check(m.viscosity, m.viscosity >= 0.0, "viscosity", "a viscosity of 0 or more (N s/m)"));
  ASPERITY_CHECK(check(m.magnetism, m.magnetism >= 0.0, "magnetism", "a stiffness of 0 or more (N/m, N/mm)"));
  ASPERITY_CHECK(check(m.stickiness, m.stickiness >= 0.0, "stickiness", "a force of 0 or more (N)"));
  ASPERITY_CHECK(check(m.magnetic_band, m.magnetic_band > 0.0, "magnetic_band", "a length above 0 (m, mm)"));
  if (Status friction = validate(material.friction); !friction) return std::move(friction).error().at("friction");
  return success();
}

}  // namespace asperity
