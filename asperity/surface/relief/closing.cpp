#include "asperity/surface/relief/closing.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "asperity/core/parallel_for.h"
#include "asperity/surface/relief/detail/closing_border.h"
#include "asperity/surface/relief/detail/closing_face.h"

namespace asperity {

namespace {

// Of the radius: rises below this are not called changes.
constexpr double change_of_radius = 1e-3;
constexpr int most_texels = 512;
// Shares of a thread: neighbours have most of what they look at in common.
constexpr std::size_t faces_a_share = 8;
// Of the work, by time: sampling, closing, the atlas.
constexpr double sampled = 0.25;
constexpr double settled = 0.85;

Error closing_error(ErrorCode code, std::string what, std::string place, std::string accepted) {
  return Error{code, std::move(what), {}, std::move(place), std::move(accepted)};
}

int texels_for(const ReliefSurface& surface, const ClosingSettings& settings) {
  if (settings.texels > 0) return settings.texels;
  const double fine = std::min(surface.coat().texel_size(), settings.radius / 8.0);
  // Eighths, so that coarse texels lie between the edges and leave most of the finer ones to bounds.
  return std::clamp(8 * static_cast<int>(std::ceil(surface.base().mesh().mean_edge() / fine / 8.0)), 8, 48);
}

/// Of the samples (m): what is finer than the coat's texels is not there to be touched, and what a ball touches between
/// them is told by curvature.
double sample_spacing(const ReliefSurface& surface, double radius) {
  return std::clamp(surface.coat().texel_size(), radius / 64.0, radius / 16.0);
}

Status validate(const ReliefSurface& surface, const ClosingSettings& settings) {
  const double size = surface.bounds().diagonal();
  if (!(settings.radius > 0.0 && settings.radius <= size)) {
    return closing_error(ErrorCode::bad_value, fmt::format("is {:g} m", settings.radius), "radius",
                         fmt::format("above 0 m and at most the size of the surface ({:.3g} m)", size));
  }
  if (settings.texels != 0 && (settings.texels < 2 || settings.texels > most_texels)) {
    return closing_error(ErrorCode::bad_value, fmt::format("is {}", settings.texels), "texels",
                         fmt::format("2 to {} texels along each edge, or 0", most_texels));
  }
  const TriangleMesh& mesh = surface.base().mesh();
  const int texels = texels_for(surface, settings);
  const ReliefSamples::Size samples = ReliefSamples::size_for(mesh, texels, sample_spacing(surface, settings.radius));
  const auto cells = static_cast<double>(atlas_texels(mesh.triangles().size(), texels));
  const unsigned workers =
      parallel_workers(mesh.triangles().size(), {.grain = faces_a_share, .threads = settings.threads});
  const double bytes =
      samples.bytes + workers * samples.bytes_a_thread + (2.0 + surface.coat().levels()) * sizeof(float) * cells;
  if (bytes > static_cast<double>(settings.most_memory)) {
    return closing_error(ErrorCode::too_large,
                         fmt::format("needs {:.0f} MiB for {:.3g} places of the surface and {:.3g} texels",
                                     bytes / 1048576.0, samples.nodes, cells),
                         "radius",
                         fmt::format("a larger radius, fewer texels, or a bound of memory above {:.0f} MiB",
                                     static_cast<double>(settings.most_memory) / 1048576.0));
  }
  return success();
}

/// What was done to all faces, from what was done to each.
void sum_up(const TriangleMesh& mesh, const std::vector<ClosedFace>& faces, ClosingReport& report) {
  double area = 0.0;
  double changed_area = 0.0;
  for (std::uint32_t face = 0; face < faces.size(); ++face) {
    const ClosedFace& one = faces[face];
    const auto [a, b, c] = mesh.corners(face);
    const double own = 0.5 * (b - a).cross(c - a).norm();
    area += own;
    report.texels += one.texels;
    report.changed_texels += one.changed;
    report.unsettled_texels += one.unsettled;
    if (one.changed == 0) continue;
    report.changed_faces.push_back(face);
    changed_area += own * one.changed / one.texels;
    if (one.largest_rise > report.largest_rise) {
      report.largest_rise = one.largest_rise;
      report.largest_face = face;
    }
  }
  report.changed_share = area > 0.0 ? changed_area / area : 0.0;
}

}  // namespace

std::string ClosingReport::summary() const {
  if (changed_texels == 0) return "the ball reaches every place of the relief: nothing was filled";
  std::string text = fmt::format("{:.3g} % of the surface filled, on {} faces; by {:.3g} mm at most, on face {}",
                                 100.0 * changed_share, changed_faces.size(), 1e3 * largest_rise, largest_face);
  if (unsettled_texels > 0)
    text += fmt::format("; {} texels raised as those around them: no place was found there that the ball fits into",
                        unsettled_texels);
  return text;
}

double ClosedRelief::rise_at(std::uint32_t face, const Vec3& barycentric) const noexcept {
  if (face >= atlas.corner_uvs.size() || rise.empty()) return 0.0;
  Vec2 uv = Vec2::Zero();
  for (std::size_t k = 0; k < 3; ++k) uv += barycentric[static_cast<int>(k)] * atlas.corner_uvs[face][k].cast<double>();
  const int x = std::clamp(static_cast<int>(uv.x() * atlas.width), 0, atlas.width - 1);
  const int y = std::clamp(static_cast<int>((1.0 - uv.y()) * atlas.height), 0, atlas.height - 1);
  return static_cast<double>(
      rise[static_cast<std::size_t>(y) * static_cast<std::size_t>(atlas.width) + static_cast<std::size_t>(x)]);
}

namespace {

/// Faces along a Morton curve through their middles: those that follow one another lie side by side.
std::vector<std::uint32_t> along_a_curve(const TriangleMesh& mesh) {
  constexpr int bits = 21;
  const Box box = mesh.bounds();
  const double scale = ((1 << bits) - 1) / std::max(box.extent().maxCoeff(), std::numeric_limits<double>::min());
  std::vector<std::pair<std::uint64_t, std::uint32_t>> keys;
  keys.reserve(mesh.triangles().size());
  for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) {
    const auto [a, b, c] = mesh.corners(face);
    const Vec3 cell = scale * ((a + b + c) / 3.0 - box.lower);
    std::uint64_t key = 0;
    for (int bit = bits - 1; bit >= 0; --bit) {
      for (int axis = 0; axis < 3; ++axis)
        key = key << 1U | (static_cast<std::uint64_t>(cell[axis]) >> static_cast<unsigned>(bit) & 1U);
    }
    keys.emplace_back(key, face);
  }
  std::sort(keys.begin(), keys.end());
  std::vector<std::uint32_t> order;
  order.reserve(keys.size());
  for (const auto& [key, face] : keys) order.push_back(face);
  return order;
}

/// One level of detail (0: the relief itself) closed into `closed`, whose atlas and rises are 0.
void close_level(const ReliefSurface& surface, const CoatMoment& moment, const Progress& progress,
                 ClosedRelief& closed) {
  const TriangleMesh& mesh = surface.base().mesh();
  const std::size_t count = mesh.triangles().size();
  const ClosingSettings& settings = closed.settings;
  ParallelSettings parallel{faces_a_share, settings.threads, &progress, "sampling the relief", 0.0, sampled};
  const ReliefSamples samples(surface, moment, settings.texels, sample_spacing(surface, settings.radius), parallel);

  parallel.what = "closing the relief";
  parallel.from = sampled;
  parallel.to = settled;
  std::vector<ClosedFace> faces(count);
  std::vector<std::unique_ptr<FaceCloser>> closers(parallel_workers(count, parallel));
  const std::vector<std::uint32_t> order = along_a_curve(mesh);
  parallel_for(count, parallel, [&](std::size_t i, unsigned worker) {
    if (closers[worker] == nullptr) {
      closers[worker] =
          std::make_unique<FaceCloser>(surface, samples, moment, settings.radius, closed.report.tolerance);
    }
    // Shares begin at multiples of this on any number of threads.
    if (i % faces_a_share == 0) closers[worker]->start_anew();
    faces[order[i]] = closers[worker]->close(order[i], closed);
  });
  closers.clear();
  sum_up(mesh, faces, closed.report);

  parallel.what = "baking the closed relief";
  parallel.from = settled;
  parallel.to = 1.0;
  const ClosedBorders borders(surface, samples, moment, closed);
  parallel_for(count, parallel, [&](std::size_t face) { borders.fill(static_cast<std::uint32_t>(face), closed); });
}

}  // namespace

