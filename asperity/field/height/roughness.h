#pragma once
// Roughness of measured and generated topographies, and what it predicts.

#include <span>

#include "asperity/core/result.h"
#include "asperity/field/height/map.h"
#include "asperity/field/height/surface_features.h"

namespace asperity {

/// Of a profile, evenly spaced heights (m), about its least-squares line. Fewer than three heights: all 0. [any]
Roughness profile_roughness(std::span<const double> heights, double spacing);

/// A topography's roughness by direction.
struct SurfaceRoughness {
  Roughness along_s;  ///< mean over the map's rows, each about its own line
  Roughness along_t;  ///< mean over its columns
};
/// `tile`: size of the map (m). At most 2048 of its rows and of its columns are read, evenly spread, each whole. [any]
SurfaceRoughness surface_roughness(const HeightMap& map, const Vec2& tile);

/// Coefficients of friction that a roughness suggests.
struct FrictionProposal {
  double across = 0.0;        ///< coefficient in the rougher direction
  double along = 0.0;         ///< in the other one
  bool rough_along_s = true;  ///< the rougher direction is the map's s
};
/// Interlocking asperities: each adds its mean slope to the coefficient of the smooth material, because the force that
/// carries a load up a slope m is m times the load, and what is let go on the other side does no work on a slider that
/// jumps off. `smooth`: coefficient of the material itself. At most 2. [any]
FrictionProposal propose_friction(const SurfaceRoughness& roughness, double smooth) noexcept;

/// How rough a periodic profile feels to a tip of some radius: rms slope of the path of the tip's centre, which rides
/// over crests and does not reach into narrow gaps. It has a maximum over the wavelength, near 4.4 sqrt(amplitude x
/// radius): finer features feel smoother because the tip does not reach in, coarser ones because they are flatter
/// (heterogeneous-features-2008, section 4.2: neck smoothest, abdomen roughest). `amplitude` c and `wavelength` (m) of
/// c cos, `tip_radius` (m); all above 0. [any]
double felt_roughness(double amplitude, double wavelength, double tip_radius);
/// Of any profile that repeats, evenly spaced heights (m). [any]
double felt_roughness(std::span<const double> heights, double spacing, double tip_radius);

}  // namespace asperity
