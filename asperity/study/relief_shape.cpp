#include "asperity/study/relief_shape.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace asperity {
namespace {

constexpr double pi = std::numbers::pi;
constexpr int most_places = 512;  // along an axis of a map
constexpr std::size_t places_on_a_coat = 65536;
constexpr double crossing_margin = 0.15;  // of the range: less is no crossing

/// Second derivatives in metres: (1/m).
struct Bend {
  double xx = 0.0;
  double xy = 0.0;
  double yy = 0.0;
  /// The larger principal value of minus the matrix: convex above 0.
  [[nodiscard]] double convexity() const noexcept {
    const double mean = -0.5 * (xx + yy);
    return mean + std::hypot(0.5 * (xx - yy), xy);
  }
};

/// `bends` are above 0, `places` those looked at.
CrestRadii radii_of(std::vector<double> bends, std::size_t places) {
  CrestRadii radii;
  if (bends.empty()) return radii;
  std::sort(bends.begin(), bends.end(), std::greater<>());
  for (std::size_t i = 0; i < radii.percentiles.size(); ++i)
    radii.percentiles[i] = 1.0 / bends[i * (bends.size() - 1) / (radii.percentiles.size() - 1)];
  radii.convex_share = static_cast<double>(bends.size()) / static_cast<double>(places);
  return radii;
}

/// Keeps what is convex by more than rounding of heights over a texel makes.
void drop_flat(std::vector<double>& bends) {
  if (bends.empty()) return;
  const double least = 1e-6 * *std::max_element(bends.begin(), bends.end());
  std::erase_if(bends, [least](double bend) { return !(bend > least) || !(bend > 0.0); });
}

/// Mean lengths of complete runs above and below a level, in samples.
class Runs {
 public:
  Runs(double level, double margin) : level_(level), margin_(margin) {}

  /// `height(i)` for i = 0 ... count - 1; a loop where `closed`.
  template <class Height>
  void add(int count, bool closed, const Height& height) {
    int side = 0;        // of the level, once it was left by the margin
    bool known = false;  // where the run began
    double crossed = 0.0;
    double first = -1.0;
    const int end = closed ? 2 * count : count;
    double last_height = 0.0;
    for (int i = 0; i < end; ++i) {
      const double over = height(i % count) - level_;
      // Where the level itself was crossed last, whatever the margin.
      if (i > 0 && (over < 0.0) != (last_height < 0.0)) crossed = i - over / (over - last_height);
      last_height = over;
      const int now = over > margin_ ? 1 : over < -margin_ ? -1 : 0;
      if (now == 0 || now == side) continue;
      if (side != 0) {
        if (known) take(side, crossed - start_);
        if (first < 0.0) first = crossed;
        start_ = crossed;
        known = true;
        // Once around: what follows is known.
        if (closed && crossed >= first + count - 1e-9) return;
      }
      side = now;
    }
  }

  /// Twice the shorter mean run, in samples; nothing where no run is complete.
  [[nodiscard]] std::optional<double> wave() const {
    std::optional<double> best;
    for (int side = 0; side < 2; ++side) {
      if (counts_[side] == 0) continue;
      const double wave = 2.0 * sums_[side] / static_cast<double>(counts_[side]);
      if (!best || wave < *best) best = wave;
    }
    return best;
  }

 private:
  void take(int side, double length) {
    sums_[side > 0 ? 1 : 0] += length;
    ++counts_[side > 0 ? 1 : 0];
  }

