#include "asperity/io/sparse_io.h"

#include <atomic>
#include <system_error>

namespace asperity {
namespace {

namespace fs = std::filesystem;

std::atomic<SparseReader>& registered_reader() {
  static std::atomic<SparseReader> reader{nullptr};
  return reader;
}

std::atomic<SparseWriter>& registered_writer() {
  static std::atomic<SparseWriter> writer{nullptr};
  return writer;
}

Error library_missing(const fs::path& path, const char* what) {
  return Error{ErrorCode::file_unsupported,
               what,
               path.string(),
               {},
               "OpenVDB 10 (Debian: scripts/install-packages implicit) and a new build"};
}

}  // namespace

void register_sparse_files(SparseReader reader, SparseWriter writer) {
  registered_reader() = reader;
  registered_writer() = writer;
}

bool has_sparse_files() {
  return registered_reader() != nullptr && registered_writer() != nullptr;
}

bool is_sparse_path(const fs::path& path) {
  std::string suffix = path.extension().string();
  for (char& c : suffix) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return suffix == ".vdb";
}

Result<SparseFile> read_sparse(const fs::path& path, const SparseRequest& request, const Progress& progress) {
  std::error_code ignored;
  const fs::file_status status = fs::status(path, ignored);
  if (!fs::exists(status)) return Error{ErrorCode::file_missing, "no such file", path.string(), {}, "a .vdb file"};
  if (fs::is_directory(status)) return Error{ErrorCode::file_missing, "is a folder", path.string(), {}, "a .vdb file"};
  const SparseReader reader = registered_reader();
  if (reader == nullptr) return library_missing(path, "is read with OpenVDB, which this program was built without");
  Result<SparseFile> file = reader(path, request, progress);
  if (!file) return std::move(file).error().in_file(path.string());
  return file;
}

Status write_sparse(const fs::path& path, const SparseGrid& grid, std::size_t mesh_faces, const Progress& progress) {
  const SparseWriter writer = registered_writer();
  if (writer == nullptr) return library_missing(path, "is written with OpenVDB, which this program was built without");
  Status status = writer(path, grid, mesh_faces, progress);
  if (!status) return std::move(status).error().in_file(path.string());
  return status;
}

}  // namespace asperity
