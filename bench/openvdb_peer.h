#pragma once

#include <memory>

#include "asperity/field/volume/sparse_grid.h"

namespace asperity::bench {

/// OpenVDB's sampler over the same potential: the peer in the same run. Its box sampler answers the trilinear value,
/// without a gradient; its accessor remembers the last leaf, as our hint does the last brick.
class OpenvdbPeer {
 public:
  explicit OpenvdbPeer(const SparseSource& source);
  ~OpenvdbPeer();
  OpenvdbPeer(const OpenvdbPeer&) = delete;
  OpenvdbPeer& operator=(const OpenvdbPeer&) = delete;

  /// Trilinear value (m). One thread at a time.
  [[nodiscard]] double value(const Vec3& p) const;

 private:
  struct Grid;
  std::unique_ptr<Grid> grid_;
};

}  // namespace asperity::bench