  double level_;
  double margin_;
  double start_ = 0.0;
  double sums_[2] = {0.0, 0.0};
  std::size_t counts_[2] = {0, 0};
};

int stride_for(int size) {
  return std::max(1, (size + most_places - 1) / most_places);
}

/// Twice the shorter mean run along the rows and the columns (m).
double main_wave(const HeightMap& map, const Vec2& pitch) {
  std::vector<double> heights;
  for (int y = 0; y < map.height(); y += stride_for(map.height())) {
    for (int x = 0; x < map.width(); x += stride_for(map.width())) heights.push_back(map.texel(x, y));
  }
  std::sort(heights.begin(), heights.end());
  const auto percentile = [&](double share) {
    return heights[static_cast<std::size_t>(share * static_cast<double>(heights.size() - 1))];
  };
  // Between what there is some of, so that a speck of dust is no feature; of a few features on a ground, the features.
  double low = percentile(0.01);
  double high = percentile(0.99);
  if (!(high > low)) {
    low = heights.front();
    high = heights.back();
  }
  const double level = 0.5 * (low + high);
  const double margin = crossing_margin * (high - low);
  const bool closed = map.wrap() == Wrap::repeat;
  Runs rows(level, margin);
  for (int y = 0; y < map.height(); y += stride_for(map.height()))
    rows.add(map.width(), closed, [&](int x) { return map.texel(x, y); });
  Runs columns(level, margin);
  for (int x = 0; x < map.width(); x += stride_for(map.width()))
    columns.add(map.height(), closed, [&](int y) { return map.texel(x, y); });
  double wave = infinity;
  if (const auto found = rows.wave()) wave = std::min(wave, *found * pitch.x());
  if (const auto found = columns.wave()) wave = std::min(wave, *found * pitch.y());
  // A relief that crosses its mean nowhere twice: one wave as large as the map, there and back.
  return std::isfinite(wave) ? wave : 2.0 * std::min(pitch.x() * map.width(), pitch.y() * map.height());
}

/// Sums for the finest wave and the crests.
class BendStatistics {
 public:
  void add(const Vec2& slope, const Bend& bend) {
    ++places_;
    slopes_ += slope.cwiseAbs2();
    bends_ += Vec2(bend.xx * bend.xx, bend.yy * bend.yy);
    const double convex = bend.convexity();
    if (convex > 0.0) convex_.push_back(convex);
  }
  /// 0 where nothing bends.
  [[nodiscard]] double finest_wave() const {
    double wave = infinity;
    for (int axis = 0; axis < 2; ++axis) {
      if (bends_[axis] > 1e-12 * bends_.maxCoeff() && slopes_[axis] > 0.0)
        wave = std::min(wave, 2.0 * pi * std::sqrt(slopes_[axis] / bends_[axis]));
    }
    return std::isfinite(wave) ? wave : 0.0;
  }
  [[nodiscard]] CrestRadii crests() {
    drop_flat(convex_);
    return radii_of(std::move(convex_), places_);
  }

