#include "asperity/geometry/bvh_search.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

#include "asperity/core/parallel_for.h"

namespace asperity {

namespace {

constexpr std::uint32_t leaf_size = 8;
constexpr int bin_count = 16;
// Up to so many triangles every cut that fills leaves is looked at; so many fill a node of leaves.
constexpr std::uint32_t node_of_leaves = 64;
// Ranges of up to so many are cut into full nodes of leaves.
constexpr std::uint32_t cut_by_nodes = 512;
// Below this depth ranges are halved by position whatever the area: it bounds the traversal stack.
constexpr int balanced_depth = 20;
// From so far away (in sizes of the mesh) single precision tells no two triangles apart, and its squares leave their
// range.
constexpr float far_rounding = 1e5F;

// Three coordinates and a lane that no box reads.
using FourFloats = float __attribute__((vector_size(16)));

/// A FloatBox whose coordinates are compared side by side.
struct WideBox {
  FourFloats lower = {1e30F, 1e30F, 1e30F, 1e30F};
  FourFloats upper = {-1e30F, -1e30F, -1e30F, -1e30F};

  void include(const FourFloats& low, const FourFloats& high) noexcept {
    lower = low < lower ? low : lower;
    upper = high > upper ? high : upper;
  }
  void include(const WideBox& other) noexcept { include(other.lower, other.upper); }
  [[nodiscard]] float area() const noexcept {
    return FloatBox{{lower[0], lower[1], lower[2]}, {upper[0], upper[1], upper[2]}}.area();
  }
  [[nodiscard]] int widest_axis() const noexcept {
    const FourFloats extent = upper - lower;
    int axis = 0;
    for (int other = 1; other < 3; ++other) {
      if (extent[other] > extent[axis]) axis = other;
    }
    return axis;
  }
};

/// A triangle's box; in the lanes that no box reads its number.
struct Primitive {
  FourFloats lower;
  FourFloats upper;

  Primitive() noexcept = default;
  Primitive(const FloatBox& box, std::uint32_t face) noexcept
      : lower{box.lower[0], box.lower[1], box.lower[2], std::bit_cast<float>(face + least_normal)},
        upper{box.upper[0], box.upper[1], box.upper[2], 0.0F} {}
  [[nodiscard]] std::uint32_t face() const noexcept { return std::bit_cast<std::uint32_t>(lower[3]) - least_normal; }
  [[nodiscard]] float centre(int axis) const noexcept { return lower[axis] + upper[axis]; }

 private:
  // Numbers below it would be denormal floats, with which some processors take their time.
  static constexpr std::uint32_t least_normal = 0x00800000U;
};

struct Range {
  std::uint32_t first;
  std::uint32_t last;
  WideBox box;
  WideBox centres;  ///< twice them
  [[nodiscard]] std::uint32_t size() const { return last - first; }
};

/// What lies between planes across an axis.
struct Bins {
  WideBox box[bin_count];
  WideBox centres[bin_count];
  std::uint32_t count[bin_count] = {};
};

}  // namespace

class Bvh::Builder {
 public:
  Builder(const TriangleMesh& mesh, Bvh& bvh) : mesh_(mesh), bvh_(bvh) {}

