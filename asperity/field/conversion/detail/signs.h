#pragma once
// Private to asperity/field: exact distances, and what tells inside from outside, when a mesh becomes a potential.

#include <array>
#include <memory>
#include <unordered_map>
#include <vector>

#include "asperity/core/parallel_for.h"
#include "asperity/field/conversion/mesh_conversion.h"
#include "asperity/geometry/winding_number.h"

namespace asperity::conversion {

/// Items that a thread takes at a time: blocks and points are not worth one each.
inline constexpr ParallelSettings shared_out{.grain = 16};

/// Points of a block along an axis.
inline constexpr int block_side = SparseBlock::side;

/// One number for a place on a grid, 21 bits an axis: within a million of the origin, which the bound on the resolution
/// keeps blocks to. [build]
inline std::uint64_t key_of(const std::array<std::int32_t, 3>& at) noexcept {
  std::uint64_t key = 0;
  for (const std::int32_t a : at) key = key << 21U | static_cast<std::uint64_t>((a + (1 << 20)) & ((1 << 21) - 1));
  return key;
}

/// A stored point of a list of blocks.
struct Node {
  std::uint32_t block = 0;  ///< no_index: its block is not there
  std::uint32_t point = 0;
};

/// Calls visit(node) for every stored point of the blocks that there are when it begins. [build]
template <class Visit>
void for_each_node(const std::vector<VoxelBlock>& blocks, const Visit& visit) {
  for (std::uint32_t b = 0, count = static_cast<std::uint32_t>(blocks.size()); b < count; ++b) {
    for (std::uint32_t n = 0; n < SparseBlock::points; ++n) visit(Node{b, n});
  }
}

/// Where the blocks of a list are, and what is beside them.
class BlockMap {
 public:
  /// [build]
  explicit BlockMap(const std::vector<VoxelBlock>& blocks);
  /// Index of the block at this place, or no_index. [build]
  [[nodiscard]] std::uint32_t find(const std::array<std::int32_t, 3>& at) const;
  /// Puts a block at the end of the list, without faces and this far from them throughout; answers its index. [build]
  std::uint32_t append(const std::array<std::int32_t, 3>& at, double distance, std::vector<VoxelBlock>& blocks);
  /// The point beside one: `way` 0 to 5 is -x, +x, -y, +y, -z, +z. [build]
  [[nodiscard]] Node beside(const Node& node, std::uint32_t way) const noexcept {
    constexpr std::uint32_t side = SparseBlock::side;
    constexpr std::uint32_t stride[3] = {1, side, side * side};
    const std::uint32_t step = stride[way / 2];
    const std::uint32_t at = node.point / step % side;
    if (way % 2 == 0)
      return at > 0 ? Node{node.block, node.point - step}
                    : Node{beside_[node.block][way], node.point + (side - 1) * step};
    return at + 1 < side ? Node{node.block, node.point + step}
                         : Node{beside_[node.block][way], node.point - (side - 1) * step};
  }

 private:
  std::unordered_map<std::uint64_t, std::uint32_t> index_;
  std::vector<std::array<std::uint32_t, 6>> beside_;
};

/// The place of a block beside another. [build]
[[nodiscard]] std::array<std::int32_t, 3> place_beside(std::array<std::int32_t, 3> at, std::uint32_t way) noexcept;
/// Where a stored point is (m). [build]
[[nodiscard]] Vec3 position_of(const VoxelBlock& block, std::uint32_t point, const Vec3& origin, double voxel) noexcept;

/// How a list of blocks lies, and how far its band goes.
struct BandFrame {
  Vec3 origin = Vec3::Zero();  ///< of node (0, 0, 0) (m)
  double voxel = 0.0;          ///< m
  double outward = 0.0;        ///< m
  double inward = 0.0;         ///< m; may be infinite
  bool by_flood = false;       ///< the voxeliser's signs are those of a flood
};

/// Turns a voxeliser's distances (in voxels) into exact ones (m) to the faces that are nearest, and completes the band
/// where the voxeliser missed some of it. Answers how far its distances were off (m). [build]
double make_exact(const TriangleIndex& index, const BandFrame& frame, std::vector<VoxelBlock>& blocks,
                  const Progress& progress);

/// A mesh whose faces agree, as far as they can, about which side is out, and its winding numbers.
struct OrientedMesh {
  std::unique_ptr<const TriangleMesh> mesh;
  std::unique_ptr<const WindingNumber> winding;
  std::size_t turned = 0;  ///< faces that were turned round
};
/// Faces take the side of most of their part's area. Errors: those of TriangleMesh::build. [build]
Result<OrientedMesh> oriented(const TriangleMesh& mesh);

/// Share (0 to 1) of up to `most` faces beside whose middle the winding number is above 1/2 behind and below in front.
/// [build]
double told_apart(const OrientedMesh& oriented, std::size_t most);

/// Turns distances (m) negative where the winding number exceeds 1/2. Points without a face are
/// beyond the band, and have its width.
/// `origin` and `voxel`: where points are (m). [build]
void sign_by_winding(const OrientedMesh& oriented, const Vec3& origin, double voxel, std::vector<VoxelBlock>& blocks);

/// Where inside meets outside in a hole, without a face between them, puts a surface there (the winding number's 1/2)
/// and makes distances the lesser of those to it and to the faces; blocks are added where it leaves them. Distances to
/// it are of first order in the voxel. [build]
void bridge_holes(const TriangleIndex& index, const OrientedMesh& oriented, const BandFrame& frame,
                  std::vector<VoxelBlock>& blocks);

/// Signs of a flood are right away from the surface, but not everywhere beside it (OpenVDB's are wrong at one point in
/// some hundred, up to half a voxel off). Carries those from a voxel and more away to all points that no surface
/// separates from them; what this does not reach (parts thinner than two voxels) asks the winding number where the mesh
/// is closed and oriented. [build]
void settle_flood(const TriangleMesh& mesh, const Vec3& origin, double voxel, std::vector<VoxelBlock>& blocks);

}  // namespace asperity::conversion
