#pragma once
// A relief as samples on a triangular grid over every face, and what of it a ball comes near: for closing.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "asperity/core/parallel_for.h"
#include "asperity/surface/relief/detail/block_lanes.h"
#include "asperity/surface/relief/surface.h"

namespace asperity {

/// Blocks a side of a chunk, whose places are held at once.
inline constexpr int chunk_side = 8;

/// Heights of a relief at the nodes (i, j) of a grid over each face: u = i / cuts, v = j / cuts, i + j <= cuts. Built
/// once, read by any number of threads.
class ReliefSamples {
 public:
  /// A square part of a face's grid, or the half of one.
  struct Chunk {
    std::uint32_t face = 0;
    std::uint16_t i = 0;  ///< first node
    std::uint16_t j = 0;
    std::uint32_t block = 0;  ///< first of its blocks
    std::uint32_t blocks = 0;
    Vec3 centre = Vec3::Zero();  ///< m: places of its nodes are held relative to this
    double radius = 0.0;         ///< of a sphere around it that holds them (m)
  };
  /// A block's first node, a sphere that holds its nodes, and a plane that none of them is above.
  struct Block {
    std::uint16_t i = 0;
    std::uint16_t j = 0;
    Vec3f centre = Vec3f::Zero();  ///< m, from the chunk's
    float radius = 0.0F;           ///< m
    Vec3f normal = Vec3f::Zero();
    float top = 0.0F;  ///< m, of the plane over `centre`
  };

  /// `spacing`: of the nodes at most (m), as far as a grid allows. Cuts are multiples of `texels`. [build]
  ReliefSamples(const ReliefSurface& surface, const CoatMoment& moment, int texels, double spacing,
                const ParallelSettings& parallel);

  /// Nodes and bytes that there would be. [build]
  struct Size {
    double nodes = 0.0;
    double bytes = 0.0;
    double bytes_a_thread = 0.0;
  };
  static Size size_for(const TriangleMesh& mesh, int texels, double spacing);

  [[nodiscard]] int cuts(std::uint32_t face) const noexcept { return cuts_[face]; }
  [[nodiscard]] float height(std::uint32_t face, int i, int j) const noexcept {
    return heights_[first_[face] + offset_in_face(cuts_[face], i, j)];
  }
  [[nodiscard]] ShellPrism prism(std::uint32_t face) const noexcept {
    return surface_.shell().prism(surface_.base().mesh(), face);
  }
  /// Place of a node (m).
  [[nodiscard]] Vec3 place(const ShellPrism& prism, std::uint32_t face, int i, int j) const noexcept {
    const double step = 1.0 / cuts_[face];
    const double u = i * step;
    const double v = j * step;
    return prism.base_at(u, v) + static_cast<double>(height(face, i, j)) * prism.direction_at(u, v);
  }
  [[nodiscard]] std::span<const Chunk> chunks() const noexcept { return chunks_; }
  [[nodiscard]] const Block* blocks() const noexcept { return blocks_.data(); }
  /// Places of a chunk's nodes from its centre (m): block by block, of each all x, all y, all z. Nodes beyond the face
  /// repeat those at its edge (`node_of`).
  void fill(const Chunk& chunk, float* places) const;
  /// The node that a lane of a block stands for.
  [[nodiscard]] std::array<int, 2> node_of(const Block& block, std::uint32_t face, std::size_t lane) const noexcept {
    const int i = std::min(block.i + static_cast<int>(lane) / block_side, cuts_[face]);
    return {i, std::min(block.j + static_cast<int>(lane) % block_side, cuts_[face] - i)};
  }
  /// Visits the chunks whose spheres come within `reach` (m) of `centre`. [build]
  template <class Visit>
  void for_each_chunk(const Vec3& centre, double reach, Visit&& visit) const {
    const Eigen::Array3i low = cell_of(centre - Vec3::Constant(reach + largest_));
    const Eigen::Array3i high = cell_of(centre + Vec3::Constant(reach + largest_));
    for (int z = low[2]; z <= high[2]; ++z) {
      for (int y = low[1]; y <= high[1]; ++y) {
        for (int x = low[0]; x <= high[0]; ++x) {
          const auto found = cells_.find(key_of(Eigen::Array3i(x, y, z)));
          if (found == cells_.end()) continue;
          for (const std::uint32_t one : found->second) {
            const double within = reach + chunks_[one].radius;
            if ((chunks_[one].centre - centre).squaredNorm() < within * within) visit(one);
          }
        }
      }
    }
  }

