// Grids of any cells resampled onto a rectilinear grid.

#include <fmt/format.h>
#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkCellDataToPointData.h>
#include <vtkCellType.h>
#include <vtkGenericCell.h>
#include <vtkPointData.h>
#include <vtkStaticCellLocator.h>
#include <vtkUnstructuredGrid.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "asperity/io/vtk/vtk_data.h"

namespace asperity::vtk_io {
namespace {

using Axes = std::array<std::vector<double>, 3>;

/// Points of a cell of this kind; 0: a kind that is not read.
int points_of_kind(int kind) {
  switch (kind) {
    case VTK_TETRA: return 4;
    case VTK_VOXEL:
    case VTK_HEXAHEDRON: return 8;
    case VTK_WEDGE: return 6;
    case VTK_PYRAMID: return 5;
    case VTK_PENTAGONAL_PRISM: return 10;
    case VTK_HEXAGONAL_PRISM: return 12;
    default: return 0;
  }
}

/// Distinct coordinates along an axis, those nearer than a thousandth of `typical` taken as one; empty where there are
/// more than `most`: then the cells are in no rows.
std::vector<double> rows(vtkDataSet& data, int axis, double typical, std::size_t most) {
  std::vector<double> all(static_cast<std::size_t>(data.GetNumberOfPoints()));
  double p[3];
  for (vtkIdType i = 0; i < data.GetNumberOfPoints(); ++i) {
    data.GetPoint(i, p);
    all[static_cast<std::size_t>(i)] = p[axis];
  }
  std::sort(all.begin(), all.end());
  std::vector<double> distinct;
  for (const double x : all) {
    if (!distinct.empty() && x - distinct.back() <= 1e-3 * typical) continue;
    if (distinct.size() == most) return {};
    distinct.push_back(x);
  }
  if (distinct.size() < 2) return {};
  distinct.back() = all.back();
  return distinct;
}

/// Nodes of the grid that is sampled: asked for, those of the cells' own rows, or as many as the cells are wide.
Result<Axes> choose_axes(vtkDataSet& data, const VolumeRequest& request, std::size_t bytes_each) {
  double bounds[6];
  data.GetBounds(bounds);
  std::array<double, 3> width{};
  double cell[6];
  for (vtkIdType i = 0; i < data.GetNumberOfCells(); ++i) {
    data.GetCellBounds(i, cell);
    for (std::size_t a = 0; a < 3; ++a) width[a] += cell[2 * a + 1] - cell[2 * a];
  }
  Axes axes;
  std::array<std::uint64_t, 3> size{};
  for (std::size_t a = 0; a < 3; ++a) {
    const double length = bounds[2 * a + 1] - bounds[2 * a];
    width[a] /= static_cast<double>(data.GetNumberOfCells());
    if (!std::isfinite(length) || !(length > 0.0) || !(width[a] > 0.0)) {
      return bad_value(fmt::format("is flat along axis {}", "xyz"[a]), "", "cells with volume");
    }
    const std::uint64_t cells =
        std::clamp<std::uint64_t>(static_cast<std::uint64_t>(std::min(length / width[a] + 0.5, 1e9)), 1, 1U << 20U);
    if (request.resample[a] == 1)
      return bad_value(fmt::format("asks for one node along axis {}", "xyz"[a]), "resample", "two nodes or more, or 0");
    size[a] = request.resample[a] > 0 ? request.resample[a] : cells + 1;
    if (request.resample[a] == 0) {
      axes[a] = rows(data, static_cast<int>(a), width[a], static_cast<std::size_t>(2 * cells + 2));
      if (!axes[a].empty()) size[a] = axes[a].size();
    }
  }
  ASPERITY_CHECK(volume_assembly::sample_count(size, bytes_each, request.most_bytes));
  for (std::size_t a = 0; a < 3; ++a) {
    if (!axes[a].empty()) continue;
    const double length = bounds[2 * a + 1] - bounds[2 * a];
    axes[a] = volume_assembly::even_nodes(bounds[2 * a], length / static_cast<double>(size[a] - 1),
                                          static_cast<std::size_t>(size[a]));
    axes[a].back() = bounds[2 * a + 1];
  }
  return axes;
}

/// Interpolates an array of points anywhere in the grid.
class Sampler {
 public:
  Sampler(vtkDataSet& data, vtkDataArray& values) : values_(values) {
    locator_->SetDataSet(&data);
    locator_->BuildLocator();
    tolerance_ = 1e-6 * data.GetLength();
  }
  /// False outside every cell.
  bool sample(const double at[3], float* out) {
    double x[3] = {at[0], at[1], at[2]};
    double parametric[3];
    double weights[16] = {};
    int sub = 0;
    vtkIdType cell = locator_->FindCell(x, 0.0, cell_, parametric, weights);
    if (cell < 0) {
      // Rounding may put a point between two cells.
      double nearest[3];
      double square = 0.0;
      if (locator_->FindClosestPointWithinRadius(x, tolerance_, nearest, cell_, cell, sub, square) == 0) return false;
      if (cell_->EvaluatePosition(nearest, nullptr, sub, parametric, square, weights) < 0) return false;
    }
    const int components = values_.GetNumberOfComponents();
    for (int c = 0; c < components; ++c) {
      double sum = 0.0;
      for (vtkIdType i = 0; i < cell_->GetNumberOfPoints(); ++i)
        sum += weights[i] * values_.GetComponent(cell_->GetPointId(static_cast<int>(i)), c);
      out[c] = static_cast<float>(sum);
    }
    return true;
  }

