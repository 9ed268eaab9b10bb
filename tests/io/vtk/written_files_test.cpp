// Files that VTK's own writers wrote, read back; then cut short and spoilt.

#include <vtkDataSetWriter.h>
#include <vtkPoints.h>
#include <vtkRectilinearGridToTetrahedra.h>
#include <vtkStructuredGrid.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLImageDataWriter.h>
#include <vtkXMLPImageDataWriter.h>
#include <vtkXMLPRectilinearGridWriter.h>
#include <vtkXMLRectilinearGridWriter.h>
#include <vtkXMLStructuredGridWriter.h>
#include <vtkXMLUnstructuredGridWriter.h>

#include "tests/io/vtk/vtk_files.h"

namespace asperity::written_files_test {
namespace {

/// How an XML file holds its data.
struct Mode {
  const char* name;
  int data;      ///< vtkXMLWriter::Ascii, Binary, Appended
  bool encoded;  ///< appended data as base64
  bool packed;
  bool wide;  ///< 64-bit headers
};
const Mode modes[] = {{"ascii", vtkXMLWriter::Ascii, false, false, false},
                      {"binary", vtkXMLWriter::Binary, false, false, false},
                      {"binary packed", vtkXMLWriter::Binary, false, true, false},
                      {"appended raw", vtkXMLWriter::Appended, false, false, true},
                      {"appended raw packed", vtkXMLWriter::Appended, false, true, false},
                      {"appended base64 packed", vtkXMLWriter::Appended, true, true, true}};

class WrittenFiles : public VtkFiles {
 protected:
  template <class Writer>
  std::filesystem::path write_xml(const std::string& name, vtkDataObject* data, const Mode& mode) const {
    const auto writer = vtkSmartPointer<Writer>::New();
    const std::string file = (folder_ / name).string();
    writer->SetFileName(file.c_str());
    writer->SetInputData(data);
    writer->SetDataMode(mode.data);
    writer->SetEncodeAppendedData(mode.encoded);
    if (mode.packed) {
      writer->SetCompressorTypeToZLib();
    } else {
      writer->SetCompressorTypeToNone();
    }
    if (mode.wide) {
      writer->SetHeaderTypeToUInt64();
    } else {
      writer->SetHeaderTypeToUInt32();
    }
    EXPECT_EQ(writer->Write(), 1);
    return file;
  }
  std::filesystem::path write_legacy(const std::string& name, vtkDataSet* data, bool binary) const {
    const auto writer = vtkSmartPointer<vtkDataSetWriter>::New();
    const std::string file = (folder_ / name).string();
    writer->SetFileName(file.c_str());
    writer->SetInputData(data);
    if (binary) writer->SetFileTypeToBinary();
    EXPECT_EQ(writer->Write(), 1);
    return file;
  }
  static vtkSmartPointer<vtkUnstructuredGrid> tetrahedra() {
    const auto split = vtkSmartPointer<vtkRectilinearGridToTetrahedra>::New();
    const auto grid = rectilinear();
    split->SetInputData(grid);
    split->SetTetraPerCellTo5();
    split->Update();
    vtkSmartPointer<vtkUnstructuredGrid> cells = split->GetOutput();
    fill(*cells);
    return cells;
  }

