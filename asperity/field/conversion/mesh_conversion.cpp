#include "asperity/field/conversion/mesh_conversion.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>
#include <optional>

#include "asperity/field/conversion/detail/signs.h"

namespace asperity {
namespace {

using conversion::OrientedMesh;

constexpr int side = SparseBlock::side;
constexpr double least_band = 3.0;  // voxels: what a centre difference at the zero crossing and its apron read
constexpr double least_resolution = 8.0;
constexpr double most_resolution = 4096.0;
constexpr double usual_resolution = 256.0;
/// A brick of a SparseGrid with faces: values, faces, and what holds them together.
constexpr double brick_bytes = 4.0 * SparseGrid::brick_points + 4.0 * SparseBlock::points + 92.0;
/// Sampled faces of which so many tell their sides apart make a mesh "slightly broken" rather than a sheet.
constexpr double slightly_broken = 0.99;
constexpr std::size_t sampled_faces = 2000;

std::atomic<MeshVoxelizer>& registered() {
  static std::atomic<MeshVoxelizer> voxelizer{nullptr};
  return voxelizer;
}

double longest_side(const TriangleMesh& mesh) {
  return mesh.bounds().extent().maxCoeff();
}

Status check_settings(const TriangleMesh& mesh, const ConversionSettings& settings) {
  const auto check_length = [](double value, const char* place, const char* accepted) -> Status {
    if (value >= 0.0 && !std::isinf(value)) return success();
    return bad_value(fmt::format("is {}", value), place, accepted);
  };
  ASPERITY_CHECK(check_length(settings.voxel, "voxel", "a length above 0 (m)"));
  const int given =
      (settings.voxel > 0.0 ? 1 : 0) + (settings.resolution > 0 ? 1 : 0) + (settings.budget_bytes > 0 ? 1 : 0);
  if (given > 1) return bad_value("is given besides another size", "voxel", "one of voxel, resolution and budget");
  if (settings.resolution > 0 && (settings.resolution < static_cast<std::uint32_t>(least_resolution) ||
                                  settings.resolution > static_cast<std::uint32_t>(most_resolution)))
    return bad_value(fmt::format("is {}", settings.resolution), "resolution",
                     "8 to 4096 voxels along the longest side");
  const double longest = longest_side(mesh);
  if (settings.voxel > 0.0 && (settings.voxel < longest / most_resolution * (1.0 - 1e-9) ||
                               settings.voxel > longest / least_resolution * (1.0 + 1e-9))) {
    return bad_value(fmt::format("is {} m, on a mesh {} m long", settings.voxel, longest), "voxel",
                     fmt::format("{} to {} m: 8 to 4096 voxels along the longest side", longest / most_resolution,
                                 longest / least_resolution));
  }
  ASPERITY_CHECK(check_length(settings.band_outside, "band_outside", "a finite length, 0 or more (m)"));
  if (!(settings.band_inside >= 0.0))
    return bad_value(fmt::format("is {}", settings.band_inside), "band_inside", "a length, 0 or more (m), or infinity");
  ASPERITY_CHECK(check_length(settings.shell_thickness, "shell_thickness", "a finite length, 0 or more (m)"));
  if (settings.shell_thickness > 0.0 && settings.rule != InsideRule::shell && settings.rule != InsideRule::automatic)
    return bad_value(fmt::format("is given for rule {}", to_string(settings.rule)), "shell_thickness",
                     "rule shell or automatic");
  return success();
}

/// The rule to go by, and what it needs.
struct Judgement {
  InsideRule rule = InsideRule::flood;
  std::optional<OrientedMesh> oriented;  ///< of rule winding
  std::vector<std::string> notes;
};

Result<Judgement> judge(const TriangleMesh& mesh, InsideRule wanted) {
  Judgement out;
  out.rule = wanted;
  const MeshReport& report = mesh.report();
  if (wanted == InsideRule::automatic && report.closed() && report.oriented()) {
    out.rule = InsideRule::flood;
    out.notes.emplace_back("the mesh is closed: inside is what cannot be reached from far away");
  }
  if (out.rule != InsideRule::automatic && out.rule != InsideRule::winding) return out;
  ASPERITY_TRY(out.oriented, conversion::oriented(mesh));
  if (out.oriented->turned > 0) {
    out.notes.push_back(
        fmt::format("{} of {} faces are turned against their neighbours: their order was taken "
                    "the other way round to find what is inside",
                    out.oriented->turned, report.triangles));
  }
  if (out.rule == InsideRule::winding) return out;
  const double share = conversion::told_apart(*out.oriented, sampled_faces);
  std::string flaws = fmt::format("{} edges with one face only", report.boundary_edges);
  if (report.nonmanifold_edges > 0) flaws += fmt::format(", {} with three or more", report.nonmanifold_edges);
  if (report.misoriented_edges > 0) flaws += fmt::format(", {} between faces that disagree", report.misoriented_edges);
  const std::string state =
      fmt::format("the mesh has {}; beside {:.1f} % of its faces the winding number tells outside from inside", flaws,
                  100.0 * share);
  const bool broken_slightly = share >= slightly_broken;
  out.rule = broken_slightly ? InsideRule::winding : InsideRule::shell;
  out.notes.push_back(state + (broken_slightly ? ": inside is where it exceeds 1/2, which bridges the holes"
                                               : ": it has no inside, and gets a shell around its faces"));
  return out;
}

/// One conversion at one voxel.
struct Attempt {
  double voxel = 0.0;
  Vec3 origin = Vec3::Zero();
  double outside = 0.0;    ///< m
  double inside = 0.0;     ///< m, above 0; may be infinite
  double thickness = 0.0;  ///< of the shell (m)
  std::vector<VoxelBlock> blocks;
};

class Converter {
 public:
  Converter(const TriangleIndex& index, const ConversionSettings& settings, Judgement judgement,
            MeshVoxelizer voxelizer, const Progress& progress)
      : index_(index),
        mesh_(index.mesh()),
        settings_(settings),
        judgement_(std::move(judgement)),
        voxelizer_(voxelizer),
        progress_(progress) {}

