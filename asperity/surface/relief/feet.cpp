// All places of a displaced surface that a ball may rest on: local minima of the distance from its centre, found among
// samples on a lattice over each face and led to their ends.

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <optional>

#include "asperity/surface/relief/blocks.h"
#include "asperity/surface/relief/detail/bounds.h"
#include "asperity/surface/relief/detail/kept_blocks.h"
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
                   KeptBlocks* blocks, ContactSet& out) noexcept
      : surface_(surface), p_(p), asked_(asked), reach_(asked.reach), moment_(moment), blocks_(blocks), out_(out) {
    partners_ = blocks_ != nullptr ? &blocks_->partners() : &own_partners_.emplace();
  }

  /// How far what is looked for may be (m): less once as many as that are known.
  [[nodiscard]] double reach() const noexcept { return reach_; }

  [[nodiscard]] const WorkCount& count() const noexcept { return count_; }

  /// Looks for places over a face.
  void visit(std::uint32_t face) noexcept {
    for_each_block(face, [&](const ReliefFrame& frame, const Part& part) {
      count_.evaluations += evaluations_of_block;
      look_at(frame, part);
    });
  }

  /// No more than how far the relief over a face is is within reach from then on.
  void stay_off(std::uint32_t face) noexcept {
    for_each_block(face, [&](const ReliefFrame&, const Part& part) { reach_ = std::min(reach_, part.away); });
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

  /// A part of the lattice, how far it is at least (m), and what it lies in.
  struct Part {
    ReliefBlockName name;
    double away = 0.0;
    ReliefDisk disk;  ///< of all but the whole
  };
  using Parts = FixedVector<Part, 3 * deepest_part + 4>;

  /// Calls see(frame, part) for the parts at level 0 of a face's lattice that may come within reach, the nearest first
  /// of what lies side by side.
  template <class See>
  void for_each_block(std::uint32_t face, const See& see) noexcept {
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
    from_corner_ = p_ - frame.prism.corner;
    std::uint32_t level = 1;
    while (BlockSamples::across << level < width) ++level;
    const int side = BlockSamples::across << level;
    Parts parts;
    for (int i = range.from_u / side; i * side < range.to_u; ++i) {
      for (int j = range.from_v / side; j * side < range.to_v; ++j) {
        parts.push_back({{face, static_cast<std::uint16_t>(i), static_cast<std::uint16_t>(j), level}, 0.0, {}});
        while (!parts.empty()) {
          const Part part = parts[parts.size() - 1];
          parts.swap_remove(parts.size() - 1);
          if (part.away > reach_) continue;
          if (part.name.level == 0) {
            see(frame, part);
          } else {
            add_quarters(part.name, frame, range, parts);
          }
        }
      }
    }
  }

  /// The quarters of a part that may come within reach.
  void add_quarters(const ReliefBlockName& name, const ReliefFrame& frame, const Range& range, Parts& parts) noexcept {
    const ReliefQuarters& quarters = quarters_of(name, frame);
    float away[ReliefQuarters::count];
    least_distances(quarters, from_corner_, away);
    const int side = BlockSamples::across << (name.level - 1);
    const std::size_t first = parts.size();
    for (int k = 0; k < ReliefQuarters::count; ++k) {
      const int i = 2 * name.i + (k & 1);
      const int j = 2 * name.j + (k >> 1);
      const int u = i * side;
      const int v = j * side;
      const bool beyond_third_side = u + v > last_;
      if (beyond_third_side || u >= range.to_u || u + side <= range.from_u || v >= range.to_v ||
          v + side <= range.from_v)
        continue;
      count_.bounds += bounds_of_block;
      if (static_cast<double>(away[k]) > reach_) continue;
      const ReliefBlockName quarter{name.face, static_cast<std::uint16_t>(i), static_cast<std::uint16_t>(j),
                                    name.level - 1};
      parts.push_back({quarter, static_cast<double>(away[k]), quarters.disk(k)});
    }
    std::sort(parts.begin() + static_cast<std::ptrdiff_t>(first), parts.end(),
              [](const Part& a, const Part& b) { return a.away > b.away; });
  }

  const ReliefQuarters& quarters_of(const ReliefBlockName& name, const ReliefFrame& frame) noexcept {
    bool known = false;
    ReliefQuarters& quarters = blocks_ != nullptr ? blocks_->quarters(name, known) : quarters_;
    if (known) return quarters;
    const int side = BlockSamples::across << (name.level - 1);
    for (int k = 0; k < ReliefQuarters::count; ++k) {
      const int u = (2 * name.i + (k & 1)) * side;
      const int v = (2 * name.j + (k >> 1)) * side;
      quarters.put(k, u + v > last_ ? ReliefDisk{} : disk_around(frame, u, v, side));
    }
    return quarters;
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
    const Vec3& corner = frame.prism.corner;
    const Vec3f rounded = (0.5 * (halves[0].corner[0] + halves[1].corner[0]) - corner).cast<float>();
    const Vec3 middle = corner + rounded.cast<double>();
    const Vec3 normal =
        (halves[1].corner[0] - halves[0].corner[0]).cross(halves[0].corner[2] - halves[0].corner[1]).normalized();
    ReliefDisk disk;
    for (int a = 0; a < 3; ++a) {
      disk.middle[a] = rounded[a];
      disk.normal[a] = static_cast<float>(normal[a]);
    }
    double radius = 0.0;
    double thick = 0.0;
    for (const ReliefBound& bound : halves) {
      for (const Vec3& at : bound.corner) {
        radius = std::max(radius, (at - middle).norm() + bound.error);
        thick = std::max(thick, std::abs(normal.dot(at - middle)) + bound.error);
      }
    }
    // Rounded up, and for the normal's own rounding.
    disk.radius = static_cast<float>(radius * (1.0 + 1e-6));
    disk.half = static_cast<float>(thick + 1e-6 * radius);
    return disk;
  }

  /// Descends from every sample that is no farther than those around it and may lie beside a place within reach.
  void look_at(const ReliefFrame& frame, const Part& part) noexcept {
    bool known = false;
    BlockSamples& samples = blocks_ != nullptr ? blocks_->samples(part.name, known) : samples_;
    const Vec3 middle(part.disk.middle[0], part.disk.middle[1], part.disk.middle[2]);
    const int from_u = part.name.i * BlockSamples::across;
    const int from_v = part.name.j * BlockSamples::across;
    if (!known) {
      sample(frame, from_u, from_v, frame.prism.corner + middle, samples);
      enclose(part.disk, samples);
      for (const bool along_u : {true, false}) mark_steep(frame, along_u, samples);
    }
    if (!within_reach(samples)) return;
    const Vec3f off = (from_corner_ - middle).cast<float>();
    SampleSquares squares;
    squares_from(samples, off, squares);
    started_.clear();
    if (squares.nearest < BlockSamples::nowhere) overlaps(std::sqrt(static_cast<double>(squares.nearest)));
    for (int i = 0; i < BlockSamples::across; ++i) {
      for (std::uint32_t least = squares.least[i]; least != 0; least &= least - 1) {
        const int j = std::countr_zero(least);
        start_from(frame, from_u + i, from_v + j, &squares.of[(i + 1) * stride + j + 1]);
      }
    }
    const auto beside_touching = static_cast<float>(asked_.touching * asked_.touching + 2.0 * least_drop_);
    if (squares.nearest <= beside_touching) look_closely(frame, from_u, from_v, squares, beside_touching);
    if (narrowest_ >= few_steps * step_) return;
    for (const bool along_u : {true, false}) {
      const auto& steep = samples.steep[along_u ? 0 : 1];
      if (std::any_of(steep, steep + stride, [](std::uint32_t row) { return row != 0; }))
        look_between(frame, from_u, from_v, along_u, samples, off);
    }
  }

  /// Of the bands in which a face's heights and those across its edges meet (barycentric); 1: it has none.
  static double narrowest(const StitchBand& band) noexcept {
    double least = 1.0;
    for (const float look : band.look) {
      if (look > 0.0F) least = std::min(least, static_cast<double>(look));
    }
    return least;
  }

  /// Of samples that are far from the next one, in a face that has walls, which they are.
  void mark_steep(const ReliefFrame& frame, bool along_u, BlockSamples& samples) const noexcept {
    constexpr float more_than_level = 1.2F;  // of the squared distance
    const int ahead = along_u ? stride : 1;
    const Vec3& edge = along_u ? frame.prism.edge_u : frame.prism.edge_v;
    const float far = more_than_level * static_cast<float>(step_ * step_ * edge.squaredNorm());
    auto& steep = samples.steep[along_u ? 0 : 1];
    std::fill_n(steep, stride, 0U);
    if (narrowest_ >= few_steps * step_) return;
    for (int i = 0; i < stride - (along_u ? 1 : 0); ++i) {
      for (int j = 0; j < stride - (along_u ? 0 : 1); ++j) {
        const int k = i * stride + j;
        const float length = (sample_at(samples, k + ahead) - sample_at(samples, k)).squaredNorm();
        if (length > far && length < BlockSamples::far_off) steep[i] |= 1U << static_cast<unsigned>(j);
      }
    }
  }

  /// Descends from between samples that are far apart: where the maps of two faces meet at unlike heights, a wall
  /// stands in a band that is narrower than the lattice's steps. Where the line from one sample to the other comes as
  /// near as those beside it, the surface is sampled along it, as finely as the band is narrow.
  void look_between(const ReliefFrame& frame, int from_u, int from_v, bool along_u, const BlockSamples& samples,
                    const Vec3f& p) noexcept {
    const int ahead = along_u ? stride : 1;
    const int beside = along_u ? 1 : stride;
    const Vec3& edge = along_u ? frame.prism.edge_u : frame.prism.edge_v;
    constexpr std::uint32_t own = (1U << BlockSamples::across) - 1;
    const auto& steep = samples.steep[along_u ? 0 : 1];
    float squares[BlockSamples::count];
    std::fill_n(squares, BlockSamples::count, BlockSamples::nowhere);
    for (int i = 0; i < stride; ++i) {
      for (std::uint32_t row = steep[i]; row != 0; row &= row - 1) {
        const int k = i * stride + std::countr_zero(row);
        const Vec3f way = sample_at(samples, k + ahead) - sample_at(samples, k);
        const Vec3f to = p - sample_at(samples, k);
        squares[k] = (to - std::clamp(to.dot(way) / way.squaredNorm(), 0.0F, 1.0F) * way).squaredNorm();
      }
    }
    for (int i = 0; i < BlockSamples::across; ++i) {
      for (std::uint32_t row = (steep[i + 1] >> 1U) & own; row != 0; row &= row - 1) {
        const int j = std::countr_zero(row);
        const int k = (i + 1) * stride + j + 1;
        const float here = squares[k];
        if (!first_of_like(&squares[k])) continue;
        const auto length = static_cast<double>((sample_at(samples, k + ahead) - sample_at(samples, k)).norm());
        if (std::sqrt(static_cast<double>(here)) > reach_ + of_chord * length) continue;
        const auto square = [&](int at) { return static_cast<double>(squares[at]); };
        const double drop = std::max(least_drop_, 0.5 * rise(square(k), square(k - beside), square(k + beside)));
        sample_between(frame, {(from_u + i) * step_, (from_v + j) * step_}, along_u, length / (step_ * edge.norm()),
                       drop);
      }
    }
  }

  /// From a sample to the next one, `steepness` times as far as on the level, and descends from what is nearer than
  /// what is beside it on the way, and may be within reach. `drop`: by how much (m^2) a place beside the way may be
  /// nearer.
  void sample_between(const ReliefFrame& frame, const Vec2& from, bool along_u, double steepness,
                      double drop) noexcept {
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
      const bool may_be = part >= 0 && here < before && here <= next &&
                          here - std::max(drop, 0.5 * rise(here, before, next)) <= reach_ * reach_;
      if (may_be) descend_from({frame, at(part).x(), at(part).y()});
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
      surface_.heights_alone(frame, u, v, *partners_, heights);
      for (std::size_t k = 0; k < lanes; ++k)
        look(first + static_cast<int>(k) - 1, (frame.prism.point({u[k], v[k], heights[k]}) - p_).squaredNorm());
    }
    look(parts - 1, infinity);
    count_.evaluations += static_cast<std::uint32_t>(parts) / static_cast<std::uint32_t>(lanes);
  }

  static Vec3f sample_at(const BlockSamples& samples, int k) noexcept {
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
  void look_closely(const ReliefFrame& frame, int from_u, int from_v, const SampleSquares& squares,
                    float beside_touching) noexcept {
    const double nearer = std::min(asked_.touching, reach_);
    const auto touching = static_cast<float>(nearer * nearer);
    std::uint32_t rows[BlockSamples::across];
    if (!beside_crests(squares, touching, rows)) return;
    float crests[BlockSamples::count];
    std::copy_n(squares.of, BlockSamples::count, crests);
    const auto each = [&](const auto& look) {
      for (int i = 0; i < BlockSamples::across; ++i) {
        for (std::uint32_t row = rows[i]; row != 0; row &= row - 1) {
          const int j = std::countr_zero(row);
          look(i, j, (i + 1) * stride + j + 1);
        }
      }
    };
    each([&](int, int, int k) {
      if (squares.of[k] <= beside_touching) crests[k] = crest_beside(&squares.of[k]).square;
    });
    // What is beside the block is not looked for here.
    for (int k = 0; k < stride; ++k)
      crests[k] = crests[k * stride] = crests[k * stride + stride - 1] = crests[(stride - 1) * stride + k] =
          BlockSamples::nowhere;
    each([&](int i, int j, int k) {
      if (crests[k] > touching || !first_of_like(&crests[k])) return;
      const Beside crest = crest_beside(&squares.of[k]);
      const double u = std::clamp((from_u + i + static_cast<double>(crest.u)) * step_, 0.0, 1.0);
      const double v = std::clamp((from_v + j + static_cast<double>(crest.v)) * step_, 0.0, 1.0 - u);
      const bool known =
          started_at(u, v) || std::any_of(out_.begin(), out_.end(), [&](const Foot& foot) {
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
    const auto rise_of = [&](int ahead) {
      return rise(static_cast<double>(*here), static_cast<double>(here[-ahead]), static_cast<double>(here[ahead]));
    };
    const double drop = std::max(least_drop_, 0.5 * (rise_of(stride) + rise_of(1)));
    const double u = i * step_;
    const double v = std::min(j * step_, 1.0 - u);
    if (static_cast<double>(*here) - drop > reach_ * reach_ || found_beside(frame.face, u, v)) return;
    descend_from({frame, u, v});
  }

  /// Whether something of a block may be what is looked for.
  [[nodiscard]] bool within_reach(const BlockSamples& samples) const noexcept {
    const auto apart = static_cast<double>(samples.apart);
    const double reach = reach_ + apart + std::max(apart * apart, least_drop_) / reach_;
    return samples.around.may_be_within(reach, from_corner_);
  }

  /// Of two as near, the first.
  static bool first_of_like(const float* here) noexcept {
    const float one = *here;
    return one < here[-stride - 1] && one < here[-stride] && one < here[-1] && one < here[1 - stride] &&
           one <= here[1] && one <= here[stride + 1] && one <= here[stride] && one <= here[stride - 1];
  }

  /// How much farther the neighbours on both sides are at most, of those that there are.
  static double rise(double here, double before, double after) noexcept {
    constexpr double nowhere = static_cast<double>(BlockSamples::nowhere);
    double most = 0.0;
    if (before < nowhere) most = before - here;
    if (after < nowhere) most = std::max(most, after - here);
    return most;
  }

  /// The surface at a block's samples and at those around it.
  void sample(const ReliefFrame& frame, int from_u, int from_v, const Vec3& middle, BlockSamples& out) noexcept {
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
        surface_.heights_alone(frame, u, v, *partners_, heights);
        put_samples(frame.prism, u, v, heights, middle, std::min(static_cast<int>(lanes), end - j),
                    (i - from_u + 1) * stride + j - from_v + 1, out);
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

  /// Whether a descent has begun there already, among the block's samples.
  [[nodiscard]] bool started_at(double u, double v) const noexcept {
    const double same = 1e-3 * step_;
    return std::any_of(started_.begin(), started_.end(), [&](const Vec2& from) {
      return std::abs(from.x() - u) <= same && std::abs(from.y() - v) <= same;
    });
  }

  void descend_from(const ReliefPlace& place) noexcept {
    started_.push_back({place.u, place.v});
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
    if (blocks_ != nullptr) {
      bool known = false;
      ReliefPoint& kept = blocks_->spot(foot.element, at.u, at.v, known);
      if (!known) kept = spot;
    }
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
    overlaps(foot.distance);
  }

  /// Something of the surface is so far away (m): much further off nothing is looked for where that is overlapped.
  void overlaps(double distance) noexcept {
    if (!(asked_.of_overlap < 1.0) || !(distance < asked_.touching)) return;
    const double among = std::max(asked_.of_overlap * (asked_.touching - distance), asked_.reach - asked_.touching);
    reach_ = std::min(reach_, distance + among);
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
  KeptBlocks* blocks_;  ///< none: every look is the first
  ContactSet& out_;
  ReliefFrame frame_;
  ReliefQuarters quarters_;
  BlockSamples samples_;
  std::optional<ReliefPartners> own_partners_;
  ReliefPartners* partners_;
  FixedVector<Vec2, 16> started_;    ///< descents from the samples of the block that is looked at (barycentric)
  Vec3 from_corner_ = Vec3::Zero();  ///< of the face to where places are looked for (m)
  double step_ = 1.0;                ///< of the face's lattice (barycentric)
  int last_ = 1;                     ///< sample along an edge
  double narrowest_ = 1.0;           ///< of the face's bands (barycentric)
  /// By how much (m^2) a sample may be farther than a place beside it that is nearest, at least: at the face's border
  /// what lies on one side of it is not known.
  double least_drop_ = 0.0;
  WorkCount count_;
};

}  // namespace

const ReliefFrame& ReliefView::kept_frame(std::uint32_t face) const noexcept {
  ReliefFrame& frame = cache_->blocks->of(surface_->identity(), moment_).frame(face);
  if (!surface_->holds(frame, face, moment_)) frame = surface_->frame(face, moment_);
  return frame;
}

ReliefPoint& ReliefView::kept_spot(std::uint32_t face, double u, double v) const noexcept {
  bool known = false;
  ReliefPoint& spot = cache_->blocks->of(surface_->identity(), moment_).spot(face, u, v, known);
  if (!known) spot = surface_->point(kept_frame(face), u, v);
  return spot;
}

void ReliefView::keep(const ReliefPlace& place, const ReliefPoint& spot) const noexcept {
  bool known = false;
  ReliefPoint& kept = cache_->blocks->of(surface_->identity(), moment_).spot(place.frame.face, place.u, place.v, known);
  if (!known) kept = spot;
}

Foot ReliefView::follow(const Vec3& p, const Foot& foot) const noexcept {
  ReliefPlace place;
  ReliefPoint spot;
  if (cache_->blocks != nullptr) {
    place = {kept_frame(foot.element), foot.at[1], foot.at[2]};
    spot = kept_spot(foot.element, place.u, place.v);
  } else {
    place = {surface_->frame(foot.element, moment_), foot.at[1], foot.at[2]};
    spot = surface_->point(place.frame, place.u, place.v);
  }
  WorkCount count;
  ++count.frames;
  asperity::descend(*surface_, place, spot, 1.0, goal_of_feet(p), count);
  tell(cache_->work, count);
  if (cache_->blocks != nullptr) keep(place, spot);
  return foot_at(place, spot, p);
}

double ReliefView::room_around(const Vec3& p, double within) const noexcept {
  KeptBlocks* const blocks = cache_->blocks != nullptr ? &cache_->blocks->of(surface_->identity(), moment_) : nullptr;
  ContactSet none;
  ReliefFeetSearch search(*surface_, p, {within, within}, moment_, blocks, none);
  surface_->base().index().for_each_near(p, within, surface_->boxes(), [&](std::uint32_t face) {
    search.stay_off(face);
    return search.reach();
  });
  tell(cache_->work, search.count());
  return search.reach();
}

void ReliefView::feet(const Vec3& p, const FeetAsked& asked, ContactSet& out) const noexcept {
  out.clear();
  KeptBlocks* const blocks = cache_->blocks != nullptr ? &cache_->blocks->of(surface_->identity(), moment_) : nullptr;
  if (blocks != nullptr) {
    // A tick begins where the last one has ended.
    if (const KeptBlocks::Answer* known = blocks->answer(p, asked)) {
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