  /// Cut at every tenth of the length, and with single bytes changed: an error with words, or a volume.
  void expect_no_harm(const std::filesystem::path& file, bool cut_is_error) const {
    const std::string whole = bytes_of(file);
    const std::string name = "cut" + file.extension().string();
    for (std::size_t tenth = 0; tenth < 10; ++tenth) {
      const auto cut = read_vtk_volume(write(name, whole.substr(0, whole.size() * tenth / 10)));
      EXPECT_FALSE(cut_is_error && cut.ok()) << file << " at " << tenth;
      if (!cut) {
        EXPECT_FALSE(cut.error().what.empty());
        EXPECT_NE(cut.error().file.find(name), std::string::npos);
      }
    }
    for (std::size_t at = 1; at < whole.size(); at += std::max<std::size_t>(whole.size() / 60, 1)) {
      std::string spoilt = whole;
      spoilt[at] = static_cast<char>(spoilt[at] ^ 0x15);
      const auto read = read_vtk_volume(write(name, spoilt));
      EXPECT_TRUE(read.ok() || !read.error().what.empty());
    }
  }
};

TEST_F(WrittenFiles, ImagesInEveryWayOfStoringThem) {
  for (const Mode& mode : modes) {
    const auto file = write_xml<vtkXMLImageDataWriter>("a.vti", image(), mode);
    const auto source = read_vtk_volume(file);
    ASSERT_TRUE(source.ok()) << mode.name << ": " << source.error().message();
    EXPECT_EQ(source->array, "value");
    EXPECT_TRUE(has_note(*source, "3 arrays"));
    EXPECT_EQ(scalars(source).axis(0).front(), 1.0);
    EXPECT_EQ(scalars(source).axis(2).back(), 7.0);
    expect_plane(scalars(source));
    expect_no_harm(file, true);
  }
}

TEST_F(WrittenFiles, RectilinearGridsAndTheirCellData) {
  VolumeRequest cells;
  cells.array = "number";
  for (const Mode& mode : modes) {
    const auto file = write_xml<vtkXMLRectilinearGridWriter>("a.vtr", rectilinear(), mode);
    const auto nodes = read_vtk_volume(file);
    ASSERT_TRUE(nodes.ok()) << mode.name << ": " << nodes.error().message();
    expect_plane(scalars(nodes));
    const auto source = read_vtk_volume(file, cells);
    ASSERT_TRUE(source.ok());
    EXPECT_TRUE(source->cell_data);
    EXPECT_DOUBLE_EQ(scalars(source).axis(0).front(), 0.05);
    EXPECT_EQ(scalars(source).value(1, 2, 1), 1.0 + 4.0 * 2.0 + 12.0);
    expect_no_harm(file, true);
  }
}

TEST_F(WrittenFiles, LegacyFilesOfEachKind) {
  const auto structured = vtkSmartPointer<vtkStructuredGrid>::New();
  const auto points = vtkSmartPointer<vtkPoints>::New();
  const auto like = rectilinear();
  for (vtkIdType i = 0; i < like->GetNumberOfPoints(); ++i) points->InsertNextPoint(like->GetPoint(i));
  structured->SetDimensions(5, 4, 3);
  structured->SetPoints(points);
  fill(*structured);
  for (const bool binary : {false, true}) {
    for (int kind = 0; kind < 3; ++kind) {
      const vtkSmartPointer<vtkDataSet> grid = kind == 0   ? vtkSmartPointer<vtkDataSet>(image())
                                               : kind == 1 ? vtkSmartPointer<vtkDataSet>(rectilinear())
                                                           : vtkSmartPointer<vtkDataSet>(structured);
      const auto file = write_legacy("a.vtk", grid, binary);
      const auto source = read_vtk_volume(file);
      ASSERT_TRUE(source.ok()) << kind << binary << source.error().message();
      expect_plane(scalars(source));
      // A legacy file cut between two arrays is a whole one with fewer.
      expect_no_harm(file, false);
    }
  }
}

TEST_F(WrittenFiles, DoublesAreRoundedWithANote) {
  VolumeRequest request;
  request.array = "motion";
  const auto source = read_vtk_volume(write_xml<vtkXMLImageDataWriter>("a.vti", image(), modes[0]), request);
  ASSERT_TRUE(source.ok()) << source.error().message();
  EXPECT_TRUE(has_note(*source, "float64 are kept as float32"));
  const auto* grid = std::get_if<VectorGrid>(&source->data);
  ASSERT_NE(grid, nullptr);
  EXPECT_EQ(grid->samples[0], 1.0F);
  EXPECT_EQ(grid->samples[2], -3.0F);
}

TEST_F(WrittenFiles, ArraysThatAreNotThere) {
  const auto file = write_xml<vtkXMLImageDataWriter>("a.vti", image(), modes[3]);
  VolumeRequest request;
  request.array = "valeu";
  const auto unknown = read_vtk_volume(file, request);
  ASSERT_FALSE(unknown.ok());
  EXPECT_EQ(unknown.error().code, ErrorCode::bad_value);
  EXPECT_NE(unknown.error().what.find("did you mean \"value\""), std::string::npos);
  EXPECT_NE(unknown.error().accepted.find("\"number\" (float32 on cells)"), std::string::npos);
  request.array = "value";
  request.association = Association::cell;
  const auto elsewhere = read_vtk_volume(file, request);
  ASSERT_FALSE(elsewhere.ok());
  EXPECT_NE(elsewhere.error().what.find("sits on nodes"), std::string::npos);
}

TEST_F(WrittenFiles, DescendingAxesAreTurned) {
  const auto grid = vtkSmartPointer<vtkRectilinearGrid>::New();
  grid->SetDimensions(3, 2, 2);
  grid->SetXCoordinates(axis({2.0, 1.0, 0.0}));
  grid->SetYCoordinates(axis({0.0, 1.0}));
  grid->SetZCoordinates(axis({5.0, 4.0}));
  fill(*grid);
  const auto source = read_vtk_volume(write_xml<vtkXMLRectilinearGridWriter>("a.vtr", grid, modes[4]));
  ASSERT_TRUE(source.ok()) << source.error().message();
  EXPECT_TRUE(has_note(*source, "x axis descends"));
  EXPECT_TRUE(has_note(*source, "z axis descends"));
  expect_plane(scalars(source));
}

TEST_F(WrittenFiles, TetrahedraAreResampledWithAnErrorThatIsTrue) {
  for (const Mode& mode : modes) {
    const auto file = write_xml<vtkXMLUnstructuredGridWriter>("a.vtu", tetrahedra(), mode);
    const auto source = read_vtk_volume(file);
    ASSERT_TRUE(source.ok()) << mode.name << ": " << source.error().message();
    // A linear field is reproduced by tetrahedra and by the trilinear grid alike.
    expect_plane(scalars(source), 1e-4);
    EXPECT_LT(source->resample_max, 1e-4);
    EXPECT_TRUE(has_note(*source, "resampled onto 5 x 4 x 3"));
    expect_no_harm(file, true);
  }
  VolumeRequest coarse;
  coarse.array = "number";
  coarse.resample = {4, 4, 4};
  const auto cells = read_vtk_volume(folder_ / "a.vtu", coarse);
  ASSERT_TRUE(cells.ok()) << cells.error().message();
  EXPECT_EQ(scalars(cells).axis(0).size(), 4U);
  EXPECT_GT(cells->resample_rms, 0.1);
  EXPECT_GE(cells->resample_max, cells->resample_rms);
}

TEST_F(WrittenFiles, CellsThatNamePointsThatAreNotThere) {
  const std::string whole = bytes_of(write_xml<vtkXMLUnstructuredGridWriter>("a.vtu", tetrahedra(), modes[0]));
  const std::size_t at = whole.find("Name=\"connectivity\"");
  const std::size_t number = whole.find_first_of("0123456789", whole.find('>', at));
  std::string spoilt = whole;
  spoilt.insert(number, "7777");
  auto source = read_vtk_volume(write("b.vtu", spoilt));
  ASSERT_FALSE(source.ok());
  EXPECT_EQ(source.error().code, ErrorCode::file_malformed);
  source = read_vtk_volume(write("b.vtu", changed(whole, "NumberOfCells=\"120\"", "NumberOfCells=\"119\"")));
  EXPECT_FALSE(source.ok());
}

/// The whole image in two pieces along x, by VTK's parallel writers.
class Pieces : public WrittenFiles {
 protected:
  template <class Writer>
  std::filesystem::path split(const std::string& name, vtkDataObject* data) const {
    const auto writer = vtkSmartPointer<Writer>::New();
    const std::string file = (folder_ / name).string();
    writer->SetFileName(file.c_str());
    writer->SetInputData(data);
    writer->SetNumberOfPieces(2);
    writer->SetStartPiece(0);
    writer->SetEndPiece(1);
    EXPECT_EQ(writer->Write(), 1);
    return file;
  }
};

TEST_F(Pieces, AreJoined) {
  const auto images = read_vtk_volume(split<vtkXMLPImageDataWriter>("a.pvti", image()));
  ASSERT_TRUE(images.ok()) << images.error().message();
  expect_plane(scalars(images));
  EXPECT_EQ(scalars(images).axis(0).size(), 5U);
  EXPECT_EQ(scalars(images).axis(0).front(), 1.0);
  const auto file = split<vtkXMLPRectilinearGridWriter>("b.pvtr", rectilinear());
  const auto grids = read_vtk_volume(file);
  ASSERT_TRUE(grids.ok()) << grids.error().message();
  expect_plane(scalars(grids));
  VolumeRequest cells;
  cells.array = "number";
  const auto numbers = read_vtk_volume(file, cells);
  ASSERT_TRUE(numbers.ok()) << numbers.error().message();
  EXPECT_EQ(scalars(numbers).axis(0).size(), 4U);
  EXPECT_EQ(scalars(numbers).value(3, 2, 1), 23.0);
}

TEST_F(Pieces, ThatAreMissingAreNamed) {
  const auto file = split<vtkXMLPImageDataWriter>("a.pvti", image());
  const std::string whole = bytes_of(file);
  std::filesystem::path second;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_)) {
    if (entry.path().filename().string().find("_1.vti") != std::string::npos) second = entry.path();
  }
  ASSERT_FALSE(second.empty());
  const std::string piece = bytes_of(second);
  std::ofstream(second, std::ios::binary) << piece.substr(0, piece.size() / 2);
  auto source = read_vtk_volume(file);
  ASSERT_FALSE(source.ok());
  EXPECT_NE(source.error().file.find("_1.vti"), std::string::npos) << source.error().message();
  std::filesystem::remove(second);
  source = read_vtk_volume(file);
  ASSERT_FALSE(source.ok());
  EXPECT_EQ(source.error().code, ErrorCode::file_missing);
  EXPECT_NE(source.error().message().find("_1.vti"), std::string::npos);
  EXPECT_NE(source.error().place.find("piece 1"), std::string::npos);
  expect_no_harm(file, true);
}

