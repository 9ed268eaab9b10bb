#pragma once

#include <optional>
#include <string>
#include <vector>

#include "asperity/field/height/roughness.h"
#include "asperity/io/experiment.h"
#include "asperity/io/texture_waves.h"

namespace asperity::program {

/// How rough a feature feels to a finger's tip, by the length that its waves have on the surface.
struct FeltWaves {
  WaveRange waves;
  double shortest = 0.0;       ///< felt roughness of the shortest waves (felt_roughness)
  double longest = 0.0;        ///< of the longest
  double roughest = 0.0;       ///< the largest of those between
  double roughest_wave = 0.0;  ///< m, where it is
};
/// One fine feature of a scene in numbers. [any]
struct FeatureFact {
  std::string surface;
  SurfaceFeature feature;
  FeatureScale felt_as = FeatureScale::texture;
  Roughness across;              ///< across its lay, in the plane of the features
  Roughness along;               ///< at right angles to that
  double friction_across = 0.0;  ///< coefficient that its roughness proposes
  double friction_along = 0.0;
  std::optional<FeltWaves> felt;  ///< of a texture that changes under the stroke
};

/// Radius of the tip that feels (m): a finger's.
inline constexpr double felt_tip_radius = 2e-3;

/// Every feature of the scene that is felt as texture or friction. `smooth`: coefficient of friction of the material
/// itself. [main]
std::vector<FeatureFact> feature_facts(const Experiment& experiment, double smooth);
/// The same for people: a line a feature, one for how it feels, and one for where the coefficients come from. [main]
std::vector<std::string> feature_lines(const std::vector<FeatureFact>& facts, double smooth);
/// "R_a 202 nm, R_q 261 nm, mean slope 0.133". [any]
std::string roughness_text(const Roughness& roughness);
/// Why a roughness proposes the coefficients that it does. [any]
std::string proposal_reason(double smooth);

}  // namespace asperity::program