 private:
  std::size_t places_ = 0;
  Vec2 slopes_ = Vec2::Zero();
  Vec2 bends_ = Vec2::Zero();
  std::vector<double> convex_;
};

void add_spline_place(const HeightMap& map, const Vec2& tile, int x, int y, BendStatistics& statistics) {
  const HeightCurvature c = map.curvature(map.texel_centre(x, y));
  const Bend bend{c.ss / (tile.x() * tile.x()), c.st / (tile.x() * tile.y()), c.tt / (tile.y() * tile.y())};
  statistics.add(c.gradient.cwiseQuotient(tile), bend);
}

/// Differences of neighbouring texels; the border of a map that does not repeat is left out.
void add_difference_place(const HeightMap& map, const Vec2& pitch, int x, int y, BendStatistics& statistics) {
  const bool closed = map.wrap() == Wrap::repeat;
  const int w = map.width();
  const int h = map.height();
  if (!closed && (x == 0 || y == 0 || x == w - 1 || y == h - 1)) return;
  const auto at = [&](int i, int j) { return map.texel((i + w) % w, (j + h) % h); };
  const double here = at(x, y);
  const Vec2 slope((at(x + 1, y) - at(x - 1, y)) / (2.0 * pitch.x()),
                   (at(x, y - 1) - at(x, y + 1)) / (2.0 * pitch.y()));
  Bend bend;
  bend.xx = (at(x + 1, y) - 2.0 * here + at(x - 1, y)) / (pitch.x() * pitch.x());
  bend.yy = (at(x, y + 1) - 2.0 * here + at(x, y - 1)) / (pitch.y() * pitch.y());
  bend.xy = (at(x + 1, y - 1) - at(x - 1, y - 1) - at(x + 1, y + 1) + at(x - 1, y + 1)) / (4.0 * pitch.x() * pitch.y());
  statistics.add(slope, bend);
}

/// Highest and lowest of what is between the texels as well.
void take_range(const HeightMap& map, ReliefShape& shape) {
  shape.lowest = map.lowest();
  shape.highest = map.highest();
  if (!is_spline(map.reconstruction())) return;
  // The map's own bounds are those of its coefficients, wider than what is reached: two samples a texel come closer.
  const double reach_low = shape.lowest;
  const double reach_high = shape.highest;
  double low = infinity;
  double high = -infinity;
  const int across = stride_for(map.width());
  const int down = stride_for(map.height());
  for (int y = 0; y < map.height(); y += down) {
    for (int x = 0; x < map.width(); x += across) {
      const Vec2 centre = map.texel_centre(x, y);
      for (const double shift : {0.0, 0.5}) {
        const Vec2 st = centre + Vec2(shift / map.width(), shift / map.height());
        const double height = map.height_at(st);
        low = std::min(low, height);
        high = std::max(high, height);
      }
    }
  }
  if (across > 1 || down > 1) return;  // thinned out, peaks may be missed: the bounds stay
  shape.lowest = std::max(low, reach_low);
  shape.highest = std::min(high, reach_high);
}

/// Size on the surface of one unit of texture coordinate (m), the median over the faces.
Vec2 size_on_mesh(const TriangleMesh& mesh, const Coat& coat) {
  if (mesh.triangles().empty()) return coat.maps().tile();
  if (coat.frame(mesh, 0).triplanar) return coat.maps().tile();
  std::vector<double> along_s;
  std::vector<double> along_t;
  const auto faces = static_cast<std::uint32_t>(mesh.triangles().size());
  for (std::uint32_t face = 0; face < faces; ++face) {
    const CoatFrame frame = coat.frame(mesh, face);
    const auto [a, b, c] = mesh.corners(face);
    const double det = frame.st_u.x() * frame.st_v.y() - frame.st_u.y() * frame.st_v.x();
    if (!(std::abs(det) > 0.0)) continue;
    const Vec3 per_s = (frame.st_v.y() * (b - a) - frame.st_u.y() * (c - a)) / det;
    const Vec3 per_t = (-frame.st_v.x() * (b - a) + frame.st_u.x() * (c - a)) / det;
    along_s.push_back(per_s.norm());
    along_t.push_back(per_t.norm());
  }
  if (along_s.empty()) return coat.maps().tile();
  const auto median = [](std::vector<double>& values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
  };
  return {median(along_s), median(along_t)};
}

/// Crests and finest waves of the heights as they lie on the faces.
void measure_on_faces(const TriangleMesh& mesh, const Coat& coat, ReliefShape& shape) {
  const auto faces = static_cast<std::uint32_t>(mesh.triangles().size());
  std::vector<double> areas(faces);
  double total = 0.0;
  for (std::uint32_t face = 0; face < faces; ++face) {
    const auto [a, b, c] = mesh.corners(face);
    total += 0.5 * (b - a).cross(c - a).norm();
    areas[face] = total;
  }
  if (!(total > 0.0)) return;
  BendStatistics statistics;
  std::uint32_t face = 0;
  std::optional<std::uint32_t> prepared;
  CoatFrame frame;
  BarycentricFrame plane;
  Vec3 axis_x = Vec3::UnitX();
  Vec3 axis_y = Vec3::UnitY();
  for (std::size_t i = 0; i < places_on_a_coat; ++i) {
    const double target = (static_cast<double>(i) + 0.5) / static_cast<double>(places_on_a_coat) * total;
    while (face + 1 < faces && areas[face] < target) ++face;
    if (prepared != face) {
      frame = coat.frame(mesh, face);
      plane = barycentric_frame(mesh, face);
      const auto corners = mesh.corners(face);
      axis_x = (corners[1] - corners[0]).normalized();
      axis_y = plane.normal.cross(axis_x);
      prepared = face;
    }
    // Additive recurrence of the plastic number: even over the unit square, here folded into the triangle.
    double u = std::fmod(0.5 + 0.7548776662466927 * static_cast<double>(i), 1.0);
    double v = std::fmod(0.5 + 0.5698402909980532 * static_cast<double>(i), 1.0);
    if (u + v > 1.0) {
      u = 1.0 - u;
      v = 1.0 - v;
    }
    const HeightJet jet = coat.jet(frame, u, v);
    const Vec2 gu(plane.gradient[1].dot(axis_x), plane.gradient[1].dot(axis_y));
    const Vec2 gv(plane.gradient[2].dot(axis_x), plane.gradient[2].dot(axis_y));
    const auto bend = [&](int p, int q) {
      return jet.uu * gu[p] * gu[q] + jet.uv * (gu[p] * gv[q] + gv[p] * gu[q]) + jet.vv * gv[p] * gv[q];
    };
    statistics.add(jet.u * gu + jet.v * gv, {bend(0, 0), bend(0, 1), bend(1, 1)});
  }
  const double finest = statistics.finest_wave();
  if (finest > 0.0) shape.finest_wave = finest;
  shape.crests = statistics.crests();
}

/// Twice the 99th percentile of the distance of the heights from chords over `span` texels (m).
double residual_over(const HeightMap& map, int span_x, int span_y) {
  std::vector<double> distances;
  const auto along = [&](int count, int span, bool closed, const auto& height) {
    const int last = closed ? count : count - span;
    for (int begin = 0; begin < last; begin += span) {
      const double a = height(begin);
      const double b = height((begin + span) % count);
      for (int i = 1; i < span; ++i) {
        const double share = static_cast<double>(i) / span;
        distances.push_back(std::abs(height((begin + i) % count) - ((1.0 - share) * a + share * b)));
      }
    }
  };
  const bool closed = map.wrap() == Wrap::repeat;
  // A quarter of what is looked at for waves: this is asked for several spans.
  for (int y = 0; y < map.height(); y += 4 * stride_for(map.height()))
    along(map.width(), span_x, closed, [&](int x) { return map.texel(x, y); });
  for (int x = 0; x < map.width(); x += 4 * stride_for(map.width()))
    along(map.height(), span_y, closed, [&](int y) { return map.texel(x, y); });
  if (distances.empty()) return 0.0;
  const auto at = distances.begin() + static_cast<std::ptrdiff_t>(0.99 * static_cast<double>(distances.size() - 1));
  std::nth_element(distances.begin(), at, distances.end());
  return 2.0 * *at;
}

}  // namespace

