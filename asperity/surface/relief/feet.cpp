// All places of a displaced surface that a ball may rest on: local minima of the distance from its centre, found among
// samples on a lattice over each face and led to their ends.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "asperity/surface/detail/four.h"
#include "asperity/surface/relief/blocks.h"
#include "asperity/surface/relief/detail/bounds.h"
#include "asperity/surface/relief/detail/search.h"

namespace asperity {

namespace {

/// Samples of a face's lattice, at most half a texel apart: [from, to) in both directions.
struct Range {
  int from_u = 0;
  int to_u = 0;
  int from_v = 0;
  int to_v = 0;
};

/// Of a descent to a foot, before it is seen where it leads.
constexpr int few_moves = 5;
Goal goal_of_feet(const Vec3& p) noexcept {
  // A ball may lie on a surface that is bent nearly as it is.
  constexpr double flattest = 1e-4;
  return {.point = p, .may_leave = false, .exactly = true, .moves = few_moves, .flattest = flattest};
}

class ReliefFeetSearch {
 public:
  ReliefFeetSearch(const ReliefSurface& surface, const Vec3& p, const FeetAsked& asked, const CoatMoment& moment,
                   ReliefBlocks* blocks, ContactSet& out) noexcept
      : surface_(surface), p_(p), asked_(asked), reach_(asked.reach), moment_(moment), blocks_(blocks), out_(out) {}

  /// How far what is looked for may be (m): less once as many as that are known.
  [[nodiscard]] double reach() const noexcept { return reach_; }

  [[nodiscard]] const WorkCount& count() const noexcept { return count_; }

  void visit(std::uint32_t face) noexcept {
    ++count_.frames;
    ReliefFrame& frame = blocks_ != nullptr ? blocks_->frame(face) : frame_;
    if (blocks_ == nullptr || !surface_.holds(frame, face, moment_)) frame = surface_.frame(face, moment_);
    const double samples = std::min(texels_across(frame) / leaf_of_texel, std::ldexp(1.0, deepest_part));
    last_ = std::max(1 << (frame.stitched ? least_level_stitched : least_level), static_cast<int>(std::ceil(samples)));
    step_ = 1.0 / last_;
    narrowest_ = frame.stitched ? narrowest(frame.band) : 1.0;
    const Vec3& edge_u = frame.prism.edge_u;
    const Vec3& edge_v = frame.prism.edge_v;
    least_drop_ =
        2.0 * step_ * step_ * std::max({edge_u.squaredNorm(), edge_v.squaredNorm(), (edge_u - edge_v).squaredNorm()});
    const Range range = within_reach(frame.prism);
    const int width = std::max(range.to_u - range.from_u, range.to_v - range.from_v);
    if (range.to_u <= range.from_u || range.to_v <= range.from_v) return;
    std::uint32_t level = 0;
    while (BlockSamples::across << level < width) ++level;
    const int side = BlockSamples::across << level;
    for (int i = range.from_u / side; i * side < range.to_u; ++i) {
      for (int j = range.from_v / side; j * side < range.to_v; ++j)
        search({face, static_cast<std::uint16_t>(i), static_cast<std::uint16_t>(j), level}, frame, range);
    }
  }

 private:
  static constexpr int stride = BlockSamples::stride;
  /// Of a descent in all.
  static constexpr int most_moves = 1024;
  /// Of a step of the lattice: places nearer to each other are told once.
  static constexpr double same_place = 0.25;
  /// Squared, in twice the squared length of the longest of the lattice's steps.
  static constexpr double far_off = 4.5;
  /// Of the lattice, that a band between two faces is wide at least where samples show what stands in it.
  static constexpr double few_steps = 4.0;
  /// How far the surface between two samples may be off the line from one to the other, of its length.
  static constexpr double of_chord = 0.25;
  /// The least of the samples around a place that is looked for may be so many of them off it, in thin triangles.
  static constexpr int beside = 2;

  [[nodiscard]] Range within_reach(const ShellPrism& prism) const noexcept {
    Vec2 middle;
    Vec2 reach;
    if (!places_within(prism, p_, reach_, middle, reach)) return {0, last_ + 1, 0, last_ + 1};
    const auto sample = [&](double at) { return static_cast<int>(std::clamp(at / step_, -1.0, last_ + 1.0)); };
    const auto from = [&](double at) { return std::max(0, sample(at) - beside); };
    const auto to = [&](double at) { return std::min(last_ + 1, sample(at) + beside + 2); };
    return {from(middle.x() - reach.x()), to(middle.x() + reach.x()), from(middle.y() - reach.y()),
            to(middle.y() + reach.y())};
  }

