#pragma once
// Numbers by name: what a scene file hands to a surface or a law that a program has added.

#include <map>
#include <string>
#include <string_view>

#include "asperity/core/result.h"

namespace asperity {

/// What is read from it is remembered, so that names nobody read become errors and defaults are written down. SI.
class NamedNumbers {
 public:
  NamedNumbers() = default;
  explicit NamedNumbers(std::map<std::string, double, std::less<>> given) : given_(std::move(given)) {}

  /// The number of that name, or `fallback`. [build]
  double get(std::string_view name, double fallback);
  /// Every number read so far, defaults included. [any]
  [[nodiscard]] const std::map<std::string, double, std::less<>>& taken() const noexcept { return taken_; }
  /// Errors: bad_key, naming a number that nobody has read and those that were; bad_value, one that is not finite.
  /// [build]
  [[nodiscard]] Status all_taken() const;

 private:
  std::map<std::string, double, std::less<>> given_;
  std::map<std::string, double, std::less<>> taken_;
};

/// Whether a name can be typed where laws and shapes are named: lower-case letters, digits and single hyphens between
/// them. [any]
bool is_plain_name(std::string_view name);

}  // namespace asperity
