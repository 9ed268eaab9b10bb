#pragma once
// The bricked file, ".aspvol": a volume and its coarser levels, cut into bricks that are read one by one.
//
//   prefix        magic, version, sample type, sizes, checksum: see brick_file.cpp
//   name          of the array
//   levels        for each: node count along x, y, z, then the nodes (m), x then y then z
//   brick table   for each brick, level by level, x fastest: offset, least and greatest value, checksum
//   bricks        each at its offset, a multiple of brick_alignment
//
// All numbers are little-endian. A brick serves brick_cells cells along each axis and holds brick_nodes samples: one
// node before its first cell and one after its last cell's end, so that samples i-1 ... i+2 of each of its cells are
// inside; places beyond the grid's end repeat the end. Level l + 1 has every second node of level l
// (GridAxis::coarsened), with the samples between smoothed by (1, 2, 1) / 4 along each axis; on stretched axes the
// outer weights keep linear fields linear, and at the ends a sample keeps its value. The last level is one brick.

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "asperity/core/progress.h"
#include "asperity/field/volume/min_max_octree.h"
#include "asperity/field/volume/scalar_grid.h"

namespace asperity {

inline constexpr std::uint32_t brick_cells = 32;
inline constexpr std::uint32_t brick_nodes = brick_cells + 3;
inline constexpr std::size_t brick_samples = std::size_t{brick_nodes} * brick_nodes * brick_nodes;
inline constexpr std::uint64_t brick_alignment = 4096;
/// The next multiple of it (bytes). [any]
constexpr std::uint64_t brick_aligned(std::uint64_t bytes) {
  return (bytes + brick_alignment - 1) / brick_alignment * brick_alignment;
}

/// One level of a bricked volume.
struct BrickLevel {
  GridAxes axes;
  std::array<std::uint32_t, 3> bricks{};  ///< along each axis
  std::uint32_t first = 0;                ///< number of its first brick in the brick table
  [[nodiscard]] std::uint32_t count() const noexcept { return bricks[0] * bricks[1] * bricks[2]; }
};

/// Where a brick is, and what it holds.
struct BrickRecord {
  std::uint64_t offset = 0;  ///< bytes from the file's start
  ValueRange range;          ///< over all its samples, the ring around its cells included
  std::uint64_t checksum = 0;
};

/// All that a bricked file says before its bricks.
struct BrickFileHeader {
  SampleType type = SampleType::float32;
  std::string name;
  double lowest = 0.0;   ///< of the finest level
  double highest = 0.0;  ///< of the finest level
  std::vector<BrickLevel> levels;
  std::vector<BrickRecord> bricks;
  std::uint64_t file_bytes = 0;
};

/// Bytes of a brick's samples. [any]
std::size_t brick_bytes(SampleType type) noexcept;
/// What tells a brick or a header from a damaged one. [any]
std::uint64_t brick_checksum(const void* bytes, std::size_t count) noexcept;
/// The levels that a volume of these axes has, finest first. Errors: too_large (more than 2^31 bricks). [build]
Result<std::vector<BrickLevel>> brick_levels(const GridAxes& axes);

/// Reads and checks the header of a file open for reading. Every number is checked against the file's length before
/// anything of its size is allocated. Errors: file_empty, file_truncated, file_malformed, file_unsupported (another
/// version), each with the byte; `name` is the file in messages. [build]
Result<BrickFileHeader> read_brick_header(int descriptor, const std::string& name);
/// Puts the right checksum into the first bytes of a file: for tests that change a header. [build]
void reseal_brick_header(std::string& bytes);

/// Fills `out`, which has room for them, with the samples of node layers [first, last) along z, x fastest.
using SlabSource = std::function<Status(std::uint32_t first, std::uint32_t last, SampleArray& out)>;

/// What was written.
struct BrickFileSummary {
  std::size_t levels = 0;
  std::size_t bricks = 0;
  std::uint64_t file_bytes = 0;
  double lowest = 0.0;
  double highest = 0.0;
  std::uint64_t unknown = 0;  ///< samples that are not numbers
};

/// Memory (bytes) that writing a volume of these axes takes: about 45 layers of its finest level. [any]
std::size_t brick_writer_memory(const GridAxes& axes, SampleType type) noexcept;
/// Writes a bricked file from slabs that are asked for in order, once each. It is written aside and renamed: a failure
/// leaves nothing behind and an older file in place. Errors: what `source` answers; file_unwritable (no such folder,
/// disk full); bad_value (an infinite sample, no sample that is a number); too_large. [build]
Result<BrickFileSummary> write_brick_file(const std::filesystem::path& path, const GridAxes& axes, SampleType type,
                                          const std::string& name, const SlabSource& source,
                                          const Progress& progress = {});
/// The same of a grid in memory. [build]
Result<BrickFileSummary> write_brick_file(const std::filesystem::path& path, const ScalarGrid& grid,
                                          const Progress& progress = {});

/// Used by reader and writer of the file: its first bytes, as they lie there.
struct BrickFilePrefix {
  char magic[8];
  std::uint32_t version;
  std::uint32_t type;
  std::uint32_t cells;  ///< brick_cells
  std::uint32_t nodes;  ///< brick_nodes
  std::uint32_t levels;
  std::uint32_t name_bytes;
  std::uint64_t axis_nodes;    ///< of all axes of all levels
  std::uint64_t bricks;        ///< of all levels
  std::uint64_t header_bytes;  ///< prefix, name, levels and brick table
  std::uint64_t file_bytes;
  double lowest;
  double highest;
  std::uint64_t checksum;  ///< of the header with 0 here
};
static_assert(sizeof(BrickFilePrefix) == 88);
/// Bytes of the whole header but its padding. [build]
std::string encode_brick_header(const BrickFileHeader& header);

}  // namespace asperity
