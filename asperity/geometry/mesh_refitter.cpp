#include "asperity/geometry/mesh_refitter.h"

#include <atomic>

#include "asperity/core/parallel_for.h"

namespace asperity {

namespace {

// Below this, starting a thread takes longer than it saves.
constexpr std::size_t worth_a_thread = 20000;
// More snapshots than this in use at a time are left to their readers to free.
constexpr std::size_t most_buffers = 4;

}  // namespace

MeshRefitter::MeshRefitter(TriangleIndex rest, int threads) : rest_(std::move(rest)), threads_(threads) {
  if (const auto* bvh = std::get_if<Bvh>(&rest_.inside_->structure)) fitting_ = bvh->fitting();
  // One snapshot that is read and one that is written: made now, so that no move waits for memory.
  for (int i = 0; i < 2; ++i) buffers_.push_back(fresh());
}

std::shared_ptr<TriangleIndex::Inside> MeshRefitter::fresh() const {
  const auto made = std::make_shared<Inside>(rest_.inside_->mesh);
  made->built_cost = rest_.inside_->built_cost;
  if (const auto* bvh = std::get_if<Bvh>(&rest_.inside_->structure)) made->structure = *bvh;
  return made;
}

std::shared_ptr<TriangleIndex::Inside> MeshRefitter::spare() {
  for (const std::shared_ptr<Inside>& buffer : buffers_) {
    if (buffer.use_count() != 1) continue;
    // Whoever held it last has read it for the last time before this.
    std::atomic_thread_fence(std::memory_order_acquire);
    return buffer;
  }
  if (buffers_.size() == most_buffers) buffers_.erase(buffers_.begin());
  return buffers_.emplace_back(fresh());
}

Result<TriangleIndex> MeshRefitter::moved(std::span<const Vec3> positions) {
  const std::shared_ptr<Inside> inside = spare();
  TriangleMesh& mesh = inside->mesh;
  ASPERITY_CHECK(mesh.place(positions));
  Status measured = success();
  if (auto* bvh = std::get_if<Bvh>(&inside->structure);
      bvh != nullptr && std::holds_alternative<Bvh>(rest_.inside_->structure)) {
    const unsigned threads = threads_ > 1 && mesh.triangles().size() >= worth_a_thread ? 2U : 1U;
    parallel_for(2, {.threads = threads}, [&](std::size_t part) {
      if (part == 0) {
        bvh->refit(mesh, fitting_);
      } else {
        measured = mesh.measure(sums_);
      }
    });
    ASPERITY_CHECK(std::move(measured));
  } else {
    ASPERITY_CHECK(mesh.measure(sums_));
    inside->structure = TriangleOctree::build(mesh);
  }
  return TriangleIndex(inside, rest_.lineage_);
}

}  // namespace asperity