double CrestRadii::share_sharper(double radius) const noexcept {
  if (!(percentiles[0] < radius)) return 0.0;
  std::size_t above = 1;
  while (above < percentiles.size() && percentiles[above] < radius) ++above;
  if (above == percentiles.size()) return convex_share;
  // Between two percentiles bends, not radii, are spread evenly.
  const double sharper = 1.0 / percentiles[above - 1];
  const double rounder = 1.0 / percentiles[above];
  const double part = sharper > rounder ? (sharper - 1.0 / radius) / (sharper - rounder) : 0.0;
  return 0.01 * (static_cast<double>(above - 1) + part) * convex_share;
}

double cosine_crest_radius(double wavelength, double amplitude) noexcept {
  return wavelength * wavelength / (4.0 * pi * pi * amplitude);
}

ReliefShape cosine_shape(double wavelength, double amplitude) noexcept {
  ReliefShape shape;
  shape.lowest = -amplitude;
  shape.highest = amplitude;
  shape.wave = shape.finest_wave = wavelength;
  const double radius = cosine_crest_radius(wavelength, amplitude);
  // Convex places lie within a quarter wave of a crest, evenly: radius / cos there.
  for (std::size_t i = 0; i + 1 < shape.crests.percentiles.size(); ++i)
    shape.crests.percentiles[i] = radius / std::cos(0.01 * static_cast<double>(i) * 0.5 * pi);
  shape.crests.convex_share = 0.5;
  return shape;
}

ReliefShape scaled(const ReliefShape& shape, double height, double width) noexcept {
  ReliefShape out = shape;
  out.lowest *= height;
  out.highest *= height;
  out.step *= height;
  out.wave *= width;
  out.finest_wave *= width;
  out.texel *= width;
  const double rounder = width * width / height;
  for (double& radius : out.crests.percentiles) radius *= rounder;
  return out;
}

ReliefShape measure_shape(const HeightMap& map, const Vec2& tile) {
  ReliefShape shape;
  take_range(map, shape);
  const Vec2 pitch(tile.x() / map.width(), tile.y() / map.height());
  shape.texel = std::sqrt(pitch.x() * pitch.y());
  shape.step = map.quantisation_step();
  if (!(shape.range() > 0.0)) {
    shape.wave = shape.finest_wave = 2.0 * std::min(tile.x(), tile.y());
    return shape;
  }
  shape.wave = main_wave(map, pitch);
  BendStatistics statistics;
  const bool spline = is_spline(map.reconstruction());
  for (int y = 0; y < map.height(); y += stride_for(map.height())) {
    for (int x = 0; x < map.width(); x += stride_for(map.width())) {
      if (spline) {
        add_spline_place(map, tile, x, y, statistics);
      } else {
        add_difference_place(map, pitch, x, y, statistics);
      }
    }
  }
  shape.finest_wave = statistics.finest_wave();
  shape.crests = statistics.crests();
  return shape;
}

