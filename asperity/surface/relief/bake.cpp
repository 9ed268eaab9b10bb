#include "asperity/surface/relief/bake.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "asperity/core/units.h"

namespace asperity {

namespace {

// Texels around a triangle that hold the surface as it goes on; those farther out repeat the outermost.
constexpr double baked_border = 3.2;
constexpr int most_search_steps = 4096;
constexpr std::size_t most_named_faces = 8;

Status validate_bake(const SignedFormula& formula, const FormulaBakeSettings& settings) {
  if (!formula) return bad_value("is empty", "formula", "a function of a place");
  if (!(std::isfinite(settings.lowest) && settings.lowest <= 0.0)) {
    return bad_value(fmt::format("is {:g} m", settings.lowest), "lowest", "a length of 0 m or below");
  }
  if (!(std::isfinite(settings.highest) && settings.highest >= 0.0 && settings.highest > settings.lowest)) {
    return bad_value(fmt::format("is {:g} m", settings.highest), "highest",
                     "a length of 0 m or above, and above lowest");
  }
  if (!(settings.tolerance > 0.0 && std::isfinite(settings.tolerance))) {
    return bad_value(fmt::format("is {:g} m", settings.tolerance), "tolerance", "a length above 0 m");
  }
  if (settings.steps < 1 || settings.steps > most_search_steps) {
    return bad_value(fmt::format("is {}", settings.steps), "steps", fmt::format("1 to {}", most_search_steps));
  }
  return success();
}

/// A height on a ray and what the formula says there.
struct RaySample {
  double height = 0.0;
  double value = 0.0;
};

/// The formula along one ray of the shell.
class FormulaRay {
 public:
  FormulaRay(const SignedFormula& formula, const FormulaBakeSettings& settings, std::size_t& evaluations)
      : formula_(formula), settings_(settings), evaluations_(evaluations) {}

  /// Height at which the surface is entered from outside; not a number where that is nowhere within the range.
  double search(const Vec3& origin, const Vec3& direction) {
    origin_ = origin;
    direction_ = direction;
    turned_ = false;
    strange_.reset();
    const RaySample base = at(0.0);
    if (base.value == 0.0) return 0.0;
    const bool inside = base.value < 0.0;
    const double first = follow(base, inside ? settings_.highest : settings_.lowest);
    return std::isfinite(first) || strange_ ? first : follow(base, inside ? settings_.lowest : settings_.highest);
  }
  /// The last search came by a surface that is seen from inside.
  [[nodiscard]] bool turned() const { return turned_; }
  /// The place at which the formula was not finite in the last search, where there was one.
  [[nodiscard]] const std::optional<Vec3>& strange() const { return strange_; }

 private:
  RaySample at(double height) {
    const Vec3 place = origin_ + height * direction_;
    const double value = formula_(place);
    ++evaluations_;
    if (!std::isfinite(value) && !strange_) strange_ = place;
    return {height, value};
  }

  /// Steps from the base to `end` (m) and answers the first root at which the formula rises with the height.
  double follow(const RaySample& base, double end) {
    const double step = (settings_.highest - settings_.lowest) / settings_.steps;
    const int count = static_cast<int>(std::ceil(std::abs(end) / step - 1e-9));
    RaySample before = base;
    for (int i = 1; i <= count && !strange_; ++i) {
      const RaySample now = at(i == count ? end : std::copysign(step * i, end));
      if (strange_) break;
      const RaySample& below = end > 0.0 ? before : now;
      const RaySample& above = end > 0.0 ? now : before;
      if (below.value < 0.0 && above.value >= 0.0) return root(below, above);
      if (below.value >= 0.0 && above.value < 0.0) turned_ = true;
      before = now;
    }
    return std::numeric_limits<double>::quiet_NaN();
  }

  /// ITP (oliveira-2021) with k1 = 0.2 / width, k2 = 2, n0 = 1: false position, moved towards the middle and kept
  /// within what bisection would have left.
  double root(RaySample below, RaySample above) {
    const double width = above.height - below.height;
    const double weight = 0.2 / width;
    const double tolerance = settings_.tolerance;
    const int most = std::max(0, static_cast<int>(std::ceil(std::log2(width / (2.0 * tolerance))))) + 1;
    for (int i = 0; i < most && above.height - below.height > 2.0 * tolerance; ++i) {
      const double left = above.height - below.height;
      const double middle = 0.5 * (below.height + above.height);
      const double chord = (above.value * below.height - below.value * above.height) / (above.value - below.value);
      const double aside = std::isfinite(chord) ? middle - chord : 0.0;
      const double nudge = weight * left * left;
      const double nudged = nudge <= std::abs(aside) ? middle - aside + std::copysign(nudge, aside) : middle;
      const double reach = std::max(0.0, std::ldexp(tolerance, most - i) - 0.5 * left);
      const double next = std::abs(nudged - middle) <= reach ? nudged : middle - std::copysign(reach, aside);
      const RaySample tried = at(next);
      if (strange_) return std::numeric_limits<double>::quiet_NaN();
      (tried.value < 0.0 ? below : above) = tried;
    }
    return 0.5 * (below.height + above.height);
  }