TEST_F(Pieces, HaveToCoverTheWhole) {
  const auto file = split<vtkXMLPImageDataWriter>("a.pvti", image());
  const std::string whole = bytes_of(file);
  auto source = read_vtk_volume(write("c.pvti", changed(whole, "WholeExtent=\"0 4", "WholeExtent=\"0 5")));
  ASSERT_FALSE(source.ok());
  EXPECT_NE(source.error().what.find("leave"), std::string::npos) << source.error().message();
  source = read_vtk_volume(write("c.pvti", changed(whole, "WholeExtent=\"0 4", "WholeExtent=\"0 16000000")));
  ASSERT_FALSE(source.ok());
  EXPECT_EQ(source.error().code, ErrorCode::too_large) << source.error().message();
  source = read_vtk_volume(write("c.pvti", changed(whole, "Spacing=\"0.5", "Spacing=\"-0.5")));
  ASSERT_FALSE(source.ok());
  EXPECT_NE(source.error().what.find("axis x"), std::string::npos);
}

/// A change to a header, and the error's code.
struct Spoilt {
  const char* from;
  const char* to;
  ErrorCode code;
};

TEST_F(WrittenFiles, HeadersOfImagesThatAreWrong) {
  const std::string whole = bytes_of(write_xml<vtkXMLImageDataWriter>("a.vti", image(), modes[4]));
  for (const Spoilt& spoilt :
       {Spoilt{"WholeExtent=\"0 4", "WholeExtent=\"0 99999999999", ErrorCode::bad_value},
        Spoilt{"<Piece Extent=\"0 4 0 3", "<Piece Extent=\"0 4 0 4", ErrorCode::bad_value},
        Spoilt{"WholeExtent=\"0 4", "WholeExtent=\"0 0", ErrorCode::bad_value},
        Spoilt{"WholeExtent=\"0 4", "WholeExtent=\"4 0", ErrorCode::bad_value},
        Spoilt{"WholeExtent=\"0 4", "WholeExtent=\"0 four", ErrorCode::file_malformed},
        Spoilt{"Spacing=\"0.5", "Spacing=\"-0.5", ErrorCode::bad_value},
        Spoilt{"Spacing=\"0.5", "Spacing=\"0", ErrorCode::bad_value},
        Spoilt{"Spacing=\"0.5", "Spacing=\"nan", ErrorCode::file_malformed},
        Spoilt{"Origin=\"1", "Origin=\"one", ErrorCode::file_malformed},
        Spoilt{"offset=\"0\"", "offset=\"99999999\"", ErrorCode::file_truncated},
        Spoilt{"offset=\"0\"", "offset=\"-1\"", ErrorCode::file_truncated},
        Spoilt{"NumberOfComponents=\"3\"", "NumberOfComponents=\"999\"", ErrorCode::file_truncated},
        Spoilt{"NumberOfComponents=\"3\"", "NumberOfComponents=\"99999999\"", ErrorCode::bad_value},
        Spoilt{"type=\"Float32\"", "type=\"Float99\"", ErrorCode::file_unsupported},
        Spoilt{"type=\"ImageData\"", "type=\"PolyData\"", ErrorCode::file_unsupported},
        Spoilt{"LittleEndian", "MiddleEndian", ErrorCode::file_malformed},
        Spoilt{"<VTKFile", "<!DOCTYPE a [<!ENTITY a \"b\">]><VTKFile", ErrorCode::file_malformed}}) {
    const auto source = read_vtk_volume(write("b.vti", changed(whole, spoilt.from, spoilt.to)));
    ASSERT_FALSE(source.ok()) << spoilt.to;
    EXPECT_EQ(source.error().code, spoilt.code) << spoilt.to << ": " << source.error().message();
    EXPECT_FALSE(source.error().place.empty()) << source.error().message();
    EXPECT_FALSE(source.error().accepted.empty()) << source.error().message();
  }
}

