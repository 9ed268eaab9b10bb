// Features that a mesh wears as a relief: a height map of them, and the mesh's corners in its coordinates.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "asperity/io/detail/scene_fine.h"

namespace asperity {
namespace {

constexpr double texels_a_wavelength = 16.0;
constexpr int most_texels = 4096;   // along a side
constexpr int fewest_texels = 8;    // along a side on which nothing changes
constexpr double never = infinity;  // m: a pattern that changes nowhere, or comes back nowhere

/// How a feature runs along u and v.
struct Run {
  Vec2 wave = Vec2::Constant(never);    ///< finest length that has to be resolved (m); never: nothing changes
  Vec2 period = Vec2::Constant(never);  ///< after which the pattern comes back (m); never: it does not
};

Run run_of(const SurfaceFeature& feature) {
  const FeatureSpec& spec = feature.spec();
  const double cosine = std::abs(std::cos(spec.direction));
  const double sine = std::abs(std::sin(spec.direction));
  constexpr double aligned = 1e-9;
  const bool along_u = sine < aligned;
  const bool along_v = cosine < aligned;
  Run run;
  run.wave = Vec2::Constant(feature.wavelength());
  switch (spec.kind) {
    case FeatureKind::grating:
    case FeatureKind::triangular:
    case FeatureKind::serrated:
      run.wave = Vec2(along_v ? never : spec.wavelength.x() / cosine, along_u ? never : spec.wavelength.x() / sine);
      // Along an axis on which nothing changes any length is a period.
      run.period = Vec2(along_v ? 0.0 : run.wave.x(), along_u ? 0.0 : run.wave.y());
      break;
    case FeatureKind::grid:
    case FeatureKind::map:
      if (along_u) run.period = spec.wavelength;
      if (along_v) run.period = Vec2(spec.wavelength.y(), spec.wavelength.x());
      // Its texels, not waves of sixteen of them.
      if (spec.kind == FeatureKind::map) run.wave *= 0.5;
      break;
    case FeatureKind::noise: run.period = spec.period; break;
    case FeatureKind::circular_grating: break;
  }
  return run;
}

/// The length after which both come back: the longer one, if it is a multiple of the other.
double common(double a, double b) {
  const double longer = std::max(a, b);
  const double shorter = std::min(a, b);
  if (shorter == 0.0 || !std::isfinite(longer)) return longer;
  const double turns = longer / shorter;
  return std::abs(turns - std::round(turns)) < 1e-6 ? longer : never;
}

/// Corners of a face in the plane of the features (m), next to one another where the mapping comes back.
std::array<Vec2, 3> corners_of(const TriangleMesh& mesh, const FeatureMapping& mapping, std::uint32_t face) {
  std::array<Vec2, 3> corners;
  const FeatureMappingSettings& settings = mapping.settings();
  const std::array<Vec3, 3> points = mesh.corners(face);
  if (settings.surface == IntermediateSurface::uv) {
    for (std::size_t k = 0; k < 3; ++k) corners[k] = mesh.uvs(face)[k].cast<double>().cwiseProduct(settings.tile);
    return corners;
  }
  std::array<bool, 3> on_axis{};
  for (std::size_t k = 0; k < 3; ++k) {
    MappedPlaces places;
    mapping.map(points[k], places);
    corners[k] = places[0].uv;
    on_axis[k] = places[0].du.isZero(0.0);
  }
  const bool round =
      settings.surface == IntermediateSurface::cylinder || settings.surface == IntermediateSurface::sphere;
  if (!round) return corners;
  // Over the seam of a range, too: a face that it crosses goes on with one side's pattern.
  const double around = 2.0 * std::numbers::pi * settings.radius;
  const std::size_t first = on_axis[0] ? (on_axis[1] ? 2 : 1) : 0;
  double mean = 0.0;
  int counted = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    if (on_axis[k]) continue;
    corners[k].x() -= around * std::round((corners[k].x() - corners[first].x()) / around);
    mean += corners[k].x();
    ++counted;
  }
  // At a pole every longitude is as good.
  for (std::size_t k = 0; k < 3 && counted > 0; ++k) {
    if (on_axis[k]) corners[k].x() = mean / counted;
  }
  return corners;
}

/// What is baked along one axis.
struct Side {
  double lower = 0.0;
  double upper = 0.0;
  int texels = fewest_texels;
};

Result<Side> side_of(double lower, double upper, double period, double wave, bool repeats, const std::string& place) {
  Side side{lower, upper, fewest_texels};
  // Along an axis on which nothing changes the map is as long as the surface.
  if (repeats) side = {0.0, period > 0.0 ? period : std::max(upper - lower, 1e-6), fewest_texels};
  // Heights beyond a clamped border would be those at the border.
  if (!repeats) {
    const double margin = 0.01 * (upper - lower) + (std::isfinite(wave) ? wave / texels_a_wavelength : 1e-6);
    side.lower -= margin;
    side.upper += margin;
  }
  if (!std::isfinite(wave)) return side;
  const double texels = std::ceil((side.upper - side.lower) * texels_a_wavelength / wave);
  if (!(texels <= most_texels)) {
    return refused(
        ErrorCode::too_large,
        fmt::format("would make {:.0f} texels of {} along {}", texels, format_length(wave / texels_a_wavelength),
                    format_length(side.upper - side.lower)),
        place,
        fmt::format("geometry of at most {} texels a side, {:g} a wavelength; \"as\": \"texture\" needs none",
                    most_texels, texels_a_wavelength));
  }
  side.texels = std::max(fewest_texels, static_cast<int>(texels));
  return side;
}

}  // namespace

