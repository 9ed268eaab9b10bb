#pragma once
// What a probe carries from tick to tick as bytes that another process can go on from.

#include <cstddef>
#include <span>
#include <vector>

#include "asperity/core/result.h"
#include "asperity/render/scene.h"
#include "asperity/render/state.h"

namespace asperity {

/// An image of all of `state`, the same on every machine: little-endian, laws by their names, surfaces by the instance
/// of `scene` that they are of. `scene`: what the state touches, or is to touch next. [any]
std::vector<std::byte> save_state(const ProxyState& state, const Scene& scene);

/// The state that such an image is of, for `scene`: the same one, or one built from the same file. Every tick from
/// there answers what it would have answered without the detour, to the last bit. Errors, with the byte as place:
/// file_truncated, file_malformed (no such image, damaged, a value that no state has), file_unsupported (another
/// version), mismatch (a law or an instance that is not there: of another scene). [build]
Result<ProxyState> restore_state(std::span<const std::byte> image, const Scene& scene);

}  // namespace asperity
