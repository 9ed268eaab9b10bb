#pragma once
// Built-in volumes, made from formulas. All lie in a box with its lower corner at the origin.

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <variant>

#include "asperity/core/names.h"
#include "asperity/core/progress.h"
#include "asperity/field/volume/scalar_grid.h"

namespace asperity {

/// The built-in volumes.
enum class VolumeKind : std::uint8_t {
  /// Velocity (m/s) over a cavity, like the data of large-data-2008: a stream along x above the middle height, a slow
  /// recirculation below, between them a shear layer rolled up into vortices that have come downstream. Nodes are
  /// clustered at the layer and at the walls in x. See `CavityFlow`.
  cavity,
  /// `radius` - |p - centre| (m): positive inside a ball.
  sphere,
  /// Nested closed sheets around the centre, where the field is 1: sheet n = 1, 2, ... `count` lies at r = n wavelength
  /// and threshold 0.5 gives its two faces, n thickness to either side; 0 midway between sheets, and outside.
  shells,
  /// A layer across z: 0 at the middle height and `gradient` (unit/m) there; with an `amplitude` it levels off at
  /// plus and minus that (tanh), without one the field is linear throughout.
  ramp,
  /// s(y) (z - middle - `amplitude` sin(2 pi x / wavelength)) (m): a weakly undulating sheet at threshold 0, in a field
  /// whose slope s is 1, and up to `steepness` in a strip along x: s = 1 + (steepness - 1) exp(-((y - middle) /
  /// thickness)^2). The place of the sheet does not depend on s.
  waves,
  /// sin X cos Y + sin Y cos Z + sin Z cos X, X = 2 pi x / wavelength: the gyroid at threshold 0.
  gyroid,
};
/// As in scene files and options.
template <>
struct Names<VolumeKind> {
  static constexpr auto table = std::to_array<Named<VolumeKind>>({{VolumeKind::cavity, "cavity"},
                                                                  {VolumeKind::sphere, "sphere"},
                                                                  {VolumeKind::shells, "shells"},
                                                                  {VolumeKind::ramp, "ramp"},
                                                                  {VolumeKind::waves, "waves"},
                                                                  {VolumeKind::gyroid, "gyroid"}});
};

/// What to generate. A member that a kind does not take (parameters_of) is ignored; one without a value stands for the
/// kind's own (completed).
struct VolumeGenerator {
  VolumeKind kind = VolumeKind::sphere;
  /// Nodes along x, y, z, each 2 to 4096; in memory at most 2^28 numbers in all. Own: cavity 259 x 127 x 128 (the
  /// paper's), others 128 each.
  std::optional<std::array<std::uint32_t, 3>> size = std::nullopt;
  /// Box (m), above 0. Own: cavity 0.2 x 0.1 x 0.1, others 0.1 each.
  std::optional<Vec3> extent = std::nullopt;
  /// How much wider the widest cell is than the narrowest, about: 1 (even) to 100. Own: cavity 6, others 1.
  /// Along each axis nodes are clustered at the middle; `cavity`: at the layer (z) and at both walls (x), even in y.
  std::optional<double> stretch = std::nullopt;
  /// m, above 0. `sphere`: of the ball, own: 0.35 of the shortest side.
  std::optional<double> radius = std::nullopt;
  /// m, above 0. Own: `shells` 0.1 of the shortest side; `waves` 0.1 of x; `gyroid` half the shortest side; `cavity`
  /// the distance of the vortices, a fifth of x.
  std::optional<double> wavelength = std::nullopt;
  /// m, above 0. `shells`: half thickness of the innermost sheet, at most wavelength / (4 count); own: 0.02 wavelength,
  /// or what fits. `cavity`: half thickness of the shear layer; own: 0.03 of z. `waves`: half width of the steep strip;
  /// own: 0.1 of y.
  std::optional<double> thickness = std::nullopt;
  /// 0 or more. `waves`: m, own: 0.0005 of z; `ramp`: the field's unit, own: 0.
  std::optional<double> amplitude = std::nullopt;
  double gradient = 100.0;                ///< `ramp`: unit/m, not 0
  double steepness = 1.0;                 ///< `waves`: greatest slope over least, 1 to 1e6
  int count = 4;                          ///< `shells`: sheets, 1 to 64
  double speed = 10.0;                    ///< `cavity`: of the outer stream (m/s), above 0
  double strength = 0.35;                 ///< `cavity`: how far the layer has rolled up, 0 (straight) to 0.9
  double time = 0.0;                      ///< `cavity`: s; vortices come downstream at half the speed
  SampleType type = SampleType::float32;  ///< int16 and uint8: scaled to fill the type (all but `cavity`)
};

/// Names of the members besides kind, size, extent, stretch and type that a kind takes; scene files call them the same.
/// [any]
std::span<const std::string_view> parameters_of(VolumeKind kind);
/// Errors: bad_value, listing the names. [build]
Result<VolumeKind> parse_volume_kind(std::string_view name);
/// The generator with its kind's own values where it has none. [any]
VolumeGenerator completed(VolumeGenerator generator);
/// Errors: bad_value naming the member and what it accepts, too_large. [build]
Status validate(const VolumeGenerator& generator);

/// Axes of the volume. Errors as validate. [build]
Result<GridAxes> volume_axes(const VolumeGenerator& generator);
/// The volume: vectors for `cavity`, scalars for all others. Errors as validate. [build]
Result<std::variant<ScalarGrid, VectorGrid>> generate_volume(const VolumeGenerator& generator,
                                                             const Progress& progress = {});

/// A built-in scalar volume as a function of place, for volumes that are written slab by slab and for tests.
class VolumeFunction {
 public:
  /// Errors: as validate; bad_value for `cavity`, whose values are vectors. [build]
  static Result<VolumeFunction> build(const VolumeGenerator& generator);

