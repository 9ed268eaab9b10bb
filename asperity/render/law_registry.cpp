#include "asperity/render/law_registry.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "asperity/core/named_numbers.h"
#include "asperity/core/suggest.h"
#include "asperity/render/laws.h"

namespace asperity {

namespace {

constexpr std::string_view literal_suffix = "-literal";

/// Every law that there is.
struct LawRegistry {
  std::vector<const LawKind*> kinds;
  std::vector<std::string> names;
  std::size_t built_in = 0;

  LawRegistry() {
    // The one list of the laws that are built in.
    add<ProxyLaw, GodObjectLaw, ForceShadingLaw, HeightFieldLaw, MesostructureLaw, MesostructureIntendedLaw,
        GeneratedGeometryLaw, DenseMeshLaw, AvilaLaw, CrossUncrossLaw, VirtualContactPointLaw, MagneticLaw,
        NormalPerturbationLaw>();
    built_in = kinds.size();
  }
  template <class... L>
  void add() {
    (static_cast<void>(add(detail::law_kind<L>).value()), ...);
  }
  Status add(const LawKind& kind);
};

LawRegistry& registry() {
  static LawRegistry all;
  return all;
}

/// As messages say it.
std::string said(const OptionValue& value) {
  return std::visit(
      []<class T>(const T& one) -> std::string {
        if constexpr (std::is_same_v<T, std::string>) {
          return fmt::format("is \"{}\"", one);
        } else if constexpr (std::is_arithmetic_v<T>) {
          return fmt::format("is {}", one);
        } else {
          return "is given";
        }
      },
      value);
}

bool among(const std::vector<std::string>& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

Status LawRegistry::add(const LawKind& kind) {
  const std::string name(kind.facts->name);
  if (!is_plain_name(name))
    return bad_value(fmt::format("\"{}\" is no name of a law", name), "name", "lower-case letters, digits and hyphens");
  const std::string literal = name + std::string(literal_suffix);
  if (among(names, name) || among(names, literal))
    return bad_value(fmt::format("there is a law \"{}\" already", name), "name", "another name");
  std::vector<std::string> keys{"type", "formulation"};
  for (const Option& row : law_options(kind)) {
    if (among(keys, row.key) || row.help.empty() || std::type_index(*kind.type) != row.settings)
      return bad_value(fmt::format("\"{}\" cannot be an option of the law \"{}\"", row.key, name), "options",
                       "keys of its own, bound to members of the law, each with a line of help");
    keys.push_back(row.key);
  }
  if (Status valid = validate(Law(kind)); !valid) return std::move(valid).error().at("options");
  kinds.push_back(&kind);
  names.push_back(name);
  if (kind.form != nullptr) names.push_back(literal);
  return success();
}

}  // namespace

Status register_law(const LawKind& kind) {
  return registry().add(kind);
}

const std::vector<const LawKind*>& law_kinds() {
  return registry().kinds;
}

bool is_built_in(const Law& law) {
  const LawRegistry& all = registry();
  const auto end = all.kinds.begin() + static_cast<std::ptrdiff_t>(all.built_in);
  return std::find(all.kinds.begin(), end, &law.kind()) != end;
}

std::vector<Option> law_options(const LawKind& kind) {
  std::vector<Option> rows;
  if (kind.options != nullptr) kind.options(rows);
  return rows;
}

Law magnified(const Law& law, double zoom) {
  return law.changed([&](void* settings) {
    for (const Option& row : law_options(law.kind())) {
      const OptionValue value = row.get(settings);
      const auto* number = std::get_if<double>(&value);
      if (number != nullptr && row.zoom_power() != 0) row.set(settings, *number * std::pow(zoom, row.zoom_power()));
    }
  });
}

Status validate(const Law& law) {
  for (const Option& row : law_options(law.kind())) {
    const OptionValue value = row.get(law.settings());
    if (value == row.fallback) continue;
    const auto* number = std::get_if<double>(&value);
    if (!row.type.takes(value) || (number != nullptr && !std::isfinite(*number)))
      return bad_value(said(value), row.key, row.type.accepted());
    if (!row.printed.empty() && law.formulation() == Formulation::consistent) {
      return bad_value(fmt::format("is the literal form's: the consistent \"{}\" does not read it, {}",
                                   law.facts().name, row.printed),
                       row.key, "formulation \"literal\"");
    }
  }
  return law.kind().validate != nullptr ? law.kind().validate(law.settings()) : success();
}

std::string law_name(const Law& law) {
  std::string name(law.facts().name);
  if (law.formulation() == Formulation::literal) name += literal_suffix;
  return name;
}

const std::vector<std::string>& law_names() {
  return registry().names;
}

Result<Law> law_by_name(std::string_view name) {
  for (const LawKind* kind : law_kinds()) {
    const std::string_view own = kind->facts->name;
    if (name == own) return Law(*kind);
    if (kind->form != nullptr && name.starts_with(own) && name.substr(own.size()) == literal_suffix)
      return Law(*kind).in_form(Formulation::literal);
  }
  std::string list;
  for (const std::string& known : law_names()) list += (list.empty() ? "" : ", ") + known;
  const std::string near = nearest_name(name, law_names());
  return bad_value(fmt::format("\"{}\" is no law{}", name, near.empty() ? "" : "; did you mean \"" + near + "\"?"), "",
                   list);
}

}  // namespace asperity
