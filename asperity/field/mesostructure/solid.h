#pragma once
// Heights as functions of the place in space and of time: 3-D and 4-D mesostructures (hrm-2010, section 4).

#include <array>
#include <cstdint>
#include <span>

#include "asperity/core/math.h"
#include "asperity/core/result.h"
#include "asperity/field/height/range.h"

namespace asperity {

/// Height at a place and a moment, with its derivatives by the place.
struct SolidJet {
  double height = 0.0;           ///< m
  Vec3 gradient = Vec3::Zero();  ///< m/m
  Mat3 second = Mat3::Zero();    ///< 1/m
};

/// A plane that it keeps to over a box: |H(p) - height - gradient . (p - centre)| <= error.
struct SolidPlane {
  double height = 0.0;           ///< m, at the centre
  Vec3 gradient = Vec3::Zero();  ///< m/m
  double error = 0.0;            ///< m
};

/// What a solid mesostructure is.
enum class SolidKind : std::uint8_t {
  /// amplitude * cos(2 pi (direction . p / wavelength - frequency t) + phase): layers, travelling waves
  waves,
  /// the mean of three such waves along three orthogonal axes, of which `direction` is the first: bumps throughout
  /// space
  lattice,
  /// amplitude * cos(2 pi (d / wavelength - frequency t) + phase): spheres, ripples. d is the distance from `centre`,
  /// rounded near it so that the slope is continuous: d = sqrt(|p - centre|^2 + e^2) - e, e a quarter wavelength
  rings,
  /// gradient noise of `octaves` octaves within +-amplitude, drifting by `drift`
  noise,
  /// amplitude * (1 - cos(2 pi frequency t)) / 2 * (1 - q^2)^3 for q = |p - centre| / wavelength below 1, else 0: a
  /// beat
  pulse,
};
/// As in scene files.
template <>
struct Names<SolidKind> {
  static constexpr auto table = std::to_array<Named<SolidKind>>({{SolidKind::waves, "waves"},
                                                                 {SolidKind::lattice, "lattice"},
                                                                 {SolidKind::rings, "rings"},
                                                                 {SolidKind::noise, "noise"},
                                                                 {SolidKind::pulse, "pulse"}});
};

/// Its numbers. Metres and seconds, object frame. A member that a kind does not take is ignored.
struct SolidSpec {
  SolidKind kind = SolidKind::noise;
  double amplitude = 1e-4;         ///< m, above 0: |height| never exceeds it
  double wavelength = 2e-3;        ///< m, above 0
  Vec3 direction = Vec3::UnitX();  ///< of waves and lattice; made unit
  Vec3 centre = Vec3::Zero();      ///< m; of rings and pulse
  double phase = 0.0;              ///< rad; of waves, lattice and rings
  double frequency = 0.0;          ///< Hz; 0: it stands still (a pulse needs one). All kinds but noise
  Vec3 drift = Vec3::Zero();       ///< m/s, noise
  int octaves = 1;                 ///< noise, 1 to 8; each of half the wavelength and `persistence` the amplitude
  double persistence = 0.5;        ///< noise, 0 to 1
  std::uint64_t seed = 1;          ///< noise
};

/// Immutable; any number of threads may read it.
///
/// Noise: at the points of a cubic lattice, a wavelength apart, stand gradients along the cube's edges, mixed by a
/// quintic (Perlin 2002), divided by the most that this can reach: typical heights are a quarter of the amplitude. The
/// lattices of octaves are shifted against one another, because the height is 0 on their points.
class SolidMesostructure {
 public:
  /// Errors: bad_value naming the member and what would be accepted. [build]
  static Result<SolidMesostructure> build(const SolidSpec& spec);

  /// Height with first and second derivatives, all continuous in place and time. All 0 where a coordinate or the time
  /// is not finite or beyond 1e100. [servo]
  [[nodiscard]] SolidJet jet(const Vec3& p, double time) const noexcept;
  /// Bounds of the height over a box of this centre and half extent (m) at a moment: never too narrow. Exact for waves
  /// in boxes along them; for noise, of second order in the box while that is small against the finest octave. [servo]
  [[nodiscard]] HeightRange range(const Vec3& centre, const Vec3& half_extent, double time) const noexcept;
  /// A plane that the height keeps to over the same box; of second order in the box while that is small. [servo]
  [[nodiscard]] SolidPlane plane(const Vec3& centre, const Vec3& half_extent, double time) const noexcept;
  /// Whether it changes with time. [any]
  [[nodiscard]] bool moves() const noexcept;
  /// Smallest length over which it changes (m): its shortest wavelength. [any]
  [[nodiscard]] double grain() const noexcept;
  /// Bound of |dH/dt| (m/s). [any]
  [[nodiscard]] double most_speed() const noexcept;
  /// As built, its direction made unit. [any]
  [[nodiscard]] const SolidSpec& spec() const noexcept { return spec_; }

 private:
  SolidMesostructure() = default;
  [[nodiscard]] double turn(double time) const noexcept;
  [[nodiscard]] SolidJet wave_jet(const Vec3& axis, double amplitude, const Vec3& p, double time) const noexcept;
  [[nodiscard]] SolidJet ring_jet(const Vec3& p, double time) const noexcept;
  [[nodiscard]] SolidJet noise_jet(const Vec3& p, double time) const noexcept;
  [[nodiscard]] SolidJet pulse_jet(const Vec3& p, double time) const noexcept;
  [[nodiscard]] double beat(double time) const noexcept;
  [[nodiscard]] HeightRange wave_range(const Vec3& axis, double amplitude, const Vec3& centre, const Vec3& half_extent,
                                       double time) const noexcept;
  [[nodiscard]] HeightRange noise_range(const Vec3& centre, const Vec3& half_extent, double time) const noexcept;
  [[nodiscard]] SolidPlane noise_plane(const Vec3& centre, const Vec3& half_extent, double time) const noexcept;
  /// Bound of the second derivatives of all kinds but noise (1/m).
  [[nodiscard]] double most_bend() const noexcept;

  /// One octave of noise: its lattice and how high it stands.
  struct Octave {
    Vec3 shift = Vec3::Zero();  ///< cells
    double frequency = 0.0;     ///< cells/m
    double amplitude = 0.0;     ///< m, times what the lattice answers
    std::uint64_t key = 0;
  };
  [[nodiscard]] std::span<const Octave> octaves() const noexcept {
    return std::span(octaves_).first(static_cast<std::size_t>(spec_.octaves));
  }
  SolidSpec spec_;
  Mat3 axes_ = Mat3::Identity();     ///< of the lattice, columns
  std::array<Octave, 8> octaves_{};  ///< the first spec_.octaves are used
};

}  // namespace asperity