ReliefShape measure_shape(const TriangleMesh& mesh, const Coat& coat) {
  ReliefShape shape = measure_shape(coat.maps().heights(), size_on_mesh(mesh, coat));
  if (coat.highest() - coat.lowest() > 1.5 * shape.range()) {
    // More is on it than the first map.
    shape.lowest = coat.lowest();
    shape.highest = coat.highest();
  }
  if (is_spline(coat.maps().heights().reconstruction())) measure_on_faces(mesh, coat, shape);
  return shape;
}

Result<ReliefShape> measure_shape(const std::vector<SurfaceFeature>& features) {
  if (features.empty()) return bad_value("holds no feature", "features", "one feature or more");
  const FeatureSpec& only = features.front().spec();
  const bool round = only.kind == FeatureKind::grating || only.kind == FeatureKind::circular_grating;
  if (features.size() == 1 && round) return cosine_shape(only.wavelength.x(), only.amplitude);
  // Crests alone reach this; how the rest is spread differs little between one cosine and a product of two.
  if (features.size() == 1 && only.kind == FeatureKind::grid)
    return cosine_shape(std::min(only.wavelength.x(), only.wavelength.y()), only.amplitude);
  double longest = 0.0;
  double shortest = infinity;
  for (const SurfaceFeature& feature : features) {
    const FeatureSpec& spec = feature.spec();
    longest = std::max({longest, feature.wavelength(), spec.wavelength.x(), spec.wavelength.y()});
    shortest = std::min(shortest, feature.wavelength());
  }
  constexpr int most_texels = 1024;
  const double side = std::max(4.0 * longest, 16.0 * shortest);
  const int texels = std::clamp(static_cast<int>(std::ceil(16.0 * side / shortest)), 64, most_texels);
  ASPERITY_TRY(const HeightMap map, bake(features, Vec2::Zero(), Vec2(side, side), texels, texels, Wrap::clamp));
  ReliefShape shape = measure_shape(map, Vec2(side, side));
  shape.texel = 0.0;
  shape.step = 0.0;
  return shape;
}

BaseMeshAdvice advise_base_mesh(const TriangleMesh& mesh, const Coat& coat) {
  BaseMeshAdvice advice;
  advice.mean_edge = mesh.mean_edge();
  advice.range = coat.highest() - coat.lowest();
  advice.height_allowed = largest_relief_over_edge * advice.mean_edge;
  advice.triangles = mesh.triangles().size();
  if (!(advice.mean_edge > 0.0) || !(advice.range > 0.0)) return advice;
  const Vec2 corners[3] = {Vec2(0.0, 0.0), Vec2(1.0, 0.0), Vec2(0.0, 1.0)};
  std::size_t beyond = 0;
  const auto faces = static_cast<std::uint32_t>(mesh.triangles().size());
  for (std::uint32_t face = 0; face < faces; ++face) {
    const auto [a, b, c] = mesh.corners(face);
    const double edge = ((b - a).norm() + (c - b).norm() + (a - c).norm()) / 3.0;
    const HeightRange range = coat.range(coat.frame(mesh, face), corners);
    const double ratio = std::min(range.highest - range.lowest, advice.range) / edge;
    advice.largest_ratio = std::max(advice.largest_ratio, ratio);
    if (ratio > largest_relief_over_edge) ++beyond;
  }
  advice.share_of_faces = static_cast<double>(beyond) / static_cast<double>(faces);
  constexpr double some_faces = 0.05;
  advice.exceeded =
      advice.share_of_faces > some_faces || (advice.range > advice.height_allowed && advice.share_of_faces > 0.0);
  if (!advice.exceeded) return advice;
  const HeightMap& map = coat.maps().heights();
  const Vec2 size = size_on_mesh(mesh, coat);
  constexpr int most_subdivisions = 10;
  for (int n = 1; n <= most_subdivisions; ++n) {
    const double edge = advice.mean_edge / std::exp2(n);
    const int span_x = static_cast<int>(std::lround(edge / size.x() * map.width()));
    const int span_y = static_cast<int>(std::lround(edge / size.y() * map.height()));
    if (span_x < 2 || span_y < 2) break;
    if (span_x >= map.width() || span_y >= map.height()) continue;
    const double residual = residual_over(map, span_x, span_y);
    if (residual > largest_relief_over_edge * edge) continue;
    advice.subdivisions = n;
    advice.edge_needed = edge;
    advice.residual = residual;
    advice.triangles <<= 2 * n;
    break;
  }
  return advice;
}

}  // namespace asperity
