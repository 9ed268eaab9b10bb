// The real files that this is for, whole and spoilt; and derived fields against VTK's own.

#include <vtkGradientFilter.h>
#include <vtkStructuredGrid.h>
#include <vtkStructuredGridReader.h>

#include <cstdlib>

#include "asperity/field/volume/derived_fields.h"
#include "tests/io/vtk/vtk_files.h"

namespace asperity::real_files_test {
namespace {

class RealVolumes : public VtkFiles {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(shared("kitchen.vtk"))) GTEST_SKIP() << "shared data are not here";
    VtkFiles::SetUp();
  }
  static Result<VolumeSource> read(const std::string& name, const std::string& array = {}) {
    VolumeRequest request;
    request.array = array;
    return read_vtk_volume(shared(name), request);
  }
  /// A fresh copy of the OpenFOAM case.
  [[nodiscard]] std::filesystem::path cavity() const {
    const std::string command =
        "cd '" + folder_.string() + "' && cmake -E tar xf '" + shared("OpenFOAM-cavity.zip").string() + "'";
    EXPECT_EQ(std::system(command.c_str()), 0);  // NOLINT(cert-env33-c): the command is built here
    return folder_ / "OpenFOAM" / "cavity";
  }
};

TEST_F(RealVolumes, KitchenIsATensorProductWithTwentyArrays) {
  const auto source = read("kitchen.vtk");
  ASSERT_TRUE(source.ok()) << source.error().message();
  EXPECT_EQ(source->arrays.size(), 20U);
  EXPECT_EQ(source->array, "p1");
  EXPECT_TRUE(has_note(*source, "\"p1\" was taken"));
  const GridAxes& axes = source->axes();
  EXPECT_EQ(axes[0].size(), 28U);
  EXPECT_EQ(axes[1].size(), 24U);
  EXPECT_EQ(axes[2].size(), 17U);
  EXPECT_FALSE(axes[0].is_uniform());
  EXPECT_NEAR(axes[0].front(), 0.01, 1e-8);
  EXPECT_NEAR(axes[2].back(), 2.5, 1e-6);
  const auto bits = read("kitchen.vtk", "hpor");
  ASSERT_TRUE(bits.ok()) << bits.error().message();
  EXPECT_EQ(scalars(bits).type(), SampleType::uint8);
  EXPECT_EQ(scalars(bits).lowest(), 0.0);
  EXPECT_EQ(scalars(bits).highest(), 1.0);
  const auto velocity = read("kitchen.vtk", "velocity");
  ASSERT_TRUE(velocity.ok());
  EXPECT_NE(std::get_if<VectorGrid>(&velocity->data), nullptr);
}

TEST_F(RealVolumes, SizesUnitsAndOriginsAreKept) {
  const auto carotid = read("carotid.vtk");
  ASSERT_TRUE(carotid.ok()) << carotid.error().message();
  EXPECT_EQ(scalars(carotid).axis(0).size(), 76U);
  EXPECT_EQ(scalars(carotid).axis(0).front(), 100.0);
  EXPECT_EQ(scalars(carotid).axis(1).front(), 80.0);
  EXPECT_EQ(scalars(carotid).axis(2).front(), 1.0);
  EXPECT_EQ(scalars(carotid).highest(), 580.0);
  const auto vase = read("vase.vti");
  ASSERT_TRUE(vase.ok()) << vase.error().message();
  EXPECT_EQ(scalars(vase).type(), SampleType::uint8);
  EXPECT_EQ(scalars(vase).axis(0).size(), 115U);
  EXPECT_TRUE(scalars(vase).axis(0).is_uniform());
  const auto grid = read("RectGrid2.vtk");
  ASSERT_TRUE(grid.ok()) << grid.error().message();
  EXPECT_EQ(scalars(grid).axis(0).size(), 47U);
  EXPECT_NEAR(scalars(grid).axis(0).front(), -1.22396, 1e-6);
  const auto cells = read("RectilinearGrid.vtr", "Void Volume Fraction");
  ASSERT_TRUE(cells.ok()) << cells.error().message();
  EXPECT_TRUE(cells->cell_data);
  EXPECT_EQ(scalars(cells).axis(0).size(), 128U);
  EXPECT_EQ(scalars(cells).axis(2).size(), 64U);
  EXPECT_EQ(cells->arrays.size(), 9U);
}

