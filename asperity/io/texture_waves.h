#pragma once
// How long the waves of a texture are on the surface that it is laid on: mappings stretch and squeeze features.

#include "asperity/device/stroke.h"
#include "asperity/render/scene.h"

namespace asperity {

/// Wavelengths of a feature on a surface.
struct WaveRange {
  double shortest = 0.0;  ///< m
  double longest = 0.0;   ///< m
  bool changes = true;    ///< false: the feature's height is the same all along the surface there
};
/// Of one of the instance's fine features, along a stroke: across its lay where it has one, else where it is squeezed
/// most. Along a recorded stroke, whose points need not lie on a surface: over the mesh whose texture coordinates are
/// the mapping, else as on the plane of the features. The instance has fine features. [build]
WaveRange waves_along(const Instance& instance, const SurfaceFeature& feature, const StrokePath& path);

}  // namespace asperity
