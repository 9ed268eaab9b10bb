#include "asperity/field/conversion/detail/signs.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace asperity::conversion {
namespace {

/// Loose ends near each other: edges along which the triangles' boundary does not cancel.
struct LooseEnds {
  Vec3 centre = Vec3::Zero();
  double radius = 0.0;  ///< m
  double length = 0.0;  ///< m, counted as often as it is left over
};

/// The boundary of the mesh as a chain: each edge once for every face that runs along it unanswered.
std::vector<LooseEnds> loose_ends(const TriangleMesh& mesh, double cell) {
  struct Run {
    std::uint64_t edge = 0;
    int direction = 0;
  };
  std::vector<Run> runs;
  runs.reserve(3 * mesh.triangles().size());
  for (const TriangleMesh::Triangle& t : mesh.triangles()) {
    for (std::size_t e = 0; e < 3; ++e) {
      const std::uint64_t a = t[e];
      const std::uint64_t b = t[(e + 1) % 3];
      runs.push_back({a < b ? a << 32U | b : b << 32U | a, a < b ? 1 : -1});
    }
  }
  std::sort(runs.begin(), runs.end(), [](const Run& a, const Run& b) { return a.edge < b.edge; });
  std::unordered_map<std::uint64_t, LooseEnds> cells;
  for (std::size_t i = 0; i < runs.size();) {
    std::size_t end = i;
    int sum = 0;
    for (; end < runs.size() && runs[end].edge == runs[i].edge; ++end) sum += runs[end].direction;
    if (sum != 0) {
      const Vec3& a = mesh.positions()[runs[i].edge >> 32U];
      const Vec3& b = mesh.positions()[runs[i].edge & 0xFFFFFFFFU];
      const Vec3 middle = 0.5 * (a + b);
      const Vec3 place = (middle - mesh.bounds().lower) / cell;
      const auto whole = [&](int axis) { return static_cast<std::int32_t>(std::floor(place[axis])); };
      LooseEnds& ends = cells[key_of({whole(0), whole(1), whole(2)})];
      if (ends.length == 0.0) ends.centre = middle;
      ends.radius = std::max({ends.radius, (a - ends.centre).norm(), (b - ends.centre).norm()});
      ends.length += std::abs(sum) * (b - a).norm();
    }
    i = end;
  }
  std::vector<LooseEnds> all;
  all.reserve(cells.size());
  for (const auto& [key, ends] : cells) all.push_back(ends);
  return all;
}

/// What sign_by_winding knows of a block besides.
struct BlockState {
  std::array<std::int8_t, SparseBlock::points> sign{};  ///< 0: not known yet
  double steepest = 0.0;                                ///< bound on the winding number's gradient in it (1/m)
};

class Signs {
 public:
  Signs(const TriangleMesh& mesh, const WindingNumber* winding, const Vec3& origin, double voxel,
        std::vector<VoxelBlock>& blocks)
      : mesh_(mesh),
        winding_(winding),
        origin_(origin),
        voxel_(voxel),
        blocks_(blocks),
        map_(blocks),
        states_(blocks.size()) {}

  void by_winding() {
    prepare();
    parallel_for(blocks_.size(), shared_out, [&](std::size_t b) {
      for (std::uint32_t point = 0; point < SparseBlock::points; ++point) {
        const Node node{static_cast<std::uint32_t>(b), point};
        if (!reachable(node)) settle(node, winding(node));
      }
    });
    spread_the_rest();
    apply();
  }

  /// Answers whether points are left that no sign reached.
  bool carry_flood() {
    for_each_node(blocks_, [&](const Node& node) {
      if (!(distance(node) >= voxel_)) return;
      states_[node.block].sign[node.point] = blocks_[node.block].distance[node.point] < 0.0F ? -1 : 1;
      if (distance(node) < 2.5 * voxel_) queue_.emplace_back(node, 0.0);
    });
    for (std::size_t i = 0; i < queue_.size(); ++i) {
      const Node node = queue_[i].first;
      for_each_joined(node, [&](const Node& next) {
        if (sign(next) != 0) return;
        states_[next.block].sign[next.point] = sign(node);
        queue_.emplace_back(next, 0.0);
      });
    }
    return std::any_of(states_.begin(), states_.end(), [](const BlockState& state) {
      return std::find(state.sign.begin(), state.sign.end(), 0) != state.sign.end();
    });
  }
  void ask_for_the_rest(const WindingNumber& winding_number) {
    winding_ = &winding_number;
    prepare();
    spread_the_rest();
  }
  /// Gives the distances the signs that are known.
  void apply() {
    for_each_node(blocks_, [&](const Node& node) {
      float& stored = blocks_[node.block].distance[node.point];
      if (sign(node) != 0) stored = std::copysign(stored, sign(node) < 0 ? -1.0F : 1.0F);
    });
  }