TEST_F(RealVolumes, WhatIsNoVolumeOfThisKindIsRefused) {
  const auto beach = read("beach.nrrd");
  ASSERT_FALSE(beach.ok());
  EXPECT_EQ(beach.error().code, ErrorCode::file_unsupported);
  EXPECT_NE(beach.error().what.find("is an image (3 x 100 x 100"), std::string::npos) << beach.error().message();
  const auto curved = read("StructuredGrid.vts");
  ASSERT_FALSE(curved.ok());
  EXPECT_EQ(curved.error().code, ErrorCode::file_unsupported);
  VolumeRequest request;
  request.resample = {24, 24, 24};
  const auto resampled = read_vtk_volume(shared("StructuredGrid.vts"), request);
  ASSERT_TRUE(resampled.ok()) << resampled.error().message();
  EXPECT_GT(resampled->resample_rms, 0.0);
  EXPECT_LT(resampled->resample_rms, 0.05);  // of a density of 0.2 to 0.7
}

TEST_F(RealVolumes, CutShortTheyAreRefusedOrHoldWhatIsWhole) {
  for (const char* name : {"kitchen.vtk", "RectGrid2.vtk", "carotid.vtk", "RectilinearGrid.vtr", "StructuredGrid.vts",
                           "vase.vti", "beach.nrrd"}) {
    const std::string whole = bytes_of(shared(name));
    const std::string copy = "cut" + std::filesystem::path(name).extension().string();
    for (std::size_t tenth = 0; tenth < 10; ++tenth) {
      const auto cut = read_vtk_volume(write(copy, whole.substr(0, whole.size() * tenth / 10)));
      EXPECT_FALSE(cut.ok()) << name << " at " << tenth;
      EXPECT_TRUE(cut.ok() || cut.error().file.find(copy) != std::string::npos);
    }
  }
}

TEST_F(RealVolumes, SpoiltHeadersAreRefused) {
  const std::string kitchen = bytes_of(shared("kitchen.vtk"));
  EXPECT_FALSE(read_vtk_volume(write("a.vtk", changed(kitchen, "DIMENSIONS 28", "DIMENSIONS 2800"))).ok());
  EXPECT_FALSE(read_vtk_volume(write("a.vtk", changed(kitchen, "POINTS 11424", "POINTS 11425"))).ok());
  const auto text = read_vtk_volume(write("a.vtk", changed(kitchen, "  0.1 0.0099", "  zero 0.0099")));
  ASSERT_FALSE(text.ok());
  EXPECT_EQ(text.error().place, "line 11") << text.error().message();
  const std::string vase = bytes_of(shared("vase.vti"));
  EXPECT_FALSE(read_vtk_volume(write("a.vti", changed(vase, "Spacing=\"1", "Spacing=\"-1"))).ok());
  const std::string carotid = bytes_of(shared("carotid.vtk"));
  const auto negative = read_vtk_volume(write("a.vtk", changed(carotid, "SPACING 1 1", "SPACING 1 -1")));
  ASSERT_FALSE(negative.ok());
  EXPECT_NE(negative.error().what.find("axis y"), std::string::npos);
}

