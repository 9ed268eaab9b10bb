#include "asperity/io/atomic_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <string>
#include <system_error>

#include "asperity/io/detail/file_reading.h"

namespace asperity {
namespace {

Error unwritable(const std::filesystem::path& path, std::string why) {
  return refused_file(ErrorCode::file_unwritable, "cannot be written: " + std::move(why), path.string(),
                      "a path in an existing folder that you may write to");
}

std::string reason(int error) {
  return std::generic_category().message(error);
}

/// 0, or the errno of the failed write.
int write_all(int descriptor, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return 0;
}

Status write_directly(const std::filesystem::path& path, std::string_view bytes) {
  const int descriptor = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
  if (descriptor < 0) return unwritable(path, reason(errno));
  const int failed = write_all(descriptor, bytes);
  ::close(descriptor);
  if (failed != 0) return unwritable(path, reason(failed));
  return success();
}

/// Two threads or two programs writing the same path must not share the file written aside.
std::filesystem::path aside_of(const std::filesystem::path& path) {
  static std::atomic<unsigned> serial{0};
  std::filesystem::path aside = path;
  aside += fmt::format(".{}-{}.partial", ::getpid(), serial.fetch_add(1));
  return aside;
}

int write_aside(const std::filesystem::path& aside, std::string_view bytes) {
  const int descriptor = ::open(aside.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (descriptor < 0) return errno;
  int failed = write_all(descriptor, bytes);
  if (failed == 0 && ::fsync(descriptor) != 0) failed = errno;
  if (::close(descriptor) != 0 && failed == 0) failed = errno;
  return failed;
}

Status replace(const std::filesystem::path& path, const std::filesystem::path& target, std::string_view bytes) {
  const std::filesystem::path aside = aside_of(target);
  int failed = write_aside(aside, bytes);
  if (failed == 0 && std::rename(aside.c_str(), target.c_str()) != 0) failed = errno;
  if (failed == 0) return success();
  ::unlink(aside.c_str());
  return unwritable(path, reason(failed));
}

Status write_checked(const std::filesystem::path& path, std::string_view bytes) {
  if (path.empty()) return unwritable(path, "the file name is empty");
  std::error_code ignored;
  const std::filesystem::file_status status = std::filesystem::status(path, ignored);
  if (std::filesystem::is_directory(status)) return unwritable(path, "it is a folder");
  if (!std::filesystem::exists(status)) return replace(path, path, bytes);
  if (!std::filesystem::is_regular_file(status)) return write_directly(path, bytes);
  const std::filesystem::path target = std::filesystem::canonical(path, ignored);
  return replace(path, target.empty() ? path : target, bytes);
}

}  // namespace

Status write_file_atomically(const std::filesystem::path& path, std::string_view bytes) {
  try {
    return write_checked(path, bytes);
  } catch (const std::exception& problem) {
    return unwritable(path, problem.what());
  }
}

}  // namespace asperity