Result<ClosedRelief> close_relief(const ReliefSurface& surface, const ClosingSettings& settings,
                                  const Progress& progress) {
  if (auto valid = validate(surface, settings); !valid) return std::move(valid).error();
  const TriangleMesh& mesh = surface.base().mesh();
  ClosedRelief closed;
  closed.settings = settings;
  closed.settings.texels = texels_for(surface, settings);
  ASPERITY_TRY(closed.atlas, flat_atlas(mesh, closed.settings.texels));
  closed.report.tolerance = change_of_radius * settings.radius;
  closed.report.texel_size = mesh.mean_edge() / closed.settings.texels;
  const std::size_t cells = closed.atlas.heights.size();
  // The finest last: its rises and its report are the answer's.
  for (int level = surface.coat().levels(); level >= 0; --level) {
    closed.rise.assign(cells, 0.0F);
    ClosingReport fresh;
    fresh.tolerance = closed.report.tolerance;
    fresh.texel_size = closed.report.texel_size;
    closed.report = std::move(fresh);
    close_level(surface, {static_cast<double>(level), 0.0}, progress, closed);
    if (level == 0) break;
    closed.levels.insert(closed.levels.begin(), std::move(closed.atlas.heights));
    closed.atlas.heights.assign(cells, 0.0F);
  }
  if (progress) progress("closing the relief", 1.0);
  return closed;
}

}  // namespace asperity