TEST_F(RealVolumes, OpenFoamCasesAreResampledAtAStep) {
  const auto folder = cavity();
  const auto last = read_vtk_volume(folder);
  ASSERT_TRUE(last.ok()) << last.error().message();
  EXPECT_EQ(last->array, "p");
  EXPECT_TRUE(has_note(*last, "step 2.5"));
  EXPECT_TRUE(has_note(*last, "resampled onto 21 x 21 x 2"));
  EXPECT_NEAR(scalars(last).axis(0).back(), 0.1, 1e-6);
  EXPECT_EQ(scalars(last).unknown(), 0U);
  EXPECT_GT(last->resample_rms, 0.0);
  EXPECT_LT(last->resample_rms, 0.1);  // of pressures of -4.4 to 4.8
  VolumeRequest request;
  request.array = "U";
  request.time = "1.5";
  const auto velocity = read_vtk_volume(folder / "case.foam", request);
  ASSERT_TRUE(velocity.ok()) << velocity.error().message();
  EXPECT_NE(std::get_if<VectorGrid>(&velocity->data), nullptr);
  request.time = "7";
  const auto absent = read_vtk_volume(folder, request);
  ASSERT_FALSE(absent.ok());
  EXPECT_EQ(absent.error().place, "time");
  EXPECT_NE(absent.error().accepted.find("2.5"), std::string::npos);
}

TEST_F(RealVolumes, SpoiltOpenFoamCasesAreRefused) {
  const auto folder = cavity();
  for (const char* list : {"points", "faces", "owner", "neighbour"}) {
    const auto file = folder / "constant" / "polyMesh" / list;
    const std::string whole = bytes_of(file);
    for (std::size_t tenth = 0; tenth < 10; tenth += 3) {
      std::ofstream(file, std::ios::binary) << whole.substr(0, whole.size() * tenth / 10);
      EXPECT_FALSE(read_vtk_volume(folder).ok()) << list << tenth;
    }
    std::filesystem::remove(file);
    const auto missing = read_vtk_volume(folder);
    ASSERT_FALSE(missing.ok());
    EXPECT_EQ(missing.error().code, ErrorCode::file_missing);
    std::ofstream(file, std::ios::binary) << whole;
  }
  EXPECT_TRUE(read_vtk_volume(folder).ok());
}

/// Whether node i has a neighbour at the same distance on either side: there VTK's differences are of second order too.
bool even_at(const GridAxis& axis, std::uint32_t i) {
  return i > 0 && i < axis.cells() && std::abs(axis.width(i) - axis.width(i - 1)) < 1e-5 * axis.width(i);
}

TEST_F(RealVolumes, DerivedFieldsAgreeWithVtksGradientFilter) {
  const auto source = read("kitchen.vtk", "velocity");
  ASSERT_TRUE(source.ok());
  const VectorGrid& velocity = *std::get_if<VectorGrid>(&source->data);
  const auto vorticity = derive(velocity, DerivedField::vorticity_magnitude);
  const auto q = derive(velocity, DerivedField::q_criterion);
  ASSERT_TRUE(vorticity.ok() && q.ok());

  const auto reader = vtkSmartPointer<vtkStructuredGridReader>::New();
  reader->SetFileName(shared("kitchen.vtk").string().c_str());
  const auto gradient = vtkSmartPointer<vtkGradientFilter>::New();
  gradient->SetInputConnection(reader->GetOutputPort());
  gradient->SetInputScalars(vtkDataObject::FIELD_ASSOCIATION_POINTS, "velocity");
  gradient->ComputeVorticityOn();
  gradient->ComputeQCriterionOn();
  gradient->Update();
  vtkPointData* theirs = vtkDataSet::SafeDownCast(gradient->GetOutput())->GetPointData();
  vtkDataArray* curl = theirs->GetArray("Vorticity");
  vtkDataArray* criterion = theirs->GetArray("Q-criterion");
  ASSERT_TRUE(curl != nullptr && criterion != nullptr);

  std::size_t compared = 0;
  const GridAxes& axes = velocity.axes;
  for (std::uint32_t k = 0; k < axes[2].size(); ++k) {
    for (std::uint32_t j = 0; j < axes[1].size(); ++j) {
      for (std::uint32_t i = 0; i < axes[0].size(); ++i) {
        if (!even_at(axes[0], i) || !even_at(axes[1], j) || !even_at(axes[2], k)) continue;
        const auto at = static_cast<vtkIdType>(vorticity->index(i, j, k));
        const Vec3 w(curl->GetComponent(at, 0), curl->GetComponent(at, 1), curl->GetComponent(at, 2));
        EXPECT_NEAR(vorticity->value(i, j, k), w.norm(), 1e-4 * (w.norm() + 0.01));
        const double expected = criterion->GetComponent(at, 0);
        EXPECT_NEAR(q->value(i, j, k), expected, 1e-4 * (std::abs(expected) + 0.01));
        ++compared;
      }
    }
  }
  EXPECT_GT(compared, 20U);
}