 private:
  static std::size_t offset_in_face(int cuts, int i, int j) noexcept {
    return static_cast<std::size_t>(i * (2 * cuts + 3 - i) / 2 + j);
  }
  [[nodiscard]] Eigen::Array3i cell_of(const Vec3& p) const { return (p / cell_).array().floor().cast<int>(); }
  [[nodiscard]] static std::uint64_t key_of(const Eigen::Array3i& cell) {
    const auto part = [](int i) { return static_cast<std::uint64_t>(static_cast<std::uint32_t>(i)) & 0x1fffffU; };
    return part(cell[0]) | part(cell[1]) << 21U | part(cell[2]) << 42U;
  }
  void cut_up(int texels, double spacing);
  void sample(std::uint32_t face, const CoatMoment& moment);
  void enclose(Chunk& chunk, std::vector<float>& places);

  const ReliefSurface& surface_;
  std::vector<int> cuts_;               ///< one a face
  std::vector<std::size_t> first_;      ///< one a face: of its heights
  std::vector<float> heights_;          ///< m
  std::vector<Chunk> chunks_;           ///< face by face
  std::vector<std::uint32_t> of_face_;  ///< one a face and one more: its first chunk
  std::vector<Block> blocks_;
  double largest_ = 0.0;  ///< radius of a chunk (m)
  double cell_ = 1.0;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> cells_;
};

/// What of a relief's samples lies nearest to a place, asked again and again for places near one another: a list of the
/// blocks around is kept while it holds. One thread's own.
class NearSamples {
 public:
  struct Found {
    double distance = 0.0;  ///< m
    std::uint32_t face = no_index;
    int i = 0;
    int j = 0;
    [[nodiscard]] bool any() const noexcept { return face != no_index; }
  };
  /// `bound`: distances (m) that are ever asked for, at most.
  NearSamples(const ReliefSamples& samples, double bound);
  /// Forgets the list: what follows does not depend on what was asked before.
  void start_anew() noexcept {
    listed_ = false;
    gathered_ = -1.0;
  }
  /// The node nearest to `centre` within `bound` (m).
  Found nearest(const Vec3& centre, double bound) { return search(centre, bound, false); }
  /// Some node within `bound`, the nearest of its block.
  Found any_within(const Vec3& centre, double bound) { return search(centre, bound, true); }

 private:
  struct Held {
    std::uint32_t chunk = no_index;
    std::uint64_t used = 0;
    std::vector<float> places;
  };
  Found search(const Vec3& centre, double bound, bool any);
  void gather(const Vec3& centre);
  void list(const Vec3& centre);
  const float* places_of(std::uint32_t chunk);

  const ReliefSamples& samples_;
  double bound_;
  double slack_;  ///< how far places may lie from where the list was made (m)
  struct Entry {
    std::uint32_t chunk;
    std::uint32_t block;
    const float* places;  ///< of its nodes, in a list alone
  };
  /// Blocks, and each number of theirs in a row of its own: place, radius, normal, top.
  struct Blocks {
    std::vector<Entry> entries;
    std::array<std::vector<float>, block_rows> rows;
    void clear();
    void add(const Entry& entry, const float (&values)[block_rows]);
    [[nodiscard]] std::array<const float*, block_rows> columns() const;
  };
  // Those of the chunks around, their places from where they were gathered.
  Vec3 gathered_at_ = Vec3::Zero();
  double gathered_ = -1.0;  ///< how far around (m)
  std::vector<std::uint32_t> chunks_;
  Blocks around_;
  // Those of them that a ball comes near anywhere within the slack of where the list was made.
  Vec3 listed_at_ = Vec3::Zero();
  bool listed_ = false;
  Blocks list_;
  std::vector<float> nearest_;           ///< scratch: squared distances that no node of a block is within
  std::vector<std::uint32_t> in_reach_;  ///< scratch: of the list, what may hold a node within the bound
  // Places of chunks that were looked at.
  std::uint64_t time_ = 0;
  std::size_t hand_ = 0;
  std::size_t most_held_ = 0;
  std::vector<std::int32_t> slot_of_chunk_;
  std::vector<Held> held_;
};

}  // namespace asperity