TEST_F(WrittenFiles, ADeclaredSizeThatTheFileCannotHoldIsRefusedBeforeItIsMade) {
  const std::string whole = bytes_of(write_xml<vtkXMLImageDataWriter>("a.vti", image(), modes[4]));
  std::string huge = changed(whole, "WholeExtent=\"0 4 0 3 0 2", "WholeExtent=\"0 2000 0 2000 0 500");
  huge = changed(huge, "<Piece Extent=\"0 4 0 3 0 2", "<Piece Extent=\"0 2000 0 2000 0 500");
  const auto source = read_vtk_volume(write("b.vti", huge));
  ASSERT_FALSE(source.ok());
  EXPECT_EQ(source.error().code, ErrorCode::too_large) << source.error().message();
  VolumeRequest small;
  small.most_bytes = 100;
  EXPECT_EQ(read_vtk_volume(folder_ / "a.vti", small).error().code, ErrorCode::too_large);
}

TEST_F(WrittenFiles, HeadersOfLegacyFilesThatAreWrong) {
  const std::string whole = bytes_of(write_legacy("a.vtk", image(), false));
  for (const Spoilt& spoilt : {Spoilt{"DIMENSIONS 5", "DIMENSIONS -5", ErrorCode::bad_value},
                               Spoilt{"DIMENSIONS 5", "DIMENSIONS 0", ErrorCode::bad_value},
                               Spoilt{"DIMENSIONS 5", "DIMENSIONS 1", ErrorCode::bad_value},
                               Spoilt{"DIMENSIONS 5", "DIMENSIONS five", ErrorCode::bad_value},
                               Spoilt{"DIMENSIONS 5 4 3", "DIMENSIONS 9000 9000 9000", ErrorCode::too_large},
                               Spoilt{"DIMENSIONS 5", "DIMENSIONS 99999999999999999999", ErrorCode::bad_value},
                               Spoilt{"DIMENSIONS 5", "DIMENSIONS 6", ErrorCode::file_malformed},
                               Spoilt{"SPACING 0.5", "SPACING -0.5", ErrorCode::bad_value},
                               Spoilt{"SPACING 0.5", "SPACING 0", ErrorCode::bad_value},
                               Spoilt{"SPACING 0.5", "SPACING wide", ErrorCode::bad_value},
                               Spoilt{"ORIGIN 1", "ORIGIN here", ErrorCode::bad_value},
                               Spoilt{"POINT_DATA 60", "POINT_DATA 61", ErrorCode::file_malformed},
                               Spoilt{"STRUCTURED_POINTS", "POLYDATA", ErrorCode::file_unsupported},
                               Spoilt{"ASCII", "ROMAN", ErrorCode::file_malformed},
                               Spoilt{"value 1 60 float", "value 1 99999999 float", ErrorCode::file_truncated},
                               Spoilt{"value 1 60 float", "value 1 60 string", ErrorCode::file_unsupported}}) {
    const auto source = read_vtk_volume(write("b.vtk", changed(whole, spoilt.from, spoilt.to)));
    ASSERT_FALSE(source.ok()) << spoilt.to;
    EXPECT_EQ(source.error().code, spoilt.code) << spoilt.to << ": " << source.error().message();
    EXPECT_FALSE(source.error().place.empty()) << source.error().message();
  }
}

