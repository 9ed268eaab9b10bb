#include "asperity/io/volume_io.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <fstream>
#include <new>

#include "asperity/io/detail/file_reading.h"

namespace asperity {
namespace {

namespace fs = std::filesystem;

constexpr const char* accepted_volume_formats =
    "a volume: .json (sidecar) or .raw, .vtk, .vti, .vtr, .vts, .vtu, .pvti, .pvtr, .nrrd, .nhdr, .foam";

constinit std::atomic<VolumeReader> registered_volume_reader{nullptr};

bool is_case_folder(const fs::path& path) {
  std::error_code ignored;
  return fs::is_directory(path, ignored) && fs::exists(path / "system" / "controlDict", ignored);
}

/// A JSON file that says so near its beginning; scenes have the same suffix.
bool is_sidecar(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  std::string head(65536, '\0');
  stream.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(stream.gcount()));
  return head.find("\"asperity_volume\"") != std::string::npos;
}

/// The sidecar of a file of raw samples.
Result<fs::path> sidecar_of(const fs::path& raw) {
  fs::path appended = raw;
  appended += ".json";
  fs::path replaced = raw;
  replaced.replace_extension(".json");
  std::error_code ignored;
  for (const fs::path& candidate : {appended, replaced}) {
    if (fs::is_regular_file(candidate, ignored) && is_sidecar(candidate)) return candidate;
  }
  return refused_file(ErrorCode::file_unsupported, "is raw, and no sidecar tells what it holds", raw.string(),
                      fmt::format("a sidecar \"{}\" beside it", appended.filename().string()));
}

Result<VolumeSource> read_checked(const fs::path& path, const VolumeRequest& request, const Progress& progress) {
  std::error_code ignored;
  const fs::file_status status = fs::status(path, ignored);
  const auto refuse = [&](ErrorCode code, const char* what) {
    return refused_file(code, what, path.string(), accepted_volume_formats);
  };
  if (!fs::exists(status)) return refuse(ErrorCode::file_missing, "no such file");
  if (needs_volume_reader(path)) {
    const VolumeReader reader = registered_volume_reader;
    if (reader == nullptr) {
      return refused_file(
          ErrorCode::file_unsupported, "is read with VTK, which this program was built without", path.string(),
          "VTK 9 (Debian: scripts/install-packages volumes) and a new build, or raw samples with a sidecar");
    }
    return reader(path, request, progress);
  }
  if (fs::is_directory(status)) return refuse(ErrorCode::file_missing, "is a folder, and no OpenFOAM case");
  const std::string suffix = lower_extension(path);
  if (suffix == ".json") return read_sidecar_volume(path, request, progress);
  if (suffix == ".raw") {
    ASPERITY_TRY(const fs::path sidecar, sidecar_of(path));
    return read_sidecar_volume(sidecar, request, progress);
  }
  return refuse(ErrorCode::file_unsupported, "is no volume format that is read here");
}

}  // namespace

void register_volume_reader(VolumeReader reader) {
  registered_volume_reader = reader;
}

std::span<const std::string> volume_reader_suffixes() {
  static const std::vector<std::string> suffixes{".vtk",  ".vti",  ".vtr",  ".vts",  ".vtu",
                                                 ".pvti", ".pvtr", ".nrrd", ".nhdr", ".foam"};
  return suffixes;
}

bool needs_volume_reader(const fs::path& path) {
  const std::string suffix = lower_extension(path);
  const std::span<const std::string> suffixes = volume_reader_suffixes();
  return std::find(suffixes.begin(), suffixes.end(), suffix) != suffixes.end() || is_case_folder(path);
}

bool is_bricked_path(const fs::path& path) {
  return lower_extension(path) == ".aspvol";
}

bool is_volume_path(const fs::path& path) {
  if (needs_volume_reader(path) || is_bricked_path(path)) return true;
  const std::string suffix = lower_extension(path);
  return suffix == ".raw" || (suffix == ".json" && is_sidecar(path));
}

Result<VolumeSource> read_volume(const fs::path& path, const VolumeRequest& request, const Progress& progress) {
  try {
    return in_file(read_checked(path, request, progress), path.string());
  } catch (const std::bad_alloc&) {
    return refused_file(ErrorCode::too_large, "needs more memory than there is", path.string(), "a smaller volume");
  } catch (const std::exception& failure) {
    return refused_file(ErrorCode::file_malformed, fmt::format("cannot be read ({})", failure.what()), path.string(),
                        accepted_volume_formats);
  }
}

}  // namespace asperity
