// OpenFOAM cases: the internal mesh at one step, resampled.

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <vtkDoubleArray.h>
#include <vtkMultiBlockDataSet.h>
#include <vtkOpenFOAMReader.h>
#include <vtkUnstructuredGrid.h>

#include <algorithm>
#include <cmath>

#include "asperity/io/detail/file_reading.h"
#include "asperity/io/detail/mesh_readers.h"
#include "asperity/io/vtk/vtk_data.h"

namespace asperity::vtk_io {
namespace {

namespace fs = std::filesystem;

/// The length that a list of the mesh declares, the first line that is a whole number, against its file.
Status check_list(const fs::path& file, std::size_t most_bytes) {
  std::error_code ignored;
  if (!fs::exists(file, ignored)) {
    fs::path packed = file;
    packed += ".gz";
    if (fs::exists(packed, ignored)) return success();
    return refused_file(ErrorCode::file_missing, "no such file", file.string(), "a whole OpenFOAM case");
  }
  ASPERITY_TRY(const std::string text, file_bytes(file, most_bytes));
  mesh_readers::TextCursor cursor(text);
  std::string_view line;
  while (cursor.next_line(line)) {
    const std::string_view word = mesh_readers::take_word(line);
    std::int64_t count = 0;
    if (word.empty() || !mesh_readers::parse_integer(word, count)) continue;
    if (count >= 0 && static_cast<std::uint64_t>(count) <= text.size()) return success();
    return Error{ErrorCode::file_malformed, fmt::format("declares {} entries in {} bytes", count, text.size()),
                 file.string(), cursor.place(), "no more than the file can hold"};
  }
  return refused_file(ErrorCode::file_truncated, "states no number of entries", file.string(), "an OpenFOAM list");
}

Result<double> choose_step(vtkOpenFOAMReader& reader, const std::string& wanted) {
  vtkDoubleArray* times = reader.GetTimeValues();
  if (times == nullptr || times->GetNumberOfTuples() == 0)
    return refused(ErrorCode::file_empty, "holds no time steps", {}, "a case with results");
  std::vector<double> steps;
  for (vtkIdType i = 0; i < times->GetNumberOfTuples(); ++i) steps.push_back(times->GetValue(i));
  if (wanted.empty()) return steps.back();
  double time = 0.0;
  const bool number = mesh_readers::parse_number(wanted, time);
  for (const double step : steps) {
    if (number && std::abs(step - time) <= 1e-9 * std::max(1.0, std::abs(step))) return step;
  }
  return bad_value(fmt::format("has no step \"{}\"", wanted), "time", fmt::format("{}", fmt::join(steps, ", ")));
}

}  // namespace

Result<VolumeSource> read_foam(const fs::path& path, const VolumeRequest& request, const Progress& progress,
                               const VtkSession& session) {
  std::error_code ignored;
  const fs::path folder = fs::is_directory(path, ignored) ? path : path.parent_path();
  for (const char* list : {"points", "faces", "owner", "neighbour"})
    ASPERITY_CHECK(check_list(folder / "constant" / "polyMesh" / list, request.most_bytes));
  if (!fs::exists(folder / "system" / "controlDict", ignored))
    return refused(ErrorCode::file_missing, "has no system/controlDict", {}, "an OpenFOAM case");

  const auto reader = vtkSmartPointer<vtkOpenFOAMReader>::New();
  // The reader takes the folder from the name alone; the file need not be there.
  const std::string name = (folder / "case.foam").string();
  reader->SetFileName(name.c_str());
  reader->UpdateInformation();
  ASPERITY_CHECK(session.status(path.string()));
  ASPERITY_TRY(const double step, choose_step(*reader, request.time));
  reader->DisableAllPatchArrays();
  reader->SetPatchArrayStatus("internalMesh", 1);
  reader->EnableAllCellArrays();
  reader->EnableAllPointArrays();
  reader->CreateCellToPointOff();
  reader->DecomposePolyhedraOn();
  if (progress) progress("reading volume", 0.0);
  reader->UpdateTimeStep(step);
  ASPERITY_CHECK(session.status(path.string()));
  vtkMultiBlockDataSet* blocks = reader->GetOutput();
  auto* mesh = blocks != nullptr && blocks->GetNumberOfBlocks() > 0
                   ? vtkUnstructuredGrid::SafeDownCast(blocks->GetBlock(0))
                   : nullptr;
  if (mesh == nullptr)
    return refused(ErrorCode::file_malformed, "its internal mesh cannot be read", {}, "a whole OpenFOAM case");
  ASPERITY_TRY(VolumeSource source, resampled(*mesh, request, progress));
  source.notes.insert(source.notes.begin(), fmt::format("step {:g} of the case", step));
  return source;
}

}  // namespace asperity::vtk_io
