#include "asperity/io/vtk/vtk_volume.h"

#include <fmt/format.h>
#include <vtkDataSetReader.h>
#include <vtkImageData.h>
#include <vtkRectilinearGrid.h>
#include <vtkStructuredGrid.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLImageDataReader.h>
#include <vtkXMLRectilinearGridReader.h>
#include <vtkXMLStructuredGridReader.h>
#include <vtkXMLUnstructuredGridReader.h>

#include <algorithm>
#include <fstream>
#include <new>

#include "asperity/io/detail/file_reading.h"
#include "asperity/io/vtk/file_checks.h"
#include "asperity/io/vtk/vtk_data.h"

namespace asperity {
namespace vtk_io {
namespace {

namespace fs = std::filesystem;

/// From memory: what the check let through.
vtkSmartPointer<vtkDataSet> read_legacy(const std::string& bytes) {
  const auto reader = vtkSmartPointer<vtkDataSetReader>::New();
  reader->ReadFromInputStringOn();
  reader->SetBinaryInputString(bytes.data(), static_cast<int>(bytes.size()));
  reader->ReadAllScalarsOn();
  reader->ReadAllVectorsOn();
  reader->ReadAllNormalsOn();
  reader->ReadAllTensorsOn();
  reader->ReadAllTCoordsOn();
  reader->ReadAllFieldsOn();
  reader->Update();
  return reader->GetOutput();
}

template <class Reader>
vtkSmartPointer<vtkDataSet> read_with(const std::string& file) {
  const auto reader = vtkSmartPointer<Reader>::New();
  reader->SetFileName(file.c_str());
  reader->Update();
  return reader->GetOutput();
}

/// The kind of dataset that a suffix promises, and what reads it.
struct XmlKind {
  const char* suffix;
  const char* type;
  vtkSmartPointer<vtkDataSet> (*read)(const std::string&);
};
const XmlKind xml_kinds[] = {{".vti", "ImageData", read_with<vtkXMLImageDataReader>},
                             {".vtr", "RectilinearGrid", read_with<vtkXMLRectilinearGridReader>},
                             {".vts", "StructuredGrid", read_with<vtkXMLStructuredGridReader>},
                             {".vtu", "UnstructuredGrid", read_with<vtkXMLUnstructuredGridReader>}};

bool asks_for_resampling(const VolumeRequest& request) {
  return request.resample[0] > 0 || request.resample[1] > 0 || request.resample[2] > 0;
}

Result<VolumeSource> read_serial(const fs::path& path, const VolumeRequest& request, const Progress& progress,
                                 const VtkSession& session) {
  if (progress) progress("reading volume", 0.0);
  ASPERITY_TRY(vtkSmartPointer<vtkDataSet> data, load_dataset(path, request.most_bytes, session));
  if (data->GetDataObjectType() == VTK_UNSTRUCTURED_GRID) return resampled(*data, request, progress);
  const GridData grid = grid_of(data);
  if (!grid.nodes[0].empty()) return volume_of(grid, request);
  if (asks_for_resampling(request)) return resampled(*data, request, progress);
  return refused(ErrorCode::file_unsupported,
                 "is a structured grid whose points are not the product of three axes (to a thousandth of a cell)", {},
                 "a rectilinear grid, or \"resample\": [nodes along x, y, z] to have it resampled with a stated error");
}

Result<VolumeSource> read_any(const fs::path& path, const VolumeRequest& request, const Progress& progress) {
  std::error_code ignored;
  const std::string suffix = lower_extension(path);
  const bool folder = fs::is_directory(path, ignored);
  if (!folder && !fs::is_regular_file(path, ignored))
    return refused(ErrorCode::file_missing, "no such file", {}, "a volume");
  const VtkSession session;
  if (folder || suffix == ".foam") return read_foam(path, request, progress, session);
  if (suffix == ".pvti" || suffix == ".pvtr") return read_pieces(path, request, progress, session);
  if (suffix == ".nrrd" || suffix == ".nhdr") return read_nrrd(path, request, session);
  return read_serial(path, request, progress, session);
}

}  // namespace

Result<std::string> file_bytes(const fs::path& path, std::size_t most_bytes) {
  std::error_code problem;
  const std::uintmax_t size = fs::file_size(path, problem);
  std::ifstream stream(path, std::ios::binary);
  if (problem || !stream || !fs::is_regular_file(path, problem))
    return refused_file(ErrorCode::file_missing, "cannot be read", path.string(), "a readable file");
  if (size > most_bytes) {
    return refused_file(ErrorCode::too_large, fmt::format("has {} bytes", size), path.string(),
                        fmt::format("at most {} MiB", most_bytes >> 20U));
  }
  std::string bytes(static_cast<std::size_t>(size), '\0');
  stream.read(bytes.data(), static_cast<std::streamsize>(size));
  bytes.resize(static_cast<std::size_t>(stream.gcount()));
  return bytes;
}

Result<vtkSmartPointer<vtkDataSet>> load_dataset(const fs::path& path, std::size_t most_bytes,
                                                 const VtkSession& session) {
  const std::string suffix = lower_extension(path);
  const std::string file = path.string();
  vtkSmartPointer<vtkDataSet> (*read)(const std::string&) = nullptr;
  std::string source = file;
  {
    // Let go of the bytes before VTK reads them again.
    ASPERITY_TRY(const std::string bytes, file_bytes(path, most_bytes));
    if (suffix == ".vtk") {
      // VTK counts the bytes of a text in 32 bits.
      constexpr std::size_t largest_legacy = (std::size_t{1} << 31U) - 1;
      ASPERITY_TRY(source, in_file(check_legacy(bytes, std::min(most_bytes, largest_legacy)), file));
      read = read_legacy;
    }
    for (const XmlKind& kind : xml_kinds) {
      if (suffix != kind.suffix) continue;
      ASPERITY_CHECK(in_file(check_xml(bytes, kind.type, most_bytes), file));
      read = kind.read;
    }
  }
  if (read == nullptr)
    return refused_file(ErrorCode::file_unsupported, "is no volume format that is read here", file, ".vti, .vtr");
  vtkSmartPointer<vtkDataSet> data = read(source);
  ASPERITY_CHECK(session.status(file));
  if (data == nullptr || data->GetNumberOfPoints() == 0)
    return refused_file(ErrorCode::file_empty, "holds no points", file, "a volume");
  return data;
}

}  // namespace vtk_io

Result<VolumeSource> read_vtk_volume(const std::filesystem::path& path, const VolumeRequest& request,
                                     const Progress& progress) {
  try {
    return in_file(vtk_io::read_any(path, request, progress), path.string());
  } catch (const std::bad_alloc&) {
    return refused_file(ErrorCode::too_large, "needs more memory than there is", path.string(), "a smaller volume");
  } catch (const std::exception& failure) {
    return refused_file(ErrorCode::file_malformed, fmt::format("VTK cannot read it: {}", failure.what()), path.string(),
                        "a whole file");
  }
}

void register_vtk_volumes() {
  register_volume_reader(read_vtk_volume);
}

}  // namespace asperity
