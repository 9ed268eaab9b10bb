#include "asperity/geometry/bvh_search.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "asperity/core/parallel_for.h"

namespace asperity {

namespace {

constexpr std::uint32_t leaf_size = 8;
constexpr int bin_count = 16;
// Up to so many triangles every cut that fills leaves is looked at.
constexpr std::uint32_t counted_one_by_one = 64;
// Below this depth ranges are halved by position whatever the area: it bounds the traversal stack.
constexpr int balanced_depth = 20;
// From so far away (in sizes of the mesh) single precision tells no two triangles apart, and its squares leave their
// range.
constexpr float far_rounding = 1e5F;

struct Primitive : FloatBox {
  std::uint32_t face = no_index;
  [[nodiscard]] float centre(int axis) const { return lower[axis] + upper[axis]; }
};

struct Range {
  std::uint32_t first;
  std::uint32_t last;
  FloatBox box;
  [[nodiscard]] std::uint32_t size() const { return last - first; }
};

}  // namespace

class Bvh::Builder {
 public:
  Builder(const TriangleMesh& mesh, Bvh& bvh) : mesh_(mesh), bvh_(bvh) {}

  void run() {
    const auto count = static_cast<std::uint32_t>(mesh_.triangles().size());
    Range all{0, count, take_primitives(count)};
    Part whole;
    whole.leaves.reserve(count / 7 + 1);
    whole.nodes.reserve(count / 40 + 1);
    // The top by one thread, what is below it by all; how it is shared out does not depend on how many they are.
    constexpr std::uint32_t parts = 32;
    constexpr std::uint32_t least_part = 4096;
    Top top{std::max(count / parts, least_part), {}};
    build_node(whole, all, 0, &top);
    std::vector<Part> built(top.parts.size());
    parallel_for(built.size(), {},
                 [&](std::size_t i) { build_node(built[i], top.parts[i].range, top.parts[i].depth, nullptr); });
    for (std::size_t i = 0; i < built.size(); ++i) {
      whole.nodes[top.parts[i].parent].child[top.parts[i].place] = append(whole, built[i]);
      built[i] = {};
    }
    bvh_.nodes_ = std::move(whole.nodes);
    bvh_.leaves_ = std::move(whole.leaves);
    bvh_.nodes_.shrink_to_fit();
    bvh_.leaves_.shrink_to_fit();
    bvh_.cylinders_.resize(bvh_.leaves_.size());
  }

 private:
  struct Part {
    std::vector<Node> nodes;
    std::vector<Leaf> leaves;
  };
  /// Ranges that are left for later, and where their nodes belong.
  struct Top {
    std::uint32_t most;  ///< triangles of such a range
    struct Left {
      Range range;
      int depth;
      std::uint32_t parent;
      int place;
    };
    std::vector<Left> parts;
  };

  /// Answers the box of all.
  FloatBox take_primitives(std::uint32_t count) {
    primitives_.resize(count);
    constexpr std::uint32_t share = 16384;
    std::vector<FloatBox> boxes((count + share - 1) / share);
    parallel_for(boxes.size(), {}, [&](std::size_t i) {
      const auto first = static_cast<std::uint32_t>(i) * share;
      for (std::uint32_t face = first; face < std::min(first + share, count); ++face) {
        primitives_[face] = primitive(face);
        boxes[i].include(primitives_[face]);
      }
    });
    FloatBox all;
    for (const FloatBox& box : boxes) all.include(box);
    return all;
  }

  /// Answers the index that the part's first node has in the whole.
  static std::uint32_t append(Part& whole, const Part& part) {
    const auto first_node = static_cast<std::uint32_t>(whole.nodes.size());
    const auto first_leaf = static_cast<std::uint32_t>(whole.leaves.size());
    whole.leaves.insert(whole.leaves.end(), part.leaves.begin(), part.leaves.end());
    for (Node node : part.nodes) {
      for (std::uint32_t& child : node.child) {
        if (child != empty_child) child += (child & leaf_bit) != 0 ? first_leaf : first_node;
      }
      whole.nodes.push_back(node);
    }
    return first_node;
  }

  [[nodiscard]] Primitive primitive(std::uint32_t face) const {
    Primitive p{{}, face};
    for (const Vec3& corner : mesh_.corners(face)) {
      float local[3];
      bvh_.to_local(corner, local);
      p.include(local, local);
    }
    return p;
  }

