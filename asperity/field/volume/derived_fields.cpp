#include "asperity/field/volume/derived_fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "asperity/core/parallel_for.h"

namespace asperity {
namespace {

/// Below this many nodes a second thread costs more than it brings.
constexpr std::size_t parallel_nodes = std::size_t{1} << 18U;

template <HasNames E>
Result<E> parse_name(std::string_view name, const char* what) {
  if (const std::optional<E> value = value_named<E>(name)) return *value;
  return bad_value(fmt::format("\"{}\" is no {}", name, what), {}, name_list<E>());
}

using AxisStencils = std::vector<DerivativeStencil>;

AxisStencils stencils_of(const GridAxis& axis) {
  AxisStencils stencils(axis.size());
  for (std::uint32_t i = 0; i < axis.size(); ++i) stencils[i] = derivative_stencil(axis, i);
  return stencils;
}

/// Slopes of samples with `parts` numbers a node.
class Slopes {
 public:
  Slopes(const GridAxes& axes, std::size_t parts)
      : stencils_{stencils_of(axes[0]), stencils_of(axes[1]), stencils_of(axes[2])},
        stride_{parts, parts * axes[0].size(), parts * axes[0].size() * axes[1].size()} {}

  /// Where the numbers of node `at` begin.
  [[nodiscard]] std::size_t base(const std::array<std::uint32_t, 3>& at) const {
    return at[0] * stride_[0] + at[1] * stride_[1] + at[2] * stride_[2];
  }
  /// Slope of part `part` along `axis` at node `at`.
  template <class Samples>
  [[nodiscard]] double slope(const Samples& samples, const std::array<std::uint32_t, 3>& at, std::size_t base,
                             std::size_t part, std::size_t axis) const {
    const DerivativeStencil& stencil = stencils_[axis][at[axis]];
    std::size_t from = base + part + stencil.first * stride_[axis] - at[axis] * stride_[axis];
    double sum = 0.0;
    for (std::uint32_t n = 0; n < stencil.count; ++n, from += stride_[axis])
      sum += stencil.weights[n] * static_cast<double>(samples[from]);
    return sum;
  }

 private:
  std::array<AxisStencils, 3> stencils_;
  std::array<std::size_t, 3> stride_;
};

/// `node_value(at)` for every node, layers shared out over all cores where that pays.
template <class NodeValue>
std::vector<float> for_all_nodes(const GridAxes& axes, std::string_view what, const Progress& progress,
                                 const NodeValue& node_value) {
  const std::size_t layer = static_cast<std::size_t>(axes[0].size()) * axes[1].size();
  std::vector<float> out(layer * axes[2].size());
  const auto fill = [&](std::size_t k) {
    float* to = out.data() + layer * k;
    for (std::uint32_t j = 0; j < axes[1].size(); ++j) {
      for (std::uint32_t i = 0; i < axes[0].size(); ++i)
        *to++ = static_cast<float>(node_value(std::array<std::uint32_t, 3>{i, j, static_cast<std::uint32_t>(k)}));
    }
  };
  parallel_for(axes[2].size(), {.threads = out.size() < parallel_nodes ? 1U : 0U, .progress = &progress, .what = what},
               fill);
  return out;
}

/// |curl u|, Q, u . curl u and |grad u| at a node; each asks only for the slopes that it needs.
class NodeOfFlow {
 public:
  NodeOfFlow(const std::vector<float>& samples, const Slopes& slopes) : samples_(samples), slopes_(slopes) {}

  [[nodiscard]] Vec3 vorticity(const std::array<std::uint32_t, 3>& at) const {
    const std::size_t base = slopes_.base(at);
    const auto d = [&](std::size_t part, std::size_t axis) { return slopes_.slope(samples_, at, base, part, axis); };
    return {d(2, 1) - d(1, 2), d(0, 2) - d(2, 0), d(1, 0) - d(0, 1)};
  }
  [[nodiscard]] double helicity(const std::array<std::uint32_t, 3>& at) const {
    const std::size_t base = slopes_.base(at);
    const Vec3 u(static_cast<double>(samples_[base]), static_cast<double>(samples_[base + 1]),
                 static_cast<double>(samples_[base + 2]));
    return u.dot(vorticity(at));
  }
  [[nodiscard]] Mat3 gradient(const std::array<std::uint32_t, 3>& at) const {
    const std::size_t base = slopes_.base(at);
    Mat3 out;
    for (std::size_t part = 0; part < 3; ++part) {
      for (std::size_t axis = 0; axis < 3; ++axis)
        out(static_cast<Eigen::Index>(part), static_cast<Eigen::Index>(axis)) =
            slopes_.slope(samples_, at, base, part, axis);
    }
    return out;
  }
  /// (|Omega|^2 - |S|^2) / 2 = -sum_ij (du_i/dx_j) (du_j/dx_i) / 2.
  [[nodiscard]] double q_criterion(const std::array<std::uint32_t, 3>& at) const {
    const Mat3 g = gradient(at);
    return -0.5 * g.cwiseProduct(g.transpose()).sum();
  }

