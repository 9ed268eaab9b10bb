#pragma once
// A run as columns over its ticks: what plots draw and what metrics summarise.

#include <span>
#include <vector>

#include "asperity/core/trace_record.h"
#include "asperity/device/stroke.h"
#include "asperity/render/scene.h"

namespace asperity {

/// Columns of equal length, one value a tick. SI; not-a-number where a column has no meaning at that tick.
///
/// followed     signed height over the nearest point of the base mesh, less the probe's radius: of the proxy where the
///              touched law has one (god-object, force shading); else of the probe with the force's own deflection
///              removed, h + F . n / k, n the base normal, F before the safety stage (quasi-static: damping counts as
///              deflection)
/// relief       height of the reconstructed coat over that same base point (m); 0 on a bare mesh
/// near_step    the base point lies within one texel of a step: a place where the relief changes by more than a quarter
///              of its map's whole range within one texel and more steeply than 1 in 1. Looked for along the stroke and
///              across it, in the plane of the touched triangle. (formulation.md, amendment 16: such samples are left
///              out of height errors.)
/// reference    normal of the reconstructed relief at the base point, n - grad H; the face's own on a bare mesh, turned
/// to
///              the touched side
/// follow       follow error of the probe (FollowMetrics), of the first isosurface of the scene
///
/// On an implicit surface with a mesh the mesh is the base; relief is the height of what is felt over it (texture,
/// offset), reference is the normal of what is felt. On an isosurface there is no base: followed is the signed distance
/// of the felt point from the isosurface (negative inside), relief is 0, reference is the isosurface's normal at the
/// point of it nearest to the felt one. Laws without a proxy are felt at probe + F / k. Under a texture the base is the
/// smooth surface, relief and reference are the texture's, and what is felt is at probe + F / k.
struct RunSeries {
  std::vector<double> time;  ///< s
  std::vector<double>
      distance;  ///< travelled along the stroke since its contact phase began (m), lag of the probe included
  std::vector<double> force;            ///< magnitude of the commanded force (N)
  std::vector<double> normal;           ///< commanded force along the stroke's normal (N)
  std::vector<double> tangential;       ///< commanded force along the direction of travel (N); negative resists
  std::vector<double> friction;         ///< the friction in it, before the safety stage (N)
  std::vector<double> texture;          ///< the texture's lateral force in it, likewise (N)
  std::vector<double> followed;         ///< m; in contact only
  std::vector<double> relief;           ///< m; in contact only
  std::vector<double> direction_error;  ///< angle of the rendered force to the reference normal (rad); from 1 mN on
  std::vector<double>
      work;  ///< done on the probe so far by the commanded force (J), trapezoid; positive: fed into the hand
  std::vector<double> stored;   ///< energy in the spring of the strongest contact, k penetration^2 / 2; of M1 F . n
                                ///< penetration / 2 (J); and in the springs of friction laws
  std::vector<double> follow;   ///< 0 to 1; not-a-number outside the volume and without an isosurface
  std::vector<double> update;   ///< time that `step` took (s)
  std::vector<char> near_step;  ///< 1 or 0
  std::vector<char> near_edge;  ///< 1 where the base point lies within SeriesSettings::edge_reach of a sharp edge
  std::vector<char> stroking;   ///< 1 in the stroke's contact phase
  [[nodiscard]] std::size_t size() const noexcept { return time.size(); }
};

/// What a run is judged by.
struct SeriesSettings {
  /// Its surfaces stand for those of the run, one for one: what is felt through another representation is judged by the
  /// exact geometry. nullptr: the run's own. An implicit surface without texture, offset or shell is judged by its
  /// mesh.
  const Scene* exact = nullptr;
  double edge_reach = 0.001;  ///< m; edges that fold by 20 degrees or more count
};

/// Derives the columns of a run. `records` must come from `scene` and `path`. [main]
RunSeries derive_series(std::span<const TraceRecord> records, const Scene& scene, const StrokePath& path,
                        const SeriesSettings& settings = {});
/// How far edges are near: one and a half voxels of the scene's finest potential, where it has one, else 1 mm. [any]
double edge_reach_of(const Scene& scene);

}  // namespace asperity