 private:
  vtkDataArray& values_;
  vtkSmartPointer<vtkStaticCellLocator> locator_ = vtkSmartPointer<vtkStaticCellLocator>::New();
  vtkSmartPointer<vtkGenericCell> cell_ = vtkSmartPointer<vtkGenericCell>::New();
  double tolerance_ = 0.0;
};

std::vector<float> sample_grid(Sampler& sampler, const Axes& axes, std::size_t components, const Progress& progress) {
  std::vector<float> samples(axes[0].size() * axes[1].size() * axes[2].size() * components,
                             std::numeric_limits<float>::quiet_NaN());
  float* out = samples.data();
  // Just inside: a node on the border belongs to the cell within.
  const auto inside = [](const std::vector<double>& nodes, std::size_t i) {
    const double margin = 1e-9 * (nodes.back() - nodes.front());
    return std::clamp(nodes[i], nodes.front() + margin, nodes.back() - margin);
  };
  for (std::size_t k = 0; k < axes[2].size(); ++k) {
    if (progress) progress("resampling", static_cast<double>(k) / static_cast<double>(axes[2].size()));
    for (std::size_t j = 0; j < axes[1].size(); ++j) {
      for (std::size_t i = 0; i < axes[0].size(); ++i, out += components) {
        const double p[3] = {inside(axes[0], i), inside(axes[1], j), inside(axes[2], k)};
        sampler.sample(p, out);
      }
    }
  }
  return samples;
}

/// Trilinear value of the samples at p; false where one of the corners is not known.
bool trilinear(const GridAxes& axes, const std::vector<float>& samples, std::size_t components, const double p[3],
               double* out) {
  std::array<GridAxis::Place, 3> place;
  for (std::size_t a = 0; a < 3; ++a) place[a] = axes[a].locate(p[a]);
  bool known = true;
  for (std::size_t c = 0; c < components; ++c) out[c] = 0.0;
  for (unsigned corner = 0; corner < 8; ++corner) {
    double weight = 1.0;
    std::array<std::size_t, 3> index{};
    for (std::size_t a = 0; a < 3; ++a) {
      const bool upper = ((corner >> a) & 1U) != 0;
      weight *= upper ? place[a].fraction : 1.0 - place[a].fraction;
      index[a] = place[a].cell + (upper ? 1U : 0U);
    }
    if (weight == 0.0) continue;
    const std::size_t at = index[0] + axes[0].size() * (index[1] + axes[1].size() * index[2]);
    for (std::size_t c = 0; c < components; ++c) {
      out[c] += weight * static_cast<double>(samples[at * components + c]);
      known = known && !std::isnan(samples[at * components + c]);
    }
  }
  return known;
}

/// What the resampled field makes of the original's own values.
void measure_error(vtkDataSet& data, vtkDataArray& original, bool of_cells, const GridAxes& axes,
                   const std::vector<float>& samples, VolumeSource& source, std::size_t& skipped) {
  const auto components = static_cast<std::size_t>(original.GetNumberOfComponents());
  std::vector<double> value(components);
  double squares = 0.0;
  std::size_t count = 0;
  double p[3];
  double bounds[6];
  for (vtkIdType i = 0; i < original.GetNumberOfTuples(); ++i) {
    if (of_cells) {
      data.GetCellBounds(i, bounds);
      for (int a = 0; a < 3; ++a) p[a] = 0.5 * (bounds[2 * a] + bounds[2 * a + 1]);
    } else {
      data.GetPoint(i, p);
    }
    if (!trilinear(axes, samples, components, p, value.data())) {
      ++skipped;
      continue;
    }
    double square = 0.0;
    for (std::size_t c = 0; c < components; ++c) {
      const double difference = value[c] - original.GetComponent(i, static_cast<int>(c));
      square += difference * difference;
    }
    if (!std::isfinite(square)) continue;
    squares += square;
    ++count;
    source.resample_max = std::max(source.resample_max, std::sqrt(square));
  }
  if (count > 0) source.resample_rms = std::sqrt(squares / static_cast<double>(count));
}

void tell(const Axes& axes, std::size_t originals, std::size_t skipped, VolumeSource& source) {
  source.notes.push_back(fmt::format(
      "resampled onto {} x {} x {} nodes: off by {:.3g} (RMS) and at most {:.3g} at the {} original values{}",
      axes[0].size(), axes[1].size(), axes[2].size(), source.resample_rms, source.resample_max, originals,
      skipped > 0 ? fmt::format("; {} of them lie where the resampled field is not known", skipped) : ""));
}

}  // namespace

Status check_cells(vtkDataSet& data) {
  auto* grid = vtkUnstructuredGrid::SafeDownCast(&data);
  if (data.GetNumberOfCells() == 0) return refused(ErrorCode::file_empty, "holds no cells", {}, "cells with volume");
  double p[3];
  for (vtkIdType i = 0; i < data.GetNumberOfPoints(); ++i) {
    data.GetPoint(i, p);
    if (!std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(p[2]))
      return bad_value("is not finite", fmt::format("point {}", i), "finite points");
  }
  if (grid == nullptr) return success();
  vtkDataArray* offsets = grid->GetCells()->GetOffsetsArray();
  vtkDataArray* connectivity = grid->GetCells()->GetConnectivityArray();
  const vtkIdType cells = grid->GetNumberOfCells();
  const auto ids = static_cast<double>(connectivity->GetNumberOfTuples());
  if (grid->GetCellTypesArray() == nullptr || grid->GetCellTypesArray()->GetNumberOfTuples() != cells ||
      offsets->GetNumberOfTuples() != cells + 1) {
    return refused(ErrorCode::file_malformed, "its cells' types and offsets do not fit", {}, "one for each cell");
  }
  for (vtkIdType i = 0; i < cells; ++i) {
    const int kind = grid->GetCellTypesArray()->GetValue(i);
    const int points = points_of_kind(kind);
    if (points == 0) {
      return refused(ErrorCode::file_unsupported, fmt::format("is of VTK's type {}", kind), fmt::format("cell {}", i),
                     "tetrahedra, voxels, hexahedra, wedges, pyramids and prisms");
    }
    const double from = offsets->GetComponent(i, 0);
    const double to = offsets->GetComponent(i + 1, 0);
    if (!(from >= 0.0 && to <= ids && to - from == points)) {
      return refused(ErrorCode::file_malformed, fmt::format("has {} points, its kind has {}", to - from, points),
                     fmt::format("cell {}", i), "as many points as its kind has");
    }
  }
  for (vtkIdType i = 0; i < connectivity->GetNumberOfTuples(); ++i) {
    const double id = connectivity->GetComponent(i, 0);
    if (!(id >= 0.0 && id < static_cast<double>(grid->GetNumberOfPoints()))) {
      return refused(ErrorCode::file_malformed, fmt::format("names point {}, of {}", id, grid->GetNumberOfPoints()),
                     fmt::format("corner {}", i), "points that there are");
    }
  }
  return success();
}

Result<VolumeSource> resampled(vtkDataSet& data, const VolumeRequest& request, const Progress& progress) {
  ASPERITY_CHECK(check_cells(data));
  const DataArrays found = arrays_of(data);
  std::vector<std::string> notes;
  ASPERITY_TRY(const std::size_t chosen, volume_assembly::choose_array(found.described, request, notes));
  vtkDataArray& original = *found.arrays[chosen];
  const bool of_cells = found.described[chosen].association == Association::cell;
  const auto components = static_cast<std::size_t>(original.GetNumberOfComponents());
  ASPERITY_TRY(const Axes nodes, choose_axes(data, request, components * sizeof(float)));

  vtkSmartPointer<vtkDataSet> plain = vtkSmartPointer<vtkDataSet>::Take(data.NewInstance());
  plain->CopyStructure(&data);
  vtkSmartPointer<vtkDataArray> values = &original;
  if (of_cells) {
    plain->GetCellData()->AddArray(&original);
    const auto average = vtkSmartPointer<vtkCellDataToPointData>::New();
    average->SetInputData(plain);
    average->Update();
    values = average->GetOutput()->GetPointData()->GetArray(0);
    if (values == nullptr || values->GetNumberOfTuples() != data.GetNumberOfPoints())
      return refused(ErrorCode::file_malformed, "its cells' values cannot be taken to its points", {}, "a whole grid");
  }
  Sampler sampler(*plain, *values);
  std::vector<float> samples = sample_grid(sampler, nodes, components, progress);
  GridAxes axes;
  for (std::size_t a = 0; a < 3; ++a) {
    ASPERITY_TRY(axes[a], GridAxis::build(nodes[a]));
  }
  VolumeSource measured{VectorGrid{}, {}, {}, false, 0.0, 0.0, {}, {}};
  std::size_t skipped = 0;
  measure_error(data, original, of_cells, axes, samples, measured, skipped);
  tell(nodes, found.described[chosen].values, skipped, measured);

  volume_assembly::RawVolume raw;
  raw.nodes = nodes;
  raw.samples = std::move(samples);
  raw.components = static_cast<int>(components);
  raw.array = found.described[chosen].name;
  ASPERITY_TRY(VolumeSource source, volume_assembly::assemble(std::move(raw), request));
  source.resample_rms = measured.resample_rms;
  source.resample_max = measured.resample_max;
  source.arrays = found.described;
  notes.push_back(measured.notes.front());
  source.notes.insert(source.notes.begin(), notes.begin(), notes.end());
  return source;
}

}  // namespace asperity::vtk_io