  /// A part of the lattice and how far it is at least (m).
  struct Part {
    ReliefBlockName name;
    double away = 0.0;
  };

  /// A part of the lattice and those it is made of, as far as they may come within reach; the nearest first.
  void search(const ReliefBlockName& whole, const ReliefFrame& frame, const Range& range) noexcept {
    FixedVector<Part, 3 * deepest_part + 4> parts;
    add(whole, frame, range, parts);
    while (!parts.empty()) {
      const Part part = parts[parts.size() - 1];
      parts.swap_remove(parts.size() - 1);
      if (part.away > reach_) continue;
      const ReliefBlockName& name = part.name;
      if (name.level == 0) {
        look_at(frame, block_of(name, frame));
        continue;
      }
      const std::size_t first = parts.size();
      for (int child = 0; child < 4; ++child) {
        add({name.face, static_cast<std::uint16_t>(2 * name.i + (child & 1)),
             static_cast<std::uint16_t>(2 * name.j + (child >> 1)), name.level - 1},
            frame, range, parts);
      }
      std::sort(parts.begin() + static_cast<std::ptrdiff_t>(first), parts.end(),
                [](const Part& a, const Part& b) { return a.away > b.away; });
    }
  }

  /// A part to look at, if it may come within reach.
  void add(const ReliefBlockName& name, const ReliefFrame& frame, const Range& range,
           FixedVector<Part, 3 * deepest_part + 4>& parts) noexcept {
    const int side = BlockSamples::across << name.level;
    const int u = name.i * side;
    const int v = name.j * side;
    const bool beyond_third_side = u + v > last_;
    if (beyond_third_side || u >= range.to_u || u + side <= range.from_u || v >= range.to_v || v + side <= range.from_v)
      return;
    count_.bounds += bounds_of_block;
    const ReliefBlocks::Block& block = block_of(name, frame);
    if (within_reach(block)) parts.push_back({name, block.disk.away(p_)});
  }

  ReliefBlocks::Block& block_of(const ReliefBlockName& name, const ReliefFrame& frame) noexcept {
    bool known = blocks_ == nullptr && block_.name == name;
    ReliefBlocks::Block& block = blocks_ != nullptr ? blocks_->block(name, known) : block_;
    if (known) return block;
    block.name = name;
    block.apart = 0.0F;
    const int side = BlockSamples::across << name.level;
    block.disk = disk_around(frame, name.i * side, name.j * side, side);
    return block;
  }

  /// Around the relief over a part of the lattice and over what is right beside it.
  [[nodiscard]] ReliefDisk disk_around(const ReliefFrame& frame, int from_u, int from_v, int side) const noexcept {
    const double room = beside * step_;
    const Vec2 lower(from_u * step_ - room, from_v * step_ - room);
    const Vec2 upper((std::min(from_u + side, last_ + 1) - 1) * step_ + room,
                     (std::min(from_v + side, last_ + 1) - 1) * step_ + room);
    const FacePart part{
        {0.5 * (lower + upper), Vec2::Zero(), Vec2::Zero()}, 1, 0.5 * (lower + upper), 0.5 * (upper - lower)};
    const HeightForm form = surface_.form(frame, part);
    const auto half = [&](const Vec2& a, const Vec2& b, const Vec2& c) {
      const FacePart triangle = FacePart::triangle(a, b, c);
      const Vec2 off = triangle.middle - part.middle;
      HeightForm moved = form;
      moved.height += off.x() * form.u + off.y() * form.v;
      return bound_over(frame.prism, moved, triangle);
    };
    const Vec2 beside_u(upper.x(), lower.y());
    const Vec2 beside_v(lower.x(), upper.y());
    const ReliefBound halves[2] = {half(lower, beside_u, beside_v), half(upper, beside_v, beside_u)};
    const Vec3 middle = 0.5 * (halves[0].corner[0] + halves[1].corner[0]);
    const Vec3 normal =
        (halves[1].corner[0] - halves[0].corner[0]).cross(halves[0].corner[2] - halves[0].corner[1]).normalized();
    ReliefDisk disk;
    for (int a = 0; a < 3; ++a) {
      disk.middle[a] = middle[a];
      disk.normal[a] = static_cast<float>(normal[a]);
    }
    double radius = 0.0;
    double thick = 0.0;
    for (const ReliefBound& bound : halves) {
      for (const Vec3& corner : bound.corner) {
        radius = std::max(radius, (corner - middle).norm() + bound.error);
        thick = std::max(thick, std::abs(normal.dot(corner - middle)) + bound.error);
      }
    }
    // Rounded up, and for the normal's own rounding.
    disk.radius = static_cast<float>(radius * (1.0 + 1e-6));
    disk.half = static_cast<float>(thick + 1e-6 * radius);
    return disk;
  }

