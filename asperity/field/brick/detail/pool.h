#pragma once
// Slots of memory for the bricks of a file, and how they are handed over between one thread that fills them and others
// that read them without ever waiting. Used by BrickStore.

#include <atomic>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "asperity/field/brick/file.h"

namespace asperity {

/// Bricks in memory. One filler at a time (its callers share a mutex), any number of readers.
///
/// A reader counts itself in and out on one of a few lanes. A brick that is to go is doomed first: readers that come
/// in from then on do not rely on it, those that are in still find it. When every lane has been empty once it is
/// unlinked, so that nobody finds it; when every lane has been empty once more its slot is free. Neither step makes
/// anybody wait.
class BrickPool {
 public:
  /// As BrickStore::open. [build]
  static Result<std::unique_ptr<BrickPool>> open(const std::filesystem::path& file, std::size_t resident_bytes);
  ~BrickPool();
  BrickPool(const BrickPool&) = delete;
  BrickPool& operator=(const BrickPool&) = delete;

  [[nodiscard]] const BrickFileHeader& header() const noexcept { return header_; }
  [[nodiscard]] const std::string& file() const noexcept { return file_; }

  // Readers.
  void enter() const noexcept;  ///< [servo]
  void leave() const noexcept;  ///< on the thread that entered [servo]
  /// Whether a brick is here until the reader leaves. [servo]
  [[nodiscard]] bool ready(std::uint32_t brick) const noexcept {
    return words_[brick].load(std::memory_order_seq_cst) < doomed;
  }
  /// A brick's samples; nullptr where it is not here. Good until the reader leaves. [servo]
  [[nodiscard]] const std::byte* find(std::uint32_t brick) const noexcept {
    const std::uint32_t word = words_[brick].load(std::memory_order_seq_cst);
    return word == absent ? nullptr : slots_.get() + slot_bytes_ * (word % doomed);
  }

  // The filler.
  /// Reads a brick that is not here into a free slot. Errors: file_truncated, file_malformed (a damaged brick);
  /// too_large where no slot is free. [main]
  Status load(std::uint32_t brick);
  /// Asks the system to begin reading a brick that is going to be loaded; does not wait. [main]
  void announce(std::uint32_t brick) const noexcept;
  /// Begins to take a brick away; one that is pinned or not here stays as it is. [main]
  void doom(std::uint32_t brick);
  /// Takes doomed bricks on as far as the readers allow now. [main]
  void reclaim();
  [[nodiscard]] bool here(std::uint32_t brick) const noexcept { return find(brick) != nullptr; }
  [[nodiscard]] std::size_t free_slots() const noexcept { return free_.size(); }
  [[nodiscard]] std::size_t retiring() const noexcept { return retiring_.size(); }
  /// Bricks that may be taken away, in no order. [main]
  void list_evictable(std::vector<std::uint32_t>& out) const;
  [[nodiscard]] std::size_t slots() const noexcept { return brick_of_.size(); }
  /// Bricks from this number on are always here. [main]
  [[nodiscard]] std::uint32_t first_pinned() const noexcept { return first_pinned_; }

  [[nodiscard]] std::size_t memory_bytes() const noexcept;
  [[nodiscard]] std::uint64_t bricks_read() const noexcept { return bricks_read_.load(std::memory_order_relaxed); }
  /// s
  [[nodiscard]] double slowest_read() const noexcept { return slowest_read_.load(std::memory_order_relaxed); }
  [[nodiscard]] std::size_t bricks_here() const noexcept { return bricks_here_.load(std::memory_order_relaxed); }

 private:
  static constexpr std::uint32_t absent = no_index;
  static constexpr std::uint32_t doomed = std::uint32_t{1} << 31U;
  static constexpr std::uint32_t lanes = 16;
  static constexpr std::uint32_t all_lanes = (1U << lanes) - 1U;

  struct alignas(64) Lane {
    std::atomic<std::uint32_t> readers{0};
  };
  struct Retiring {
    std::uint32_t brick = no_index;
    std::uint32_t slot = no_index;
    std::uint32_t pending = all_lanes;  ///< lanes not seen empty since the last step
    bool unlinked = false;
  };

  BrickPool() = default;
  Status allocate(std::size_t resident_bytes);
  Status pin();

  BrickFileHeader header_;
  std::string file_;
  int descriptor_ = -1;
  std::size_t slot_bytes_ = 0;
  std::unique_ptr<std::byte[]> slots_;
  std::unique_ptr<std::atomic<std::uint32_t>[]> words_;  ///< of each brick: its slot, absent, or doomed | slot
  mutable Lane lane_[lanes];
  std::vector<std::uint32_t> brick_of_;  ///< of each slot; no_index: none
  std::vector<std::uint32_t> free_;
  std::vector<Retiring> retiring_;
  std::uint32_t first_pinned_ = 0;
  std::atomic<std::uint64_t> bricks_read_{0};
  std::atomic<std::size_t> bricks_here_{0};
  std::atomic<double> slowest_read_{0.0};
};

}  // namespace asperity
