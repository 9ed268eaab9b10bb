#include "asperity/surface/relief/blocks.h"

#include <algorithm>

namespace asperity {

ReliefBlocks::ReliefBlocks()
    : blocks_(std::make_unique<Block[]>(most_blocks)),
      samples_(std::make_unique<BlockSamples[]>(most_samples)),
      sampled_(std::make_unique<std::uint32_t[]>(most_samples)) {
  std::fill_n(sampled_.get(), most_samples, no_index);
}

void ReliefBlocks::keep_only(std::uint64_t relief, const CoatMoment& moment) noexcept {
  if (relief_ == relief && moment_ == moment) return;
  relief_ = relief;
  moment_ = moment;
  ++generation_;
  for (Answer& answer : answers_) answer.asked.reach = 0.0;
}

const ReliefBlocks::Answer* ReliefBlocks::answer(const Vec3& p, const FeetAsked& asked) const noexcept {
  for (const Answer& answer : answers_) {
    if (answer.asked == asked && answer.p == p) return &answer;
  }
  return nullptr;
}

void ReliefBlocks::remember(const Answer& answer) noexcept {
  answers_[next_answer_] = answer;
  next_answer_ = (next_answer_ + 1) % answers_.size();
}

ReliefBlocks::Block& ReliefBlocks::block(const ReliefBlockName& name, bool& known) noexcept {
  std::uint32_t mixed = name.face * 0x9e3779b1U ^ (name.i + 64U * name.j) * 0x85ebca6bU ^ name.level * 0xc2b2ae35U;
  mixed ^= mixed >> 15U;
  Block& block = blocks_[mixed % most_blocks];
  known = block.generation == generation_ && block.name == name;
  if (!known) {
    block.name = name;
    block.generation = generation_;
    block.samples = no_index;
  }
  return block;
}

BlockSamples& ReliefBlocks::samples(Block& block, bool& known) noexcept {
  const auto index = static_cast<std::uint32_t>(&block - blocks_.get());
  known = block.samples != no_index && sampled_[block.samples] == index;
  if (!known) {
    block.samples = next_;
    sampled_[next_] = index;
    next_ = (next_ + 1) % most_samples;
  }
  return samples_[block.samples];
}

}  // namespace asperity
