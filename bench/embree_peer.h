#pragma once

#include <embree3/rtcore.h>

#include "asperity/geometry/mesh.h"

namespace asperity::bench {

/// Embree's point query over the same mesh: the peer in the same run. Embree's own hierarchy is in single precision;
/// the distance to each triangle is decided in double precision, as ours is, so both answer the same. Built with one
/// thread and Embree's default quality.
class EmbreePeer {
 public:
  explicit EmbreePeer(const TriangleMesh& mesh);
  ~EmbreePeer();
  EmbreePeer(const EmbreePeer&) = delete;
  EmbreePeer& operator=(const EmbreePeer&) = delete;

  /// Distance to the nearest triangle within `bound`, which may be infinite; infinity when there is none (m).
  [[nodiscard]] double closest(const Vec3& p, double bound) const;
  [[nodiscard]] double build_seconds() const { return build_seconds_; }

 private:
  const TriangleMesh& mesh_;
  RTCDevice device_;
  RTCScene scene_;
  double build_seconds_ = 0.0;
};

}  // namespace asperity::bench
