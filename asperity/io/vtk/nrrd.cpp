// NRRD files: the header is ours, the samples are read by VTK.

#include <fmt/format.h>
#include <unistd.h>
#include <vtkImageData.h>
#include <vtkNrrdReader.h>
#include <vtkPointData.h>

#include <atomic>
#include <fstream>

#include "asperity/io/vtk/file_checks.h"
#include "asperity/io/vtk/vtk_data.h"

namespace asperity::vtk_io {
namespace {

Status check_detached(const std::filesystem::path& header, const std::string& name) {
  const std::filesystem::path data = header.parent_path() / name;
  std::error_code problem;
  if (name.find('%') != std::string::npos || name.starts_with("LIST")) {
    return refused(ErrorCode::file_unsupported, "its samples are in several files", "data file", "one file of samples");
  }
  if (!std::filesystem::is_regular_file(data, problem)) {
    return refused(ErrorCode::file_missing, fmt::format("the file of samples, \"{}\", cannot be read", name),
                   "data file", "a readable file beside the header");
  }
  return success();
}

Status check_length(const NrrdHeader& header, std::size_t held) {
  constexpr std::uint64_t most_packed = 1100;  // zlib
  const std::uint64_t can_hold = header.packed ? held * most_packed : held;
  if (header.data_bytes <= can_hold) return success();
  return refused(ErrorCode::file_truncated,
                 fmt::format("declares {} bytes of samples, {} are there", header.data_bytes, held), "samples",
                 "a whole file");
}

/// The samples behind a header of our own, in a file that lives as long as this.
class PlainCopy {
 public:
  PlainCopy(const std::string& header, const std::string& samples) {
    static std::atomic<unsigned> count{0};
    path_ = (std::filesystem::temp_directory_path() / fmt::format("asperity-{}-{}.nrrd", ::getpid(), count++)).string();
    std::ofstream(path_, std::ios::binary) << header << samples;
  }
  ~PlainCopy() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }
  PlainCopy(const PlainCopy&) = delete;
  PlainCopy& operator=(const PlainCopy&) = delete;
  [[nodiscard]] const std::string& name() const { return path_; }

 private:
  std::string path_;
};

}  // namespace

Result<VolumeSource> read_nrrd(const std::filesystem::path& path, const VolumeRequest& request,
                               const VtkSession& session) {
  std::string detached;
  ASPERITY_TRY(std::string bytes, file_bytes(path, request.most_bytes));
  ASPERITY_TRY(const NrrdHeader header, check_nrrd(bytes, request.most_bytes, detached));
  if (detached.empty()) {
    bytes.erase(0, header.data_at);
  } else {
    ASPERITY_CHECK(check_detached(path, detached));
    ASPERITY_TRY(bytes, file_bytes(path.parent_path() / detached, request.most_bytes));
  }
  ASPERITY_CHECK(check_length(header, bytes.size()));
  if (!header.packed) bytes.resize(static_cast<std::size_t>(header.data_bytes));
  const PlainCopy copy(header.plain, bytes);
  const auto reader = vtkSmartPointer<vtkNrrdReader>::New();
  reader->SetFileName(copy.name().c_str());
  reader->Update();
  ASPERITY_CHECK(session.status(path.string()));
  vtkSmartPointer<vtkDataArray> samples = reader->GetOutput()->GetPointData()->GetScalars();
  const std::uint64_t count = header.size[0] * header.size[1] * header.size[2];
  const auto components = static_cast<std::uint64_t>(header.components);
  if (samples == nullptr || static_cast<std::uint64_t>(samples->GetNumberOfValues()) != count * components) {
    return refused(ErrorCode::file_unsupported, "VTK reads other sizes than its header states", {},
                   "three dimensions, or four with the components first");
  }
  // VTK 9.1 takes the first of three axes for components; the order of the samples is the same.
  samples->SetNumberOfComponents(header.components);
  samples->SetName("samples");
  const auto image = vtkSmartPointer<vtkImageData>::New();
  image->SetDimensions(static_cast<int>(header.size[0]), static_cast<int>(header.size[1]),
                       static_cast<int>(header.size[2]));
  image->GetPointData()->AddArray(samples);
  GridData grid{image, {}};
  for (std::size_t a = 0; a < 3; ++a) {
    grid.nodes[a] =
        volume_assembly::even_nodes(header.origin[a], header.spacing[a], static_cast<std::size_t>(header.size[a]));
  }
  return volume_of(grid, request);
}

}  // namespace asperity::vtk_io
