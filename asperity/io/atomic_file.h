#pragma once
// Output is written aside and renamed: a reader never sees half a file, and a failed run leaves the old one.

#include <filesystem>
#include <string_view>

#include "asperity/core/result.h"

namespace asperity {

/// Writes `bytes` to a new file beside `path`, flushes it to the disk and renames it to `path`, replacing what was
/// there. A symbolic link is followed. Something that is no regular file (/dev/stdout, a pipe) is written to directly.
/// Errors: file_unwritable (no such folder, no permission, disk full, a folder of that name); `path` is then untouched
/// and nothing is left beside it. [build] [main]
Status write_file_atomically(const std::filesystem::path& path, std::string_view bytes);

}  // namespace asperity
