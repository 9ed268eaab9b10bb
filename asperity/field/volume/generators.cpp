#include "asperity/field/volume/generators.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "asperity/core/parallel_for.h"

namespace asperity {
namespace {

constexpr double whole_turn = 2.0 * std::numbers::pi;
constexpr std::size_t most_numbers = std::size_t{1} << 28U;  // 1 GB of floats
constexpr std::uint32_t most_nodes = 4096;

struct VolumeEntry {
  VolumeKind kind;
  std::array<std::string_view, 5> parameters;  // as many as are not empty
};
constexpr std::array<VolumeEntry, 6> volume_table{{
    {VolumeKind::cavity, {"speed", "strength", "thickness", "wavelength", "time"}},
    {VolumeKind::sphere, {"radius"}},
    {VolumeKind::shells, {"count", "thickness", "wavelength"}},
    {VolumeKind::ramp, {"gradient", "amplitude"}},
    {VolumeKind::waves, {"amplitude", "wavelength", "steepness", "thickness"}},
    {VolumeKind::gyroid, {"wavelength"}},
}};

Status above_zero(double value, const char* place, const char* unit) {
  if (std::isfinite(value) && value > 0.0) return success();
  return bad_value(fmt::format("is {:g} {}", value, unit), place, fmt::format("a finite number above 0 ({})", unit));
}

Status within(double value, double low, double high, const char* place) {
  if (value >= low && value <= high) return success();
  return bad_value(fmt::format("is {:g}", value), place, fmt::format("{:g} to {:g}", low, high));
}

/// How nodes are spread along an axis.
enum class Clustering { even, middle, ends };

/// Nodes over [0, length]. The cells' widths go with the slope of the map from s in [-1, 1]: cosh for sinh(b s), which
/// is least in the middle; 1 / cosh^2 for tanh(b s), which is least at the ends.
Result<GridAxis> spread(std::uint32_t count, double length, double ratio, Clustering clustering) {
  if (clustering == Clustering::even || ratio <= 1.0) {
    return GridAxis::uniform(0.0, length / static_cast<double>(count - 1), count);
  }
  const double b = std::acosh(clustering == Clustering::middle ? ratio : std::sqrt(ratio));
  std::vector<double> nodes(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    const double s = 2.0 * i / static_cast<double>(count - 1) - 1.0;
    const double at =
        clustering == Clustering::middle ? std::sinh(b * s) / std::sinh(b) : std::tanh(b * s) / std::tanh(b);
    nodes[i] = 0.5 * length * (1.0 + at);
  }
  return GridAxis::build(std::move(nodes));
}

/// `layer(k)` for every layer of nodes along z, on all cores where that pays.
template <class Layer>
void for_all_layers(std::uint32_t layers, std::size_t nodes, std::string_view what, const Progress& progress,
                    const Layer& layer) {
  constexpr std::size_t parallel_nodes = std::size_t{1} << 18U;
  parallel_for(layers, {.threads = nodes < parallel_nodes ? 1U : 0U, .progress = &progress, .what = what},
               [&](std::size_t k) { layer(static_cast<std::uint32_t>(k)); });
}

/// The samples in the whole range of an integer type.
template <class Integer>
std::vector<Integer> scaled_to(const std::vector<float>& samples) {
  const auto [low, high] = std::minmax_element(samples.begin(), samples.end());
  const double lowest = static_cast<double>(*low);
  const double span = std::max(static_cast<double>(*high) - lowest, std::numeric_limits<double>::min());
  constexpr double from = std::numeric_limits<Integer>::min();
  constexpr double range = static_cast<double>(std::numeric_limits<Integer>::max()) - from;
  std::vector<Integer> out(samples.size());
  for (std::size_t n = 0; n < samples.size(); ++n)
    out[n] = static_cast<Integer>(std::lround(from + range * (static_cast<double>(samples[n]) - lowest) / span));
  return out;
}

SampleArray as_type(std::vector<float> samples, SampleType type) {
  if (type == SampleType::int16) return scaled_to<std::int16_t>(samples);
  if (type == SampleType::uint8) return scaled_to<std::uint8_t>(samples);
  return samples;
}

std::size_t node_count(const GridAxes& axes) {
  return static_cast<std::size_t>(axes[0].size()) * axes[1].size() * axes[2].size();
}

Status fits_memory(const GridAxes& axes, std::size_t parts) {
  if (node_count(axes) * parts <= most_numbers) return success();
  return refused(
      ErrorCode::too_large,
      fmt::format("{} x {} x {} nodes do not fit into memory", axes[0].size(), axes[1].size(), axes[2].size()), "size",
      fmt::format("{} nodes in all, or a bricked file (asperity convert)", most_numbers / parts));
}

Status check_kind(const VolumeGenerator& g) {
  switch (g.kind) {
    case VolumeKind::cavity:
      ASPERITY_CHECK(above_zero(g.speed, "speed", "m/s"));
      ASPERITY_CHECK(within(g.strength, 0.0, 0.9, "strength"));
      ASPERITY_CHECK(above_zero(*g.thickness, "thickness", "m"));
      ASPERITY_CHECK(above_zero(*g.wavelength, "wavelength", "m"));
      return within(g.time, -1e6, 1e6, "time");
    case VolumeKind::sphere: return above_zero(*g.radius, "radius", "m");
    case VolumeKind::shells:
      ASPERITY_CHECK(within(g.count, 1, 64, "count"));
      ASPERITY_CHECK(above_zero(*g.wavelength, "wavelength", "m"));
      ASPERITY_CHECK(above_zero(*g.thickness, "thickness", "m"));
      return within(*g.thickness, 0.0, *g.wavelength / (4.0 * g.count), "thickness");
    case VolumeKind::ramp:
      if (!std::isfinite(g.gradient) || g.gradient == 0.0) {
        return bad_value(fmt::format("is {:g}", g.gradient), "gradient", "a finite number, not 0");
      }
      return within(*g.amplitude, 0.0, 1e30, "amplitude");
    case VolumeKind::waves:
      ASPERITY_CHECK(above_zero(*g.wavelength, "wavelength", "m"));
      ASPERITY_CHECK(above_zero(*g.thickness, "thickness", "m"));
      ASPERITY_CHECK(within(g.steepness, 1.0, 1e6, "steepness"));
      return within(*g.amplitude, 0.0, 1e30, "amplitude");
    case VolumeKind::gyroid: return above_zero(*g.wavelength, "wavelength", "m");
  }
  return bad_value("an unknown volume", "kind", "one of the named kinds");
}

}  // namespace

std::span<const std::string_view> parameters_of(VolumeKind kind) {
  for (const VolumeEntry& entry : volume_table) {
    if (entry.kind != kind) continue;
    const auto end = std::find(entry.parameters.begin(), entry.parameters.end(), std::string_view());
    return {entry.parameters.begin(), end};
  }
  return {};
}

Result<VolumeKind> parse_volume_kind(std::string_view name) {
  if (const std::optional<VolumeKind> kind = value_named<VolumeKind>(name)) return *kind;
  return bad_value(fmt::format("\"{}\" is no built-in volume", name), {}, name_list<VolumeKind>());
}

VolumeGenerator completed(VolumeGenerator g) {
  const bool cavity = g.kind == VolumeKind::cavity;
  if (!g.size)
    g.size = cavity ? std::array<std::uint32_t, 3>{259, 127, 128} : std::array<std::uint32_t, 3>{128, 128, 128};
  if (!g.extent) g.extent = cavity ? Vec3(0.2, 0.1, 0.1) : Vec3(0.1, 0.1, 0.1);
  if (!g.stretch) g.stretch = cavity ? 6.0 : 1.0;
  const double side = g.extent->minCoeff();
  if (!g.radius) g.radius = 0.35 * side;
  if (!g.wavelength) {
    switch (g.kind) {
      case VolumeKind::cavity: g.wavelength = 0.2 * g.extent->x(); break;
      case VolumeKind::gyroid: g.wavelength = 0.5 * side; break;
      case VolumeKind::waves: g.wavelength = 0.1 * g.extent->x(); break;
      default: g.wavelength = 0.1 * side; break;
    }
  }
  if (!g.thickness) {
    switch (g.kind) {
      case VolumeKind::cavity: g.thickness = 0.03 * g.extent->z(); break;
      case VolumeKind::waves: g.thickness = 0.1 * g.extent->y(); break;
      default: g.thickness = *g.wavelength * std::min(0.02, 0.25 / std::max(g.count, 1)); break;
    }
  }
  if (!g.amplitude) g.amplitude = g.kind == VolumeKind::waves ? 0.0005 * g.extent->z() : 0.0;
  return g;
}

Status validate(const VolumeGenerator& generator) {
  const VolumeGenerator g = completed(generator);
  for (const std::uint32_t nodes : *g.size) {
    if (nodes < 2 || nodes > most_nodes) {
      return bad_value(fmt::format("has {} nodes along an axis", nodes), "size",
                       fmt::format("2 to {} nodes", most_nodes));
    }
  }
  for (int axis = 0; axis < 3; ++axis) {
    ASPERITY_CHECK(above_zero((*g.extent)[axis], "extent", "m"));
    ASPERITY_CHECK(within((*g.extent)[axis], 1e-9, 1e9, "extent"));
  }
  ASPERITY_CHECK(within(*g.stretch, 1.0, 100.0, "stretch"));
  return check_kind(g);
}

Result<GridAxes> volume_axes(const VolumeGenerator& generator) {
  ASPERITY_CHECK(validate(generator));
  const VolumeGenerator g = completed(generator);
  const bool cavity = g.kind == VolumeKind::cavity;
  const auto axis = [&](std::size_t a, Clustering clustering) {
    return spread((*g.size)[a], (*g.extent)[static_cast<Eigen::Index>(a)], *g.stretch, clustering);
  };
  ASPERITY_TRY(GridAxis x, axis(0, cavity ? Clustering::ends : Clustering::middle));
  ASPERITY_TRY(GridAxis y, axis(1, cavity ? Clustering::even : Clustering::middle));
  ASPERITY_TRY(GridAxis z, axis(2, Clustering::middle));
  return GridAxes{std::move(x), std::move(y), std::move(z)};
}

Result<std::variant<ScalarGrid, VectorGrid>> generate_volume(const VolumeGenerator& generator,
                                                             const Progress& progress) {
  using Volume = std::variant<ScalarGrid, VectorGrid>;
  ASPERITY_TRY(GridAxes axes, volume_axes(generator));
  const char* name = to_string(generator.kind);
  const std::size_t layer = static_cast<std::size_t>(axes[0].size()) * axes[1].size();
  if (generator.kind != VolumeKind::cavity) {
    ASPERITY_TRY(const VolumeFunction function, VolumeFunction::build(generator));
    ASPERITY_CHECK(fits_memory(axes, 1));
    std::vector<float> samples(node_count(axes));
    for_all_layers(axes[2].size(), samples.size(), name, progress, [&](std::uint32_t k) {
      function.slab(axes, k, k + 1, std::span(samples).subspan(layer * k, layer));
    });
    ASPERITY_TRY(ScalarGrid grid,
                 ScalarGrid::build(std::move(axes), as_type(std::move(samples), generator.type), name));
    return Volume(std::move(grid));
  }
  ASPERITY_TRY(const CavityFlow flow, CavityFlow::build(generator));
  ASPERITY_CHECK(fits_memory(axes, 3));
  VectorGrid grid{std::move(axes), {}, "velocity"};
  grid.samples.resize(3 * node_count(grid.axes));
  for_all_layers(grid.axes[2].size(), grid.samples.size(), name, progress, [&](std::uint32_t k) {
    float* to = grid.samples.data() + 3 * layer * k;
    for (const double y : grid.axes[1].nodes()) {
      for (const double x : grid.axes[0].nodes()) {
        const Vec3 u = flow.velocity({x, y, grid.axes[2].node(k)});
        for (int part = 0; part < 3; ++part) *to++ = static_cast<float>(u[part]);
      }
    }
  });
  return Volume(std::move(grid));
}

Result<VolumeFunction> VolumeFunction::build(const VolumeGenerator& generator) {
  ASPERITY_CHECK(validate(generator));
  if (generator.kind == VolumeKind::cavity) {
    return bad_value("the cavity flow is made of vectors", "kind", "a scalar volume");
  }
  VolumeFunction function;
  function.generator_ = completed(generator);
  function.centre_ = 0.5 * *function.generator_.extent;
  return function;
}

double VolumeFunction::value(const Vec3& p) const noexcept {
  const VolumeGenerator& g = generator_;
  switch (g.kind) {
    case VolumeKind::sphere: return *g.radius - (p - centre_).norm();
    case VolumeKind::shells: {
      const double r = (p - centre_).norm();
      const double sheet = std::round(r / *g.wavelength);
      if (sheet < 1.0 || sheet > g.count) return 0.0;
      const auto square = [](double v) { return v * v; };
      const double s = square(std::sin(std::numbers::pi * r / *g.wavelength));
      const double face = square(std::sin(std::numbers::pi * sheet * *g.thickness / *g.wavelength));
      return face * (1.0 - s) / (face * (1.0 - s) + s * (1.0 - face));
    }
    case VolumeKind::ramp: {
      const double linear = g.gradient * (p.z() - centre_.z());
      return *g.amplitude > 0.0 ? *g.amplitude * std::tanh(linear / *g.amplitude) : linear;
    }
    case VolumeKind::waves: {
      const double height = p.z() - centre_.z() - *g.amplitude * std::sin(whole_turn * p.x() / *g.wavelength);
      const double across = (p.y() - centre_.y()) / *g.thickness;
      return height * (1.0 + (g.steepness - 1.0) * std::exp(-across * across));
    }
    case VolumeKind::gyroid: {
      const Vec3 a = p * (whole_turn / *g.wavelength);
      return std::sin(a.x()) * std::cos(a.y()) + std::sin(a.y()) * std::cos(a.z()) + std::sin(a.z()) * std::cos(a.x());
    }
    case VolumeKind::cavity: break;
  }
  return 0.0;
}

void VolumeFunction::row(const GridAxis& x, double y, double z, float* out) const noexcept {
  if (generator_.kind == VolumeKind::sphere) {
    // The one that is written by the thousand million: no branch, no call.
    const double across = (y - centre_.y()) * (y - centre_.y()) + (z - centre_.z()) * (z - centre_.z());
    const double radius = *generator_.radius;
    const std::span<const double> nodes = x.nodes();
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      const double along = nodes[i] - centre_.x();
      out[i] = static_cast<float>(radius - std::sqrt(along * along + across));
    }
    return;
  }
  for (const double at : x.nodes()) *out++ = static_cast<float>(value({at, y, z}));
}

