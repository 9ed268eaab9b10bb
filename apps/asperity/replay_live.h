#pragma once
// asperity replay --live: a trace on the servo thread, at its own rate.

#include <string>

#include "apps/asperity/command.h"
#include "apps/asperity/timeline.h"

namespace asperity::program {

/// Every tick with its own probe and length, when it is due; told is how late the ticks began and whether their forces
/// are bit-equal. The exit code. Errors: of the servo thread (a rate that no loop runs at). [main]
Result<int> replay_live(const std::string& path, const Trace& trace, const Timeline& timeline, const Console& console);

}  // namespace asperity::program
