#include "asperity/render/laws.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "asperity/core/suggest.h"

namespace asperity {

namespace {

template <class... Fs>
struct Overloaded : Fs... {
  using Fs::operator()...;
};

Error option_error(std::string option, double value, std::string accepted) {
  return Error{ErrorCode::bad_value, fmt::format("is {}", value), {}, std::move(option), std::move(accepted)};
}

}  // namespace

std::string law_name(const Law& law) {
  const auto suffix = [](Formulation f) { return f == Formulation::literal ? std::string("-literal") : std::string(); };
  return std::visit(Overloaded{
                        [](const GodObjectLaw&) { return std::string("god-object"); },
                        [](const ForceShadingLaw&) { return std::string("force-shading"); },
                        [&](const HeightFieldLaw& l) { return "height-field" + suffix(l.formulation); },
                        [&](const MesostructureLaw& l) { return "mesostructure" + suffix(l.formulation); },
                    },
                    law);
}

const std::vector<std::string>& law_names() {
  static const std::vector<std::string> names{"god-object",           "force-shading", "height-field",
                                              "height-field-literal", "mesostructure", "mesostructure-literal"};
  return names;
}

Result<Law> law_by_name(std::string_view name) {
  // The 2005 paper forces heights to 0 at the edges; it gives no width, so the later paper's band is taken.
  constexpr double literal_taper = 0.05;
  if (name == "god-object") return Law(GodObjectLaw{});
  if (name == "force-shading") return Law(ForceShadingLaw{});
  if (name == "height-field") return Law(HeightFieldLaw{});
  if (name == "height-field-literal") return Law(HeightFieldLaw{Formulation::literal, literal_taper});
  if (name == "mesostructure") return Law(MesostructureLaw{});
  if (name == "mesostructure-literal") return Law(MesostructureLaw{Formulation::literal, 0.05, Blend::s_shape, {}});
  std::string list;
  for (const std::string& known : law_names()) list += (list.empty() ? "" : ", ") + known;
  const std::string near = nearest_name(name, law_names());
  return Error{ErrorCode::bad_value,
               fmt::format("\"{}\" is no law{}", name, near.empty() ? "" : "; did you mean \"" + near + "\"?"),
               {},
               {},
               list};
}

Status validate(const Law& law) {
  if (const auto* height_field = std::get_if<HeightFieldLaw>(&law)) {
    const double taper = height_field->edge_taper;
    if (!(taper >= 0.0 && taper <= 1.0 / 3.0)) return option_error("edge_taper", taper, "0 to 1/3");
  }
  if (const auto* meso = std::get_if<MesostructureLaw>(&law)) {
    if (!(meso->rho > 0.0 && meso->rho <= 1.0 / 3.0)) return option_error("rho", meso->rho, "above 0, at most 1/3");
    if (meso->blend == Blend::image) {
      if (meso->blend_map.size() < 2) {
        return Error{
            ErrorCode::bad_value, "has fewer than two values", {}, "blend_map", "an image at least two pixels wide"};
      }
      for (const double value : meso->blend_map) {
        if (!(value >= 0.0 && value <= 1.0)) return option_error("blend_map", value, "weights from 0 to 1");
      }
      if (meso->blend_map.back() <= 0.0)
        return option_error("blend_map", meso->blend_map.back(), "a weight above 0 at its right (inner) end");
    }
  }
  return success();
}

BlendValue blend_value(const MesostructureLaw& law, double barycentric) noexcept {
  const double scale = 1.0 / (2.0 * law.rho);
  const double t = (barycentric + law.rho) * scale;
  if (t <= 0.0) return {0.0, 0.0};
  if (t >= 1.0) return {law.blend == Blend::image ? law.blend_map.back() : 1.0, 0.0};
  switch (law.blend) {
    case Blend::none: return {t >= 0.5 ? 1.0 : 0.0, 0.0};
    case Blend::linear: return {t, scale};
    case Blend::s_shape: return {t * t * (3.0 - 2.0 * t), 6.0 * t * (1.0 - t) * scale};
    case Blend::image: {
      const double position = t * static_cast<double>(law.blend_map.size() - 1);
      const auto cell = std::min(static_cast<std::size_t>(position), law.blend_map.size() - 2);
      const double low = law.blend_map[cell];
      const double step = law.blend_map[cell + 1] - low;
      return {low + step * (position - static_cast<double>(cell)),
              step * static_cast<double>(law.blend_map.size() - 1) * scale};
    }
  }
  return {1.0, 0.0};
}

}  // namespace asperity
