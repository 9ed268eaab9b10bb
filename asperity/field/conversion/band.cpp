#include <algorithm>
#include <bitset>
#include <cmath>

#include "asperity/field/conversion/detail/signs.h"
#include "asperity/geometry/closest_point.h"

namespace asperity::conversion {
namespace {

/// A point that may be in the band though the voxeliser left it out.
struct Candidate {
  Node node;
  bool inside = false;
  double distance = 0.0;  ///< m; what was found
  std::uint32_t face = no_index;
};

class ExactBand {
 public:
  ExactBand(const TriangleIndex& index, const BandFrame& frame, std::vector<VoxelBlock>& blocks)
      : index_(index), frame_(frame), blocks_(blocks), map_(blocks), outside_(blocks.size()) {
    // As the voxeliser had it: distances change under the threads' hands.
    for_each_node(blocks, [&](const Node& node) {
      outside_[node.block][node.point] = blocks[node.block].distance[node.point] > 0.0F;
    });
  }

  /// Makes the points that have a face exact; answers the largest correction (m).
  double correct(const Progress& progress) {
    std::vector<double> corrections(blocks_.size(), 0.0);
    parallel_for(blocks_.size(), {.grain = shared_out.grain, .progress = &progress, .what = "exact distances"},
                 [&](std::size_t b) { corrections[b] = correct_block(blocks_[b]); });
    return corrections.empty() ? 0.0 : *std::max_element(corrections.begin(), corrections.end());
  }

  /// Carries the band on to points that the voxeliser left out: its distances can be a voxel too large. Every point of
  /// the band has one beside it that is nearer to the surface, so that none is missed.
  void complete() {
    std::vector<Candidate> candidates;
    tried_.assign(blocks_.size(), {});
    for_each_node(blocks_, [&](const Node& node) { propose_around(node, candidates); });
    while (!candidates.empty()) {
      parallel_for(candidates.size(), shared_out, [&](std::size_t i) { try_candidate(candidates[i]); });
      std::vector<Candidate> next;
      for (const Candidate& candidate : candidates) {
        if (candidate.face == no_index) continue;
        VoxelBlock& block = blocks_[candidate.node.block];
        block.face[candidate.node.point] = candidate.face;
        block.distance[candidate.node.point] =
            static_cast<float>(candidate.inside ? -candidate.distance : candidate.distance);
      }
      for (const Candidate& candidate : candidates) {
        if (candidate.face != no_index) propose_around(candidate.node, next);
      }
      candidates = std::move(next);
    }
  }

 private:
  /// Whether a point of the surface (m) has outside beside it: some corner of its cell.
  [[nodiscard]] bool outer(const Vec3& point) const {
    const Vec3 place = (point - frame_.origin) / frame_.voxel;
    for (int corner = 0; corner < 8; ++corner) {
      std::array<std::int32_t, 3> at{};
      int local[3];
      for (int a = 0; a < 3; ++a) {
        const int node = static_cast<int>(std::floor(place[a])) + (corner >> a & 1);
        at[static_cast<std::size_t>(a)] = node >> 3;
        local[a] = node & 7;
      }
      const std::uint32_t block = map_.find(at);
      if (block < outside_.size() && outside_[block][SparseBlock::index(local[0], local[1], local[2])]) return true;
    }
    return false;
  }

  double correct_block(VoxelBlock& block) const {
    double largest = 0.0;
    for (std::uint32_t n = 0; n < SparseBlock::points; ++n) {
      const double given = frame_.voxel * static_cast<double>(block.distance[n]);
      block.distance[n] = static_cast<float>(given);
      if (block.face[n] == no_index) continue;
      const Vec3 p = position_of(block, n, frame_.origin, frame_.voxel);
      const Foot foot = index_.closest(p, std::abs(given) + frame_.voxel);
      double distance = foot.distance;
      std::uint32_t face = foot.element;
      // Walls inside are swallowed by the flood: where shells overlap, the potential goes on falling past them. There
      // the nearest face of the mesh is not the nearest of the surface, and the voxeliser's, which knows only faces
      // that outside can be reached from, stands.
      const bool swallowed = frame_.by_flood && given < 0.0 && foot.found() &&
                             -given - distance > 0.75 * frame_.voxel && !outer(foot.point);
      if (!foot.found() || swallowed) {
        face = block.face[n];
        const std::array<Vec3, 3> c = index_.mesh().corners(face);
        distance = std::sqrt(closest_point_on_triangle(p, c[0], c[1], c[2]).squared_distance);
      } else {
        largest = std::max(largest, std::abs(std::abs(given) - distance));
      }
      block.face[n] = face;
      block.distance[n] = static_cast<float>(given < 0.0 ? -distance : distance);
    }
    return largest;
  }