  /// Descends from every sample that is no farther than those around it and may lie beside a place within reach.
  void look_at(const ReliefFrame& frame, ReliefBlocks::Block& block) noexcept {
    bool known = false;
    BlockSamples& samples = blocks_ != nullptr ? blocks_->samples(block, known) : samples_;
    const Vec3 middle(block.disk.middle[0], block.disk.middle[1], block.disk.middle[2]);
    const int from_u = block.name.i * BlockSamples::across;
    const int from_v = block.name.j * BlockSamples::across;
    if (!known) {
      sample(frame, from_u, from_v, middle, samples);
      tighten(samples, block);
    }
    const Eigen::Vector3f off = (p_ - middle).cast<float>();
    float squares[BlockSamples::count];
    squares_from(samples, off, squares);
    // Of three samples side by side along v, the least.
    Four of_row[stride][2];
    for (int i = 0; i < stride; ++i) {
      for (int half = 0; half < 2; ++half) {
        const float* const row = &squares[i * stride + 4 * half];
        of_row[i][half] = least(least(four_at(row), four_at(row + 1)), four_at(row + 2));
      }
    }
    Four nearest = of_row[1][0];
    for (int i = 0; i < BlockSamples::across; ++i) {
      for (int half = 0; half < 2; ++half) {
        const float* const row = &squares[(i + 1) * stride + 4 * half + 1];
        const Four around = least(least(of_row[i][half], of_row[i + 1][half]), of_row[i + 2][half]);
        nearest = least(nearest, four_at(row));
        const auto none_less = four_at(row) <= around;
        for (int j = 0; any(none_less) && j < 4; ++j) {
          if (none_less[j] != 0) start_from(frame, from_u + i, from_v + 4 * half + j, row + j);
        }
      }
    }
    const auto beside_touching = static_cast<float>(asked_.touching * asked_.touching + 2.0 * least_drop_);
    if (any(nearest <= beside_touching)) look_closely(frame, from_u, from_v, squares, beside_touching);
    if (narrowest_ >= few_steps * step_) return;
    for (const bool along_u : {true, false}) look_between(frame, from_u, from_v, along_u, samples, off);
  }

  /// Of the bands in which a face's heights and those across its edges meet (barycentric); 1: it has none.
  static double narrowest(const StitchBand& band) noexcept {
    double least = 1.0;
    for (const float look : band.look) {
      if (look > 0.0F) least = std::min(least, static_cast<double>(look));
    }
    return least;
  }

  /// Descends from between samples that are far apart: where the maps of two faces meet at unlike heights, a wall
  /// stands in a band that is narrower than the lattice's steps. Where the line from one sample to the other comes as
  /// near as those beside it, the surface is sampled along it, as finely as the band is narrow.
  void look_between(const ReliefFrame& frame, int from_u, int from_v, bool along_u, const BlockSamples& samples,
                    const Eigen::Vector3f& p) noexcept {
    constexpr float more_than_level = 1.2F;  // of the squared distance
    const int ahead = along_u ? stride : 1;
    const int beside = along_u ? 1 : stride;
    const Vec3& edge = along_u ? frame.prism.edge_u : frame.prism.edge_v;
    const float far = more_than_level * static_cast<float>(step_ * step_ * edge.squaredNorm());
    float squares[BlockSamples::count];
    std::fill_n(squares, BlockSamples::count, BlockSamples::nowhere);
    bool any_far = false;
    for (int k = 0; k < stride * stride - ahead; ++k) {
      if (!along_u && k % stride == stride - 1) continue;
      const Eigen::Vector3f way = sample_at(samples, k + ahead) - sample_at(samples, k);
      const float length = way.squaredNorm();
      if (!(length > far && length < BlockSamples::far_off)) continue;
      const Eigen::Vector3f to = p - sample_at(samples, k);
      squares[k] = (to - std::clamp(to.dot(way) / length, 0.0F, 1.0F) * way).squaredNorm();
      any_far = true;
    }
    if (!any_far) return;
    for (int i = 0; i < BlockSamples::across; ++i) {
      for (int j = 0; j < BlockSamples::across; ++j) {
        const int k = (i + 1) * stride + j + 1;
        const float here = squares[k];
        if (!(here < BlockSamples::nowhere) || here > squares[k - beside] || here >= squares[k + beside]) continue;
        const auto length = static_cast<double>((sample_at(samples, k + ahead) - sample_at(samples, k)).norm());
        if (std::sqrt(static_cast<double>(here)) <= reach_ + of_chord * length)
          sample_between(frame, {(from_u + i) * step_, (from_v + j) * step_}, along_u, length / (step_ * edge.norm()));
      }
    }
  }

