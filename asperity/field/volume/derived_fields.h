#pragma once
// Scalar fields computed from a velocity (large-data-2008, section 2), and slopes of any array.

#include <string_view>

#include "asperity/core/names.h"
#include "asperity/core/progress.h"
#include "asperity/field/volume/scalar_grid.h"

namespace asperity {

/// What is computed at every node from derivatives of second order: three nodes along each axis, stretched or not, on
/// one side of the node at the ends of the grid (a grid of two nodes along an axis has only their secant).
enum class DerivedField : std::uint8_t {
  vorticity_magnitude,  ///< |curl u| (1/s)
  q_criterion,          ///< (|Omega|^2 - |S|^2) / 2, the spin's and the strain's Frobenius norms (1/s^2)
  helicity,             ///< u . curl u (m/s^2): positive where the flow turns clockwise as seen along it
  gradient_magnitude,   ///< of scalars |grad f| (unit/m); of vectors the Frobenius norm of all nine slopes (1/s)
};
/// As in scene files and options.
template <>
struct Names<DerivedField> {
  static constexpr auto table =
      std::to_array<Named<DerivedField>>({{DerivedField::vorticity_magnitude, "vorticity_magnitude"},
                                          {DerivedField::q_criterion, "q_criterion"},
                                          {DerivedField::helicity, "helicity"},
                                          {DerivedField::gradient_magnitude, "gradient_magnitude"}});
};
/// Errors: bad_value, listing the names. [build]
Result<DerivedField> parse_derived_field(std::string_view name);

/// Which number of a vector is meant.
enum class VectorPart : std::uint8_t { magnitude, x, y, z };
/// As in scene files and options.
template <>
struct Names<VectorPart> {
  static constexpr auto table = std::to_array<Named<VectorPart>>(
      {{VectorPart::magnitude, "magnitude"}, {VectorPart::x, "x"}, {VectorPart::y, "y"}, {VectorPart::z, "z"}});
};
/// Errors: bad_value, listing the names. [build]
Result<VectorPart> parse_vector_part(std::string_view name);

/// Whether the axes hold as many vectors as there are, all finite or not a number. Errors: mismatch, bad_value. [build]
Status validate(const VectorGrid& grid);

/// A scalar of a velocity field, of the same axes, in float32, named as the field. What is not a number at a node is
/// not a number at the nodes whose derivatives need it, and nowhere else. On all cores where the grid is large.
/// Errors: mismatch, bad_value (as ScalarGrid::build). [build]
Result<ScalarGrid> derive(const VectorGrid& velocity, DerivedField field, const Progress& progress = {});
/// The same of a scalar field. Errors: bad_value (anything but gradient_magnitude needs vectors). [build]
Result<ScalarGrid> derive(const ScalarGrid& grid, DerivedField field, const Progress& progress = {});
/// One number of each vector. Errors as above. [build]
Result<ScalarGrid> part_of(const VectorGrid& grid, VectorPart part);

/// Weights of a derivative of second order at node `node` of an axis: of the nodes first, first + 1, first + 2.
struct DerivativeStencil {
  std::uint32_t first = 0;
  std::uint32_t count = 3;  ///< 2 on an axis of two nodes
  double weights[3] = {};   ///< 1/m
};
/// The quadratic through three neighbouring nodes, differentiated at `node`. [any]
DerivativeStencil derivative_stencil(const GridAxis& axis, std::uint32_t node) noexcept;

}  // namespace asperity
