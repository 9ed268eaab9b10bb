#pragma once
// What a program has added, in a scene file: its numbers. Internal to io.

#include "asperity/core/named_numbers.h"
#include "asperity/io/detail/scene_reader.h"

namespace asperity {

/// The numbers of {"type": NAME, ...}: SI, or texts with a unit. Errors: bad_type, bad_value. [build]
Result<NamedNumbers> read_named_numbers(const SceneJson& json, const std::string& place);
/// {"type": NAME, ...} again, defaults included. [build]
SceneJson named_numbers_json(const std::string& type, const NamedNumbers& numbers);

/// Reads `custom` of a surface. [build]
Status read_custom(ObjectReader& surface, Instance& instance);

}  // namespace asperity
