#pragma once
// How settings tell a blend.

#include <vector>

#include "asperity/core/option.h"
#include "asperity/surface/stitching.h"

namespace asperity {

/// The key "blend" of settings that have a blend and its weights: a name, or weights; an image is left to whoever reads
/// files. [any]
template <class S>
Option blend_option(Blend S::*blend, std::vector<double> S::*weights) {
  const OptionType weight_list = OptionType::array(OptionType::number({0.0, 1.0}), 2, 1000000, "weights");
  const OptionType type =
      OptionType::any({OptionType::named<Blend>(), OptionType::object("blend map"),
                       OptionType(weight_list).saying("an array of two weights or more, each from 0 to 1")});
  Option row = option("blend", blend, type,
                      "weight over the band; an array holds weights from 0 to 1, outside to inside, evenly spaced.");
  row.get = [=](const void* of) {
    const S& settings = *static_cast<const S*>(of);
    return settings.*blend == Blend::image ? OptionValue(settings.*weights) : to_option(settings.*blend);
  };
  row.set = [=](void* of, const OptionValue& value) {
    S& settings = *static_cast<S*>(of);
    const auto* given = std::get_if<std::vector<double>>(&value);
    if (given != nullptr) settings.*weights = *given;
    settings.*blend = given != nullptr ? Blend::image : from_option<Blend>(value);
  };
  return row;
}

}  // namespace asperity
