#pragma once
// What balls look at of a relief: parts of its faces' lattices, and what is kept of them. Private to surface.

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "asperity/core/work.h"
#include "asperity/geometry/contact.h"
#include "asperity/surface/relief/detail/block_samples.h"
#include "asperity/surface/relief/detail/partners.h"
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

/// Values by the names of parts, the last ones of each set; what is of an earlier generation is not there.
template <class Value, std::uint32_t sets>
class KeptByName {
 public:
  KeptByName()
      : tags_(std::make_unique<Set[]>(sets)),
        next_(std::make_unique<std::uint8_t[]>(sets)),
        values_(std::make_unique<Value[]>(sets * ways)) {}

  /// Its own, or the one that makes room for it, `known` false. [servo]
  Value& of(const ReliefBlockName& name, std::uint32_t generation, bool& known) noexcept {
    std::uint32_t mixed = name.face * 0x9e3779b1U ^ (name.i + 1024U * name.j) * 0x85ebca6bU ^ name.level * 0xc2b2ae35U;
    mixed ^= mixed >> 15U;
    const std::uint32_t at = mixed % sets;
    Set& set = tags_[at];
    known = true;
    for (std::uint32_t way = 0; way < ways; ++way) {
      if (set.tag[way].name == name && set.tag[way].generation == generation) return values_[at * ways + way];
    }
    known = false;
    const std::uint32_t way = next_[at];
    next_[at] = static_cast<std::uint8_t>((way + 1) % ways);
    set.tag[way] = {name, generation};
    return values_[at * ways + way];
  }

 private:
  static constexpr std::uint32_t ways = 4;
  struct Tag {
    ReliefBlockName name;
    std::uint32_t generation = 0;
  };
  struct alignas(64) Set {
    Tag tag[ways];
  };
  std::unique_ptr<Set[]> tags_;
  std::unique_ptr<std::uint8_t[]> next_;  ///< of each set, which makes room
  std::unique_ptr<Value[]> values_;
};

/// See ReliefBlocks.
class KeptBlocks {
 public:
  /// Forgets what is of another relief or moment. [servo]
  void keep_only(std::uint64_t relief, const CoatMoment& moment) noexcept;
  /// Disks around the quarters of a part. [servo]
  ReliefQuarters& quarters(const ReliefBlockName& name, bool& known) noexcept {
    return quarters_.of(name, generation_, known);
  }
  /// The samples of a part at level 0. [servo]
  BlockSamples& samples(const ReliefBlockName& name, bool& known) noexcept {
    return samples_.of(name, generation_, known);
  }
  /// Room for a face's frame: whether it is there already `ReliefSurface::holds` tells. [servo]
  ReliefFrame& frame(std::uint32_t face) noexcept { return frames_[face % frames_.size()]; }
  /// The surface at a place, or the one that makes room for it, `known` false. [servo]
  ReliefPoint& spot(std::uint32_t face, double u, double v, bool& known) noexcept;
  /// [servo]
  ReliefPartners& partners() noexcept { return partners_; }
  /// What `ReliefView::feet` has answered.
  struct Answer {
    Vec3 p = Vec3::Zero();
    FeetAsked asked;  ///< reach 0: nothing was
    ContactSet feet;
    WorkCount count;  ///< what it took
  };
  /// One of the last, of exactly these; none: they were of others. [servo]
  [[nodiscard]] const Answer* answer(const Vec3& p, const FeetAsked& asked) const noexcept;
  /// In place of the oldest one. [servo]
  void remember(const Answer& answer) noexcept;

 private:
  KeptByName<ReliefQuarters, 1024> quarters_;
  KeptByName<BlockSamples, 256> samples_;
  std::uint64_t relief_ = 0;
  CoatMoment moment_;
  std::uint32_t generation_ = 1;
  std::array<ReliefFrame, 64> frames_;
  struct Spot {
    std::uint32_t face = no_index;
    double u = 0.0;
    double v = 0.0;
    ReliefPoint point;
  };
  std::array<Spot, 128> spots_;
  ReliefPartners partners_;
  std::array<Answer, 2> answers_;
  std::size_t next_answer_ = 0;
};

}  // namespace asperity