  Result<ConvertedMesh> run() {
    if (settings_.budget_bytes > 0) return within_budget();
    const double longest = longest_side(mesh_);
    double voxel = settings_.voxel;
    if (!(voxel > 0.0)) voxel = longest / (settings_.resolution > 0 ? settings_.resolution : usual_resolution);
    ASPERITY_TRY(Attempt attempt, voxelized(voxel));
    return finished(std::move(attempt));
  }

 private:
  /// Bands and origin at this voxel.
  [[nodiscard]] Attempt planned(double voxel) const {
    // Half a voxel off: the sides of a box that is whole voxels long lie between nodes, where their sign is plain.
    Attempt plan{voxel, mesh_.bounds().lower - Vec3::Constant(0.5 * voxel), 0.0, 0.0, 0.0, {}};
    plan.outside = std::max(settings_.band_outside, least_band * voxel);
    plan.inside = std::max(settings_.band_inside > 0.0 ? settings_.band_inside : 0.0, least_band * voxel);
    if (judgement_.rule == InsideRule::shell)
      plan.thickness = settings_.shell_thickness > 0.0 ? settings_.shell_thickness : 2.0 * voxel;
    return plan;
  }

  /// How far distances are wanted on the outside, or on both sides where the voxeliser does not tell them apart (m).
  [[nodiscard]] double outward_of(const Attempt& attempt) const {
    if (judgement_.rule == InsideRule::winding) return std::max(attempt.outside, std::min(attempt.inside, deepest()));
    return attempt.outside + 0.5 * attempt.thickness;
  }

  /// No point within the bounds is farther from the surface.
  [[nodiscard]] double deepest() const { return 0.5 * mesh_.bounds().extent().minCoeff(); }

