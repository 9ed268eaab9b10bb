#include <openvdb/openvdb.h>
#include <openvdb/tools/MeshToVolume.h>

#include <cmath>
#include <limits>
#include <new>

#include "asperity/field/conversion/mesh_conversion.h"
#include "asperity/io/vdb/vdb_library.h"

namespace asperity::vdb_io {
namespace {

using Leaf = openvdb::FloatTree::LeafNodeType;

/// A leaf as a block: x fastest, where OpenVDB has z fastest.
VoxelBlock block_of(const Leaf& leaf, const openvdb::Int32Tree::LeafNodeType* faces, const VoxelRequest& request) {
  VoxelBlock block;
  for (std::size_t a = 0; a < 3; ++a) block.at[a] = leaf.origin()[a] >> 3;
  for (openvdb::Index n = 0; n < Leaf::SIZE; ++n) {
    const openvdb::Coord c = Leaf::offsetToLocalCoord(n);
    const std::size_t at = SparseBlock::index(c.x(), c.y(), c.z());
    const float value = leaf.getValue(n);
    const bool inside = std::signbit(value);
    const bool known = leaf.isValueOn(n) && faces != nullptr && faces->isValueOn(n) && std::isfinite(value);
    block.distance[at] = known ? value : (inside ? -request.band_inside : request.band_outside);
    const openvdb::Int32 face = known ? faces->getValue(n) : -1;
    const bool valid = face >= 0 && static_cast<std::size_t>(face) < request.triangles.size();
    block.face[at] = valid ? static_cast<std::uint32_t>(face) : no_index;
  }
  return block;
}

Result<std::vector<VoxelBlock>> converted(const VoxelRequest& request, const Progress& progress) {
  std::vector<openvdb::Vec3s> points;
  points.reserve(request.positions.size());
  for (const Vec3f& p : request.positions) points.emplace_back(p.x(), p.y(), p.z());
  std::vector<openvdb::Vec3I> triangles;
  triangles.reserve(request.triangles.size());
  for (const TriangleMesh::Triangle& t : request.triangles) triangles.emplace_back(t[0], t[1], t[2]);

  // Exactly these types are in the library; others would be compiled here for minutes.
  const openvdb::tools::QuadAndTriangleDataAdapter<openvdb::Vec3s, openvdb::Vec3I> mesh(points, triangles);
  openvdb::util::NullInterrupter nobody;
  const auto transform = openvdb::math::Transform::createLinearTransform(1.0);
  openvdb::Int32Grid faces;
  // Renormalised distances would not be those to the indexed faces any more.
  int flags = openvdb::tools::DISABLE_RENORMALIZATION;
  if (!request.signed_by_flood) flags |= openvdb::tools::UNSIGNED_DISTANCE_FIELD;
  const float inside = std::isfinite(request.band_inside) ? request.band_inside : std::numeric_limits<float>::max();
  if (progress) progress("converting mesh", 0.0);
  const openvdb::FloatGrid::Ptr distances = openvdb::tools::meshToVolume<openvdb::FloatGrid>(
      nobody, mesh, *transform, request.band_outside, inside, flags, &faces);
  if (progress) progress("converting mesh", 1.0);

  distances->tree().voxelizeActiveTiles();
  faces.tree().voxelizeActiveTiles();
  std::vector<VoxelBlock> blocks;
  blocks.reserve(distances->tree().leafCount());
  for (auto leaf = distances->tree().cbeginLeaf(); leaf; ++leaf) {
    if (leaf->isEmpty()) continue;
    blocks.push_back(block_of(*leaf, faces.tree().probeConstLeaf(leaf->origin()), request));
  }
  return blocks;
}

}  // namespace

Result<std::vector<VoxelBlock>> voxelize(const VoxelRequest& request, const Progress& progress) {
  try {
    initialize();
    return converted(request, progress);
  } catch (const std::bad_alloc&) {
    return refused(ErrorCode::too_large, "takes more memory than there is", "voxel", "a larger voxel");
  } catch (const std::exception& failure) {
    return refused(ErrorCode::bad_mesh, std::string("cannot be converted: ") + failure.what(), {},
                   "a mesh of triangles");
  }
}

}  // namespace asperity::vdb_io
