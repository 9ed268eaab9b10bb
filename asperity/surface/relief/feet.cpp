// All places of a displaced surface that a ball may rest on: local minima of the distance from its centre, found among
// samples on a lattice over each face and led to their ends.

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "asperity/geometry/closest_point.h"
#include "asperity/surface/relief/detail/bounds.h"
#include "asperity/surface/relief/detail/search.h"

namespace asperity {

namespace {

/// Samples of a face's lattice, at most half a texel apart, that lie beside each other: [from, to) in both directions.
struct Block {
  int from_u = 0;
  int to_u = 0;
  int from_v = 0;
  int to_v = 0;
};

class ReliefFeetSearch {
 public:
  ReliefFeetSearch(const ReliefSurface& surface, const Vec3& p, double reach, const CoatMoment& moment,
                   ContactSet& out) noexcept
      : surface_(surface), p_(p), reach_(reach), moment_(moment), out_(out) {}

  [[nodiscard]] const WorkCount& count() const noexcept { return count_; }

  void visit(std::uint32_t face) noexcept {
    ++count_.frames;
    const ReliefFrame frame = surface_.frame(face, moment_);
    const double samples = std::min(texels_across(frame) / leaf_of_texel, std::ldexp(1.0, deepest_part));
    last_ = std::max(1 << (frame.stitched ? least_level_stitched : least_level), static_cast<int>(std::ceil(samples)));
    step_ = 1.0 / last_;
    const Vec3& edge_u = frame.prism.edge_u;
    const Vec3& edge_v = frame.prism.edge_v;
    least_drop_ =
        2.0 * step_ * step_ * std::max({edge_u.squaredNorm(), edge_v.squaredNorm(), (edge_u - edge_v).squaredNorm()});
    Block stack[3 * deepest_part + 4];
    int top = 0;
    stack[top++] = within_reach(frame.prism);
    while (top > 0) {
      const Block block = stack[--top];
      if (block.to_u <= block.from_u || block.to_v <= block.from_v) continue;
      const bool beyond_third_side = block.from_u + block.from_v > last_;
      if (beyond_third_side || !may_be_near(frame, block)) continue;
      if (std::max(block.to_u - block.from_u, block.to_v - block.from_v) <= most_samples) {
        look_at(frame, block);
        continue;
      }
      const int half_u = block.to_u - block.from_u <= most_samples ? block.to_u : (block.from_u + block.to_u) / 2;
      const int half_v = block.to_v - block.from_v <= most_samples ? block.to_v : (block.from_v + block.to_v) / 2;
      stack[top++] = {half_u, block.to_u, half_v, block.to_v};
      stack[top++] = {block.from_u, half_u, half_v, block.to_v};
      stack[top++] = {half_u, block.to_u, block.from_v, half_v};
      stack[top++] = {block.from_u, half_u, block.from_v, half_v};
    }
  }

 private:
  static constexpr int most_samples = 8;
  static constexpr int stride = most_samples + 2;
  /// The least of the samples around a place that is looked for may be so many of them off it, in thin triangles.
  static constexpr int beside = 2;

  [[nodiscard]] Block within_reach(const ShellPrism& prism) const noexcept {
    Vec2 middle;
    Vec2 reach;
    if (!places_within(prism, p_, reach_, middle, reach)) return {0, last_ + 1, 0, last_ + 1};
    const auto sample = [&](double at) { return static_cast<int>(std::clamp(at / step_, -1.0, last_ + 1.0)); };
    const auto from = [&](double at) { return std::max(0, sample(at) - beside); };
    const auto to = [&](double at) { return std::min(last_ + 1, sample(at) + beside + 2); };
    return {from(middle.x() - reach.x()), to(middle.x() + reach.x()), from(middle.y() - reach.y()),
            to(middle.y() + reach.y())};
  }

  /// Whether the relief around the block's samples may come within reach.
  [[nodiscard]] bool may_be_near(const ReliefFrame& frame, const Block& block) noexcept {
    const double room = beside * step_;
    const Vec2 lower(block.from_u * step_ - room, block.from_v * step_ - room);
    const Vec2 upper((block.to_u - 1) * step_ + room, (block.to_v - 1) * step_ + room);
    const FacePart part{
        {0.5 * (lower + upper), Vec2::Zero(), Vec2::Zero()}, 1, 0.5 * (lower + upper), 0.5 * (upper - lower)};
    count_.bounds += surface_.bounds_of(frame, part);
    const HeightForm form = surface_.form(frame, part);
    const auto half_is_near = [&](const Vec2& a, const Vec2& b, const Vec2& c) {
      const FacePart half = FacePart::triangle(a, b, c);
      const Vec2 off = half.middle - part.middle;
      HeightForm moved = form;
      moved.height += off.x() * form.u + off.y() * form.v;
      const ReliefBound bound = bound_over(frame.prism, moved, half);
      const double square =
          closest_point_on_triangle(p_, bound.corner[0], bound.corner[1], bound.corner[2]).squared_distance;
      return square < (reach_ + bound.error) * (reach_ + bound.error);
    };
    const Vec2 beside_u(upper.x(), lower.y());
    const Vec2 beside_v(lower.x(), upper.y());
    return half_is_near(lower, beside_u, beside_v) || half_is_near(upper, beside_v, beside_u);
  }

