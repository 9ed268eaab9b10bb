#pragma once
// Laws by their names: those that are built in, and those that a program has added.

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "asperity/core/result.h"
#include "asperity/render/custom_law.h"
#include "asperity/render/laws.h"

namespace asperity {

/// "proxy", "god-object", "force-shading", "height-field", "mesostructure", "generated-geometry", "dense-mesh",
/// "avila", "cross-uncross", "virtual-contact-point", "magnetic", "normal-perturbation", with "-literal" appended where
/// a law with two forms has that one; a program's own law by the name that it was given. [any]
std::string law_name(const Law& law);
/// The law of that name with default options, built in or registered. Errors: bad_value listing the names. [any]
Result<Law> law_by_name(std::string_view name);
/// Every built-in name that law_by_name accepts. [any]
const std::vector<std::string>& law_names();
/// Its form, where the law has two; nothing where it has one. [any]
std::optional<Formulation> formulation_of(const Law& law);
/// A law of the same kind in that form, with the default options of that form: what the name with or without "-literal"
/// makes. A law with one form: the law itself. [any]
Law in_formulation(const Law& law, Formulation formulation);
/// Errors: bad_value naming the option and what would be accepted. [build]
Status validate(const Law& law);

/// Makes a law of the numbers in a scene file.
using CustomLawFactory = std::function<Result<CustomLaw>(NamedNumbers& numbers)>;

/// Makes a law known to law_by_name, scene files and `compare --laws`. To be called before scenes are read, by one
/// thread. Errors: bad_value (no plain name, a name that is taken). [build]
Status register_custom_law(std::string name, CustomLawFactory factory);
/// The same for a type that is made from its numbers: T(NamedNumbers&). [build]
template <ForceLaw T>
Status register_custom_law(const std::string& name) {
  return register_custom_law(name, [name](NamedNumbers& numbers) { return CustomLaw::build(T(numbers), name); });
}
/// Every registered law. [any]
const std::vector<std::string>& custom_law_names();
/// A registered law made from `numbers`. Errors: bad_value (unknown), bad_key (a number that it does not read), and the
/// factory's own. [build]
Result<Law> make_custom_law(std::string_view name, NamedNumbers numbers);

}  // namespace asperity
