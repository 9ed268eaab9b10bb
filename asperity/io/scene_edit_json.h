#pragma once
// Edits of a scene as they stand in traces.

#include <string>
#include <string_view>

#include "asperity/core/result.h"
#include "asperity/render/scene_edit.h"

namespace asperity {

/// One JSON object: "kind", "instance" where one is named, and "value" (SI) or "law". [any]
std::string to_json(const SceneEdit& edit);
/// Errors: file_malformed (no JSON object), bad_key, bad_type, bad_value (a kind that there is not). [any]
Result<SceneEdit> parse_scene_edit(std::string_view json);

}  // namespace asperity
