#include "asperity/study/detail/stroke_layer.h"

#include <algorithm>
#include <cmath>

#include "asperity/study/metrics.h"
#include "asperity/study/picture.h"

namespace asperity {
namespace {

constexpr std::size_t most_points = 20000;
constexpr double line_radius = 1.0 / 260.0;  // of the image's height
constexpr double edge_radius = 1.0 / 420.0;  // of the dark edge around it
constexpr double edge_opacity = 0.55;
constexpr double depth_slack = 0.012;  // of the view's height: the felt point rests on the surface, not before it

struct FeltPoint {
  Vec3 image;  // pixel x, y and depth
  double force = 0.0;
};

/// Cover of the line and its edge, and the line's colour, pixel by pixel.
struct Layer {
  int width;
  int height;
  std::vector<float> line;
  std::vector<float> edge;
  std::vector<double> force;
  Layer(int w, int h)
      : width(w),
        height(h),
        line(static_cast<std::size_t>(w) * static_cast<std::size_t>(h), 0.0F),
        edge(line),
        force(line.size(), 0.0) {}
};

/// Stretches of points in contact; a point each few ticks where a run is long, with the largest force of those it
/// stands for.
std::vector<std::vector<FeltPoint>> felt_stretches(const Camera& camera, std::span<const TraceRecord> records) {
  const std::size_t stride = records.size() / most_points + 1;
  std::vector<std::vector<FeltPoint>> stretches;
  bool open = false;
  std::size_t since = 0;
  for (const TraceRecord& tick : records) {
    const bool felt = tick.rendered.flags.has(TickFlag::contact) || tick.rendered.flags.has(TickFlag::field_force);
    if (!felt || !tick.rendered.proxy.allFinite()) {
      open = false;
      continue;
    }
    if (!open) stretches.emplace_back();
    const double force = tick.commanded.norm();
    if (!open || ++since >= stride) {
      stretches.back().push_back({camera.project(tick.rendered.proxy), force});
      since = 0;
    } else {
      stretches.back().back().force = std::max(stretches.back().back().force, force);
    }
    open = true;
  }
  return stretches;
}

class Pen {
 public:
  Pen(const Camera& camera, const Shaded& shaded, Layer& layer)
      : shaded_(shaded),
        layer_(layer),
        radius_(std::max(1.4, line_radius * camera.height)),
        edge_(radius_ + std::max(0.9, edge_radius * camera.height)),
        slack_(depth_slack * camera.height * camera.pixel) {}

  void segment(const FeltPoint& a, const FeltPoint& b) {
    const double reach = edge_ + 1.0;
    const int left = std::max(0, static_cast<int>(std::floor(std::min(a.image.x(), b.image.x()) - reach)));
    const int right =
        std::min(layer_.width - 1, static_cast<int>(std::ceil(std::max(a.image.x(), b.image.x()) + reach)));
    const int top = std::max(0, static_cast<int>(std::floor(std::min(a.image.y(), b.image.y()) - reach)));
    const int bottom =
        std::min(layer_.height - 1, static_cast<int>(std::ceil(std::max(a.image.y(), b.image.y()) + reach)));
    for (int y = top; y <= bottom; ++y) {
      for (int x = left; x <= right; ++x) touch(x, y, a, b);
    }
  }

 private:
  void touch(int x, int y, const FeltPoint& a, const FeltPoint& b) {
    const double dx = b.image.x() - a.image.x();
    const double dy = b.image.y() - a.image.y();
    const double px = x + 0.5 - a.image.x();
    const double py = y + 0.5 - a.image.y();
    const double squared = dx * dx + dy * dy;
    const double u = squared > 0.0 ? std::clamp((px * dx + py * dy) / squared, 0.0, 1.0) : 0.0;
    const double distance = std::hypot(px - u * dx, py - u * dy);
    if (distance > edge_ + 0.5) return;
    const double depth = a.image.z() + u * (b.image.z() - a.image.z());
    const std::size_t i =
        static_cast<std::size_t>(y) * static_cast<std::size_t>(layer_.width) + static_cast<std::size_t>(x);
    if (depth * (1.0 - slack_) > static_cast<double>(shaded_.depths[i])) return;
    const auto line = static_cast<float>(std::clamp(radius_ + 0.5 - distance, 0.0, 1.0));
    layer_.edge[i] = std::max(layer_.edge[i], static_cast<float>(std::clamp(edge_ + 0.5 - distance, 0.0, 1.0)));
    if (line <= 0.0F || line < layer_.line[i]) return;
    layer_.line[i] = line;
    layer_.force[i] = a.force + u * (b.force - a.force);
  }

  const Shaded& shaded_;
  Layer& layer_;
  double radius_;
  double edge_;
  double slack_;
};

void blend(Colour& under, const Colour& over, double opacity) {
  for (std::size_t c = 0; c < 3; ++c) under[c] += static_cast<float>(opacity) * (over[c] - under[c]);
}

/// All but the weakest and strongest 2 %, so that one peak does not take all the colours.
ForceRange force_range(const std::vector<double>& forces) {
  if (forces.empty()) return {};
  const ForceRange range{percentile(forces, 0.02), percentile(forces, 0.98)};
  return range.high - range.low > 0.05 * range.high ? range : ForceRange{0.0, range.high};
}

}  // namespace

ForceRange draw_stroke(const Camera& camera, std::span<const TraceRecord> records, const Shaded& shaded,
                       std::vector<Colour>& colours) {
  const auto stretches = felt_stretches(camera, records);
  std::vector<double> forces;
  Layer layer(shaded.width, shaded.height);
  Pen pen(camera, shaded, layer);
  for (const auto& stretch : stretches) {
    for (std::size_t i = 0; i < stretch.size(); ++i) {
      forces.push_back(stretch[i].force);
      pen.segment(stretch[i > 0 ? i - 1 : 0], stretch[i]);
    }
  }
  const ForceRange range = force_range(forces);
  const double span = range.high - range.low;
  for (std::size_t i = 0; i < colours.size(); ++i) {
    if (layer.edge[i] <= 0.0F) continue;
    blend(colours[i], {0.07F, 0.07F, 0.10F}, edge_opacity * static_cast<double>(layer.edge[i]));
    const auto rgb = force_colour(span > 0.0 ? (layer.force[i] - range.low) / span : 0.0);
    blend(
        colours[i],
        {static_cast<float>(rgb[0]) / 255.0F, static_cast<float>(rgb[1]) / 255.0F, static_cast<float>(rgb[2]) / 255.0F},
        static_cast<double>(layer.line[i]));
  }
  return range;
}

}  // namespace asperity
