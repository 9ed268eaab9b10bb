#pragma once
// Where the relief is over parts of a face's lattice, and how far from a point. Private to surface.

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "asperity/core/lanes.h"
#include "asperity/core/math.h"
#include "asperity/surface/shell.h"

namespace asperity {

/// A disk that a part of the relief lies in. Places are off the face's first corner.
struct ReliefDisk {
  float middle[3] = {};
  float normal[3] = {};
  float radius = 0.0F;  ///< m
  float half = 0.0F;    ///< of its thickness (m)

  /// False where no place of it is within reach (m) of p. [servo]
  [[nodiscard]] bool may_be_within(double reach, const Vec3& p) const noexcept {
    // Of a normal in single precision.
    constexpr double rounding = 1e-6;
    const Vec3 off = p - Vec3(middle[0], middle[1], middle[2]);
    const double slack = rounding * off.cwiseAbs().sum();
    const double along = off.x() * static_cast<double>(normal[0]) + off.y() * static_cast<double>(normal[1]) +
                         off.z() * static_cast<double>(normal[2]);
    const double beyond = std::max(0.0, std::abs(along) - static_cast<double>(half) - slack);
    if (beyond > reach) return false;
    const double beside = off.squaredNorm() - along * along;
    const double wide = static_cast<double>(radius) + slack;
    if (beside <= wide * wide) return true;
    const double most = wide + std::sqrt(reach * reach - beyond * beyond);
    return beside <= most * most;
  }
};

/// Disks around the four quarters of a part, side by side.
struct alignas(64) ReliefQuarters {
  static constexpr int count = 4;

  float middle[3][count] = {};
  float normal[3][count] = {};
  float radius[count] = {};
  float half[count] = {};

  void put(int quarter, const ReliefDisk& disk) noexcept {
    for (int a = 0; a < 3; ++a) {
      middle[a][quarter] = disk.middle[a];
      normal[a][quarter] = disk.normal[a];
    }
    radius[quarter] = disk.radius;
    half[quarter] = disk.half;
  }
  [[nodiscard]] ReliefDisk disk(int quarter) const noexcept {
    return {{middle[0][quarter], middle[1][quarter], middle[2][quarter]},
            {normal[0][quarter], normal[1][quarter], normal[2][quarter]},
            radius[quarter],
            half[quarter]};
  }
};

/// How far p is from each at least (m). [servo]
void least_distances(const ReliefQuarters& quarters, const Vec3& p, float (&away)[ReliefQuarters::count]) noexcept;

/// The surface at the samples of a part at level 0, and at those right beside it.
struct BlockSamples {
  static constexpr int across = 8;
  static constexpr int stride = across + 2;
  static constexpr int count = 104;  ///< stride squared, in whole registers
  /// Squared distances from this on are of samples beyond the face: there is no surface.
  static constexpr float nowhere = 1e30F;
  static constexpr float far_off = 1e18F;  ///< m: a coordinate of those

  float x[count];  ///< m, off the disk's middle
  float y[count];
  float z[count];
  ReliefDisk around;  ///< them alone
  float apart;        ///< how far they are from those beside them at most (m)
  /// Of each row those that are so far from the next, along u and along v, that a wall may stand between: bit j of the
  /// j-th, of those right beside the part as well.
  std::uint32_t steep[2][stride];
};

/// Samples (m, off `middle`) at four places of a face's shell, one after the other from `at` on. [servo]
void put_samples(const ShellPrism& prism, const Lanes& u, const Lanes& v, const Lanes& heights, const Vec3& middle,
                 int count, int at, BlockSamples& samples) noexcept;

/// Sets what lies around the samples: a disk as narrow as what is looked for among them lets it be, along that of the
/// part. [servo]
void enclose(const ReliefDisk& part, BlockSamples& samples) noexcept;

/// How far samples are from a point.
struct SampleSquares {
  float of[BlockSamples::count];
  std::uint32_t least[BlockSamples::across];  ///< of a row, those that none around is nearer than: bit j of the j-th
  float nearest;                              ///< the least of all that are the part's own
};

/// [servo]
void squares_from(const BlockSamples& samples, const Vec3f& p, SampleSquares& out) noexcept;

/// Of each row those of a part's own samples that are no farther than `most` (squared) or may be beside a crest that
/// is: bit j of the j-th. False where there is none. [servo]
bool beside_crests(const SampleSquares& squares, float most, std::uint32_t (&rows)[BlockSamples::across]) noexcept;

}  // namespace asperity