  const SignedFormula& formula_;
  const FormulaBakeSettings& settings_;
  std::size_t& evaluations_;
  Vec3 origin_ = Vec3::Zero();
  Vec3 direction_ = Vec3::Zero();
  bool turned_ = false;
  std::optional<Vec3> strange_;
};

/// Answers the height of each texel in turn, and keeps account of it.
class FormulaBaker {
 public:
  FormulaBaker(const TriangleMesh& mesh, const SignedFormula& formula, const FormulaBakeSettings& settings)
      : mesh_(mesh), settings_(settings), shell_(Shell::build(mesh)), ray_(formula, settings, report_.evaluations) {
    report_.lowest = infinity;
    report_.highest = -infinity;
  }

  double height_at(const AtlasTexel& texel) {
    if (texel.face != face_) {
      face_ = texel.face;
      prism_ = shell_.prism(mesh_, face_);
    }
    const double beyond = std::max({-texel.u, -texel.v, texel.u + texel.v - 1.0}) * settings_.texels;
    if (beyond > baked_border) {
      copies_.emplace_back(texel.index, source_of(texel, baked_border));
      return 0.0;
    }
    if (stranger_) return 0.0;
    const double height = ray_.search(prism_.base_at(texel.u, texel.v), prism_.direction_at(texel.u, texel.v));
    return beyond <= 0.0 ? over_triangle(texel, height) : beside_triangle(texel, height);
  }

  /// Fills what takes after other texels, and says what was wrong.
  Result<BakeReport> finish(ReliefAtlas& atlas) {
    if (stranger_) return *std::move(stranger_);
    if (settings_.on_miss == OnMiss::refuse && report_.missed_texels > 0) return miss_error();
    for (const auto& [to, from] : continued_) atlas.heights[to] = atlas.heights[from];
    for (const auto& [to, from] : copies_) atlas.heights[to] = atlas.heights[from];
    return std::move(report_);
  }

 private:
  [[nodiscard]] std::size_t source_of(const AtlasTexel& texel, double border) const {
    return static_cast<std::size_t>(static_cast<std::ptrdiff_t>(texel.index) +
                                    nearest_texel_within(texel, border, settings_.texels));
  }

  double over_triangle(const AtlasTexel& texel, double height) {
    ++report_.texels;
    if (ray_.strange()) {
      const Vec3& place = *ray_.strange();
      stranger_ =
          bad_value(fmt::format("is not finite at ({:.9g}, {:.9g}, {:.9g}) m", place.x(), place.y(), place.z()),
                    fmt::format("formula over face {}", texel.face), "finite values wherever heights are searched");
      return 0.0;
    }
    if (!std::isfinite(height)) {
      if (report_.missed.empty() || report_.missed.back().face != texel.face)
        report_.missed.push_back({texel.face, 0, Vec3(1.0 - texel.u - texel.v, texel.u, texel.v)});
      ++report_.missed.back().texels;
      ++report_.missed_texels;
      if (ray_.turned()) ++report_.turned_texels;
      height = 0.0;
    }
    report_.lowest = std::min(report_.lowest, height);
    report_.highest = std::max(report_.highest, height);
    return height;
  }

  double beside_triangle(const AtlasTexel& texel, double height) {
    if (std::isfinite(height) && !ray_.strange()) return height;
    ++report_.continued_texels;
    continued_.emplace_back(texel.index, source_of(texel, 0.0));
    return 0.0;
  }

  [[nodiscard]] Error miss_error() const {
    const MissedFace& first = report_.missed.front();
    std::string what = fmt::format("{} (range {} to {})", report_.summary(), format_length(settings_.lowest),
                                   format_length(settings_.highest));
    std::string accepted = "a range of heights that holds the surface, a base nearer to it, or OnMiss::flat";
    if (2 * report_.turned_texels > report_.missed_texels)
      accepted = "a formula that is above 0 outside, where the mesh's normals point; this one is below 0 there";
    return bad_value(std::move(what), fmt::format("face {}", first.face), std::move(accepted));
  }

