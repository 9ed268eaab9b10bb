// What friction laws are called, which parameters they read and what those may be.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>

#include "asperity/core/suggest.h"
#include "asperity/material/friction.h"

namespace asperity {

namespace {

struct Parameter {
  const char* name;
  double FrictionLaw::*member;
  double least;
  bool above;  ///< `least` itself is not accepted
  double most;
  const char* accepted;
};

constexpr double no_limit = std::numeric_limits<double>::max();
constexpr std::array<Parameter, 8> all_parameters{{
    {"stiffness", &FrictionLaw::stiffness, 0.0, false, no_limit,
     "a stiffness above 0 (N/m, N/mm), or 0 for the contact's own"},
    {"damping", &FrictionLaw::damping, 0.0, false, no_limit, "a damping of 0 or more (N·s/m)"},
    {"viscosity", &FrictionLaw::viscosity, 0.0, false, no_limit, "a viscosity of 0 or more (N·s/m)"},
    {"break_away", &FrictionLaw::break_away, 0.0, false, no_limit,
     "a force above 0 (N), or 0 for the static coefficient times the push"},
    {"stick_speed", &FrictionLaw::stick_speed, 0.0, true, no_limit, "a speed above 0 (m/s, mm/s)"},
    {"stribeck_speed", &FrictionLaw::stribeck_speed, 0.0, true, no_limit, "a speed above 0 (m/s, mm/s)"},
    {"exponent", &FrictionLaw::exponent, 0.5, false, 4.0, "0.5 to 4"},
    {"adhesion", &FrictionLaw::adhesion, 0.0, false, 0.9, "0 to 0.9"},
}};

}  // namespace

const char* friction_name(FrictionKind kind) {
  return to_string(kind);
}

const std::vector<std::string>& friction_names() {
  return all_names<FrictionKind>();
}

Result<FrictionKind> friction_by_name(std::string_view name) {
  if (const std::optional<FrictionKind> kind = value_named<FrictionKind>(name)) return *kind;
  const std::string near = nearest_name(name, friction_names());
  return bad_value(
      fmt::format("\"{}\" is no friction law{}", name, near.empty() ? "" : fmt::format("; did you mean \"{}\"?", near)),
      {}, listed(friction_names()));
}

const std::vector<std::string>& friction_parameters(FrictionKind kind) {
  static const std::vector<std::string> of_kind[] = {
      {"stiffness", "damping", "break_away"},                                 // implicit_coulomb
      {"viscosity"},                                                          // viscous
      {"viscosity", "stick_speed"},                                           // coulomb
      {"stiffness", "damping", "viscosity", "break_away", "stick_speed"},     // karnopp
      {"stiffness", "exponent"},                                              // dahl
      {"stiffness", "adhesion"},                                              // hayward_armstrong
      {"stiffness", "damping", "viscosity", "break_away", "stribeck_speed"},  // lugre
  };
  const auto place = static_cast<std::size_t>(kind);
  return of_kind[place < std::size(of_kind) ? place : 0];
}

Status validate(const FrictionLaw& law) {
  const FrictionLaw plain;
  const std::vector<std::string>& read = friction_parameters(law.kind);
  for (const Parameter& parameter : all_parameters) {
    const double value = law.*parameter.member;
    const bool reads = std::find(read.begin(), read.end(), parameter.name) != read.end();
    if (!reads && value != plain.*parameter.member) {
      return bad_value(fmt::format("is not read by the friction law {}", friction_name(law.kind)), parameter.name,
                       listed(read));
    }
    const bool low = parameter.above ? !(value > parameter.least) : !(value >= parameter.least);
    if (low || !(value <= parameter.most))
      return bad_value(fmt::format("is {}", value), parameter.name, parameter.accepted);
  }
  if (law.kind == FrictionKind::karnopp && law.formulation == Formulation::literal && law.damping > 0.0) {
    return bad_value("is the consistent form's: the printed spring has none", "damping",
                     "0, or formulation \"consistent\"");
  }
  if (law.kind == FrictionKind::coulomb && law.formulation == Formulation::literal &&
      law.stick_speed != plain.stick_speed) {
    return bad_value("is the consistent form's: the literal one jumps at rest", "stick_speed",
                     "formulation \"consistent\"");
  }
  return success();
}

}  // namespace asperity
