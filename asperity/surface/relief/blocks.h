#pragma once
// What balls have looked at of a relief, kept from tick to tick: it hangs on the face and on the coat's moment, not on
// where the ball is.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "asperity/core/math.h"
#include "asperity/core/work.h"
#include "asperity/geometry/contact.h"
#include "asperity/surface/relief/view.h"

namespace asperity {

/// A part of a face's lattice: its samples [i side, (i + 1) side) along u and alike along v, where side is
/// BlockSamples::across << level.
struct ReliefBlockName {
  std::uint32_t face = no_index;
  std::uint16_t i = 0;
  std::uint16_t j = 0;
  std::uint32_t level = 0;
  friend bool operator==(const ReliefBlockName&, const ReliefBlockName&) = default;
};

/// A disk that the relief over such a part lies in.
struct ReliefDisk {
  double middle[3] = {};
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
  /// How far p is from it at least, but for rounding (m). [servo]
  [[nodiscard]] double away(const Vec3& p) const noexcept {
    const Vec3 off = p - Vec3(middle[0], middle[1], middle[2]);
    const double along = off.x() * static_cast<double>(normal[0]) + off.y() * static_cast<double>(normal[1]) +
                         off.z() * static_cast<double>(normal[2]);
    const double beyond = std::max(0.0, std::abs(along) - static_cast<double>(half));
    const double beside =
        std::max(0.0, std::sqrt(std::max(0.0, off.squaredNorm() - along * along)) - static_cast<double>(radius));
    constexpr double rounding = 1e-5;
    return (1.0 - rounding) * std::sqrt(beyond * beyond + beside * beside);
  }
};

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
};

/// Room for the parts of one relief that were looked at last. Two may ask in turn: each forgets what the other left.
class ReliefBlocks {
 public:
  struct Block {
    ReliefDisk disk;
    ReliefBlockName name;
    std::uint32_t generation = 0;
    std::uint32_t samples = no_index;
    ReliefDisk around_samples;  ///< once they are known
    float apart = 0.0F;         ///< how far they are from those beside them at most (m); 0: they were never known
  };

  /// About 2 MB. A copy has room, and forgets what was looked at. [build]
  ReliefBlocks();
  ReliefBlocks(const ReliefBlocks&) : ReliefBlocks() {}
  ReliefBlocks& operator=(const ReliefBlocks&) = delete;

  /// Forgets what is of another relief or moment. [servo]
  void keep_only(std::uint64_t relief, const CoatMoment& moment) noexcept;
  /// The part's own, or the one that makes room for it, `known` false. [servo]
  Block& block(const ReliefBlockName& name, bool& known) noexcept;
  /// Room for a face's frame: whether it is there already `ReliefSurface::holds` tells. [servo]
  ReliefFrame& frame(std::uint32_t face) noexcept { return frames_[face % frames_.size()]; }
  /// What `ReliefView::feet` has answered.
  struct Answer {
    Vec3 p = Vec3::Zero();
    FeetAsked asked;  ///< reach 0: nothing was
    ContactSet feet;
    WorkCount count;  ///< what it took
  };
  /// One of the last two, of exactly these; none: they were of others. [servo]
  [[nodiscard]] const Answer* answer(const Vec3& p, const FeetAsked& asked) const noexcept;
  /// In place of the older one. [servo]
  void remember(const Answer& answer) noexcept;
  /// Its samples, or those that make room for them, `known` false. [servo]
  BlockSamples& samples(Block& block, bool& known) noexcept;

 private:
  static constexpr std::uint32_t most_blocks = 8192;
  static constexpr std::uint32_t most_samples = 768;

  std::unique_ptr<Block[]> blocks_;
  std::unique_ptr<BlockSamples[]> samples_;
  std::unique_ptr<std::uint32_t[]> sampled_;  ///< block that the samples are of
  std::uint64_t relief_ = 0;
  CoatMoment moment_;
  std::uint32_t generation_ = 1;
  std::uint32_t next_ = 0;
  std::array<ReliefFrame, 32> frames_;
  std::array<Answer, 2> answers_;
  std::size_t next_answer_ = 0;
};

}  // namespace asperity