  /// With a `top`, ranges of its size are left to it.
  std::uint32_t build_node(Part& part, const Range& range, int depth, Top* top) {
    Range children[8];
    int count = 1;
    children[0] = range;
    while (count < 8) {
      int widest = -1;
      for (int i = 0; i < count; ++i) {
        if (children[i].size() <= leaf_size) continue;
        if (widest < 0 || children[i].box.area() > children[widest].box.area()) widest = i;
      }
      if (widest < 0) break;
      split(children[widest], depth, children[widest], children[count]);
      ++count;
    }
    const auto index = static_cast<std::uint32_t>(part.nodes.size());
    part.nodes.emplace_back();
    for (std::uint32_t& child : part.nodes[index].child) child = empty_child;
    for (int i = 0; i < count; ++i) {
      const std::uint32_t size = children[i].size();
      if (top != nullptr && size > leaf_size && size <= top->most) {
        top->parts.push_back({children[i], depth + 1, index, i});
        continue;
      }
      const std::uint32_t child =
          size <= leaf_size ? build_leaf(part, children[i]) : build_node(part, children[i], depth + 1, top);
      part.nodes[index].child[i] = child;
    }
    return index;
  }

  std::uint32_t build_leaf(Part& part, const Range& range) {
    Leaf& leaf = part.leaves.emplace_back();
    for (std::uint32_t i = 0; i < 8; ++i)
      leaf.face[i] = i < range.size() ? primitives_[range.first + i].face : no_index;
    return static_cast<std::uint32_t>(part.leaves.size() - 1) | leaf_bit;
  }

  /// Splits `range` in two by the cheapest of bin_count - 1 planes along the widest axis of the centres.
  void split(Range range, int depth, Range& left, Range& right) {
    FloatBox centres;
    for (std::uint32_t i = range.first; i < range.last; ++i) {
      const float centre[3] = {primitives_[i].centre(0), primitives_[i].centre(1), primitives_[i].centre(2)};
      centres.include(centre, centre);
    }
    const auto& [low, high] = centres;
    int axis = 0;
    for (int other = 1; other < 3; ++other) {
      if (high[other] - low[other] > high[axis] - low[axis]) axis = other;
    }
    std::uint32_t middle = range.first;
    if (depth < balanced_depth && high[axis] - low[axis] > 1e-12F) {
      middle = range.size() <= counted_one_by_one ? cut_by_leaves(range, axis)
                                                  : partition_by_area(range, axis, low[axis], high[axis]);
    }
    if (middle == range.first || middle == range.last) middle = halve(range, axis);
    left = bounded(range.first, middle);
    right = bounded(middle, range.last);
  }

  [[nodiscard]] static float leaves_for(std::uint32_t triangles) {
    return static_cast<float>((triangles + leaf_size - 1) / leaf_size);
  }

  std::uint32_t partition_by_area(const Range& range, int axis, float low, float high) {
    const float to_bin = static_cast<float>(bin_count) * 0.9999F / (high - low);
    const auto bin_of = [&](const Primitive& p) { return static_cast<int>((p.centre(axis) - low) * to_bin); };
    FloatBox boxes[bin_count];
    std::uint32_t counts[bin_count] = {};
    for (std::uint32_t i = range.first; i < range.last; ++i) {
      const int bin = bin_of(primitives_[i]);
      boxes[bin].include(primitives_[i]);
      ++counts[bin];
    }
    float right_cost[bin_count] = {};
    FloatBox sweep;
    std::uint32_t sum = 0;
    for (int bin = bin_count - 1; bin > 0; --bin) {
      sweep.include(boxes[bin]);
      sum += counts[bin];
      right_cost[bin] = sweep.area() * leaves_for(sum);
    }
    sweep = {};
    sum = 0;
    int best = -1;
    float best_cost = 1e30F;
    for (int bin = 0; bin + 1 < bin_count; ++bin) {
      sweep.include(boxes[bin]);
      sum += counts[bin];
      const float cost = sweep.area() * leaves_for(sum) + right_cost[bin + 1];
      if (sum != 0 && sum != range.size() && cost < best_cost) {
        best_cost = cost;
        best = bin;
      }
    }
    if (best < 0) return range.first;
    const auto first = primitives_.begin() + range.first;
    const auto last = primitives_.begin() + range.last;
    const auto middle = std::partition(first, last, [&](const Primitive& p) { return bin_of(p) <= best; });
    return static_cast<std::uint32_t>(middle - primitives_.begin());
  }

