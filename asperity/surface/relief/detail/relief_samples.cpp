#include "asperity/surface/relief/detail/relief_samples.h"

#include <algorithm>
#include <cmath>

#include "asperity/surface/relief/detail/block_lanes.h"

namespace asperity {

namespace {

constexpr int most_face_cuts = 60000;
constexpr int least_face_cuts = 4;
constexpr std::size_t chunk_bytes_held = std::size_t{24} << 20U;

double longest_edge(const TriangleMesh& mesh, std::uint32_t face) {
  const auto [a, b, c] = mesh.corners(face);
  return std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
}

/// Steps along each edge of a face: a multiple of the texels, fine enough for `spacing`.
int cuts_for(const TriangleMesh& mesh, std::uint32_t face, int texels, double spacing) {
  const double wanted = std::min(longest_edge(mesh, face) / spacing, static_cast<double>(most_face_cuts));
  // A little coarser than asked for is no reason for twice as many.
  int times = std::max(1, static_cast<int>(std::ceil(wanted / texels / 1.25)));
  while (times * texels < least_face_cuts) ++times;
  return times * texels;
}

struct ChunkPlan {
  int nodes;   ///< a side of a chunk
  int chunks;  ///< a side of the face
  explicit ChunkPlan(int cuts) {
    const int blocks = (cuts + block_side) / block_side;
    chunks = (blocks + chunk_side - 1) / chunk_side;
    nodes = block_side * ((blocks + chunks - 1) / chunks);
  }
};

/// Visits the first nodes of the squares of `side` nodes that hold any of a face.
template <class Visit>
void for_each_square(int i0, int j0, int nodes, int side, int cuts, Visit&& visit) {
  for (int i = i0; i < i0 + nodes; i += side) {
    for (int j = j0; j < j0 + nodes && i + j <= cuts; j += side) visit(i, j);
  }
}

}  // namespace

ReliefSamples::Size ReliefSamples::size_for(const TriangleMesh& mesh, int texels, double spacing) {
  Size size;
  for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) {
    const double cuts = cuts_for(mesh, face, texels, spacing);
    size.nodes += 0.5 * (cuts + 1.0) * (cuts + 2.0);
    const double blocks = cuts / block_side + 1.0;
    size.bytes += sizeof(Chunk) + 64.0 + sizeof(Block) * 0.5 * blocks * (blocks + 1.0);
  }
  size.bytes += sizeof(float) * size.nodes;
  // A thread's own places of chunks.
  size.bytes_a_thread = std::min(static_cast<double>(chunk_bytes_held), 8.0 * sizeof(float) * size.nodes);
  return size;
}

ReliefSamples::ReliefSamples(const ReliefSurface& surface, const CoatMoment& moment, int texels, double spacing,
                             const ParallelSettings& parallel)
    : surface_(surface) {
  cut_up(texels, spacing);
  const std::size_t faces = cuts_.size();
  std::vector<std::vector<float>> places(parallel_workers(faces, parallel));
  parallel_for(faces, parallel, [&](std::size_t i, unsigned worker) {
    sample(static_cast<std::uint32_t>(i), moment);
    for (std::uint32_t chunk = of_face_[i]; chunk < of_face_[i + 1]; ++chunk) enclose(chunks_[chunk], places[worker]);
  });
  for (const Chunk& chunk : chunks_) largest_ = std::max(largest_, chunk.radius);
  cell_ = std::max(2.0 * largest_, 1e-6 * surface.bounds().diagonal());
  for (std::uint32_t i = 0; i < chunks_.size(); ++i) cells_[key_of(cell_of(chunks_[i].centre))].push_back(i);
}