 private:
  void prepare() {
    const double diagonal = mesh_.bounds().diagonal();
    const std::vector<LooseEnds> ends = loose_ends(mesh_, std::max(4.0 * voxel_, diagonal / 64.0));
    const double reach = 0.5 * std::sqrt(3.0) * (block_side + 1) * voxel_;
    parallel_for(blocks_.size(), shared_out, [&](std::size_t b) {
      const Vec3 centre =
          position({static_cast<std::uint32_t>(b), 0}) + Vec3::Constant(0.5 * (block_side - 1) * voxel_);
      // Away from the triangles the winding number is the solid angle of the chain's span: its gradient is the field
      // of a current along the chain (Biot-Savart), at most length / (4 pi distance^2).
      for (const LooseEnds& loose : ends) {
        const double distance = (loose.centre - centre).norm() - loose.radius - reach;
        states_[b].steepest +=
            distance > 0.0 ? loose.length / (4.0 * std::numbers::pi * distance * distance) : infinity;
      }
    });
  }

  /// Asks for the winding number where no sign is known yet.
  void spread_the_rest() {
    for_each_node(blocks_, [&](const Node& node) {
      if (sign(node) == 0) spread(node);
    });
  }

  [[nodiscard]] Vec3 position(const Node& node) const {
    return position_of(blocks_[node.block], node.point, origin_, voxel_);
  }
  [[nodiscard]] double winding(const Node& node) const { return winding_->at(position(node)); }
  [[nodiscard]] double distance(const Node& node) const {
    return std::abs(static_cast<double>(blocks_[node.block].distance[node.point]));
  }
  [[nodiscard]] std::int8_t sign(const Node& node) const { return states_[node.block].sign[node.point]; }
  void settle(const Node& node, double winding_number) {
    states_[node.block].sign[node.point] = winding_number > 0.5 ? -1 : 1;
  }

  /// Calls visit(neighbour) for the points beside one from which no surface separates it: the way between them
  /// is shorter than what is free of surface around both.
  template <class Visit>
  void for_each_joined(const Node& node, const Visit& visit) const {
    for (std::uint32_t way = 0; way < 6; ++way) {
      const Node next = map_.beside(node, way);
      if (next.block == no_index) continue;
      if (distance(node) + distance(next) > voxel_ * (1.0 + 1e-5)) visit(next);
    }
  }
  [[nodiscard]] bool reachable(const Node& node) const {
    bool joined = false;
    for_each_joined(node, [&](const Node&) { joined = true; });
    return joined;
  }

  /// Asks for the winding number at a point and carries its sign as far as it cannot have changed.
  void spread(const Node& seed) {
    const double value = winding(seed);
    settle(seed, value);
    // The approximation of far triangles has its part in it.
    constexpr double doubt = 0.02;
    queue_.assign(1, {seed, std::abs(value - 0.5) - doubt});
    for (std::size_t i = 0; i < queue_.size(); ++i) {
      const auto [node, slack] = queue_[i];
      const double lost = states_[node.block].steepest * voxel_;
      if (!(slack > lost)) continue;
      for_each_joined(node, [&, left = slack - lost](const Node& next) {
        if (sign(next) != 0) return;
        states_[next.block].sign[next.point] = sign(seed);
        queue_.emplace_back(next, left);
      });
    }
  }

