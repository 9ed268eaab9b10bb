#pragma once
// A folder for files that tests write with VTK, and grids whose values are known.

#include <gtest/gtest.h>
#include <unistd.h>
#include <vtkCellData.h>
#include <vtkDoubleArray.h>
#include <vtkFloatArray.h>
#include <vtkImageData.h>
#include <vtkPointData.h>
#include <vtkRectilinearGrid.h>
#include <vtkSmartPointer.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "asperity/io/vtk/vtk_volume.h"

namespace asperity {

class VtkFiles : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ =
        std::filesystem::temp_directory_path() / ("asperity-vtk-" + std::to_string(::getpid()) + "-" + info->name());
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  static std::filesystem::path shared(const std::string& name) {
    return std::filesystem::path(ASPERITY_SHARED_DATA) / "volumes" / name;
  }
  static std::string bytes_of(const std::filesystem::path& path) {
    std::ifstream stream(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  }
  std::filesystem::path write(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return folder_ / name;
  }
  /// The text with the first `from` replaced; fails where it is not there.
  static std::string changed(std::string text, const std::string& from, const std::string& to) {
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return at == std::string::npos ? text : text.replace(at, from.size(), to);
  }
  static bool has_note(const VolumeSource& source, const std::string& part) {
    for (const std::string& note : source.notes) {
      if (note.find(part) != std::string::npos) return true;
    }
    return false;
  }
  static const ScalarGrid& scalars(const Result<VolumeSource>& source) {
    return *std::get_if<ScalarGrid>(&source->data);
  }
  static double plane(double x, double y, double z) { return 1.0 + 2.0 * x - y + 0.5 * z; }

  /// 5 x 4 x 3 nodes from (1, 2, 3) with spacings (0.5, 1, 2): `value` on nodes, `number` in cells, `motion` vectors.
  static vtkSmartPointer<vtkImageData> image() {
    const auto grid = vtkSmartPointer<vtkImageData>::New();
    grid->SetDimensions(5, 4, 3);
    grid->SetOrigin(1.0, 2.0, 3.0);
    grid->SetSpacing(0.5, 1.0, 2.0);
    fill(*grid);
    return grid;
  }
  static vtkSmartPointer<vtkRectilinearGrid> rectilinear() {
    const auto grid = vtkSmartPointer<vtkRectilinearGrid>::New();
    grid->SetDimensions(5, 4, 3);
    grid->SetXCoordinates(axis({0.0, 0.1, 0.3, 0.7, 1.5}));
    grid->SetYCoordinates(axis({-1.0, 0.0, 2.0, 3.0}));
    grid->SetZCoordinates(axis({1.0, 2.0, 4.0}));
    fill(*grid);
    return grid;
  }
  static vtkSmartPointer<vtkDoubleArray> axis(const std::vector<double>& nodes) {
    const auto array = vtkSmartPointer<vtkDoubleArray>::New();
    for (const double node : nodes) array->InsertNextValue(node);
    return array;
  }
  static void fill(vtkDataSet& grid) {
    const auto values = vtkSmartPointer<vtkFloatArray>::New();
    values->SetName("value");
    const auto motion = vtkSmartPointer<vtkDoubleArray>::New();
    motion->SetName("motion");
    motion->SetNumberOfComponents(3);
    double p[3];
    for (vtkIdType i = 0; i < grid.GetNumberOfPoints(); ++i) {
      grid.GetPoint(i, p);
      values->InsertNextValue(static_cast<float>(plane(p[0], p[1], p[2])));
      motion->InsertNextTuple3(p[0], 0.1, -p[2]);
    }
    const auto numbers = vtkSmartPointer<vtkFloatArray>::New();
    numbers->SetName("number");
    for (vtkIdType i = 0; i < grid.GetNumberOfCells(); ++i) numbers->InsertNextValue(static_cast<float>(i));
    grid.GetPointData()->AddArray(values);
    grid.GetPointData()->AddArray(motion);
    grid.GetCellData()->AddArray(numbers);
  }
  /// Every node of a field that is linear in space.
  static void expect_plane(const ScalarGrid& grid, double tolerance = 1e-5) {
    for (std::uint32_t k = 0; k < grid.axis(2).size(); ++k) {
      for (std::uint32_t j = 0; j < grid.axis(1).size(); ++j) {
        for (std::uint32_t i = 0; i < grid.axis(0).size(); ++i) {
          ASSERT_NEAR(grid.value(i, j, k), plane(grid.axis(0).node(i), grid.axis(1).node(j), grid.axis(2).node(k)),
                      tolerance);
        }
      }
    }
  }

  std::filesystem::path folder_;
};

}  // namespace asperity
