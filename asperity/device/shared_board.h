#pragma once
// Memory that a loop and a device share, each in a process of its own.

#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <type_traits>
#include <utility>
#include <vector>

#include "asperity/core/result.h"
#include "asperity/device/port.h"

namespace asperity {

/// A value that one process writes and others read, neither ever waiting; torn reads are seen and tried again. What a
/// process leaves half written when it is killed is never read.
template <class T>
class SharedValue {
  static_assert(std::is_trivially_copyable_v<T> && sizeof(T) % sizeof(std::uint64_t) == 0);
  static_assert(std::atomic<std::uint64_t>::is_always_lock_free);
  using Words = std::array<std::uint64_t, sizeof(T) / sizeof(std::uint64_t)>;

 public:
  /// One writer. [servo]
  void put(const T& value) noexcept {
    const std::uint64_t turn = turn_.load(std::memory_order_relaxed);
    turn_.store(turn + 1, std::memory_order_relaxed);
    const Words words = std::bit_cast<Words>(value);
    // Whoever sees one of these sees the odd turn as well.
    for (std::size_t i = 0; i < words.size(); ++i) words_[i].store(words[i], std::memory_order_release);
    turn_.store(turn + 2, std::memory_order_release);
  }
  /// False, and `into` as it was, where the writer was in the middle of it at each of a few tries. [servo]
  bool get(T& into) const noexcept {
    for (int tries = 0; tries < 16; ++tries) {
      const std::uint64_t turn = turn_.load(std::memory_order_acquire);
      if (turn % 2 != 0) continue;
      Words words;
      for (std::size_t i = 0; i < words.size(); ++i) words[i] = words_[i].load(std::memory_order_acquire);
      if (turn_.load(std::memory_order_relaxed) != turn) continue;
      into = std::bit_cast<T>(words);
      return true;
    }
    return false;
  }

 private:
  std::atomic<std::uint64_t> turn_ = 0;
  std::array<std::atomic<std::uint64_t>, sizeof(T) / sizeof(std::uint64_t)> words_{};
};

/// What a device has put out over one of its periods.
struct PutOut {
  std::int64_t time = 0;          ///< ns, of the system's steady clock
  std::uint64_t heard = 0;        ///< the loop's beat that it went by
  std::array<double, 3> force{};  ///< N, world
  std::uint64_t let_go = 0;       ///< 1: by itself, for it was silent or halted
};

/// The two sides of a port, in memory that goes on to be shared with a forked process.
class SharedBoard {
 public:
  /// Errors: too_large (the system gives no memory). [build]
  static Result<std::shared_ptr<SharedBoard>> create();
  ~SharedBoard();
  SharedBoard(const SharedBoard&) = delete;
  SharedBoard& operator=(const SharedBoard&) = delete;

  // --- the loop's side ---
  /// What the device has told last; nothing where it is in the middle of it.
  [[nodiscard]] std::optional<PortReading> read() const noexcept;
  /// What a loop asks for.
  struct Asked {
    std::uint64_t beat = 0;  ///< the loop's count of what it asked; 0: nothing yet
    Vec3 force = Vec3::Zero();
    std::uint64_t released = 0;  ///< PortReading::released, as the loop knew it when it sent this
  };
  void ask(const Asked& asked) noexcept;
  void halt() noexcept;
  void resume() noexcept;
  /// The device is to end.
  void close() noexcept;

  // --- the device's ---
  /// Nothing where the loop is in the middle of it.
  [[nodiscard]] std::optional<Asked> asked() const noexcept;
  [[nodiscard]] bool halted() const noexcept;
  [[nodiscard]] bool closed() const noexcept;
  void tell(const PortReading& reading) noexcept;
  void put_out(const PutOut& put) noexcept;

  /// The last ticks of the device, oldest first: up to `most_put_out`. For tests and for the record. [main]
  [[nodiscard]] std::vector<PutOut> last_put_out() const;
  static constexpr std::size_t most_put_out = 16384;

 private:
  struct Layout;
  explicit SharedBoard(Layout* layout) noexcept : layout_(layout) {}
  Layout* layout_;
};

/// The loop's end of a board. [servo]
class SharedPort {
 public:
  explicit SharedPort(std::shared_ptr<SharedBoard> board) noexcept : board_(std::move(board)) {}
  [[nodiscard]] PortReading read() noexcept {
    last_ = board_->read().value_or(last_);
    return last_;
  }
  void write(const Vec3& force) noexcept { board_->ask({++beat_, force, last_.released}); }
  void halt() noexcept { board_->halt(); }
  void resume() noexcept { board_->resume(); }

 private:
  std::shared_ptr<SharedBoard> board_;
  PortReading last_;
  std::uint64_t beat_ = 0;
};
static_assert(Port<SharedPort>);

}  // namespace asperity