  /// About how many bytes a grid of this voxel takes: a slab as thick as the band around the whole surface, in blocks
  /// of all directions, and what a band has around the edges and corners of the mesh's box beyond that (Steiner), which
  /// is most of it where the band is wider than the mesh.
  [[nodiscard]] double estimated_bytes(double voxel) const {
    const Attempt plan = planned(voxel);
    const double inward = std::min(plan.inside, std::max(deepest(), least_band * voxel));
    const bool shell = judgement_.rule == InsideRule::shell;
    const double outward = plan.outside + 0.5 * plan.thickness;
    const double thick = outward + (shell ? outward : inward);
    const double around = std::numbers::pi * outward * outward * (mesh_.bounds().extent().sum() + 4.0 / 3.0 * outward);
    const double block = side * voxel;
    const double area = mesh_.report().area / (block * block);
    return (area * (thick / block + 1.5) + around / (block * block * block)) * brick_bytes;
  }

  [[nodiscard]] double bytes_of(const Attempt& attempt) const {
    return static_cast<double>(attempt.blocks.size()) * brick_bytes;
  }

  [[nodiscard]] Error too_large(double bytes, double most) const {
    return refused(ErrorCode::too_large, fmt::format("would take {:.0f} MiB", bytes / 1048576.0), "voxel",
                   fmt::format("at most {:.0f} MiB: a larger voxel or narrower bands", most / 1048576.0));
  }

  /// What the voxeliser makes of the mesh, blocks without a point within the band left out.
  Result<Attempt> voxelized(double voxel) {
    const auto most = static_cast<double>(settings_.most_bytes);
    // Surfaces that lie close together share their blocks: only far too much is refused unseen.
    if (const double bytes = estimated_bytes(voxel); bytes > 2.0 * most) return too_large(bytes, most);
    Attempt attempt = planned(voxel);
    if (attempt.thickness > 0.0 && attempt.thickness < 2.0 * voxel * (1.0 - 1e-9)) {
      return bad_value(fmt::format("is {} m, with a voxel of {} m", attempt.thickness, voxel), "shell_thickness",
                       fmt::format("{} m or more: two voxels", 2.0 * voxel));
    }
    VoxelRequest request;
    request.positions.reserve(mesh_.positions().size());
    for (const Vec3& p : mesh_.positions()) request.positions.push_back(((p - attempt.origin) / voxel).cast<float>());
    request.triangles = mesh_.triangles();
    request.signed_by_flood = judgement_.rule == InsideRule::flood;
    request.band_outside = static_cast<float>(outward_of(attempt) / voxel);
    // Beyond the deepest place a band is the same as none, which the voxeliser is quicker at.
    const bool throughout = attempt.inside > deepest();
    request.band_inside = throughout ? static_cast<float>(infinity) : static_cast<float>(attempt.inside / voxel);
    ASPERITY_TRY(attempt.blocks, voxelizer_(request, progress_));
    if (const double bytes = bytes_of(attempt); bytes > most) return too_large(bytes, most);
    if (attempt.blocks.empty())
      return refused(ErrorCode::bad_mesh, "gave no stored point", {}, "a mesh with triangles at this voxel");
    return attempt;
  }