  /// From a sample to the next one, `steepness` times as far as on the level, and descends from what is nearer than
  /// what is beside it on the way.
  void sample_between(const ReliefFrame& frame, const Vec2& from, bool along_u, double steepness) noexcept {
    constexpr int most = 64;
    const double wanted = 0.5 * few_steps * steepness * step_ / narrowest_;
    const int parts = std::clamp(static_cast<int>(std::ceil(wanted / lanes)) * static_cast<int>(lanes), 4, most);
    double before = infinity;
    double here = infinity;
    const auto at = [&](int part) -> Vec2 {
      const double share = (part + 0.5) / parts * step_;
      return along_u ? Vec2(from.x() + share, from.y()) : Vec2(from.x(), from.y() + share);
    };
    const auto look = [&](int part, double next) {
      if (part >= 0 && here < before && here <= next) descend_from({frame, at(part).x(), at(part).y()});
      before = here;
      here = next;
    };
    for (int first = 0; first < parts; first += static_cast<int>(lanes)) {
      Lanes u;
      Lanes v;
      Lanes heights;
      for (std::size_t k = 0; k < lanes; ++k) {
        const Vec2 place = at(first + static_cast<int>(k));
        u[k] = place.x();
        v[k] = std::min(place.y(), 1.0 - u[k]);
      }
      surface_.heights_alone(frame, u, v, heights);
      for (std::size_t k = 0; k < lanes; ++k)
        look(first + static_cast<int>(k) - 1, (frame.prism.point({u[k], v[k], heights[k]}) - p_).norm());
    }
    look(parts - 1, infinity);
    count_.evaluations += static_cast<std::uint32_t>(parts) / static_cast<std::uint32_t>(lanes);
  }

  static Eigen::Vector3f sample_at(const BlockSamples& samples, int k) noexcept {
    return {samples.x[k], samples.y[k], samples.z[k]};
  }

  /// A place beside a sample, in steps of the lattice, and its squared distance.
  struct Beside {
    float square;
    float u = 0.0F;
    float v = 0.0F;
  };

  /// Of a ball that touches a narrow crest, samples next to each other are more or less off it: which of them is the
  /// least tells nothing of where along the crest it is. So crests are led to first, by parabolas across.
  void look_closely(const ReliefFrame& frame, int from_u, int from_v, const float (&squares)[BlockSamples::count],
                    float beside_touching) noexcept {
    float crests[BlockSamples::count];
    std::fill_n(crests, BlockSamples::count, BlockSamples::nowhere);
    const auto each = [](const auto& look) {
      for (int i = 0; i < BlockSamples::across; ++i) {
        for (int j = 0; j < BlockSamples::across; ++j) look(i, j, (i + 1) * stride + j + 1);
      }
    };
    each([&](int, int, int k) {
      crests[k] = squares[k] <= beside_touching ? crest_beside(&squares[k]).square : squares[k];
    });
    const double nearer = std::min(asked_.touching, reach_);
    const auto touching = static_cast<float>(nearer * nearer);
    each([&](int i, int j, int k) {
      if (crests[k] > touching || !first_of_like(&crests[k])) return;
      const Beside crest = crest_beside(&squares[k]);
      const double u = std::clamp((from_u + i + static_cast<double>(crest.u)) * step_, 0.0, 1.0);
      const double v = std::clamp((from_v + j + static_cast<double>(crest.v)) * step_, 0.0, 1.0 - u);
      const bool known = std::any_of(out_.begin(), out_.end(), [&](const Foot& foot) {
        return foot.element == frame.face && std::hypot(foot.at[1] - u, foot.at[2] - v) <= same_place * step_;
      });
      if (!known) descend_from({frame, u, v});
    });
  }

