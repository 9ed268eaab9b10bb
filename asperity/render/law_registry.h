#pragma once
// Laws by their names: those that are built in, and those that a program has added, all by the same registration.

#include <string>
#include <string_view>
#include <vector>

#include "asperity/core/option.h"
#include "asperity/core/result.h"
#include "asperity/render/law.h"

namespace asperity {

/// Makes a kind of law known to law_by_name, scene files, the schema and `compare`. To be called before scenes are
/// read, by one thread. Errors: bad_value (no plain name, a name that is taken, an option twice or that a program keeps
/// for itself, a default that it would not take). [build]
Status register_law(const LawKind& kind);
/// The same for a type. [build]
template <ContactLaw L>
Status register_law() {
  return register_law(detail::law_kind<L>);
}

/// Every kind, in the order of registration: the built-in ones first. [any]
const std::vector<const LawKind*>& law_kinds();
/// Whether the law is one of those. [any]
bool is_built_in(const Law& law);
/// What scene files may say of a law beside its type and form. [any]
std::vector<Option> law_options(const LawKind& kind);

/// Errors: bad_value naming the option and what would be accepted. [build]
Status validate(const Law& law);
/// The law as it stands in a scene that is shown `zoom` times its size, by what its options say. [build]
Law magnified(const Law& law, double zoom);

/// What it is called in scene files: its kind's name, with "-literal" appended where a law with two forms has that one.
/// [any]
std::string law_name(const Law& law);
/// The law of that name with default options. Errors: bad_value listing the names. [any]
Result<Law> law_by_name(std::string_view name);
/// Every name that law_by_name accepts: "proxy", "god-object", "force-shading", "force-shading-literal", ... [any]
const std::vector<std::string>& law_names();

}  // namespace asperity
