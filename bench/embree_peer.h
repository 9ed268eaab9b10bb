#pragma once

#include <embree3/rtcore.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

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

/// Embree's rays over triangles, in single precision. Built with one thread and Embree's default quality.
class EmbreeRays {
 public:
  using Vertex = std::array<float, 3>;  ///< m

  /// The triangles are copied. [build]
  EmbreeRays(std::span<const Vertex> vertices, std::span<const std::array<std::uint32_t, 3>> triangles);
  ~EmbreeRays();
  EmbreeRays(const EmbreeRays&) = delete;
  EmbreeRays& operator=(const EmbreeRays&) = delete;

  /// Where a segment first meets a triangle, from either side, as a fraction of it; infinity: nowhere. [any]
  [[nodiscard]] double first_hit(const Segment& segment) const;
  [[nodiscard]] double build_seconds() const { return build_seconds_; }
  /// Of vertices, indices and tree, as the device's memory monitor counts. [any]
  [[nodiscard]] std::size_t memory_bytes() const { return static_cast<std::size_t>(bytes_); }

 private:
  std::int64_t bytes_ = 0;
  RTCDevice device_;
  RTCScene scene_;
  double build_seconds_ = 0.0;
};

}  // namespace asperity::bench
