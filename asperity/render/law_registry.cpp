#include "asperity/render/law_registry.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <type_traits>
#include <utility>

#include "asperity/core/suggest.h"

namespace asperity {

namespace {

struct Registered {
  std::vector<std::string> names;
  std::vector<CustomLawFactory> factories;
};

Registered& registry() {
  static Registered all;
  return all;
}

/// What the kinds of laws are called, in the order of the variant: the one place where a built-in law is named. The
/// last kind, a program's own, has names of its own.
constexpr std::size_t built_in_laws = std::variant_size_v<Law> - 1;
constexpr std::array<std::string_view, built_in_laws> law_kind_names{
    "proxy",      "god-object", "force-shading", "height-field",          "mesostructure", "generated-geometry",
    "dense-mesh", "avila",      "cross-uncross", "virtual-contact-point", "magnetic",      "normal-perturbation"};
static_assert(std::none_of(law_kind_names.begin(), law_kind_names.end(), [](auto name) { return name.empty(); }));
static_assert(std::is_same_v<std::variant_alternative_t<built_in_laws, Law>, std::shared_ptr<const CustomLaw>>);
constexpr std::string_view literal_suffix = "-literal";

template <class L>
constexpr bool has_two_forms = requires(L law) {
  law.formulation;
};

/// A name and what it makes.
struct NamedLaw {
  std::string name;
  Law law;
};

template <std::size_t Kind>
void add_named_laws(std::vector<NamedLaw>& all) {
  using Made = std::variant_alternative_t<Kind, Law>;
  const std::string name(law_kind_names[Kind]);
  if constexpr (has_two_forms<Made>) {
    all.push_back({name, Made{.formulation = Formulation::consistent}});
    all.push_back({name + std::string(literal_suffix), Made{.formulation = Formulation::literal}});
  } else {
    all.push_back({name, Made{}});
  }
}

/// Every built-in law by its name: what is listed is what is made.
const std::vector<NamedLaw>& named_laws() {
  static const std::vector<NamedLaw> laws = [] {
    std::vector<NamedLaw> all;
    [&]<std::size_t... Kind>(std::index_sequence<Kind...>) {
      (add_named_laws<Kind>(all), ...);
    }
    (std::make_index_sequence<built_in_laws>());
    return all;
  }();
  return laws;
}

Error option_error(std::string option, double value, std::string accepted) {
  return bad_value(fmt::format("is {}", value), std::move(option), std::move(accepted));
}

Status validate_avila(const AvilaLaw& law) {
  if (!(law.band >= 0.0 && std::isfinite(law.band)))
    return option_error("band", law.band, "a width above 0 in the field's unit, or 0 to choose it by the stiffness");
  if (!(law.largest_force > 0.0 && std::isfinite(law.largest_force)))
    return option_error("largest_force", law.largest_force, "a force above 0 (N)");
  if (!(law.retarding >= 0.0 && std::isfinite(law.retarding)))
    return option_error("retarding", law.retarding, "a viscosity of 0 or more (N·s/m)");
  return success();
}

Status validate_cross_uncross(const CrossUncrossLaw& law) {
  if (!(law.retarding >= 0.0 && std::isfinite(law.retarding)))
    return option_error("retarding", law.retarding, "a viscosity of 0 or more (N·s/m)");
  if (!(law.reach >= 0.0 && std::isfinite(law.reach)))
    return option_error("reach", law.reach, "a length of 0 or more (m, mm)");
  if (law.reach > 0.0 && law.formulation == Formulation::consistent) {
    return bad_value("is the literal form's: the consistent one looks as far as it has to", "reach",
                     "0, or formulation \"literal\"");
  }
  return success();
}

Status validate_virtual_contact_point(const VirtualContactPointLaw& law) {
  if (!(law.depth_gain >= 0.0 && std::isfinite(law.depth_gain)))
    return option_error("depth_gain", law.depth_gain, "0 or more (1/m)");
  if (!(law.offset >= 0.0 && std::isfinite(law.offset)))
    return option_error("offset", law.offset, "a length of 0 or more (m, mm)");
  if (law.magnitude != ContactMagnitude::distance && law.formulation == Formulation::consistent) {
    return bad_value("is the literal form's: the consistent one is the slope of one energy", "magnitude",
                     "\"distance\", or formulation \"literal\"");
  }
  return success();
}

}  // namespace

std::string law_name(const Law& law) {
  if (law.index() >= built_in_laws) return custom_of(law) == nullptr ? std::string("custom") : custom_of(law)->name();
  std::string name(law_kind_names[law.index()]);
  if (formulation_of(law) == Formulation::literal) name += literal_suffix;
  return name;
}

const std::vector<std::string>& law_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const NamedLaw& named : named_laws()) all.push_back(named.name);
    return all;
  }();
  return names;
}

std::optional<Formulation> formulation_of(const Law& law) {
  return std::visit(
      []<class L>(const L& one) -> std::optional<Formulation> {
        if constexpr (has_two_forms<L>) {
          return one.formulation;
        } else {
          return std::nullopt;
        }
      },
      law);
}