  /// The finest voxel whose grid fits: from the area first, then corrected by what comes of it.
  Result<ConvertedMesh> within_budget() {
    const auto budget = static_cast<double>(settings_.budget_bytes);
    const double longest = longest_side(mesh_);
    double finest = longest / most_resolution;
    double coarsest = longest / least_resolution;
    double voxel = coarsest;
    for (double low = finest, n = 0; n < 60; ++n) {
      const double middle = std::sqrt(low * voxel);
      (estimated_bytes(middle) <= budget ? voxel : low) = middle;
    }
    constexpr double enough = 0.85;  // of the budget
    constexpr double aim = 0.94;
    std::optional<Attempt> best;
    for (int n = 0; n < 6; ++n) {
      ASPERITY_TRY(Attempt attempt, voxelized(voxel));
      const double bytes = bytes_of(attempt);
      const double next = voxel * std::sqrt(bytes / (aim * budget));
      if (bytes <= budget) {
        coarsest = voxel;
        best = std::move(attempt);
        if (bytes >= enough * budget || voxel <= finest * (1.0 + 1e-6)) break;
      } else {
        if (voxel >= longest / least_resolution * (1.0 - 1e-6)) return too_small(bytes);
        finest = voxel;
      }
      voxel = next > finest && next < coarsest ? next : std::sqrt(finest * coarsest);
      if (coarsest < finest * 1.02) break;
    }
    for (int n = 0; n < 8; ++n) {
      if (!best) {
        ASPERITY_TRY(best, voxelized(coarsest));
      }
      ASPERITY_TRY(ConvertedMesh out, finished(std::move(*best)));
      const auto bytes = static_cast<double>(out.grid.memory_bytes());
      if (bytes <= budget) {
        out.report.notes.push_back(
            fmt::format("a voxel of {:.6g} of the mesh's unit takes {:.1f} of the {:.1f} MiB allowed", out.report.voxel,
                        bytes / 1048576.0, budget / 1048576.0));
        return out;
      }
      best.reset();
      coarsest = std::min(out.report.voxel * std::sqrt(bytes / (aim * budget)), longest / least_resolution);
      if (out.report.voxel >= longest / least_resolution * (1.0 - 1e-6)) return too_small(bytes);
    }
    return too_small(budget);
  }

  [[nodiscard]] Error too_small(double bytes) const {
    return bad_value(
        fmt::format("of {} bytes is not enough for 8 voxels along the longest side", settings_.budget_bytes), "budget",
        fmt::format("about {:.0f} bytes or more", bytes));
  }

  /// Signs, bands and the grid.
  Result<ConvertedMesh> finished(Attempt attempt) {
    if (progress_) progress_("exact distances", 0.0);
    const bool by_flood = judgement_.rule == InsideRule::flood;
    const double outward = outward_of(attempt);
    conversion::BandFrame frame{attempt.origin, attempt.voxel, outward, by_flood ? attempt.inside : outward, by_flood};
    largest_correction_ = conversion::make_exact(index_, frame, attempt.blocks, progress_);
    if (progress_) progress_("exact distances", 1.0);
    if (by_flood) conversion::settle_flood(mesh_, attempt.origin, attempt.voxel, attempt.blocks);
    if (judgement_.rule == InsideRule::winding) {
      if (progress_) progress_("telling inside from outside", 0.0);
      conversion::sign_by_winding(*judgement_.oriented, attempt.origin, attempt.voxel, attempt.blocks);
      frame.outward = attempt.outside;
      frame.inward = std::min(attempt.inside, outward);
      conversion::bridge_holes(index_, *judgement_.oriented, frame, attempt.blocks);
      if (progress_) progress_("telling inside from outside", 1.0);
    }
    if (judgement_.rule == InsideRule::shell) {
      const double half = 0.5 * attempt.thickness;
      for (VoxelBlock& block : attempt.blocks) {
        for (float& distance : block.distance) distance = static_cast<float>(static_cast<double>(distance) - half);
      }
    }
    return packed(std::move(attempt));
  }