  /// Cuts a small range where both sides fill leaves: what a query looks at are leaves, full or not.
  std::uint32_t cut_by_leaves(const Range& range, int axis) {
    const auto begin = primitives_.begin() + range.first;
    std::sort(begin, primitives_.begin() + range.last, [axis](const Primitive& a, const Primitive& b) {
      const float at_a = a.centre(axis);
      const float at_b = b.centre(axis);
      return at_a < at_b || (at_a == at_b && a.face < b.face);
    });
    constexpr std::uint32_t most_cuts = counted_one_by_one / leaf_size;
    float right_cost[most_cuts + 1] = {};
    FloatBox sweep;
    for (std::uint32_t i = range.size(); i-- > leaf_size;) {
      sweep.include(begin[i]);
      if (i % leaf_size == 0) right_cost[i / leaf_size] = sweep.area() * leaves_for(range.size() - i);
    }
    sweep = {};
    std::uint32_t best = 0;
    float best_cost = 1e30F;
    for (std::uint32_t i = 0; i + 1 < range.size(); ++i) {
      sweep.include(begin[i]);
      if ((i + 1) % leaf_size != 0) continue;
      const std::uint32_t cut = (i + 1) / leaf_size;
      const float cost = sweep.area() * static_cast<float>(cut) + right_cost[cut];
      if (cost < best_cost) {
        best_cost = cost;
        best = i + 1;
      }
    }
    return range.first + best;
  }

  std::uint32_t halve(const Range& range, int axis) {
    const std::uint32_t middle = range.first + range.size() / 2;
    const auto begin = primitives_.begin();
    std::nth_element(begin + range.first, begin + middle, begin + range.last,
                     [axis](const Primitive& a, const Primitive& b) { return a.centre(axis) < b.centre(axis); });
    return middle;
  }

  [[nodiscard]] Range bounded(std::uint32_t first, std::uint32_t last) const {
    Range range{first, last, {}};
    for (std::uint32_t i = first; i < last; ++i) range.box.include(primitives_[i]);
    return range;
  }

  const TriangleMesh& mesh_;
  Bvh& bvh_;
  std::vector<Primitive> primitives_;
};

Bvh Bvh::build(const TriangleMesh& mesh, const BvhSettings& settings) {
  Bvh bvh;
  bvh.kernels_ = settings.plain_kernels ? &plain_kernels() : &best_kernels();
  bvh.frame(mesh);
  Builder(mesh, bvh).run();
  BvhFitting fitting = bvh.fitting();
  bvh.refit(mesh, fitting);
  return bvh;
}

void Bvh::frame(const TriangleMesh& mesh) noexcept {
  mesh_ = &mesh;
  origin_ = mesh.bounds().centre();
  scale_ = std::max(0.5 * mesh.bounds().diagonal(), std::numeric_limits<double>::min());
  per_scale_ = 1.0 / scale_;
}

ClosestHit Bvh::closest_from_afar(const Vec3& p, double bound) const noexcept {
  ClosestHit best;
  for (std::uint32_t face = 0; face < mesh_->triangles().size(); ++face) {
    const auto [a, b, c] = mesh_->corners(face);
    const ClosestHit hit{face, closest_point_on_triangle(p, a, b, c)};
    if (hit.point.squared_distance <= bound * bound && hit.before(best)) best = hit;
  }
  return best;
}

ClosestHit Bvh::closest(const Vec3& p, double bound) const noexcept {
  ClosestHit best;
  if (nodes_.empty() || !(bound >= 0.0)) return best;
  float local[3];
  to_local(p, local);
  const float error = rounding(local);
  if (!(error < far_rounding)) return closest_from_afar(p, bound);
  // Clamped, so that its square stays a float: no distance from here comes near.
  float limit = std::min(static_cast<float>(std::min(bound * per_scale_, 1e15)) * 1.000001F + error, 1e15F);
  Entry stack[stack_capacity];
  int top = 0;
  stack[top++] = {0.0F, 0};
  while (top > 0) {
    const Entry entry = stack[--top];
    if (entry.key > limit * limit) continue;
    if ((entry.child & leaf_bit) != 0) {
      const Leaf& leaf = leaves_[entry.child & ~leaf_bit];
      DistancesOf8 found;
      kernels_->triangles(leaf.triangles, local, found);
      for (int i = 0; i < 8; ++i) {
        if (found.distance[i] > limit || leaf.face[i] == no_index) continue;
        const auto corners = mesh_->corners(leaf.face[i]);
        const ClosestHit hit{leaf.face[i], closest_point_on_triangle(p, corners[0], corners[1], corners[2])};
        if (hit.point.squared_distance > bound * bound || !hit.before(best)) continue;
        best = hit;
        limit = static_cast<float>(std::sqrt(hit.point.squared_distance) * per_scale_) * 1.000001F + error;
      }
      continue;
    }
    const Node& node = nodes_[entry.child];
    float squared[8];
    unsigned mask = kernels_->boxes(node.boxes, local, limit * limit, squared);
    const int first = top;
    for (; mask != 0; mask &= mask - 1) {
      const auto i = static_cast<unsigned>(__builtin_ctz(mask));
      if (node.child[i] == empty_child) continue;
      int slot = top++;
      for (; slot > first && stack[slot - 1].key < squared[i]; --slot) stack[slot] = stack[slot - 1];
      stack[slot] = {squared[i], node.child[i]};
    }
  }
  return best;
}

FirstHit Bvh::first_hit(const Segment& segment) const noexcept {
  FirstHit first;
  for_each_along(segment, 0.0, [&](std::uint32_t face) {
    const auto corners = mesh_->corners(face);
    double t = 0.0;
    if (segment_triangle_intersection(segment, corners[0], corners[1], corners[2], t) &&
        (t < first.t || first.face == no_index)) {
      first = {face, t};
    }
    return first.face == no_index ? 1.0 : first.t;
  });
  return first;
}

namespace {

/// The nearest leaves found so far, with the distance beyond which the list is no longer complete.
class NearestLeaves {
 public:
  struct Entry {
    float squared;
    std::uint32_t leaf;
    bool operator<(const Entry& other) const noexcept { return squared < other.squared; }
  };