  /// The place where a parabola through a sample and those around it is least, across the way along which it changes
  /// least; the sample itself where that is not beside it.
  static Beside crest_beside(const float* here) noexcept {
    const Beside itself{*here};
    for (const int beside : {-stride - 1, -stride, 1 - stride, -1, 1, stride - 1, stride, stride + 1}) {
      if (!(here[beside] < BlockSamples::nowhere)) return itself;
    }
    const float slope_u = 0.5F * (here[stride] - here[-stride]);
    const float slope_v = 0.5F * (here[1] - here[-1]);
    const float uu = here[stride] + here[-stride] - 2.0F * *here;
    const float vv = here[1] + here[-1] - 2.0F * *here;
    const float uv = 0.25F * (here[stride + 1] + here[-stride - 1] - here[stride - 1] - here[1 - stride]);
    const float half = std::hypot(0.5F * (uu - vv), uv);
    const float most = 0.5F * (uu + vv) + half;
    if (!(most > 0.0F)) return itself;
    // Across: along the larger of both curvatures.
    const float u = uu > vv ? most - vv : uv;
    const float v = uu > vv ? uv : most - uu;
    const float length = std::hypot(u, v);
    if (!(length > 0.0F)) return itself;
    const float slope = (u * slope_u + v * slope_v) / length;
    const float off = -slope / most;
    if (std::abs(off) > 1.0F) return itself;
    return {*here + 0.5F * slope * off, off * u / length, off * v / length};
  }

  /// Descends from a sample, where those around it are no nearer, if it may lead to something new within reach.
  void start_from(const ReliefFrame& frame, int i, int j, const float* here) noexcept {
    if (!first_of_like(here) || !(*here < BlockSamples::nowhere)) return;
    const double drop =
        std::max(least_drop_, 0.5 * (rise(*here, here[-stride], here[stride]) + rise(*here, here[-1], here[1])));
    const double u = i * step_;
    const double v = std::min(j * step_, 1.0 - u);
    if (static_cast<double>(*here) - drop > reach_ * reach_ || found_beside(frame.face, u, v)) return;
    descend_from({frame, u, v});
  }

  using Four = four::Floats;
  static Four four_at(const float* first) noexcept {
    Four four;
    std::memcpy(&four, first, sizeof(four));
    return four;
  }
  static Four least(const Four& a, const Four& b) noexcept { return a < b ? a : b; }
  template <class Mask>
  static bool any(const Mask& mask) noexcept {
    std::uint64_t words[2];
    std::memcpy(words, &mask, sizeof(words));
    return (words[0] | words[1]) != 0;
  }

  static void squares_from(const BlockSamples& samples, const Eigen::Vector3f& p,
                           float (&squares)[BlockSamples::count]) noexcept {
    for (int k = 0; k < BlockSamples::count; ++k) {
      const float x = samples.x[k] - p.x();
      const float y = samples.y[k] - p.y();
      const float z = samples.z[k] - p.z();
      squares[k] = x * x + y * y + z * z;
    }
  }

  /// A disk as narrow as what is looked for among a block's samples lets it be: one of them that lies beside a place
  /// within reach is itself no farther than reach and, about, their distance from one another.
  static void tighten(const BlockSamples& samples, ReliefBlocks::Block& block) noexcept {
    const Eigen::Vector3f normal(block.disk.normal[0], block.disk.normal[1], block.disk.normal[2]);
    float lowest = BlockSamples::nowhere;
    float highest = -BlockSamples::nowhere;
    float radius = 0.0F;
    float apart = 0.0F;
    const auto at = [&](int k) { return sample_at(samples, k); };
    for (int k = 0; k < stride * stride; ++k) {
      if (!(samples.x[k] < BlockSamples::far_off)) continue;
      const Eigen::Vector3f here = at(k);
      const float above = normal.dot(here);
      lowest = std::min(lowest, above);
      highest = std::max(highest, above);
      radius = std::max(radius, here.squaredNorm());
      for (const int to : {k + 1, k + stride}) {
        if (to % stride == 0 || to >= stride * stride || !(samples.x[to] < BlockSamples::far_off)) continue;
        apart = std::max(apart, (at(to) - here).squaredNorm());
      }
    }
    constexpr float rounding = 1e-5F;
    radius = std::sqrt(radius);
    block.around_samples = block.disk;
    for (int a = 0; a < 3; ++a)
      block.around_samples.middle[a] += 0.5 * static_cast<double>(lowest + highest) * static_cast<double>(normal[a]);
    block.around_samples.half = 0.5F * (highest - lowest) + rounding * radius;
    block.around_samples.radius = (1.0F + rounding) * radius;
    block.apart = (1.0F + rounding) * std::sqrt(apart);
  }