  /// Adds the points around one of the band that have no face yet, each once.
  void propose_around(const Node& node, std::vector<Candidate>& candidates) {
    if (blocks_[node.block].face[node.point] == no_index) return;
    const double distance = static_cast<double>(blocks_[node.block].distance[node.point]);
    const bool inside = distance < 0.0;
    if (!(std::abs(distance) < (inside ? frame_.inward : frame_.outward))) return;
    for (std::uint32_t way = 0; way < 6; ++way) {
      Node next = map_.beside(node, way);
      if (next.block == no_index) {
        const double beyond = inside ? -frame_.inward : frame_.outward;
        next.block = map_.append(place_beside(blocks_[node.block].at, way), beyond, blocks_);
        tried_.emplace_back();
      }
      if (blocks_[next.block].face[next.point] != no_index || tried_[next.block][next.point]) continue;
      tried_[next.block][next.point] = true;
      candidates.push_back({next, inside});
    }
  }

  void try_candidate(Candidate& candidate) const {
    const Vec3 p = position_of(blocks_[candidate.node.block], candidate.node.point, frame_.origin, frame_.voxel);
    const Foot foot = index_.closest(p, candidate.inside ? frame_.inward : frame_.outward);
    if (!foot.found()) return;
    if (frame_.by_flood && candidate.inside && !outer(foot.point)) return;
    candidate.face = foot.element;
    candidate.distance = foot.distance;
  }

  const TriangleIndex& index_;
  const BandFrame& frame_;
  std::vector<VoxelBlock>& blocks_;
  BlockMap map_;
  std::vector<std::bitset<SparseBlock::points>> outside_;
  std::vector<std::bitset<SparseBlock::points>> tried_;
};

}  // namespace

BlockMap::BlockMap(const std::vector<VoxelBlock>& blocks) {
  index_.reserve(blocks.size());
  for (std::size_t b = 0; b < blocks.size(); ++b) index_.emplace(key_of(blocks[b].at), static_cast<std::uint32_t>(b));
  beside_.resize(blocks.size());
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    for (std::uint32_t way = 0; way < 6; ++way) beside_[b][way] = find(place_beside(blocks[b].at, way));
  }
}

std::uint32_t BlockMap::find(const std::array<std::int32_t, 3>& at) const {
  const auto found = index_.find(key_of(at));
  return found == index_.end() ? no_index : found->second;
}

std::uint32_t BlockMap::append(const std::array<std::int32_t, 3>& at, double distance,
                               std::vector<VoxelBlock>& blocks) {
  const auto block = static_cast<std::uint32_t>(blocks.size());
  VoxelBlock& added = blocks.emplace_back();
  added.at = at;
  added.distance.fill(static_cast<float>(distance));
  added.face.fill(no_index);
  index_.emplace(key_of(at), block);
  beside_.emplace_back();
  for (std::uint32_t way = 0; way < 6; ++way) {
    const std::uint32_t other = find(place_beside(at, way));
    beside_[block][way] = other;
    if (other != no_index) beside_[other][way ^ 1U] = block;
  }
  return block;
}

std::array<std::int32_t, 3> place_beside(std::array<std::int32_t, 3> at, std::uint32_t way) noexcept {
  at[way / 2] += way % 2 == 0 ? -1 : 1;
  return at;
}

Vec3 position_of(const VoxelBlock& block, std::uint32_t point, const Vec3& origin, double voxel) noexcept {
  const auto n = static_cast<int>(point);
  return origin + voxel * Vec3(block_side * block.at[0] + n % block_side,
                               block_side * block.at[1] + n / block_side % block_side,
                               block_side * block.at[2] + n / (block_side * block_side));
}

double make_exact(const TriangleIndex& index, const BandFrame& frame, std::vector<VoxelBlock>& blocks,
                  const Progress& progress) {
  ExactBand band(index, frame, blocks);
  const double correction = band.correct(progress);
  band.complete();
  return correction;
}

}  // namespace asperity::conversion