Result<BakedFeatures> bake_features(const TriangleMesh& mesh, const std::vector<SurfaceFeature>& features,
                                    const FeatureMapping& mapping, const std::string& place) {
  std::vector<std::array<Vec2, 3>> corners;
  corners.reserve(mesh.triangles().size());
  Vec2 lower = Vec2::Constant(infinity);
  Vec2 upper = Vec2::Constant(-infinity);
  for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) {
    corners.push_back(corners_of(mesh, mapping, face));
    for (const Vec2& corner : corners.back()) {
      lower = lower.cwiseMin(corner);
      upper = upper.cwiseMax(corner);
    }
  }
  Run all = run_of(features.front());
  for (const SurfaceFeature& feature : features) {
    const Run run = run_of(feature);
    all.wave = all.wave.cwiseMin(run.wave);
    for (int k = 0; k < 2; ++k) all.period[k] = common(all.period[k], run.period[k]);
  }
  const bool repeats = std::isfinite(all.period.x()) && std::isfinite(all.period.y());
  ASPERITY_TRY(const Side u, side_of(lower.x(), upper.x(), all.period.x(), all.wave.x(), repeats, place));
  ASPERITY_TRY(const Side v, side_of(lower.y(), upper.y(), all.period.y(), all.wave.y(), repeats, place));
  const Vec2 from(u.lower, v.lower);
  const Vec2 size = Vec2(u.upper, v.upper) - from;
  const Wrap wrap = repeats ? Wrap::repeat : Wrap::clamp;
  ASPERITY_TRY(HeightMap heights, at_place(bake(features, from, from + size, u.texels, v.texels, wrap), place));
  ASPERITY_TRY(Mesostructure maps, at_place(Mesostructure::build(std::move(heights), size), place));

  MeshSource source;
  source.positions.assign(mesh.positions().begin(), mesh.positions().end());
  source.triangles.assign(mesh.triangles().begin(), mesh.triangles().end());
  for (const std::array<Vec2, 3>& face : corners) {
    std::array<Vec2f, 3> uvs;
    // Whole repeats are taken off, which costs no digits of what is left.
    const Vec2 repeat = repeats ? Vec2((face[0] - from).cwiseQuotient(size).array().floor()) : Vec2(Vec2::Zero());
    for (std::size_t k = 0; k < 3; ++k) uvs[k] = Vec2((face[k] - from).cwiseQuotient(size) - repeat).cast<float>();
    source.corner_uvs.push_back(uvs);
  }
  ASPERITY_TRY(TriangleMesh worn, TriangleMesh::build(std::move(source)));
  return BakedFeatures{std::move(worn), std::make_shared<const Mesostructure>(std::move(maps))};
}

}  // namespace asperity