  const TriangleMesh& mesh_;
  const FormulaBakeSettings& settings_;
  Shell shell_;
  BakeReport report_;
  FormulaRay ray_;
  ShellPrism prism_{};
  std::uint32_t face_ = no_index;
  std::optional<Error> stranger_;
  // Texels that take after another one: beside a triangle, and farther out.
  std::vector<std::pair<std::size_t, std::size_t>> continued_;
  std::vector<std::pair<std::size_t, std::size_t>> copies_;
};

}  // namespace

std::string BakeReport::summary() const {
  if (missed_texels == 0) {
    return fmt::format("heights from {} to {} over {} texels", format_length(lowest), format_length(highest), texels);
  }
  std::string text = fmt::format("no surface over {} of {} texels, on {} faces:", missed_texels, texels, missed.size());
  for (std::size_t i = 0; i < std::min(missed.size(), most_named_faces); ++i) {
    const MissedFace& one = missed[i];
    text += fmt::format("{} face {}: {} (first at barycentric {:.3g}, {:.3g}, {:.3g})", i == 0 ? "" : ",", one.face,
                        one.texels, one.barycentric.x(), one.barycentric.y(), one.barycentric.z());
  }
  return missed.size() > most_named_faces ? text + ", ..." : text;
}

Result<BakedRelief> bake_relief(const TriangleMesh& mesh, const SignedFormula& formula,
                                const FormulaBakeSettings& settings, const Progress& progress) {
  ASPERITY_CHECK(validate_bake(formula, settings));
  FormulaBaker baker(mesh, formula, settings);
  const TexelHeight height = [&](const AtlasTexel& texel) { return baker.height_at(texel); };
  ASPERITY_TRY(ReliefAtlas atlas, bake_relief(mesh, settings.texels, height, progress));
  ASPERITY_TRY(BakeReport report, baker.finish(atlas));
  ASPERITY_TRY(TriangleMesh wearer, with_atlas_uvs(mesh, atlas));
  return BakedRelief{std::move(wearer), std::move(atlas), std::move(report)};
}

Result<std::shared_ptr<const ReliefSurface>> wear_baked(const BakedRelief& baked, const ReliefSettings& settings) {
  ASPERITY_TRY(std::shared_ptr<const ReliefSurface> surface, wear_atlas(baked.mesh, baked.atlas, settings));
  if (surface->shell().directions != Shell::build(baked.mesh).directions) {
    return refused(ErrorCode::bad_mesh, "making room for the relief turned the directions that it was baked along",
                   "on_overlap", "OnOverlap::refuse, a lower relief, or a finer base mesh");
  }
  return surface;
}

Result<TriangleMesh> with_atlas_uvs(const TriangleMesh& mesh, const ReliefAtlas& atlas) {
  if (atlas.corner_uvs.size() != mesh.triangles().size()) {
    return refused(ErrorCode::mismatch,
                   fmt::format("has {} triangles, the mesh {}", atlas.corner_uvs.size(), mesh.triangles().size()),
                   "atlas", "the atlas of this very mesh");
  }
  MeshSource source;
  source.positions.assign(mesh.positions().begin(), mesh.positions().end());
  source.triangles.assign(mesh.triangles().begin(), mesh.triangles().end());
  source.corner_uvs = atlas.corner_uvs;
  return TriangleMesh::build(std::move(source), MeshBuildSettings{1.0, false});
}

Result<HeightMap> atlas_heights(const ReliefAtlas& atlas, const std::vector<float>& heights) {
  return HeightMap::build(heights, atlas.width, atlas.height, Wrap::clamp, Reconstruction::quadratic_bspline);
}

Vec2 atlas_size(const TriangleMesh& mesh, const ReliefAtlas& atlas) noexcept {
  const double texel = mesh.mean_edge() / atlas.texels;
  return {texel * atlas.width, texel * atlas.height};
}

Result<std::shared_ptr<const ReliefSurface>> wear_atlas(const TriangleMesh& mesh, const ReliefAtlas& atlas,
                                                        const ReliefSettings& settings) {
  ASPERITY_TRY(HeightMap heights, atlas_heights(atlas, atlas.heights));
  ASPERITY_TRY(Mesostructure maps, Mesostructure::build(std::move(heights), atlas_size(mesh, atlas)));
  return wear_atlas(mesh, atlas.texels, std::move(maps), settings);
}

Result<std::shared_ptr<const ReliefSurface>> wear_atlas(const TriangleMesh& mesh, int texels, Mesostructure maps,
                                                        const ReliefSettings& settings) {
  CoatSettings coat;
  coat.stitching.folds = FoldMode::round;
  // Half a texel: enough to join what differs by rounding and reconstruction alone.
  coat.stitching.rho = std::clamp(0.6 / texels, 0.005, 0.05);
  coat.stitching.most_rounding = 0.25 * mesh.mean_edge() / texels;
  return make_relief(MeshSurface(TriangleIndex::build(mesh)), std::move(maps), coat, settings);
}

}  // namespace asperity