void ReliefSamples::cut_up(int texels, double spacing) {
  const TriangleMesh& mesh = surface_.base().mesh();
  std::size_t nodes = 0;
  std::size_t blocks = 0;
  for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) {
    const int cuts = cuts_for(mesh, face, texels, spacing);
    cuts_.push_back(cuts);
    first_.push_back(nodes);
    of_face_.push_back(static_cast<std::uint32_t>(chunks_.size()));
    nodes += offset_in_face(cuts, cuts, 0) + 1;
    const ChunkPlan plan(cuts);
    for_each_square(0, 0, plan.nodes * plan.chunks, plan.nodes, cuts, [&](int i, int j) {
      Chunk chunk;
      chunk.face = face;
      chunk.i = static_cast<std::uint16_t>(i);
      chunk.j = static_cast<std::uint16_t>(j);
      chunk.block = static_cast<std::uint32_t>(blocks);
      for_each_square(i, j, plan.nodes, block_side, cuts, [&](int, int) { ++chunk.blocks; });
      blocks += chunk.blocks;
      chunks_.push_back(chunk);
    });
  }
  of_face_.push_back(static_cast<std::uint32_t>(chunks_.size()));
  heights_.resize(nodes);
  blocks_.resize(blocks);
  for (const Chunk& chunk : chunks_) {
    std::size_t block = chunk.block;
    for_each_square(chunk.i, chunk.j, ChunkPlan(cuts_[chunk.face]).nodes, block_side, cuts_[chunk.face],
                    [&](int i, int j) {
                      blocks_[block].i = static_cast<std::uint16_t>(i);
                      blocks_[block++].j = static_cast<std::uint16_t>(j);
                    });
  }
}

void ReliefSamples::sample(std::uint32_t face, const CoatMoment& moment) {
  const ReliefFrame frame = surface_.frame(face, moment);
  const int cuts = cuts_[face];
  float* to = heights_.data() + first_[face];
  for (int i = 0; i <= cuts; ++i) {
    for (int j = 0; i + j <= cuts; ++j) {
      const double u = static_cast<double>(i) / cuts;
      *to++ = static_cast<float>(surface_.height_alone(frame, u, std::min(static_cast<double>(j) / cuts, 1.0 - u)));
    }
  }
}

void ReliefSamples::fill(const Chunk& chunk, float* places) const {
  const ShellPrism prism = this->prism(chunk.face);
  const int cuts = cuts_[chunk.face];
  const double step = 1.0 / cuts;
  for (std::uint32_t k = 0; k < chunk.blocks; ++k, places += 3 * block_nodes) {
    const Block& block = blocks_[chunk.block + k];
    float* to = places;
    for (int di = 0; di < block_side; ++di) {
      const int i = std::min(block.i + di, cuts);
      const double u = i * step;
      const Vec3 base = prism.base_at(u, 0.0) - chunk.centre;
      const Vec3 direction = prism.direction_at(u, 0.0);
      const float* row = heights_.data() + first_[chunk.face] + offset_in_face(cuts, i, 0);
      for (int dj = 0; dj < block_side; ++dj, ++to) {
        const int j = std::min(block.j + dj, cuts - i);
        const double v = j * step;
        const auto height = static_cast<double>(row[j]);
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const auto a = static_cast<int>(axis);
          to[axis * block_nodes] =
              static_cast<float>(base[a] + v * prism.edge_v[a] + height * (direction[a] + v * prism.turn_v[a]));
        }
      }
    }
  }
}

