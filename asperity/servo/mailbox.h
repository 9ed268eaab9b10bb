#pragma once
// How what is built on one thread comes to the servo thread, and goes back to be freed.

#include <atomic>
#include <cstdint>
#include <memory>
#include <utility>

namespace asperity {

/// What has passed through a mailbox.
struct MailboxCount {
  std::uint64_t put = 0;
  std::uint64_t taken = 0;
  std::uint64_t replaced = 0;  ///< put, and replaced by a newer one before the servo thread looked
  std::uint64_t freed = 0;     ///< given up again: replaced or taken and done with
};

/// Hands values (scenes) to a thread that must neither wait nor free memory. The latest wins. The servo thread takes a
/// value by one exchange and gives the one before back by two: bounded steps, no lock, no allocation. Whoever puts
/// frees what has come back; a value is destroyed on the threads of `put`, `collect` and the destructor alone.
///
/// Any number of threads may put and collect, one takes. A mailbox outlives its taker.
template <class T>
class Mailbox {
 public:
  Mailbox() = default;
  Mailbox(const Mailbox&) = delete;
  Mailbox& operator=(const Mailbox&) = delete;
  /// [build]
  ~Mailbox() {
    free_all(coming_.load(std::memory_order_acquire));
    free_all(back_.load(std::memory_order_acquire));
    delete current_;
  }

  /// In place of one that has not been taken yet; frees what has come back. [build]
  void put(std::shared_ptr<const T> value) {
    auto node = std::make_unique<Node>(Node{std::move(value)});
    put_.fetch_add(1, std::memory_order_relaxed);
    Node* replaced = coming_.exchange(node.release(), std::memory_order_acq_rel);
    if (replaced != nullptr) replaced_.fetch_add(1, std::memory_order_relaxed);
    free_all(replaced);
    collect();
  }

  /// The newest value, nullptr where none has come since the last call. It stays until the next one is taken. [servo]
  const T* take() noexcept {
    // Nothing is written where nothing has come: the line stays where the other threads have it.
    if (coming_.load(std::memory_order_relaxed) == nullptr) return nullptr;
    Node* node = coming_.exchange(nullptr, std::memory_order_acq_rel);
    if (node == nullptr) return nullptr;
    Node* const done = std::exchange(current_, node);
    taken_.fetch_add(1, std::memory_order_relaxed);
    if (done != nullptr) {
      // Nobody else puts anything here: between the two lines it can only have been emptied.
      done->next = back_.exchange(nullptr, std::memory_order_acq_rel);
      back_.store(done, std::memory_order_release);
    }
    return node->value.get();
  }

  /// Frees what has come back. [build]
  void collect() { free_all(back_.exchange(nullptr, std::memory_order_acq_rel)); }

  /// [any]
  [[nodiscard]] MailboxCount count() const noexcept {
    MailboxCount count;
    count.put = put_.load(std::memory_order_relaxed);
    count.taken = taken_.load(std::memory_order_relaxed);
    count.replaced = replaced_.load(std::memory_order_relaxed);
    count.freed = freed_.load(std::memory_order_relaxed);
    return count;
  }

 private:
  struct Node {
    std::shared_ptr<const T> value;
    Node* next = nullptr;
  };

  void free_all(Node* first) {
    while (first != nullptr) {
      Node* const next = first->next;
      delete first;
      first = next;
      freed_.fetch_add(1, std::memory_order_relaxed);
    }
  }

  std::atomic<Node*> coming_ = nullptr;
  std::atomic<Node*> back_ = nullptr;
  Node* current_ = nullptr;  ///< the taker's
  std::atomic<std::uint64_t> put_ = 0;
  std::atomic<std::uint64_t> taken_ = 0;
  std::atomic<std::uint64_t> replaced_ = 0;
  std::atomic<std::uint64_t> freed_ = 0;
};

}  // namespace asperity
