#pragma once
// Script, style and plot library of the report pages, part of the program. Private to study.

#include "asperity/io/embedded_file.h"

namespace asperity {

/// report.js, report.css, dygraph.min.js, dygraph.min.css, friction.js, path.js, in this order
/// (asperity/study/CMakeLists.txt).
std::span<const EmbeddedFile> report_assets();

}  // namespace asperity