  /// Whether something of a part may be what is looked for.
  [[nodiscard]] bool within_reach(const ReliefBlocks::Block& block) noexcept {
    if (!block.disk.may_be_within(reach_, p_)) return false;
    if (block.name.level == 0) count_.evaluations += evaluations_of_block;
    if (block.apart <= 0.0F) return true;
    const auto apart = static_cast<double>(block.apart);
    const double reach = reach_ + apart + std::max(apart * apart, least_drop_) / reach_;
    return block.around_samples.may_be_within(reach, p_);
  }

  /// Of two as near, the first.
  static bool first_of_like(const float* here) noexcept {
    const float one = *here;
    return one < here[-stride - 1] && one < here[-stride] && one < here[-1] && one < here[1 - stride] &&
           one <= here[1] && one <= here[stride + 1] && one <= here[stride] && one <= here[stride - 1];
  }

  /// How much farther the neighbours on both sides are at most, of those that there are.
  static double rise(float here, float before, float after) noexcept {
    float most = 0.0F;
    if (before < BlockSamples::nowhere) most = before - here;
    if (after < BlockSamples::nowhere) most = std::max(most, after - here);
    return static_cast<double>(most);
  }

  /// The surface at a block's samples and at those around it.
  void sample(const ReliefFrame& frame, int from_u, int from_v, const Vec3& middle, BlockSamples& out) const noexcept {
    std::fill_n(out.x, BlockSamples::count, BlockSamples::far_off);
    std::fill_n(out.y, BlockSamples::count, 0.0F);
    std::fill_n(out.z, BlockSamples::count, 0.0F);
    for (int i = from_u - 1; i <= from_u + BlockSamples::across; ++i) {
      if (i < 0 || i > last_) continue;
      // Of the row what lies in the triangle.
      const int begin = std::max(0, from_v - 1);
      const int end = std::min(from_v + BlockSamples::across, last_ - i) + 1;
      for (int j = begin; j < end; j += static_cast<int>(lanes)) {
        Lanes u;
        Lanes v;
        Lanes heights;
        for (std::size_t k = 0; k < lanes; ++k) {
          u[k] = i * step_;
          v[k] = std::min(j + static_cast<int>(k), end - 1) * step_;
        }
        surface_.heights_alone(frame, u, v, heights);
        for (int k = 0; k < static_cast<int>(lanes) && j + k < end; ++k) {
          const auto lane = static_cast<std::size_t>(k);
          const Vec3 there = frame.prism.point({u[lane], v[lane], heights[lane]}) - middle;
          const int at = (i - from_u + 1) * stride + j + k - from_v + 1;
          out.x[at] = static_cast<float>(there.x());
          out.y[at] = static_cast<float>(there.y());
          out.z[at] = static_cast<float>(there.z());
        }
      }
    }
  }

  /// Whether a place is known already that a descent from here would end at.
  [[nodiscard]] bool found_beside(std::uint32_t face, double u, double v) const noexcept {
    return std::any_of(out_.begin(), out_.end(), [&](const Foot& foot) {
      return foot.element == face && std::abs(foot.at[1] - u) <= 0.75 * step_ &&
             std::abs(foot.at[2] - v) <= 0.75 * step_;
    });
  }