  explicit NearestLeaves(float limit) noexcept : limit_(limit) {}
  [[nodiscard]] float limit() const noexcept { return limit_; }
  [[nodiscard]] std::uint32_t count() const noexcept { return count_; }
  const Entry& operator[](std::uint32_t i) const noexcept { return entries_[i]; }

  void offer(const Entry& entry) noexcept {
    if (count_ == room) shrink();
    if (entry.squared <= limit_ * limit_) entries_[count_++] = entry;
  }
  void finish() noexcept {
    shrink();
    std::sort(entries_, entries_ + count_);
  }

 private:
  // Room above the patch's capacity, so that the farthest are dropped in bulk, not one by one.
  static constexpr std::uint32_t room = 96;
  static constexpr std::uint32_t keep = TrianglePatch::capacity;

  void shrink() noexcept {
    if (count_ <= keep) return;
    std::nth_element(entries_, entries_ + keep, entries_ + count_);
    limit_ = std::min(limit_, std::sqrt(entries_[keep].squared));
    count_ = keep;
  }

  float limit_;
  std::uint32_t count_ = 0;
  Entry entries_[room];
};

}  // namespace

void Bvh::gather(const Vec3& centre, double reach, std::uint64_t owner, TrianglePatch& patch) const noexcept {
  float local[3];
  to_local(centre, local);
  const float error = rounding(local);
  NearestLeaves nearest(static_cast<float>(reach * per_scale_) + error);
  Entry stack[stack_capacity];
  int top = 0;
  if (!nodes_.empty()) stack[top++] = {0.0F, 0};
  while (top > 0) {
    const Entry entry = stack[--top];
    if (entry.key > nearest.limit() * nearest.limit()) continue;
    const Node& node = nodes_[entry.child];
    float squared[8];
    unsigned mask = kernels_->boxes(node.boxes, local, nearest.limit() * nearest.limit(), squared);
    const int first = top;
    for (; mask != 0; mask &= mask - 1) {
      const auto i = static_cast<unsigned>(__builtin_ctz(mask));
      if (node.child[i] == empty_child) continue;
      if ((node.child[i] & leaf_bit) != 0) {
        nearest.offer({squared[i], node.child[i] & ~leaf_bit});
        continue;
      }
      int slot = top++;
      for (; slot > first && stack[slot - 1].key < squared[i]; --slot) stack[slot] = stack[slot - 1];
      stack[slot] = {squared[i], node.child[i]};
    }
  }
  nearest.finish();

  patch.owner = owner;
  patch.centre = centre;
  patch.certified = (static_cast<double>(nearest.limit()) - static_cast<double>(error)) * scale_;
  patch.count = nearest.count();
  for (std::uint32_t i = 0; i < (patch.count + 7) / 8 * 8; ++i) {
    const bool used = i < patch.count;
    const NearestLeaves::Entry& entry = nearest[used ? i : 0];
    if (i % 8 == 0) patch.nearest[i / 8] = std::max(0.0F, std::sqrt(entry.squared) - error);
    patch.leaf[i] = used ? entry.leaf : 0;
    const Cylinder& from = cylinders_[patch.leaf[i]];
    CylindersOf8& to = patch.bounds[i / 8];
    const std::uint32_t lane = i % 8;
    for (int axis = 0; axis < 3; ++axis) {
      to.centre[axis][lane] = used ? from.centre[axis] : 1e9F;
      to.axis[axis][lane] = from.axis[axis];
    }
    to.radius[lane] = from.radius;
    to.half_height[lane] = from.half_height;
  }
}

}  // namespace asperity
