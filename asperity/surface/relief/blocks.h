#pragma once
// What balls have looked at of a relief, kept from tick to tick: it hangs on the face and on the coat's moment, not on
// where the ball is.

#include <memory>

#include "asperity/surface/relief/view.h"

namespace asperity {

class KeptBlocks;

/// Room for the parts of one relief that were looked at last. Two may ask in turn: each forgets what the other left.
class ReliefBlocks {
 public:
  /// About 2 MB. A copy has room, and forgets what was looked at. [build]
  ReliefBlocks();
  ReliefBlocks(const ReliefBlocks&) : ReliefBlocks() {}
  ReliefBlocks& operator=(const ReliefBlocks&) = delete;
  ~ReliefBlocks();

  /// What is kept of this relief at this moment; of another one all is forgotten. [servo]
  [[nodiscard]] KeptBlocks& of(std::uint64_t relief, const CoatMoment& moment) noexcept;

 private:
  std::unique_ptr<KeptBlocks> kept_;
};

}  // namespace asperity
