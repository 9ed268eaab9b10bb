#pragma once
// What balls have asked of an isosurface, kept from tick to tick.

#include <cstdint>
#include <vector>

#include "asperity/core/work.h"
#include "asperity/field/volume/cell_polynomial.h"
#include "asperity/geometry/contact.h"

namespace asperity {

/// Which level of which field.
struct FieldLevel {
  std::uint64_t field = 0;  ///< its identity; 0: none
  int level = 0;
  bool operator==(const FieldLevel&) const = default;
};

/// What a search for nearest places asks of a cell at first.
struct CellSummary {
  FieldLevel of;
  CellIndex cell;
  float low = 0.0F;    ///< not above the field anywhere in the cell
  float high = 0.0F;   ///< not below it
  float bend = 0.0F;   ///< most_bend()
  double value = 0.0;  ///< in its middle
  Vec3 gradient = Vec3::Zero();
};

/// Cells by where they are, so that those around a ball do not drive each other out, and the last two answers. With
/// none of it every answer is the same. Two thirds of a megabyte.
class KeptCells {
 public:
  struct Asked {
    FieldLevel of;
    double threshold = 0.0;
    Vec3 p = Vec3::Zero();
    bool operator==(const Asked&) const = default;
  };
  /// To a search within a bound, from a place or from none. `from_start`: how far the foot is that Newton's method
  /// alone led to from there; `last_pass`: what it takes from the foot that was found, where that settled.
  struct Answer {
    Asked asked;
    double bound = 0.0;
    bool started = false;
    Vec3 start = Vec3::Zero();
    double from_start = infinity;
    Foot foot;
    bool settled = false;
    WorkCount work;
    WorkCount last_pass;
  };

  /// [build]
  KeptCells() : summaries_(cube(around)), cells_(cube(near)) {}

  /// Where the summary of a cell is kept, if it is. [servo]
  [[nodiscard]] CellSummary& summary(const CellIndex& cell) noexcept { return summaries_[slot<around>(cell)]; }
  /// And its polynomial. [servo]
  [[nodiscard]] CellPolynomial& polynomial(const CellIndex& cell) noexcept { return cells_[slot<near>(cell)]; }
  /// The last but `before`. [servo]
  [[nodiscard]] const Answer& answer(unsigned before) const noexcept { return answers_[(last_ + before) % 2]; }
  /// [servo]
  void keep(const Answer& answer) noexcept {
    last_ = 1 - last_;
    answers_[last_] = answer;
  }

 private:
  // Cells along each axis; powers of two.
  static constexpr std::uint32_t around = 16;
  static constexpr std::uint32_t near = 8;
  static constexpr std::size_t cube(std::size_t n) noexcept { return n * n * n; }
  template <std::uint32_t Along>
  static std::size_t slot(const CellIndex& cell) noexcept {
    return cell.at[0] % Along + Along * (cell.at[1] % Along + std::size_t{Along} * (cell.at[2] % Along));
  }

  std::vector<CellSummary> summaries_;
  std::vector<CellPolynomial> cells_;
  Answer answers_[2];
  unsigned last_ = 0;
};

}  // namespace asperity