  /// Descends from every sample that is no farther than those around it and may lie beside a place within reach.
  void look_at(const ReliefFrame& frame, const Block& block) noexcept {
    // Squared distances, with those of the samples around the block.
    double squares[stride][stride];
    sample(frame, block, squares);
    for (int i = block.from_u; i < block.to_u; ++i) {
      for (int j = block.from_v; j < block.to_v; ++j) {
        const int row = i - block.from_u + 1;
        const int column = j - block.from_v + 1;
        const double here = squares[row][column];
        if (!(here < infinity)) continue;
        bool least = true;
        for (int side = 0; side < 8 && least; ++side) {
          constexpr int du[8] = {-1, -1, 0, 1, 1, 1, 0, -1};
          constexpr int dv[8] = {0, -1, -1, -1, 0, 1, 1, 1};
          // Of two as near, the first.
          const double there = squares[row + du[side]][column + dv[side]];
          least = side < 4 ? here < there : here <= there;
        }
        if (!least) continue;
        const double drop =
            std::max(least_drop_, 0.5 * (rise(here, squares[row - 1][column], squares[row + 1][column]) +
                                         rise(here, squares[row][column - 1], squares[row][column + 1])));
        if (here - drop > reach_ * reach_ || found_beside(frame.face, i * step_, j * step_)) continue;
        const double u = i * step_;
        descend_from({frame, u, std::min(j * step_, 1.0 - u)});
      }
    }
  }

  /// How much farther the neighbours on both sides are at most, of those that there are.
  static double rise(double here, double before, double after) noexcept {
    double most = 0.0;
    if (before < infinity) most = before - here;
    if (after < infinity) most = std::max(most, after - here);
    return most;
  }

  void sample(const ReliefFrame& frame, const Block& block, double (&squares)[stride][stride]) noexcept {
    for (int i = block.from_u - 1; i <= block.to_u; ++i) {
      double* row = squares[i - block.from_u + 1];
      // Of the row what lies in the triangle.
      const int begin = std::max(0, block.from_v - 1);
      const int end = i < 0 || i > last_ ? begin : std::min(block.to_v, last_ - i) + 1;
      std::fill(row, row + (block.to_v - block.from_v + 2), infinity);
      for (int j = begin; j < end; j += static_cast<int>(lanes)) {
        Lanes u;
        Lanes v;
        Lanes there;
        for (std::size_t k = 0; k < lanes; ++k) {
          u[k] = i * step_;
          v[k] = std::min(j + static_cast<int>(k), end - 1) * step_;
        }
        surface_.squared_distances(frame, u, v, p_, there);
        for (int k = 0; k < static_cast<int>(lanes) && j + k < end; ++k)
          row[j + k - block.from_v + 1] = there[static_cast<std::size_t>(k)];
        // Heights alone, side by side: about as long as one evaluation with its derivatives.
        ++count_.evaluations;
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
    const Goal goal{.point = p_, .may_leave = false, .exactly = true};
    descend(surface_, at, spot, 1.0, goal, count_);
    const Foot foot = foot_at(at, spot, p_);
    if (foot.distance > reach_) return;
    const double same = 1e-2 * surface_.grain();
    for (const Foot& other : out_) {
      if ((other.point - foot.point).norm() <= same) return;
    }
    if (out_.push_back(foot)) return;
    // Of more than there is room for, the nearest.
    Foot* farthest = std::max_element(out_.begin(), out_.end(),
                                      [](const Foot& a, const Foot& b) { return a.distance < b.distance; });
    if (foot.distance < farthest->distance) *farthest = foot;
  }

  const ReliefSurface& surface_;
  Vec3 p_;
  double reach_;
  CoatMoment moment_;
  ContactSet& out_;
  double step_ = 1.0;  ///< of the face's lattice (barycentric)
  int last_ = 1;       ///< sample along an edge
  /// By how much (m^2) a sample may be farther than a place beside it that is nearest, at least: at the face's border
  /// what lies on one side of it is not known.
  double least_drop_ = 0.0;
  WorkCount count_;
};

}  // namespace

void ReliefView::feet(const Vec3& p, double reach, ContactSet& out) const noexcept {
  out.clear();
  ReliefFeetSearch search(*surface_, p, reach, moment_, out);
  surface_->base().index().for_each_near(p, reach, surface_->boxes(), [&](std::uint32_t face) {
    search.visit(face);
    return reach;
  });
  tell(cache_->work, search.count());
  std::sort(out.begin(), out.end(), [](const Foot& a, const Foot& b) {
    return a.distance < b.distance || (a.distance == b.distance && a.element < b.element);
  });
}

}  // namespace asperity
