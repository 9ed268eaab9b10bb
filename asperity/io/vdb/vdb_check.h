#pragma once
// Private to asperity/io/vdb: what a .vdb file has to hold before OpenVDB is let at it. OpenVDB makes nodes for as many
// children as a file declares, and goes on past the file's end; this walk ties every count to the bytes that are there.

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "asperity/core/math.h"
#include "asperity/core/result.h"

namespace asperity::vdb_io {

/// A value of a file's or a grid's metadata, as its bytes.
struct MetaValue {
  std::string type;  ///< "string", "float", "int64", ...
  std::string bytes;
};

/// Text from a file as it may stand in a message: short, without what a terminal would take for a command. [any]
std::string shown(std::string_view text);

/// What the file says of a grid outside its tree.
struct GridOutline {
  std::string unique_name;  ///< as OpenVDB tells grids of one name apart
  std::string name;
  std::string tree;    ///< "Tree_float_5_4_3"
  bool half = false;   ///< stored in half precision
  std::string parent;  ///< grid whose tree this one shares; empty: none
  std::size_t at = 0;  ///< byte where it begins
  std::size_t buffers_at = 0;
  std::size_t end = 0;
  std::uint32_t compression = 0;
  std::map<std::string, MetaValue> metadata;
  std::string map;             ///< kind of transform
  Mat3 linear = Mat3::Zero();  ///< of the transform; zero: not a linear one
  Vec3 origin = Vec3::Zero();
  std::size_t tree_at = 0;  ///< byte where its topology begins
  [[nodiscard]] std::string text(const std::string& key) const;
  [[nodiscard]] double number(const std::string& key, double missing) const;
};

/// What a tree would take in memory.
struct TreeSize {
  std::uint64_t leaves = 0;
  std::uint64_t tiles = 0;    ///< active tiles, in blocks of 8 x 8 x 8
  std::uint64_t nodes_5 = 0;  ///< largest inner nodes
  std::uint64_t nodes_4 = 0;
};

/// Header, metadata and grids of a file. Errors: file_malformed (no .vdb file, inconsistent), file_truncated,
/// file_unsupported (format before 2013, written as a stream), too_large, each with the byte. [build]
Result<std::vector<GridOutline>> outline(std::string_view bytes);

/// Walks through all of a grid's tree, of values of `value_bytes` each. Errors as above, with the grid and the byte.
/// [build]
Result<TreeSize> check_tree(std::string_view bytes, const GridOutline& grid, std::size_t value_bytes, bool real);

}  // namespace asperity::vdb_io
