#pragma once
// Words that the table of scene keys is written in. Internal to io.

#include <algorithm>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "asperity/io/detail/scene_table.h"

namespace asperity::scene_rows {

using Type = OptionType;
using Test = OptionTest;

inline constexpr Range positive = Range::positive();
inline constexpr Range not_negative = Range::not_negative();
inline const auto length = [](Range range = {}) { return Type::quantity(Dimension::length, range); };
inline const auto force = [](Range range = {}) { return Type::quantity(Dimension::force, range); };
inline const auto stiffness = [](Range range = {}) { return Type::quantity(Dimension::stiffness, range); };
inline const auto damping = [](Range range = {}) { return Type::quantity(Dimension::damping, range); };
inline const auto mass = [](Range range = {}) { return Type::quantity(Dimension::mass, range); };
inline const auto seconds = [](Range range = {}) { return Type::quantity(Dimension::time, range); };
inline const auto frequency = [](Range range = {}) { return Type::quantity(Dimension::frequency, range); };
inline const auto speed = [](Range range = {}) { return Type::quantity(Dimension::speed, range); };
inline const auto ratio = [](Range range = {}) { return Type::quantity(Dimension::ratio, range); };
inline const auto angle = [](Range range = {}) { return Type::quantity(Dimension::angle, range); };

// What a row may be told beside key, type and help.
inline const auto only_if = [](Test test, std::string why) { return [=](Option& row) { row.only_if(test, why); }; };
inline const auto or_else = [](std::string words) { return [=](Option& row) { row.otherwise = words; }; };
inline const auto with_default = [](auto value) { return [=](Option& row) { row.fallback = to_option(value); }; };
inline const auto there_if = [](Test test) { return [=](Option& row) { row.required = test; }; };
inline const auto always_there = there_if({});
inline const auto by_contents = [](std::string what) { return [=](Option& row) { row.contents = what; }; };

/// Names of the values of E that take a parameter. [any]
template <HasNames E, class Parameters>
std::vector<std::string> taking(const Parameters& parameters, std::string_view parameter) {
  std::vector<std::string> names;
  for (const Named<E>& entry : Names<E>::table) {
    const auto& taken = parameters(entry.value);
    if (std::find(taken.begin(), taken.end(), parameter) != taken.end()) names.emplace_back(entry.name);
  }
  return names;
}

/// Kinds of object, each with what fills in its rows.
using Rows = std::vector<std::pair<SceneObject, void (*)(SceneObject& row)>>;
/// The scene, who touches it, how it is looked at. [any]
Rows hand_rows();
/// What is touched, and where it is. [any]
Rows shape_rows();
/// Heights and coats. [any]
Rows coat_rows();
/// Laws, materials, fine features. [any]
Rows feel_rows();

/// Where heights or other values over a surface come from. [any]
Type heights_source();
/// "height_map" and what its grey means. `shares`: heights may be shares of a mesh's mean edge. `each` adds what all of
/// these rows have in common.
void heights(SceneObject& row, bool shares, const std::function<void(Option&)>& each);
/// "units", "fit" and "pose", which surfaces and effects have. [any]
void placing(SceneObject& row, std::vector<std::pair<Test, std::string>> unfit);

}  // namespace asperity::scene_rows
