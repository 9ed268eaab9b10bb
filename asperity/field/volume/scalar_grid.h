#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "asperity/core/math.h"
#include "asperity/core/names.h"
#include "asperity/field/volume/grid_axis.h"

namespace asperity {

/// How samples are stored.
enum class SampleType : std::uint8_t { float32, int16, uint8 };
/// As in files.
template <>
struct Names<SampleType> {
  static constexpr auto table = std::to_array<Named<SampleType>>(
      {{SampleType::float32, "float32"}, {SampleType::int16, "int16"}, {SampleType::uint8, "uint8"}});
};
/// Bytes of one sample. [any]
std::size_t sample_bytes(SampleType type);
/// What work.operator()<Sample>() answers for the type's own numbers. [any]
template <class Work>
decltype(auto) with_samples_of(SampleType type, const Work& work) {
  switch (type) {
    case SampleType::int16: return work.template operator()<std::int16_t>();
    case SampleType::uint8: return work.template operator()<std::uint8_t>();
    case SampleType::float32: break;
  }
  return work.template operator()<float>();
}

/// Samples in one of their types. x runs fastest, then y, then z.
using SampleArray = std::variant<std::vector<float>, std::vector<std::int16_t>, std::vector<std::uint8_t>>;

using GridAxes = std::array<GridAxis, 3>;

/// Range and holes of samples that come in, some layers or all at once.
struct SampleSurvey {
  double lowest = infinity;
  double highest = -infinity;
  std::size_t unknown = 0;  ///< samples that are not numbers

  /// Takes layers of a grid, `first_layer` the number of the first; `name` goes before the place in messages. Errors:
  /// bad_value (an infinite sample). [build]
  Status take(const SampleArray& samples, const GridAxes& axes, std::size_t first_layer = 0,
              const std::string& name = {});
};

/// Scalar samples on a rectilinear grid, in memory, in the unit they came with. A float that is not a number marks a
/// place where nothing is known.
class ScalarGrid {
 public:
  /// Errors: mismatch (samples do not fill the grid), bad_value (an infinite sample, no sample that is a number).
  /// [build]
  static Result<ScalarGrid> build(GridAxes axes, SampleArray samples, std::string name = {});

  [[nodiscard]] const GridAxes& axes() const noexcept { return axes_; }
  [[nodiscard]] const GridAxis& axis(std::size_t a) const noexcept { return axes_[a]; }
  [[nodiscard]] std::size_t index(std::uint32_t i, std::uint32_t j, std::uint32_t k) const noexcept {
    return i + static_cast<std::size_t>(axes_[0].size()) * (j + static_cast<std::size_t>(axes_[1].size()) * k);
  }
  [[nodiscard]] double value(std::uint32_t i, std::uint32_t j, std::uint32_t k) const noexcept {
    return std::visit([at = index(i, j, k)](const auto& s) { return static_cast<double>(s[at]); }, samples_);
  }
  [[nodiscard]] SampleType type() const noexcept { return static_cast<SampleType>(samples_.index()); }
  [[nodiscard]] const SampleArray& samples() const noexcept { return samples_; }
  [[nodiscard]] std::size_t size() const noexcept {
    return std::visit([](const auto& s) { return s.size(); }, samples_);
  }
  [[nodiscard]] double lowest() const noexcept { return survey_.lowest; }
  [[nodiscard]] double highest() const noexcept { return survey_.highest; }
  [[nodiscard]] std::size_t unknown() const noexcept { return survey_.unknown; }  ///< samples that are not numbers
  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  [[nodiscard]] Box bounds() const noexcept {
    return {{axes_[0].front(), axes_[1].front(), axes_[2].front()},
            {axes_[0].back(), axes_[1].back(), axes_[2].back()}};
  }
  /// The same samples on axes scaled, then moved. [build]
  [[nodiscard]] ScalarGrid placed(double scale, const Vec3& offset) &&;
  [[nodiscard]] std::size_t memory_bytes() const noexcept;

 private:
  ScalarGrid() = default;

  GridAxes axes_;
  SampleArray samples_;
  std::string name_;
  SampleSurvey survey_;
};

/// A value that splits the samples in two classes that differ most (Otsu 1979): the threshold when nobody names one.
/// [build]
double otsu_threshold(const ScalarGrid& grid);

/// Vectors on a rectilinear grid: x, y, z of one sample after the other, samples as in ScalarGrid.
struct VectorGrid {
  GridAxes axes;
  std::vector<float> samples;
  std::string name;
};

}  // namespace asperity
