#include "asperity/surface/relief/blocks.h"

#include <algorithm>
#include <bit>

#include "asperity/surface/relief/detail/kept_blocks.h"

namespace asperity {

ReliefBlocks::ReliefBlocks() : kept_(std::make_unique<KeptBlocks>()) {}
ReliefBlocks::~ReliefBlocks() = default;

KeptBlocks& ReliefBlocks::of(std::uint64_t relief, const CoatMoment& moment) noexcept {
  kept_->keep_only(relief, moment);
  return *kept_;
}

void KeptBlocks::keep_only(std::uint64_t relief, const CoatMoment& moment) noexcept {
  if (relief_ == relief && moment_ == moment) return;
  relief_ = relief;
  moment_ = moment;
  ++generation_;
  for (Answer& answer : answers_) answer.asked.reach = 0.0;
  for (Spot& spot : spots_) spot.face = no_index;
  partners_ = {};
}

ReliefPoint& KeptBlocks::spot(std::uint32_t face, double u, double v, bool& known) noexcept {
  const std::uint64_t mixed =
      (std::bit_cast<std::uint64_t>(u) * 3 + std::bit_cast<std::uint64_t>(v) + face) * 0x9e3779b97f4a7c15U;
  Spot& spot = spots_[(mixed >> 32U) % spots_.size()];
  known = spot.face == face && spot.u == u && spot.v == v;
  spot.face = face;
  spot.u = u;
  spot.v = v;
  return spot.point;
}

const KeptBlocks::Answer* KeptBlocks::answer(const Vec3& p, const FeetAsked& asked) const noexcept {
  for (const Answer& answer : answers_) {
    if (answer.asked == asked && answer.p == p) return &answer;
  }
  return nullptr;
}

void KeptBlocks::remember(const Answer& answer) noexcept {
  answers_[next_answer_] = answer;
  next_answer_ = (next_answer_ + 1) % answers_.size();
}

}  // namespace asperity
