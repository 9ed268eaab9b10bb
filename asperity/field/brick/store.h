#pragma once
// A volume larger than memory: bricks of a file, a resident set of them, and a thread that fetches ahead.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "asperity/core/progress.h"
#include "asperity/field/brick/file.h"
#include "asperity/field/volume/cell_polynomial.h"
#include "asperity/field/volume/min_max_octree.h"
#include "asperity/field/volume/scalar_grid.h"

namespace asperity {

/// How much of a bricked volume is kept in memory.
struct BrickSettings {
  std::size_t resident_bytes = std::size_t{512} << 20;  ///< of bricks, all levels together
  bool stream = true;  ///< a background thread fetches around the probe; false: only `fetch` does
};

/// What a store has read so far, and holds.
struct BrickTraffic {
  std::uint64_t bricks_read = 0;
  std::uint64_t bytes_read = 0;
  std::size_t bricks_here = 0;
  std::size_t slots = 0;      ///< bricks that the resident memory holds
  double slowest_read = 0.0;  ///< s, of one brick: what the disk kept the background thread waiting at most
};

/// Opens and serves a bricked file (".aspvol"). A level's samples are every second one of the level below, smoothed;
/// the coarsest level is always resident. The servo thread never waits: it asks what is here, and takes that.
class BrickStore {
 public:
  /// Errors: file_missing, file_empty, file_truncated, file_malformed, file_unsupported (with the byte), too_large (not
  /// even the coarsest level fits into the resident set). [build]
  static Result<std::unique_ptr<BrickStore>> open(const std::filesystem::path& file, const BrickSettings& settings);
  ~BrickStore();
  BrickStore(const BrickStore&) = delete;
  BrickStore& operator=(const BrickStore&) = delete;

  [[nodiscard]] int levels() const noexcept { return static_cast<int>(header_->levels.size()); }
  [[nodiscard]] const GridAxes& axes(int level) const noexcept {
    return header_->levels[static_cast<std::size_t>(level)].axes;
  }
  /// Its leaves are the bricks; ranges hold one ring of samples around each. [servo]
  [[nodiscard]] const MinMaxOctree& octree(int level) const noexcept;
  [[nodiscard]] SampleType type() const noexcept { return header_->type; }
  [[nodiscard]] double lowest() const noexcept { return header_->lowest; }
  [[nodiscard]] double highest() const noexcept { return header_->highest; }
  [[nodiscard]] const std::string& name() const noexcept { return header_->name; }
  [[nodiscard]] std::uint64_t file_bytes() const noexcept { return header_->file_bytes; }
  /// Memory taken, all of it at opening. [any]
  [[nodiscard]] std::size_t resident_bytes() const noexcept;
  [[nodiscard]] BrickTraffic traffic() const noexcept;  ///< [any]
  /// Whether bricks could be read since opening; the first error, where the file was cut or damaged meanwhile. Such
  /// bricks stay missing. [main]
  [[nodiscard]] Status status() const;

  /// A reader must enter before it asks for levels or samples and leave afterwards, on the same thread: what it was
  /// told is here stays here until then. Neither waits for anything. [servo]
  void enter() const noexcept;
  void leave() const noexcept;
  /// Finest level, `finest` or coarser, at which every sample that cells meeting `box` (m) need is here, and stays
  /// until the reader leaves. [servo]
  [[nodiscard]] int ready_level(const Box& box, int finest) const noexcept;
  /// Samples i-1 … i+2 along each axis around a cell, x fastest; places beyond the grid's end repeat the end. False
  /// (and nothing written) where the cell's brick is not here. [servo]
  bool samples(int level, const CellIndex& cell, double out[64]) const noexcept;
  /// Tells the background thread where the probe is (m) and how it moves (m/s). One that is not finite is ignored.
  /// [servo]
  void look_ahead(const Vec3& position, const Vec3& velocity) const noexcept;
  /// Reads whatever cells meeting `box` need at `level`, now; it stays until another fetch needs the room, or, with a
  /// background thread, until that does. Not between enter and leave. Errors: file_truncated,
  /// file_malformed (a damaged brick), too_large (a box of more bricks than the resident set takes). [main]
  Status fetch(const Box& box, int level) const;

 private:
  BrickStore();
  struct State;
  std::unique_ptr<State> state_;
  const BrickFileHeader* header_ = nullptr;  ///< of state_
};

}  // namespace asperity
