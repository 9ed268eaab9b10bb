#pragma once
// What a law says of itself before it is asked.

#include <cstdint>
#include <string_view>

namespace asperity {

/// What a law needs of a surface.
enum class LawNeeds {
  nothing,    ///< felt on whatever it does not refuse itself
  triangles,  ///< a mesh, bare or coated
  coat,       ///< on a mesh
  field,      ///< a scalar field: isosurfaces, also of implicit surfaces
  potential,  ///< one on a sparse grid: implicit surfaces
};

/// What a law leads the proxy along.
enum class LawProxy {
  none,        ///< it has none: it adds a force of its own
  surface,     ///< the true surface, the displaced one where there is a coat
  triangles,   ///< of the mesh itself
  facets,      ///< small flat triangles of the displaced surface, generated in every tick
  dense_mesh,  ///< the same, made once when the scene is built
};

/// What a law feels of a coat.
enum class LawCoat {
  nothing,     ///< the mesh alone
  directions,  ///< its normals
  relief,      ///< its heights, standing still
  moment,      ///< its heights as they are at the moment: moving, at their level of detail
};

/// Surfaces that a law is put beside others on when nobody says which: bits of LawFacts::compared.
enum LawCompared : unsigned { on_mesh = 1, on_relief = 2, on_iso = 4, on_implicit = 8, literal_too = 16 };

/// What a law is.
struct LawFacts {
  std::string_view name;    ///< lower-case letters, digits and hyphens
  std::string_view title;   ///< one line: what it feels, and how
  std::string_view source;  ///< paper key and section or equation; of one's own: whatever says where it is from
  LawNeeds needs = LawNeeds::nothing;
  LawProxy proxy = LawProxy::none;
  LawCoat coat = LawCoat::nothing;
  bool linear = false;     ///< pushes by the material's stiffness times the penetration
  bool retards = false;    ///< by the material's dynamic friction, where no friction law is named
  bool own_place = false;  ///< looks the material up itself, where its contact point is: it is given the instance's
  /// Without a proxy: in its own form a probe with a radius feels it too, from where the surface lies that much farther
  /// out (TouchedSurface::probe_radius). Laws with a proxy lead the ball.
  bool ball = false;
  bool unpaid = false;    ///< built in: felt as its authors have it, what it gives is paid by nobody
  unsigned compared = 0;  ///< LawCompared
};

/// How far outside of a surface a law reads its potential.
struct LawReach {
  double distance = 0.0;         ///< m
  std::string_view option = {};  ///< that says so
};

/// The small flat triangles that a law's proxy goes along.
struct LawFacets {
  int subdivisions = 0;           ///< cuts along each edge of a base triangle; 0: triangles of a texel, if not too many
  double influence_radius = 0.0;  ///< m around the proxy within which triangles are made; 0: one and a half of theirs
};

}  // namespace asperity