  const TriangleMesh& mesh_;
  const WindingNumber* winding_;
  Vec3 origin_;
  double voxel_;
  std::vector<VoxelBlock>& blocks_;
  BlockMap map_;
  std::vector<BlockState> states_;
  std::vector<std::pair<Node, double>> queue_;
};

/// Area of a triangle (m²).
double area_of(const TriangleMesh& mesh, std::uint32_t face) {
  const std::array<Vec3, 3> c = mesh.corners(face);
  return 0.5 * (c[1] - c[0]).cross(c[2] - c[0]).norm();
}

/// For each face whether it has to be turned for its part to agree.
std::vector<bool> disagreeing(const TriangleMesh& mesh) {
  const auto triangles = mesh.triangles();
  std::vector<std::int8_t> side_of(triangles.size(), 0);
  std::vector<bool> turned(triangles.size(), false);
  std::vector<std::uint32_t> part;
  for (std::uint32_t seed = 0; seed < triangles.size(); ++seed) {
    if (side_of[seed] != 0) continue;
    part.assign(1, seed);
    side_of[seed] = 1;
    double kept = 0.0;
    double against = 0.0;
    for (std::size_t i = 0; i < part.size(); ++i) {
      const std::uint32_t face = part[i];
      (side_of[face] > 0 ? kept : against) += area_of(mesh, face);
      for (int e = 0; e < 3; ++e) {
        const std::uint32_t other = mesh.neighbour(face, e);
        if (other == no_index || side_of[other] != 0) continue;
        const std::uint32_t from = triangles[face][static_cast<std::size_t>(e)];
        const std::uint32_t to = triangles[face][static_cast<std::size_t>((e + 1) % 3)];
        const bool same_way = triangles[other][(mesh.corner_of(other, from) + 1) % 3] == to;
        side_of[other] = static_cast<std::int8_t>(same_way ? -side_of[face] : side_of[face]);
        part.push_back(other);
      }
    }
    const int wrong = kept >= against ? -1 : 1;
    for (const std::uint32_t face : part) turned[face] = side_of[face] == wrong;
  }
  return turned;
}

}  // namespace

Result<OrientedMesh> oriented(const TriangleMesh& mesh) {
  OrientedMesh out;
  MeshSource source;
  source.positions.assign(mesh.positions().begin(), mesh.positions().end());
  source.triangles.assign(mesh.triangles().begin(), mesh.triangles().end());
  const std::vector<bool> turned = disagreeing(mesh);
  for (std::size_t f = 0; f < turned.size(); ++f) {
    if (!turned[f]) continue;
    std::swap(source.triangles[f][1], source.triangles[f][2]);
    ++out.turned;
  }
  ASPERITY_TRY(TriangleMesh built, TriangleMesh::build(std::move(source)));
  out.mesh = std::make_unique<const TriangleMesh>(std::move(built));
  out.winding = std::make_unique<const WindingNumber>(*out.mesh);
  return out;
}

double told_apart(const OrientedMesh& oriented, std::size_t most) {
  const TriangleMesh& mesh = *oriented.mesh;
  const std::size_t faces = mesh.triangles().size();
  const std::size_t samples = std::min(faces, most);
  const double step = 1e-6 * mesh.bounds().diagonal();
  std::size_t right = 0;
  for (std::size_t s = 0; s < samples; ++s) {
    const auto face = static_cast<std::uint32_t>(s * faces / samples);
    const std::array<Vec3, 3> c = mesh.corners(face);
    const Vec3 middle = (c[0] + c[1] + c[2]) / 3.0;
    const Vec3 off = step * mesh.face_normal(face);
    if (oriented.winding->at(middle + off) < 0.5 && oriented.winding->at(middle - off) > 0.5) ++right;
  }
  return static_cast<double>(right) / static_cast<double>(samples);
}

void sign_by_winding(const OrientedMesh& oriented, const Vec3& origin, double voxel, std::vector<VoxelBlock>& blocks) {
  Signs(*oriented.mesh, oriented.winding.get(), origin, voxel, blocks).by_winding();
}

void settle_flood(const TriangleMesh& mesh, const Vec3& origin, double voxel, std::vector<VoxelBlock>& blocks) {
  std::unique_ptr<const WindingNumber> winding;
  Signs signs(mesh, nullptr, origin, voxel, blocks);
  if (signs.carry_flood() && mesh.report().closed() && mesh.report().oriented()) {
    winding = std::make_unique<const WindingNumber>(mesh);
    signs.ask_for_the_rest(*winding);
  }
  signs.apply();
}

}  // namespace asperity::conversion
