#pragma once
// The part of `asperity convert` that writes glTF.

#include <string>

#include "apps/asperity/command.h"

namespace asperity::program {

/// Reads a mesh file, with its materials where it is glTF, or a scene, whose first surface with a mesh is taken with
/// the coat it wears, and writes it as .glb or .gltf. Prints what came of it. [main]
Result<int> convert_to_gltf(const std::string& from, const std::string& gltf, const Console& console);

}  // namespace asperity::program
