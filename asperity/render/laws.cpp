#include "asperity/render/laws.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "asperity/core/suggest.h"
#include "asperity/render/custom_law.h"

namespace asperity {

namespace {

template <class... Fs>
struct Overloaded : Fs... {
  using Fs::operator()...;
};

Error option_error(std::string option, double value, std::string accepted) {
  return Error{ErrorCode::bad_value, fmt::format("is {}", value), {}, std::move(option), std::move(accepted)};
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
    return Error{ErrorCode::bad_value,
                 "is the literal form's: the consistent one looks as far as it has to",
                 {},
                 "reach",
                 "0, or formulation \"literal\""};
  }
  return success();
}

Status validate_virtual_contact_point(const VirtualContactPointLaw& law) {
  if (!(law.depth_gain >= 0.0 && std::isfinite(law.depth_gain)))
    return option_error("depth_gain", law.depth_gain, "0 or more (1/m)");
  if (!(law.offset >= 0.0 && std::isfinite(law.offset)))
    return option_error("offset", law.offset, "a length of 0 or more (m, mm)");
  if (law.magnitude != ContactMagnitude::distance && law.formulation == Formulation::consistent) {
    return Error{ErrorCode::bad_value,
                 "is the literal form's: the consistent one is the slope of one energy",
                 {},
                 "magnitude",
                 "\"distance\", or formulation \"literal\""};
  }
  return success();
}

}  // namespace

std::string law_name(const Law& law) {
  const auto suffix = [](Formulation f) { return f == Formulation::literal ? std::string("-literal") : std::string(); };
  return std::visit(
      Overloaded{
          [](const ProxyLaw&) { return std::string("proxy"); },
          [](const GodObjectLaw&) { return std::string("god-object"); },
          [&](const ForceShadingLaw& l) { return "force-shading" + suffix(l.formulation); },
          [&](const HeightFieldLaw& l) { return "height-field" + suffix(l.formulation); },
          [&](const MesostructureLaw& l) { return "mesostructure" + suffix(l.formulation); },
          [](const GeneratedGeometryLaw&) { return std::string("generated-geometry"); },
          [](const DenseMeshLaw&) { return std::string("dense-mesh"); },
          [&](const AvilaLaw& l) { return "avila" + suffix(l.formulation); },
          [&](const CrossUncrossLaw& l) { return "cross-uncross" + suffix(l.formulation); },
          [&](const VirtualContactPointLaw& l) { return "virtual-contact-point" + suffix(l.formulation); },
          [&](const MagneticLaw& l) { return "magnetic" + suffix(l.formulation); },
          [](const NormalPerturbationLaw&) { return std::string("normal-perturbation"); },
          [](const std::shared_ptr<const CustomLaw>& l) { return l == nullptr ? std::string("custom") : l->name(); },
      },
      law);
}

const std::vector<std::string>& law_names() {
  static const std::vector<std::string> names{"proxy",
                                              "god-object",
                                              "force-shading",
                                              "force-shading-literal",
                                              "height-field",
                                              "height-field-literal",
                                              "mesostructure",
                                              "mesostructure-literal",
                                              "generated-geometry",
                                              "dense-mesh",
                                              "avila",
                                              "avila-literal",
                                              "cross-uncross",
                                              "cross-uncross-literal",
                                              "virtual-contact-point",
                                              "virtual-contact-point-literal",
                                              "magnetic",
                                              "magnetic-literal",
                                              "normal-perturbation"};
  return names;
}

Result<Law> law_by_name(std::string_view name) {
  // The 2005 paper forces heights to 0 at the edges; it gives no width, so the later paper's band is taken.
  constexpr double literal_taper = 0.05;
  if (name == "proxy") return Law(ProxyLaw{});
  if (name == "god-object") return Law(GodObjectLaw{});
  if (name == "force-shading") return Law(ForceShadingLaw{});
  if (name == "force-shading-literal") return Law(ForceShadingLaw{Formulation::literal});
  if (name == "height-field") return Law(HeightFieldLaw{});
  if (name == "height-field-literal") return Law(HeightFieldLaw{Formulation::literal, literal_taper});
  if (name == "mesostructure") return Law(MesostructureLaw{});
  if (name == "mesostructure-literal") return Law(MesostructureLaw{Formulation::literal, 0.05, Blend::s_shape, {}});
  if (name == "generated-geometry") return Law(GeneratedGeometryLaw{});
  if (name == "dense-mesh") return Law(DenseMeshLaw{});
  if (name == "avila") return Law(AvilaLaw{});
  if (name == "avila-literal") return Law(AvilaLaw{Formulation::literal});
  if (name == "cross-uncross") return Law(CrossUncrossLaw{});
  if (name == "cross-uncross-literal") return Law(CrossUncrossLaw{Formulation::literal});
  if (name == "virtual-contact-point") return Law(VirtualContactPointLaw{});
  if (name == "virtual-contact-point-literal") return Law(VirtualContactPointLaw{Formulation::literal});
  if (name == "magnetic") return Law(MagneticLaw{});
  if (name == "magnetic-literal") return Law(MagneticLaw{Formulation::literal});
  if (name == "normal-perturbation") return Law(NormalPerturbationLaw{});
  std::vector<std::string> all = law_names();
  all.insert(all.end(), custom_law_names().begin(), custom_law_names().end());
  if (std::find(all.begin(), all.end(), name) != all.end()) return make_custom_law(name, {});
  std::string list;
  for (const std::string& known : all) list += (list.empty() ? "" : ", ") + known;
  const std::string near = nearest_name(name, all);
  return Error{ErrorCode::bad_value,
               fmt::format("\"{}\" is no law{}", name, near.empty() ? "" : "; did you mean \"" + near + "\"?"),
               {},
               {},
               list};
}

Status validate(const Law& law) {
  if (std::holds_alternative<std::shared_ptr<const CustomLaw>>(law) && custom_of(law) == nullptr)
    return Error{ErrorCode::bad_value, "holds no law", {}, {}, "a law made by CustomLaw::build"};
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
      return Error{ErrorCode::bad_value,
                   "is the literal form's: the consistent one blends as the coat's stitching says",
                   {},
                   meso->test_neighbours ? "test_neighbours" : (meso->rho != plain.rho ? "rho" : "blend"),
                   "coat.stitching, or formulation \"literal\""};
    }
    return validate(Stitching{FoldMode::keep, meso->blend, meso->rho, meso->blend_map});
  }
  return success();
}

}  // namespace asperity