TEST_F(WrittenFiles, MetadataThatPromiseMoreThanThereIsDoNoHarm) {
  const auto grid = image();
  grid->GetPointData()->GetArray("motion")->GetRange(-1);  // VTK writes the range it knows
  const std::string whole = bytes_of(write_legacy("a.vtk", grid, true));
  const std::size_t at = whole.find("INFORMATION ");
  if (at == std::string::npos) GTEST_SKIP() << "this VTK writes no metadata";
  const std::string spoilt = whole.substr(0, at) + "INFORMATION 999999" + whole.substr(whole.find('\n', at));
  const auto source = read_vtk_volume(write("b.vtk", spoilt));
  ASSERT_TRUE(source.ok()) << source.error().message();
  expect_plane(scalars(source));
}

TEST_F(WrittenFiles, AStructuredGridThatIsTurnedHasToBeResampled) {
  const auto structured = vtkSmartPointer<vtkStructuredGrid>::New();
  const auto points = vtkSmartPointer<vtkPoints>::New();
  for (int k = 0; k < 4; ++k) {
    for (int j = 0; j < 4; ++j) {
      for (int i = 0; i < 4; ++i) points->InsertNextPoint(i + 0.3 * j, j - 0.3 * i, k);
    }
  }
  structured->SetDimensions(4, 4, 4);
  structured->SetPoints(points);
  fill(*structured);
  const auto file = write_xml<vtkXMLStructuredGridWriter>("a.vts", structured, modes[2]);
  const auto refused = read_vtk_volume(file);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::file_unsupported);
  EXPECT_NE(refused.error().accepted.find("resample"), std::string::npos);
  VolumeRequest request;
  request.array = "value";
  request.resample = {9, 9, 9};
  const auto source = read_vtk_volume(file, request);
  ASSERT_TRUE(source.ok()) << source.error().message();
  EXPECT_GT(scalars(source).unknown(), 0U);
  EXPECT_LT(source->resample_max, 1e-4);
}

}  // namespace
}  // namespace asperity::written_files_test
