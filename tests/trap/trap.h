#pragma once
// The trap, for whoever steps: what it has counted while it was armed in a thread.

namespace asperity::trap {

struct Counts {
  int allocations, locks, throws, files;
};
/// In this thread from here on.
void arm(bool on) noexcept;
/// Of all threads.
Counts counts() noexcept;
void forget() noexcept;

}  // namespace asperity::trap
