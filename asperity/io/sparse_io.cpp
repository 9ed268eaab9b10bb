#include "asperity/io/sparse_io.h"

#include <atomic>
#include <system_error>

#include "asperity/io/detail/file_reading.h"

namespace asperity {
namespace {

namespace fs = std::filesystem;

constinit std::atomic<SparseReader> registered_sparse_reader{nullptr};
constinit std::atomic<SparseWriter> registered_sparse_writer{nullptr};

Error library_missing(const fs::path& path, const char* what) {
  return refused_file(ErrorCode::file_unsupported, what, path.string(),
                      "OpenVDB 10 (Debian: scripts/install-packages implicit) and a new build");
}

}  // namespace

void register_sparse_files(SparseReader reader, SparseWriter writer) {
  registered_sparse_reader = reader;
  registered_sparse_writer = writer;
}

bool is_sparse_path(const fs::path& path) {
  return lower_extension(path) == ".vdb";
}

Result<SparseFile> read_sparse(const fs::path& path, const SparseRequest& request, const Progress& progress) {
  std::error_code ignored;
  const fs::file_status status = fs::status(path, ignored);
  if (!fs::exists(status)) return refused_file(ErrorCode::file_missing, "no such file", path.string(), "a .vdb file");
  if (fs::is_directory(status))
    return refused_file(ErrorCode::file_missing, "is a folder", path.string(), "a .vdb file");
  const SparseReader reader = registered_sparse_reader;
  if (reader == nullptr) return library_missing(path, "is read with OpenVDB, which this program was built without");
  return in_file(reader(path, request, progress), path.string());
}

Status write_sparse(const fs::path& path, const SparseGrid& grid, std::size_t mesh_faces, const Progress& progress) {
  const SparseWriter writer = registered_sparse_writer;
  if (writer == nullptr) return library_missing(path, "is written with OpenVDB, which this program was built without");
  return in_file(writer(path, grid, mesh_faces, progress), path.string());
}

}  // namespace asperity