Law in_formulation(const Law& law, Formulation formulation) {
  return std::visit(
      [&]<class L>(const L& one) -> Law {
        if constexpr (has_two_forms<L>) {
          return L{.formulation = formulation};
        } else {
          return one;
        }
      },
      law);
}

Result<Law> law_by_name(std::string_view name) {
  for (const NamedLaw& named : named_laws())
    if (named.name == name) return named.law;
  const std::vector<std::string>& custom = custom_law_names();
  if (std::find(custom.begin(), custom.end(), name) != custom.end()) return make_custom_law(name, {});
  std::vector<std::string> all = law_names();
  all.insert(all.end(), custom.begin(), custom.end());
  std::string list;
  for (const std::string& known : all) list += (list.empty() ? "" : ", ") + known;
  const std::string near = nearest_name(name, all);
  return bad_value(fmt::format("\"{}\" is no law{}", name, near.empty() ? "" : "; did you mean \"" + near + "\"?"), "",
                   list);
}

Status validate(const Law& law) {
  if (std::holds_alternative<std::shared_ptr<const CustomLaw>>(law) && custom_of(law) == nullptr)
    return bad_value("holds no law", "", "a law made by CustomLaw::build");
  if (const auto* avila = std::get_if<AvilaLaw>(&law)) return validate_avila(*avila);
  if (const auto* cross = std::get_if<CrossUncrossLaw>(&law)) return validate_cross_uncross(*cross);
  if (const auto* contact = std::get_if<VirtualContactPointLaw>(&law)) return validate_virtual_contact_point(*contact);
  if (const auto* magnetic = std::get_if<MagneticLaw>(&law);
      magnetic != nullptr && !(magnetic->band > 0.0 && std::isfinite(magnetic->band)))
    return option_error("band", magnetic->band, "a length above 0 (m, mm)");
  if (const auto* height_field = std::get_if<HeightFieldLaw>(&law)) {
    const double taper = height_field->edge_taper;
    if (!(taper >= 0.0 && taper <= 1.0 / 3.0)) return option_error("edge_taper", taper, "0 to 1/3");
  }
  if (const auto* generated = std::get_if<GeneratedGeometryLaw>(&law)) {
    if (generated->subdivisions < 1 || generated->subdivisions > most_generated_subdivisions)
      return option_error("subdivisions", generated->subdivisions, fmt::format("1 to {}", most_generated_subdivisions));
    if (!(generated->influence_radius >= 0.0 && std::isfinite(generated->influence_radius)))
      return option_error("influence_radius", generated->influence_radius, "a length of 0 or more (m, mm)");
  }
  if (const auto* dense = std::get_if<DenseMeshLaw>(&law); dense != nullptr && dense->subdivisions < 0)
    return option_error("subdivisions", dense->subdivisions, "1 or more, or 0 to choose them by the texels");
  if (const auto* meso = std::get_if<MesostructureLaw>(&law)) {
    const MesostructureLaw plain;
    const bool given =
        meso->rho != plain.rho || meso->blend != plain.blend || !meso->blend_map.empty() || meso->test_neighbours;
    if (meso->formulation == Formulation::consistent && given) {
      return bad_value("is the literal form's: the consistent one blends as the coat's stitching says",
                       meso->test_neighbours ? "test_neighbours" : (meso->rho != plain.rho ? "rho" : "blend"),
                       "coat.stitching, or formulation \"literal\"");
    }
    return validate(Stitching{FoldMode::keep, meso->blend, meso->rho, meso->blend_map});
  }
  return success();
}

Status register_custom_law(std::string name, CustomLawFactory factory) {
  Registered& all = registry();
  if (!is_plain_name(name))
    return bad_value(fmt::format("\"{}\" is no name of a law", name), "name", "lower-case letters, digits and hyphens");
  const auto taken = [&](const std::vector<std::string>& names) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  if (taken(all.names) || taken(law_names()))
    return bad_value(fmt::format("there is a law \"{}\" already", name), "name", "another name");
  if (!factory)
    return bad_value(fmt::format("the law \"{}\" has no factory", name), "factory", "a function that makes it");
  all.names.push_back(std::move(name));
  all.factories.push_back(std::move(factory));
  return success();
}

const std::vector<std::string>& custom_law_names() {
  return registry().names;
}

Result<Law> make_custom_law(std::string_view name, NamedNumbers numbers) {
  const Registered& all = registry();
  const auto found = std::find(all.names.begin(), all.names.end(), name);
  // The list of all laws is law_by_name's to tell.
  if (found == all.names.end()) return law_by_name(name);
  ASPERITY_TRY(const CustomLaw law, all.factories[static_cast<std::size_t>(found - all.names.begin())](numbers));
  ASPERITY_CHECK(numbers.all_taken());
  return Law(std::make_shared<const CustomLaw>(law.made_from(std::move(numbers))));
}

}  // namespace asperity
