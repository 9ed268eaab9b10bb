#pragma once
// Implicit haptic texturing: heights that modulate a potential (hybrid-surface-2004, Fig. 7, and "Haptic decoration").

#include <functional>

#include "asperity/core/names.h"
#include "asperity/core/progress.h"
#include "asperity/field/volume/sparse_grid.h"
#include "asperity/surface/coat.h"

namespace asperity {

/// Height (m, outward) that a texture gives a stored point: by its position, the mesh's closest face to it (no_index
/// where there is none) and the node's number, which tells nodes apart whatever their place. Asked from several threads
/// at once.
using PointHeight = std::function<double(const Vec3& position, std::uint32_t face, std::uint64_t node)>;

/// Independent normal deviates at the stored points (the paper's "Gaussian noise"): its grain is the voxel.
/// `deviation`: standard deviation (m), cut at three of them. [build]
PointHeight gaussian_noise(double deviation, std::uint64_t seed);
/// Gradient noise (Perlin 2002) of the position: `amplitude` is its largest height (m), `wavelength` the distance of
/// its lattice (m). [build]
PointHeight gradient_noise(double amplitude, double wavelength, std::uint64_t seed);
/// A coat over the mesh: its height at the closest face's point nearest to the stored point ("image-based haptic
/// texturing"). Both must outlive the function. Points without a face have height 0. [build]
PointHeight coat_height(const Coat& coat, const TriangleMesh& mesh);

/// What is done so that the textured potential stays a usable distance.
enum class Redistancing : std::uint8_t {
  none,         ///< as the paper: potential less height; where heights change its slope is not 1
  normalised,   ///< that divided by its own slope: right to first order at the surface
  redistanced,  ///< the distance to the textured zero set itself, point by point
};
/// As in scene files and options.
template <>
struct Names<Redistancing> {
  static constexpr auto table = std::to_array<Named<Redistancing>>({{Redistancing::none, "none"},
                                                                    {Redistancing::normalised, "normalised"},
                                                                    {Redistancing::redistanced, "redistanced"}});
};

/// A textured potential and how far it is from a distance.
struct TexturedPotential {
  SparseGrid grid;
  double lowest = 0.0;  ///< heights at points within a voxel of the surface (m)
  double highest = 0.0;
  /// Largest and root of the mean square of | |potential| - distance to its own zero set | at stored points within two
  /// voxels of that set, before and after redistancing (m).
  double largest_error_before = 0.0;
  double rms_error_before = 0.0;
  double largest_error = 0.0;
  double rms_error = 0.0;
};

/// Takes the heights off the potential at every stored point. Where the points' material has a roughness, it multiplies
/// the height. Heights must keep within the stored band less two voxels, and be finite. Errors: bad_value naming the
/// height and what would be accepted. [build]
Result<TexturedPotential> textured(const SparseGrid& grid, const PointHeight& height, Redistancing mode,
                                   const Progress& progress = {});

}  // namespace asperity