 private:
  const std::vector<float>& samples_;
  const Slopes& slopes_;
};

std::string derived_name(const std::string& of, const char* what) {
  return of.empty() ? std::string(what) : fmt::format("{} of {}", what, of);
}

}  // namespace

Result<DerivedField> parse_derived_field(std::string_view name) {
  return parse_name<DerivedField>(name, "derived field");
}

Result<VectorPart> parse_vector_part(std::string_view name) {
  return parse_name<VectorPart>(name, "part of a vector");
}

DerivativeStencil derivative_stencil(const GridAxis& axis, std::uint32_t node) noexcept {
  if (axis.size() == 2) {
    const double slope = 1.0 / axis.width(0);
    return {0, 2, {-slope, slope, 0.0}};
  }
  const std::uint32_t middle = std::clamp(node, std::uint32_t{1}, axis.size() - 2);
  const double below = axis.width(middle - 1);
  const double above = axis.width(middle);
  const double both = below + above;
  // Lagrange's quadratic through the three nodes, differentiated at x, the place measured from the middle node.
  const double x = node < middle ? -below : (node > middle ? above : 0.0);
  return {middle - 1,
          3,
          {(2.0 * x - above) / (below * both), (above - below - 2.0 * x) / (below * above),
           (2.0 * x + below) / (above * both)}};
}

Status validate(const VectorGrid& grid) {
  std::size_t nodes = 1;
  for (const GridAxis& axis : grid.axes) nodes *= axis.size();
  if (nodes == 0 || grid.samples.size() != 3 * nodes) {
    return refused(ErrorCode::mismatch,
                   fmt::format("{} numbers on {} x {} x {} nodes", grid.samples.size(), grid.axes[0].size(),
                               grid.axes[1].size(), grid.axes[2].size()),
                   grid.name, "three numbers for each node");
  }
  const auto infinite = std::find_if(grid.samples.begin(), grid.samples.end(), [](float v) { return std::isinf(v); });
  if (infinite == grid.samples.end()) return success();
  return bad_value("is infinite", fmt::format("{} vector {}", grid.name, (infinite - grid.samples.begin()) / 3),
                   "finite numbers, or NaN where nothing is known");
}

Result<ScalarGrid> derive(const VectorGrid& velocity, DerivedField field, const Progress& progress) {
  ASPERITY_CHECK(validate(velocity));
  const char* name = to_string(field);
  const Slopes slopes(velocity.axes, 3);
  const NodeOfFlow node(velocity.samples, slopes);
  const auto all = [&](const auto& value) { return for_all_nodes(velocity.axes, name, progress, value); };
  using At = std::array<std::uint32_t, 3>;
  std::vector<float> samples;
  switch (field) {
    case DerivedField::vorticity_magnitude:
      samples = all([&](const At& at) { return node.vorticity(at).norm(); });
      break;
    case DerivedField::q_criterion: samples = all([&](const At& at) { return node.q_criterion(at); }); break;
    case DerivedField::helicity: samples = all([&](const At& at) { return node.helicity(at); }); break;
    case DerivedField::gradient_magnitude: samples = all([&](const At& at) { return node.gradient(at).norm(); }); break;
  }
  return ScalarGrid::build(velocity.axes, std::move(samples), derived_name(velocity.name, name));
}

Result<ScalarGrid> derive(const ScalarGrid& grid, DerivedField field, const Progress& progress) {
  const char* name = to_string(field);
  if (field != DerivedField::gradient_magnitude) {
    return bad_value(fmt::format("{} needs vectors, and \"{}\" holds one number a node", name, grid.name()), "derive",
                     "gradient_magnitude, or a velocity");
  }
  const Slopes slopes(grid.axes(), 1);
  std::vector<float> samples = std::visit(
      [&](const auto& values) {
        return for_all_nodes(grid.axes(), name, progress, [&](const std::array<std::uint32_t, 3>& at) {
          const std::size_t base = slopes.base(at);
          return Vec3(slopes.slope(values, at, base, 0, 0), slopes.slope(values, at, base, 0, 1),
                      slopes.slope(values, at, base, 0, 2))
              .norm();
        });
      },
      grid.samples());
  return ScalarGrid::build(grid.axes(), std::move(samples), derived_name(grid.name(), name));
}

Result<ScalarGrid> part_of(const VectorGrid& grid, VectorPart part) {
  ASPERITY_CHECK(validate(grid));
  std::vector<float> samples(grid.samples.size() / 3);
  for (std::size_t n = 0; n < samples.size(); ++n) {
    const float* v = grid.samples.data() + 3 * n;
    samples[n] = part == VectorPart::magnitude
                     ? static_cast<float>(
                           std::hypot(static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])))
                     : v[static_cast<std::size_t>(part) - 1];
  }
  return ScalarGrid::build(grid.axes, std::move(samples), derived_name(grid.name, to_string(part)));
}

}  // namespace asperity