  void run() {
    const auto count = static_cast<std::uint32_t>(mesh_.triangles().size());
    const Range all = take_primitives(count);
    Part whole;
    // The top by one thread, what is below it by all; how it is shared out does not depend on how many they are.
    constexpr std::uint32_t parts = 32;
    constexpr std::uint32_t least_part = 4096;
    Top top{std::max(count / parts, least_part), {}};
    build_node(whole, all, 0, &top);
    std::vector<Part> built(top.parts.size());
    parallel_for(built.size(), {},
                 [&](std::size_t i) { build_node(built[i], top.parts[i].range, top.parts[i].depth, nullptr); });
    join(whole, top, built);
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

  Range take_primitives(std::uint32_t count) {
    primitives_.resize(count);
    std::vector<Range> ranges((count + share - 1) / share);
    parallel_for(ranges.size(), {}, [&](std::size_t i) {
      const auto first = static_cast<std::uint32_t>(i) * share;
      const std::uint32_t last = std::min(first + share, count);
      for (std::uint32_t face = first; face < last; ++face) {
        FloatBox box;
        for (const Vec3& corner : mesh_.corners(face)) {
          float local[3];
          bvh_.to_local(corner, local);
          box.include(local, local);
        }
        primitives_[face] = Primitive(box, face);
      }
      ranges[i] = bounded(first, last);
    });
    Range all{0, count, {}, {}};
    for (const Range& range : ranges) {
      all.box.include(range.box);
      all.centres.include(range.centres);
    }
    return all;
  }

  /// The parts behind the whole, one after the other.
  void join(Part& whole, const Top& top, std::vector<Part>& built) {
    std::size_t nodes = whole.nodes.size();
    std::size_t leaves = whole.leaves.size();
    struct At {
      std::uint32_t node;
      std::uint32_t leaf;
    };
    std::vector<At> at;
    for (std::size_t i = 0; i < built.size(); ++i) {
      at.push_back({static_cast<std::uint32_t>(nodes), static_cast<std::uint32_t>(leaves)});
      whole.nodes[top.parts[i].parent].child[top.parts[i].place] = at[i].node;
      nodes += built[i].nodes.size();
      leaves += built[i].leaves.size();
    }
    bvh_.nodes_.resize(nodes);
    bvh_.leaves_.resize(leaves);
    bvh_.cylinders_.resize(leaves);
    std::copy(whole.nodes.begin(), whole.nodes.end(), bvh_.nodes_.begin());
    std::copy(whole.leaves.begin(), whole.leaves.end(), bvh_.leaves_.begin());
    parallel_for(built.size(), {}, [&](std::size_t i) {
      const Part part = std::move(built[i]);
      std::copy(part.leaves.begin(), part.leaves.end(), bvh_.leaves_.begin() + at[i].leaf);
      const std::span<Node> moved(bvh_.nodes_.data() + at[i].node, part.nodes.size());
      std::copy(part.nodes.begin(), part.nodes.end(), moved.begin());
      for (Node& node : moved) {
        for (std::uint32_t& child : node.child) {
          if (child != empty_child) child += (child & leaf_bit) != 0 ? at[i].leaf : at[i].node;
        }
      }
    });
  }

  /// With a `top`, ranges of its size are left to it.
  std::uint32_t build_node(Part& part, const Range& range, int depth, Top* top) {
    Range children[8];
    int count = 1;
    children[0] = range;
    // What fills a node of leaves is left whole for one.
    const std::uint32_t whole = range.size() > node_of_leaves ? node_of_leaves : leaf_size;
    while (count < 8) {
      int widest = -1;
      for (int i = 0; i < count; ++i) {
        if (children[i].size() <= whole) continue;
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
      leaf.face[i] = i < range.size() ? primitives_[range.first + i].face() : no_index;
    return static_cast<std::uint32_t>(part.leaves.size() - 1) | leaf_bit;
  }

  /// Splits `range` in two by the cheapest of bin_count - 1 planes along the widest axis of the centres.
  void split(Range range, int depth, Range& left, Range& right) {
    const int axis = range.centres.widest_axis();
    std::uint32_t middle = range.first;
    if (depth < balanced_depth && range.centres.upper[axis] - range.centres.lower[axis] > 1e-12F) {
      if (range.size() > cut_by_nodes && partition_by_area(range, axis, left, right)) return;
      middle = range.size() <= node_of_leaves ? cut_by_leaves(range, axis) : cut_near_planes(range, axis);
    }
    if (middle == range.first || middle == range.last) middle = halve(range, axis);
    left = bounded(range.first, middle);
    right = bounded(middle, range.last);
  }

  [[nodiscard]] static float leaves_for(std::uint32_t triangles) {
    return static_cast<float>((triangles + leaf_size - 1) / leaf_size);
  }

  struct ToBin {
    int axis;
    float low;
    float scale;
    ToBin(const Range& range, int axis_)
        : axis(axis_),
          low(range.centres.lower[axis]),
          scale(static_cast<float>(bin_count) * 0.9999F / (range.centres.upper[axis] - low)) {}
    [[nodiscard]] int operator()(const Primitive& p) const { return static_cast<int>((p.centre(axis) - low) * scale); }
  };

  void bin(std::uint32_t first, std::uint32_t last, const ToBin& to_bin, Bins& bins) const {
    for (std::uint32_t i = first; i < last; ++i) {
      const Primitive& p = primitives_[i];
      const int to = to_bin(p);
      const FourFloats centre = p.lower + p.upper;
      bins.box[to].include(p.lower, p.upper);
      bins.centres[to].include(centre, centre);
      ++bins.count[to];
    }
  }

  [[nodiscard]] Bins binned(const Range& range, const ToBin& to_bin) const {
    Bins all;
    if (range.size() <= share) {
      bin(range.first, range.last, to_bin, all);
      return all;
    }
    std::vector<Bins> parts((range.size() + share - 1) / share);
    parallel_for(parts.size(), {}, [&](std::size_t i) {
      const std::uint32_t first = range.first + static_cast<std::uint32_t>(i) * share;
      bin(first, std::min(first + share, range.last), to_bin, parts[i]);
    });
    for (const Bins& part : parts) {
      for (int k = 0; k < bin_count; ++k) {
        all.box[k].include(part.box[k]);
        all.centres[k].include(part.centres[k]);
        all.count[k] += part.count[k];
      }
    }
    return all;
  }

  /// The last bin on the lower side of the cheapest plane; none: below 0.
  static int cheapest_cut(const Bins& bins, std::uint32_t size) {
    float right_cost[bin_count] = {};
    WideBox sweep;
    std::uint32_t sum = 0;
    for (int k = bin_count - 1; k > 0; --k) {
      sweep.include(bins.box[k]);
      sum += bins.count[k];
      right_cost[k] = sweep.area() * leaves_for(sum);
    }
    sweep = {};
    sum = 0;
    int best = -1;
    float best_cost = 1e30F;
    for (int k = 0; k + 1 < bin_count; ++k) {
      sweep.include(bins.box[k]);
      sum += bins.count[k];
      const float cost = sweep.area() * leaves_for(sum) + right_cost[k + 1];
      if (sum != 0 && sum != size && cost < best_cost) {
        best_cost = cost;
        best = k;
      }
    }
    return best;
  }

  bool partition_by_area(const Range& range, int axis, Range& left, Range& right) {
    const ToBin to_bin(range, axis);
    const Bins bins = binned(range, to_bin);
    const int best = cheapest_cut(bins, range.size());
    if (best < 0) return false;
    const auto begin = primitives_.begin();
    const auto middle = static_cast<std::uint32_t>(
        std::partition(begin + range.first, begin + range.last, [&](const Primitive& p) { return to_bin(p) <= best; }) -
        begin);
    left = {range.first, middle, {}, {}};
    right = {middle, range.last, {}, {}};
    for (int k = 0; k < bin_count; ++k) {
      Range& side = k <= best ? left : right;
      side.box.include(bins.box[k]);
      side.centres.include(bins.centres[k]);
    }
    return true;
  }

  /// Cuts near the cheapest plane, where what is on its lower side fills nodes of leaves.
  std::uint32_t cut_near_planes(const Range& range, int axis) {
    const Bins bins = binned(range, ToBin(range, axis));
    const int best = cheapest_cut(bins, range.size());
    if (best < 0) return range.first;
    const std::uint32_t below = std::accumulate(bins.count, bins.count + best + 1, 0U);
    const std::uint32_t nodes = (below + node_of_leaves / 2) / node_of_leaves;
    return cut_at(range, axis,
                  range.first + node_of_leaves * std::clamp(nodes, 1U, (range.size() - 1) / node_of_leaves));
  }

  /// Cuts a small range where both sides fill leaves: what a query looks at are leaves, full or not.
  std::uint32_t cut_by_leaves(const Range& range, int axis) {
    const auto begin = primitives_.begin() + range.first;
    sort(&*begin, range.size(), axis);
    constexpr std::uint32_t most_cuts = node_of_leaves / leaf_size;
    float right_cost[most_cuts + 1] = {};
    WideBox sweep;
    for (std::uint32_t i = range.size(); i-- > leaf_size;) {
      sweep.include(begin[i].lower, begin[i].upper);
      if (i % leaf_size == 0) right_cost[i / leaf_size] = sweep.area() * leaves_for(range.size() - i);
    }
    sweep = {};
    std::uint32_t best = 0;
    float best_cost = 1e30F;
    for (std::uint32_t i = 0; i + 1 < range.size(); ++i) {
      sweep.include(begin[i].lower, begin[i].upper);
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

  /// By their centres; where those are one they stay in order.
  static void sort(Primitive* first, std::uint32_t count, int axis) {
    // Each centre as a number in the same order, its place behind it.
    std::uint64_t keys[node_of_leaves];
    Primitive before[node_of_leaves];
    std::copy(first, first + count, before);
    for (std::uint32_t i = 0; i < count; ++i) {
      const auto bits = std::bit_cast<std::uint32_t>(first[i].centre(axis));
      const std::uint32_t ordered = bits ^ ((bits >> 31U) != 0 ? 0xffffffffU : 0x80000000U);
      keys[i] = std::uint64_t{ordered} << 32U | i;
    }
    std::sort(keys, keys + count);
    for (std::uint32_t i = 0; i < count; ++i) first[i] = before[keys[i] & 0xffffffffU];
  }

  std::uint32_t halve(const Range& range, int axis) { return cut_at(range, axis, range.first + range.size() / 2); }

  std::uint32_t cut_at(const Range& range, int axis, std::uint32_t middle) {
    const auto begin = primitives_.begin();
    std::nth_element(begin + range.first, begin + middle, begin + range.last,
                     [axis](const Primitive& a, const Primitive& b) { return a.centre(axis) < b.centre(axis); });
    return middle;
  }

  [[nodiscard]] Range bounded(std::uint32_t first, std::uint32_t last) const {
    Range range{first, last, {}, {}};
    for (std::uint32_t i = first; i < last; ++i) {
      const FourFloats centre = primitives_[i].lower + primitives_[i].upper;
      range.box.include(primitives_[i].lower, primitives_[i].upper);
      range.centres.include(centre, centre);
    }
    return range;
  }

  // Primitives that a thread takes at a time.
  static constexpr std::uint32_t share = 16384;

  const TriangleMesh& mesh_;
  Bvh& bvh_;
  UnsetVector<Primitive> primitives_;
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
    FirstHit hit{face};
    if (segment_triangle_intersection(segment, corners[0], corners[1], corners[2], hit.t) && hit.before(first))
      first = hit;
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