  void descend_from(const ReliefPlace& place) noexcept {
    ReliefPlace at = place;
    ReliefPoint spot = surface_.point(at.frame, at.u, at.v);
    const Vec3 start = spot.point;
    Goal goal = goal_of_feet(p_);
    if (descend(surface_, at, spot, 1.0, goal, count_) == DescentEnd::limited) {
      // What lies further off beyond an edge, samples of the other face lead to.
      if (at.frame.face != place.frame.face && (spot.point - start).squaredNorm() > far_off * least_drop_) return;
      goal.moves = most_moves;
      descend(surface_, at, spot, 1.0, goal, count_);
    }
    const Foot foot = foot_at(at, spot, p_);
    if (foot.distance > reach_) return;
    const double same = 1e-2 * surface_.grain();
    for (const Foot& other : out_) {
      if ((other.point - foot.point).norm() <= same) return;
    }
    // Of more than are asked for, the nearest.
    if (out_.size() < asked_.most) {
      out_.push_back(foot);
    } else {
      Foot* const farthest = farthest_found();
      if (foot.distance < farthest->distance) *farthest = foot;
    }
    if (out_.size() == asked_.most) reach_ = farthest_found()->distance;
    if (asked_.of_overlap < 1.0 && foot.distance < asked_.touching) {
      const double among =
          std::max(asked_.of_overlap * (asked_.touching - foot.distance), asked_.reach - asked_.touching);
      reach_ = std::min(reach_, foot.distance + among);
    }
  }
  [[nodiscard]] Foot* farthest_found() noexcept {
    return std::max_element(out_.begin(), out_.end(),
                            [](const Foot& a, const Foot& b) { return a.distance < b.distance; });
  }

  /// What looks take where nothing is known yet: what is counted does not hang on what is.
  static constexpr std::uint32_t bounds_of_block = 1;
  static constexpr std::uint32_t evaluations_of_block = stride * stride / lanes;

  const ReliefSurface& surface_;
  Vec3 p_;
  FeetAsked asked_;
  double reach_;
  CoatMoment moment_;
  ReliefBlocks* blocks_;  ///< none: every look is the first
  ContactSet& out_;
  ReliefFrame frame_;
  ReliefBlocks::Block block_;
  BlockSamples samples_;
  double step_ = 1.0;       ///< of the face's lattice (barycentric)
  int last_ = 1;            ///< sample along an edge
  double narrowest_ = 1.0;  ///< of the face's bands (barycentric)
  /// By how much (m^2) a sample may be farther than a place beside it that is nearest, at least: at the face's border
  /// what lies on one side of it is not known.
  double least_drop_ = 0.0;
  WorkCount count_;
};

}  // namespace

Foot ReliefView::follow(const Vec3& p, const Foot& foot) const noexcept {
  ReliefPlace place;
  if (ReliefBlocks* const blocks = cache_->blocks) {
    blocks->keep_only(surface_->identity(), moment_);
    ReliefFrame& frame = blocks->frame(foot.element);
    if (!surface_->holds(frame, foot.element, moment_)) frame = surface_->frame(foot.element, moment_);
    place = {frame, foot.at[1], foot.at[2]};
  } else {
    place = {surface_->frame(foot.element, moment_), foot.at[1], foot.at[2]};
  }
  ReliefPoint spot = surface_->point(place.frame, place.u, place.v);
  WorkCount count;
  ++count.frames;
  asperity::descend(*surface_, place, spot, 1.0, goal_of_feet(p), count);
  tell(cache_->work, count);
  return foot_at(place, spot, p);
}

void ReliefView::feet(const Vec3& p, const FeetAsked& asked, ContactSet& out) const noexcept {
  out.clear();
  ReliefBlocks* const blocks = cache_->blocks;
  if (blocks != nullptr) {
    blocks->keep_only(surface_->identity(), moment_);
    // A tick begins where the last one has ended.
    if (const ReliefBlocks::Answer* known = blocks->answer(p, asked)) {
      out = known->feet;
      tell(cache_->work, known->count);
      return;
    }
  }
  ReliefFeetSearch search(*surface_, p, asked, moment_, blocks, out);
  surface_->base().index().for_each_near(p, asked.reach, surface_->boxes(), [&](std::uint32_t face) {
    search.visit(face);
    return search.reach();
  });
  tell(cache_->work, search.count());
  std::sort(out.begin(), out.end(), [](const Foot& a, const Foot& b) {
    return a.distance < b.distance || (a.distance == b.distance && a.element < b.element);
  });
  if (blocks != nullptr) blocks->remember({p, asked, out, search.count()});
}

}  // namespace asperity
