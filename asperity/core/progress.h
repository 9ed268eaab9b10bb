#pragma once

#include <functional>
#include <string_view>

namespace asperity {

/// Called by anything that may take longer than a second: what is being done, and how far (0 to 1). [build]
/// An empty function is allowed and means nobody looks.
using Progress = std::function<void(std::string_view what, double fraction)>;

}  // namespace asperity