TEST_F(VtkFiles, NrrdVolumes) {
  std::string samples;
  for (int i = 0; i < 60; ++i) samples += static_cast<char>(i);
  const std::string header =
      "NRRD0004\ntype: unsigned char\ndimension: 3\nsizes: 5 4 3\nspacings: 0.5 1 2\nencoding: raw\n\n";
  const auto source = read_vtk_volume(write("a.nrrd", header + samples));
  ASSERT_TRUE(source.ok()) << source.error().message();
  EXPECT_EQ(scalars(source).type(), SampleType::uint8);
  EXPECT_EQ(scalars(source).axis(0).back(), 2.0);
  EXPECT_EQ(scalars(source).axis(2).back(), 4.0);
  EXPECT_EQ(scalars(source).value(4, 3, 2), 59.0);
  EXPECT_EQ(scalars(source).value(1, 2, 0), 11.0);
  const std::string placed = changed(header, "spacings: 0.5 1 2",
                                     "space dimension: 3\nspace directions: (0.5,0,0) (0,1,0) (0,0,2)\n"
                                     "space origin: (1,2,3)");
  const auto moved = read_vtk_volume(write("b.nrrd", placed + samples));
  ASSERT_TRUE(moved.ok()) << moved.error().message();
  EXPECT_EQ(scalars(moved).axis(0).front(), 1.0);
  EXPECT_EQ(scalars(moved).axis(2).back(), 7.0);
  const std::string vectors =
      changed(changed(header, "sizes: 5 4 3", "sizes: 3 5 2 2"), "spacings: 0.5 1 2", "spacings: nan 0.5 1 2");
  const auto four = read_vtk_volume(write("f.nrrd", changed(vectors, "dimension: 3", "dimension: 4") + samples));
  ASSERT_TRUE(four.ok()) << four.error().message();
  const auto* grid = std::get_if<VectorGrid>(&four->data);
  ASSERT_NE(grid, nullptr);
  EXPECT_EQ(grid->axes[0].size(), 5U);
  EXPECT_EQ(grid->axes[2].back(), 2.0);
  EXPECT_EQ(grid->samples[17], 17.0F);

  for (std::size_t length = 0; length < header.size() + samples.size(); length += 9)
    EXPECT_FALSE(read_vtk_volume(write("c.nrrd", (header + samples).substr(0, length))).ok()) << length;
  for (const auto& [from, to] :
       std::vector<std::pair<std::string, std::string>>{{"sizes: 5", "sizes: -5"},
                                                        {"sizes: 5", "sizes: 0"},
                                                        {"sizes: 5", "sizes: five"},
                                                        {"sizes: 5 4 3", "sizes: 5 4"},
                                                        {"sizes: 5 4 3", "sizes: 90000 90000 90000"},
                                                        {"spacings: 0.5", "spacings: -0.5"},
                                                        {"spacings: 0.5", "spacings: 0"},
                                                        {"spacings: 0.5", "spacings: wide"},
                                                        {"dimension: 3", "dimension: 2"},
                                                        {"dimension: 3", "dimension: x"},
                                                        {"type: unsigned char", "type: block"},
                                                        {"encoding: raw", "encoding: ascii"},
                                                        {"encoding: raw", "encoding: hex"}}) {
    const auto wrong = read_vtk_volume(write("d.nrrd", changed(header, from, to) + samples));
    ASSERT_FALSE(wrong.ok()) << to;
    EXPECT_FALSE(wrong.error().place.empty()) << wrong.error().message();
  }
}

}  // namespace
}  // namespace asperity::real_files_test
