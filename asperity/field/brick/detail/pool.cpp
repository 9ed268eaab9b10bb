#include "asperity/field/brick/detail/pool.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <system_error>

namespace asperity {
namespace {

// The coarser levels that together take no more than this share of the slots are pinned.
constexpr std::size_t pinned_share = 8;

/// A number for each thread, so that threads meet on one lane only where there are more of them than lanes.
std::uint32_t thread_number() noexcept {
  static std::atomic<std::uint32_t> next{0};
  thread_local std::uint32_t number = no_index;
  if (number == no_index) number = next.fetch_add(1, std::memory_order_relaxed);
  return number;
}

}  // namespace

Result<std::unique_ptr<BrickPool>> BrickPool::open(const std::filesystem::path& file, std::size_t resident_bytes) {
  std::unique_ptr<BrickPool> pool(new BrickPool());
  pool->file_ = file.string();
  // Without O_NONBLOCK a pipe would keep us waiting for its writer.
  pool->descriptor_ = ::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (pool->descriptor_ < 0) {
    return Error{ErrorCode::file_missing, "cannot be read: " + std::generic_category().message(errno), file.string(),
                 "", "a bricked volume (.aspvol)"};
  }
  ASPERITY_TRY(pool->header_, read_brick_header(pool->descriptor_, file.string()));
  ::posix_fadvise(pool->descriptor_, 0, 0, POSIX_FADV_RANDOM);
  ASPERITY_CHECK(pool->allocate(resident_bytes));
  ASPERITY_CHECK(pool->pin());
  return pool;
}

BrickPool::~BrickPool() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

Status BrickPool::allocate(std::size_t resident_bytes) {
  constexpr std::size_t line = 64;
  slot_bytes_ = (brick_bytes(header_.type) + line - 1) / line * line;
  const std::size_t slots = std::min({resident_bytes / slot_bytes_, header_.bricks.size(), std::size_t{doomed - 1}});
  if (slots < header_.levels.back().count()) {
    return refused(ErrorCode::too_large, "does not fit its coarsest level into the resident memory", "resident",
                   fmt::format("{} bytes or more", slot_bytes_))
        .in_file(file_);
  }
  // Not touched before a brick comes in.
  slots_ = std::make_unique_for_overwrite<std::byte[]>(slots * slot_bytes_);
  words_ = std::make_unique<std::atomic<std::uint32_t>[]>(header_.bricks.size());
  for (std::size_t n = 0; n < header_.bricks.size(); ++n) words_[n].store(absent, std::memory_order_relaxed);
  brick_of_.assign(slots, no_index);
  for (std::size_t n = slots; n-- > 0;) free_.push_back(static_cast<std::uint32_t>(n));
  retiring_.reserve(slots);
  return success();
}

Status BrickPool::pin() {
  // The coarsest level is always here: it is a single brick.
  std::size_t pinned = 0;
  for (auto level = header_.levels.rbegin(); level != header_.levels.rend(); ++level) {
    pinned += level->count();
    if (pinned > std::max<std::size_t>(slots() / pinned_share, 1)) break;
    first_pinned_ = level->first;
  }
  for (std::uint32_t brick = first_pinned_; brick < header_.bricks.size(); ++brick) ASPERITY_CHECK(load(brick));
  return success();
}

void BrickPool::enter() const noexcept {
  // Sequentially consistent with the look-up of bricks: a filler that finds this lane empty afterwards has doomed what
  // it doomed before this reader looks.
  lane_[thread_number() % lanes].readers.fetch_add(1, std::memory_order_seq_cst);
}

void BrickPool::leave() const noexcept {
  lane_[thread_number() % lanes].readers.fetch_sub(1, std::memory_order_release);
}

Status BrickPool::load(std::uint32_t brick) {
  if (free_.empty()) return Error{ErrorCode::too_large, "has no room for another brick", file_, "", "more memory"};
  const std::uint32_t slot = free_.back();
  std::byte* const begin = slots_.get() + slot_bytes_ * slot;
  const BrickRecord& record = header_.bricks[brick];
  const std::size_t bytes = brick_bytes(header_.type);
  const auto started = std::chrono::steady_clock::now();
  std::size_t got = 0;
  while (got < bytes) {
    const ssize_t part = ::pread(descriptor_, begin + got, bytes - got, static_cast<off_t>(record.offset + got));
    if (part < 0 && errno == EINTR) continue;
    if (part <= 0) {
      return Error{ErrorCode::file_truncated,
                   part < 0 ? "cannot be read: " + std::generic_category().message(errno)
                            : fmt::format("ends within brick {}", brick),
                   file_, fmt::format("byte {}", record.offset + got), "the file as it was opened"};
    }
    got += static_cast<std::size_t>(part);
  }
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  slowest_read_.store(std::max(slowest_read(), seconds), std::memory_order_relaxed);
  if (brick_checksum(begin, bytes) != record.checksum) {
    return Error{ErrorCode::file_malformed, fmt::format("has a damaged brick {}: its checksum differs", brick), file_,
                 fmt::format("byte {}", record.offset), "the file as it was written"};
  }
  free_.pop_back();
  brick_of_[slot] = brick;
  words_[brick].store(slot, std::memory_order_seq_cst);
  bricks_read_.fetch_add(1, std::memory_order_relaxed);
  bricks_here_.fetch_add(1, std::memory_order_relaxed);
  return success();
}

void BrickPool::announce(std::uint32_t brick) const noexcept {
  ::posix_fadvise(descriptor_, static_cast<off_t>(header_.bricks[brick].offset),
                  static_cast<off_t>(brick_bytes(header_.type)), POSIX_FADV_WILLNEED);
}

void BrickPool::doom(std::uint32_t brick) {
  const std::uint32_t word = words_[brick].load(std::memory_order_relaxed);
  if (brick >= first_pinned_ || word >= doomed) return;
  words_[brick].store(word | doomed, std::memory_order_seq_cst);
  retiring_.push_back({brick, word, all_lanes, false});
}

void BrickPool::reclaim() {
  if (retiring_.empty()) return;
  std::uint32_t empty = 0;
  for (std::uint32_t n = 0; n < lanes; ++n) {
    if (lane_[n].readers.load(std::memory_order_seq_cst) == 0) empty |= 1U << n;
  }
  std::size_t kept = 0;
  for (Retiring entry : retiring_) {
    entry.pending &= ~empty;
    if (entry.pending == 0 && entry.unlinked) {
      free_.push_back(entry.slot);
      bricks_here_.fetch_sub(1, std::memory_order_relaxed);
      continue;
    }
    if (entry.pending == 0) {
      words_[entry.brick].store(absent, std::memory_order_seq_cst);
      brick_of_[entry.slot] = no_index;
      entry.unlinked = true;
      entry.pending = all_lanes;
    }
    retiring_[kept++] = entry;
  }
  retiring_.resize(kept);
}

void BrickPool::list_evictable(std::vector<std::uint32_t>& out) const {
  out.clear();
  for (const std::uint32_t brick : brick_of_) {
    if (brick < first_pinned_ && words_[brick].load(std::memory_order_relaxed) < doomed) out.push_back(brick);
  }
}

std::size_t BrickPool::memory_bytes() const noexcept {
  return slots() * (slot_bytes_ + 3 * sizeof(std::uint32_t) + sizeof(Retiring)) +
         header_.bricks.size() * (sizeof(std::atomic<std::uint32_t>) + sizeof(BrickRecord));
}

}  // namespace asperity
