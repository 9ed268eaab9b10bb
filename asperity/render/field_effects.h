#pragma once
// Feeling a volume without a surface: forces that follow from the field at the probe alone.

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "asperity/core/frames.h"
#include "asperity/core/result.h"
#include "asperity/field/volume/scalar_field.h"
#include "asperity/render/laws.h"

namespace asperity {

/// A piecewise linear function of the field's value, constant beyond its ends.
class TransferFunction {
 public:
  struct Point {
    double value = 0.0;   ///< of the field, in its unit
    double answer = 0.0;  ///< in the unit that the effect asks for
  };
  TransferFunction() = default;
  /// Errors: bad_value (no point, not finite, values that do not increase), naming the point. [build]
  static Result<TransferFunction> build(std::vector<Point> points);
  [[nodiscard]] double operator()(double value) const noexcept;
  [[nodiscard]] std::span<const Point> points() const noexcept { return points_; }

 private:
  std::vector<Point> points_;
};

/// How a field is turned into a force, g its gradient, v the probe's velocity, T the transfer function.
enum class FieldEffectKind : std::uint8_t {
  viscosity,          ///< -T(phi) v                              T in N·s/m (large-data-2008, eq. 2)
  gradient,           ///< T(phi) g                               T in N·m per unit (eq. 3)
  iwata,              ///< T(phi) along a fixed direction         T in N (Iwata and Noma 1993)
  pao,                ///< -T(phi) (v . g^) g^                    T in N·s/m (Pao and Lawrence; eq. 4)
  gravity_scalars,    ///< T(|phi - value|) towards `value` along g^   T in N (Reimersdahl et al. 2003)
  viscosity_scalars,  ///< -T(|phi - value|) v                    T in N·s/m (likewise)
};
/// As in scene files.
template <>
struct Names<FieldEffectKind> {
  static constexpr auto table =
      std::to_array<Named<FieldEffectKind>>({{FieldEffectKind::viscosity, "viscosity"},
                                             {FieldEffectKind::gradient, "gradient"},
                                             {FieldEffectKind::iwata, "iwata"},
                                             {FieldEffectKind::pao, "pao"},
                                             {FieldEffectKind::gravity_scalars, "gravity-scalars"},
                                             {FieldEffectKind::viscosity_scalars, "viscosity-scalars"}});
};

/// A volume that is felt wherever the probe is in it.
struct FieldEffect {
  std::string name;
  std::shared_ptr<const ScalarField> field;
  FieldEffectKind kind = FieldEffectKind::viscosity;
  Formulation formulation = Formulation::consistent;  ///< literal: eq. 4 as printed, v g^ component by component
  TransferFunction transfer;
  Vec3 direction = Vec3::UnitY();  ///< iwata: unit, world
  double value = 0.0;              ///< the "scalars" modes: what is looked for, in the field's unit
  double largest_force = 5.0;      ///< N, above 0: what any answer is cut to
  Pose world_from_object;
};

/// "viscosity", "gradient", ...: the kinds by name, in their order. [any]
std::span<const std::string> field_effect_names();
/// Errors: bad_value naming the member and what would be accepted. [build]
Status validate(const FieldEffect& effect);
/// Force on the probe (N, world); zero outside the volume and where nothing is known. [servo]
Vec3 field_effect_force(const FieldEffect& effect, int level, const Vec3& position, const Vec3& velocity,
                        CellPolynomial& cache) noexcept;

}  // namespace asperity