void ReliefSamples::enclose(Chunk& chunk, std::vector<float>& places) {
  const ShellPrism prism = this->prism(chunk.face);
  chunk.centre = place(prism, chunk.face, chunk.i, std::min<int>(chunk.j, cuts_[chunk.face] - chunk.i));
  places.resize(3 * block_nodes * chunk.blocks);
  fill(chunk, places.data());
  using Places = Eigen::Map<const Eigen::Array<float, static_cast<int>(block_nodes), 3>>;
  // Room for the rounding of floats.
  constexpr float room = 1.0F + 1e-5F;
  const Vec3f face_normal = prism.edge_u.cross(prism.edge_v).normalized().cast<float>();
  const auto spread = [&](const Places& all, const Vec3f& from) {
    return std::sqrt((all.rowwise() - from.transpose().array()).square().rowwise().sum().maxCoeff());
  };
  Vec3f low = Vec3f::Constant(std::numeric_limits<float>::max());
  Vec3f high = -low;
  for (std::uint32_t k = 0; k < chunk.blocks; ++k) {
    const Places all(places.data() + 3 * block_nodes * k);
    low = low.cwiseMin(all.colwise().minCoeff().transpose().matrix());
    high = high.cwiseMax(all.colwise().maxCoeff().transpose().matrix());
  }
  // The places again, from a centre in the middle.
  const Vec3f middle = 0.5F * (low + high);
  chunk.centre += middle.cast<double>();
  fill(chunk, places.data());
  float radius = 0.0F;
  for (std::uint32_t k = 0; k < chunk.blocks; ++k) {
    Block& block = blocks_[chunk.block + k];
    const Places all(places.data() + 3 * block_nodes * k);
    const Vec3f least = all.colwise().minCoeff().transpose().matrix();
    const Vec3f most = all.colwise().maxCoeff().transpose().matrix();
    block.centre = 0.5F * (least + most);
    block.radius = room * spread(all, block.centre);
    const auto lane = [&](std::size_t i) { return Vec3f(all.row(static_cast<int>(i)).transpose().matrix()); };
    const Vec3f own = (lane(block_nodes - block_side) - lane(0)).cross(lane(block_side - 1) - lane(0));
    block.normal = own.dot(face_normal) > 0.3F * own.norm() ? Vec3f(own.normalized()) : face_normal;
    block.top = (all.matrix() * block.normal).maxCoeff() - block.centre.dot(block.normal) + 1e-5F * block.radius;
    radius = std::max(radius, spread(all, Vec3f::Zero()));
  }
  chunk.radius = static_cast<double>(room * radius);
}

NearSamples::NearSamples(const ReliefSamples& samples, double bound)
    : samples_(samples), bound_(bound), slack_(0.4 * bound), slot_of_chunk_(samples.chunks().size(), -1) {
  std::uint32_t blocks = 1;
  for (const ReliefSamples::Chunk& chunk : samples.chunks()) blocks = std::max(blocks, chunk.blocks);
  most_held_ = std::max<std::size_t>(16, chunk_bytes_held / (3 * sizeof(float) * block_nodes * blocks));
}

const float* NearSamples::places_of(std::uint32_t chunk) {
  std::int32_t& slot = slot_of_chunk_[chunk];
  if (slot >= 0) {
    held_[static_cast<std::size_t>(slot)].used = time_;
    return held_[static_cast<std::size_t>(slot)].places.data();
  }
  std::size_t to = held_.size();
  if (held_.size() >= most_held_) {
    // Another one's place, but of none that the list at hand has.
    for (std::size_t tried = 0; tried < held_.size(); ++tried) {
      hand_ = (hand_ + 1) % held_.size();
      if (held_[hand_].used == time_) continue;
      to = hand_;
      break;
    }
  }
  if (to == held_.size()) {
    held_.emplace_back();
  } else {
    slot_of_chunk_[held_[to].chunk] = -1;
  }
  Held& one = held_[to];
  one.chunk = chunk;
  one.used = time_;
  const ReliefSamples::Chunk& filled = samples_.chunks()[chunk];
  one.places.resize(3 * block_nodes * filled.blocks);
  samples_.fill(filled, one.places.data());
  slot = static_cast<std::int32_t>(to);
  return one.places.data();
}

void NearSamples::Blocks::clear() {
  entries.clear();
  for (auto& row : rows) row.clear();
}

void NearSamples::Blocks::add(const Entry& entry, const float (&values)[block_rows]) {
  entries.push_back(entry);
  for (std::size_t i = 0; i < block_rows; ++i) rows[i].push_back(values[i]);
}

std::array<const float*, block_rows> NearSamples::Blocks::columns() const {
  std::array<const float*, block_rows> columns;
  for (std::size_t i = 0; i < block_rows; ++i) columns[i] = rows[i].data();
  return columns;
}