void VolumeFunction::gyroid_slab(const GridAxes& axes, std::uint32_t first, std::uint32_t last, float* out) const {
  const double k = whole_turn / *generator_.wavelength;
  std::array<std::vector<double>, 3> sine;
  std::array<std::vector<double>, 3> cosine;
  for (std::size_t a = 0; a < 3; ++a) {
    for (const double node : axes[a].nodes()) {
      sine[a].push_back(std::sin(k * node));
      cosine[a].push_back(std::cos(k * node));
    }
  }
  const std::size_t width = axes[0].size();
  for (std::uint32_t n = first; n < last; ++n) {
    for (std::uint32_t j = 0; j < axes[1].size(); ++j, out += width) {
      const double across = sine[1][j] * cosine[2][n];
      for (std::size_t i = 0; i < width; ++i)
        out[i] = static_cast<float>(sine[0][i] * cosine[1][j] + across + sine[2][n] * cosine[0][i]);
    }
  }
}

void VolumeFunction::slab(const GridAxes& axes, std::uint32_t first, std::uint32_t last, std::span<float> out) const {
  float* to = out.data();
  if (generator_.kind == VolumeKind::gyroid) return gyroid_slab(axes, first, last, to);
  for (std::uint32_t k = first; k < last; ++k) {
    const float* rows = to;
    for (std::uint32_t j = 0; j < axes[1].size(); ++j, to += axes[0].size()) {
      const bool even = generator_.kind == VolumeKind::waves && generator_.steepness == 1.0;
      const bool same = j > 0 && (even || generator_.kind == VolumeKind::ramp);
      if (same) {
        std::copy_n(rows, axes[0].size(), to);
      } else {
        row(axes[0], axes[1].node(j), axes[2].node(k), to);
      }
    }
  }
}

}  // namespace asperity
