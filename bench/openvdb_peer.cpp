#include "bench/openvdb_peer.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>

namespace asperity::bench {

struct OpenvdbPeer::Grid {
  openvdb::FloatGrid::Ptr tree;
  std::unique_ptr<openvdb::FloatGrid::ConstAccessor> accessor;
  Vec3 origin;
  double per_voxel = 0.0;
};

OpenvdbPeer::OpenvdbPeer(const SparseSource& source) : grid_(std::make_unique<Grid>()) {
  openvdb::initialize();
  grid_->tree = openvdb::FloatGrid::create(static_cast<float>(source.outside));
  openvdb::FloatGrid::Accessor writer = grid_->tree->getAccessor();
  for (const SparseBlock& block : source.blocks) {
    const openvdb::Coord first(block.at[0] * SparseBlock::side, block.at[1] * SparseBlock::side,
                               block.at[2] * SparseBlock::side);
    for (int k = 0; k < SparseBlock::side; ++k) {
      for (int j = 0; j < SparseBlock::side; ++j) {
        for (int i = 0; i < SparseBlock::side; ++i) {
          writer.setValue(first.offsetBy(i, j, k), block.value[SparseBlock::index(i, j, k)]);
        }
      }
    }
  }
  grid_->accessor = std::make_unique<openvdb::FloatGrid::ConstAccessor>(grid_->tree->getConstAccessor());
  grid_->origin = source.origin;
  grid_->per_voxel = 1.0 / source.voxel;
}

OpenvdbPeer::~OpenvdbPeer() = default;

double OpenvdbPeer::value(const Vec3& p) const {
  const Vec3 at = (p - grid_->origin) * grid_->per_voxel;
  return static_cast<double>(
      openvdb::tools::BoxSampler::sample(*grid_->accessor, openvdb::Vec3R(at.x(), at.y(), at.z())));
}

}  // namespace asperity::bench