void NearSamples::gather(const Vec3& centre) {
  gathered_at_ = centre;
  gathered_ = 3.0 * bound_;
  chunks_.clear();
  around_.clear();
  samples_.for_each_chunk(centre, gathered_, [&](std::uint32_t chunk) { chunks_.push_back(chunk); });
  std::sort(chunks_.begin(), chunks_.end());
  for (const std::uint32_t one : chunks_) {
    const ReliefSamples::Chunk& chunk = samples_.chunks()[one];
    const Vec3f from = (chunk.centre - centre).cast<float>();
    for (std::uint32_t k = chunk.block; k < chunk.block + chunk.blocks; ++k) {
      const ReliefSamples::Block& block = samples_.blocks()[k];
      const Vec3f at = from + block.centre;
      around_.add({one, k, nullptr}, {at.x(), at.y(), at.z(), block.radius, block.normal.x(), block.normal.y(),
                                      block.normal.z(), block.top});
    }
  }
  nearest_.resize(std::max(nearest_.size(), around_.entries.size()));
}

void NearSamples::list(const Vec3& centre) {
  if ((centre - gathered_at_).norm() + bound_ + slack_ > gathered_ || gathered_ < 0.0) gather(centre);
  ++time_;
  listed_at_ = centre;
  listed_ = true;
  list_.clear();
  const auto reach = static_cast<float>((bound_ + slack_) * (bound_ + slack_) * (1.0 + 1e-5));
  const std::array<const float*, block_rows> columns = around_.columns();
  bound_blocks(columns, around_.entries.size(), (centre - gathered_at_).cast<float>(), nearest_.data());
  std::uint32_t chunk = no_index;
  const float* places = nullptr;
  for (std::size_t k = 0; k < around_.entries.size(); ++k) {
    if (nearest_[k] > reach) continue;
    Entry one = around_.entries[k];
    if (one.chunk != chunk) {
      chunk = one.chunk;
      places = places_of(chunk);
    }
    one.places = places + 3 * block_nodes * (one.block - samples_.chunks()[chunk].block);
    list_.add(one, {columns[0][k], columns[1][k], columns[2][k], columns[3][k], columns[4][k], columns[5][k],
                    columns[6][k], columns[7][k]});
  }
}

NearSamples::Found NearSamples::search(const Vec3& centre, double bound, bool any) {
  if (!listed_ || (centre - listed_at_).squaredNorm() > slack_ * slack_) list(centre);
  bound_blocks(list_.columns(), list_.entries.size(), (centre - gathered_at_).cast<float>(), nearest_.data());
  Found found;
  auto best = static_cast<float>(bound * bound);
  in_reach_.clear();
  std::size_t first = 0;
  for (std::uint32_t k = 0; k < list_.entries.size(); ++k) {
    if (nearest_[k] >= best) continue;
    if (!in_reach_.empty() && nearest_[k] < nearest_[in_reach_[first]]) first = in_reach_.size();
    in_reach_.push_back(k);
  }
  if (in_reach_.empty()) return found;
  // What comes closest first: of the others few are left.
  std::swap(in_reach_[0], in_reach_[first]);
  float squares[block_nodes];
  for (const std::uint32_t k : in_reach_) {
    if (nearest_[k] >= best) continue;
    const Entry& entry = list_.entries[k];
    const ReliefSamples::Chunk& chunk = samples_.chunks()[entry.chunk];
    const float least = square_nodes(entry.places, (centre - chunk.centre).cast<float>(), squares);
    if (least >= best) continue;
    best = least;
    const auto lane = static_cast<std::size_t>(std::find(squares, squares + block_nodes, least) - squares);
    const auto [i, j] = samples_.node_of(samples_.blocks()[entry.block], chunk.face, lane);
    found = {0.0, chunk.face, i, j};
    if (any) break;
  }
  if (found.any()) found.distance = std::sqrt(static_cast<double>(best));
  return found;
}

}  // namespace asperity