  Result<ConvertedMesh> packed(Attempt attempt) {
    double deepest_stored = 0.0;
    for (const VoxelBlock& block : attempt.blocks) {
      for (std::size_t n = 0; n < SparseBlock::points; ++n) {
        if (block.face[n] != no_index)
          deepest_stored = std::min(deepest_stored, static_cast<double>(block.distance[n]));
      }
    }
    if (!(deepest_stored < 0.0)) {
      return refused(ErrorCode::bad_mesh,
                     fmt::format("encloses no stored point by rule {} at a voxel of {} m", to_string(judgement_.rule),
                                 attempt.voxel),
                     {}, "a closed mesh thicker than the voxel, or rule shell");
    }
    const auto outside = static_cast<float>(attempt.outside);
    auto inside = static_cast<float>(-attempt.inside);
    // Stored throughout: the deepest value is the least.
    if (std::isinf(inside)) inside = static_cast<float>(std::min(deepest_stored, -least_band * attempt.voxel));
    if (judgement_.rule == InsideRule::shell) inside = static_cast<float>(-0.5 * attempt.thickness);
    SparseSource source{attempt.voxel, attempt.origin, static_cast<double>(outside), static_cast<double>(inside), {}};
    source.blocks.reserve(attempt.blocks.size());
    ConversionReport report{judgement_.rule,     attempt.voxel,   attempt.thickness, 0,
                            largest_correction_, judgement_.notes};
    for (const VoxelBlock& block : attempt.blocks) {
      SparseBlock stored;
      stored.at = block.at;
      std::size_t within = 0;
      for (std::size_t n = 0; n < SparseBlock::points; ++n) {
        stored.value[n] = std::clamp(block.distance[n], inside, outside);
        if (block.face[n] != no_index && stored.value[n] > inside && stored.value[n] < outside) ++within;
      }
      if (within == 0) continue;
      stored.face.assign(block.face.begin(), block.face.end());
      report.points += within;
      source.blocks.push_back(std::move(stored));
    }
    attempt.blocks = {};
    const auto note = [&](bool holds, std::string text) {
      if (holds) report.notes.push_back(std::move(text));
    };
    const double least = least_band * attempt.voxel;
    note(judgement_.rule == InsideRule::shell,
         fmt::format("the shell is {:.3g} voxels thick: the potential is the distance from the faces less half of that",
                     attempt.thickness / attempt.voxel));
    note(settings_.band_outside > 0.0 && settings_.band_outside < least,
         fmt::format("distances are stored {:.3g} voxels out: three are the least", attempt.outside / attempt.voxel));
    note(settings_.band_inside > 0.0 && settings_.band_inside < least,
         fmt::format("distances are stored {:.3g} voxels in: three are the least", attempt.inside / attempt.voxel));
    ASPERITY_TRY(SparseGrid grid, SparseGrid::build(std::move(source)));
    return ConvertedMesh{std::move(grid), std::move(report)};
  }

  const TriangleIndex& index_;
  const TriangleMesh& mesh_;
  const ConversionSettings& settings_;
  Judgement judgement_;
  MeshVoxelizer voxelizer_;
  const Progress& progress_;
  double largest_correction_ = 0.0;
};

}  // namespace

Result<InsideRule> parse_inside_rule(std::string_view name) {
  if (const std::optional<InsideRule> rule = value_named<InsideRule>(name)) return *rule;
  return bad_value(fmt::format("is \"{}\"", name), {}, name_list<InsideRule>("\"", " or "));
}

void register_mesh_voxelizer(MeshVoxelizer voxelizer) {
  registered() = voxelizer;
}

bool has_mesh_voxelizer() {
  return registered() != nullptr;
}

Result<ConvertedMesh> convert_mesh(const TriangleIndex& mesh, const ConversionSettings& settings,
                                   const Progress& progress) {
  ASPERITY_CHECK(check_settings(mesh.mesh(), settings));
  const MeshVoxelizer voxelizer = registered();
  if (voxelizer == nullptr) {
    return refused(ErrorCode::file_unsupported,
                   "meshes are made potentials with OpenVDB, which this program was built without", {},
                   "OpenVDB 10 (Debian: scripts/install-packages implicit) and a new build");
  }
  ASPERITY_TRY(Judgement judgement, judge(mesh.mesh(), settings.rule));
  return Converter(mesh, settings, std::move(judgement), voxelizer, progress).run();
}

}  // namespace asperity