  /// The field (its unit) at p (m), anywhere in space. [any]
  [[nodiscard]] double value(const Vec3& p) const noexcept;
  /// Samples of the node layers [first, last) along z, x fastest. [any]
  void slab(const GridAxes& axes, std::uint32_t first, std::uint32_t last, std::span<float> out) const;
  /// Centre of what is round, middle of the rest (m). [any]
  [[nodiscard]] const Vec3& centre() const noexcept { return centre_; }

 private:
  VolumeFunction() = default;
  void row(const GridAxis& x, double y, double z, float* out) const noexcept;
  void gyroid_slab(const GridAxes& axes, std::uint32_t first, std::uint32_t last, float* out) const;

  VolumeGenerator generator_;
  Vec3 centre_ = Vec3::Zero();
};

/// The flow of `cavity`: u = (dpsi/dz, dA/dz, -dpsi/dx - dA/dy), the curl of a vector potential, so that its divergence
/// is 0 exactly; sampled, what is left of it is the differences' own error.
///   psi = (U/2) (z' + d ln(cosh(z'/d) + c)) - R(x, z),   z' = z - middle height,
///   c = strength W(x) cos(k (x - U t / 2) + sin(m y) / 2),
/// is a shear layer of half thickness d with a row of vortices (after Stuart 1967; k = 2 pi / wavelength, m = 2 pi /
/// the box's y), straight at the upstream wall where W = 1 - exp(-(x / 0.3 Lx)^2) is 0. R is one slow eddy that fills
/// the cavity below, and A = b sin(m y) exp(-(z'/4d)^2) are weak rolls along the stream. The layer's sway and the rolls
/// make the flow three-dimensional, so that it has helicity. The walls are not modelled: the flow passes them.
class CavityFlow {
 public:
  /// Errors as validate. [build]
  static Result<CavityFlow> build(const VolumeGenerator& generator);
  /// m/s at p (m). [any]
  [[nodiscard]] Vec3 velocity(const Vec3& p) const noexcept;
  /// Slopes du_i/dx_j (1/s) of it, exact. [any]
  [[nodiscard]] Mat3 gradient(const Vec3& p) const noexcept;

 private:
  CavityFlow() = default;
  VolumeGenerator generator_;
};

}  // namespace asperity
