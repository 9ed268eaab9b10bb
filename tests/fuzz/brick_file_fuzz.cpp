// What no file may do to the reader of bricked volumes: crash, throw, hand out samples that are not there, or an error
// that says nothing. The first byte says whether the header's checksum is put right, so that what lies behind it is
// reached too.

#include <sys/mman.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <iterator>

#include "asperity/field/brick/file.h"
#include "asperity/field/brick/store.h"
#include "tests/fuzz/fuzz_driver.h"

namespace {

using namespace asperity;

void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "broken: %s\n", what);
  std::abort();
}

void check_error(const Error& error) {
  require(!error.what.empty() && !error.file.empty(), "an error names its cause and file");
}

void check_store(const BrickStore& store) {
  require(store.levels() >= 1 && store.lowest() <= store.highest(), "levels and a range");
  for (int level = 0; level < store.levels(); ++level) {
    const GridAxes& axes = store.axes(level);
    Box box;
    for (int corner = 0; corner < 2; ++corner)
      box.include(corner == 0 ? Vec3(axes[0].front(), axes[1].front(), axes[2].front())
                              : Vec3(axes[0].back(), axes[1].back(), axes[2].back()));
    const Status fetched = store.fetch(box, level);
    if (!fetched) check_error(fetched.error());
    store.enter();
    const int ready = store.ready_level(box, level);
    require(!fetched || ready == level, "what was fetched is ready");
    CellIndex cell;
    for (std::size_t a = 0; a < 3; ++a) cell.at[a] = store.axes(ready)[a].cells() - 1;
    double out[64];
    require(store.samples(ready, cell, out), "what is ready is there");
    store.leave();
    require(store.octree(level).levels() >= 1, "a tree of ranges");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  std::string bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  if (data[0] % 4 != 0) reseal_brick_header(bytes);
  const int file = ::memfd_create("brick", MFD_CLOEXEC);
  require(file >= 0 && ::write(file, bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size()), "a file");
  const auto store = BrickStore::open("/proc/self/fd/" + std::to_string(file),
                                      {.resident_bytes = std::size_t{1} << 20U, .stream = false});
  if (store) {
    check_store(**store);
  } else {
    check_error(store.error());
  }
  ::close(file);
  return 0;
}

#ifndef ASPERITY_FUZZ_WITHOUT_MAIN

namespace {

/// One brick of bytes: the smallest file there is. Two would be more than the fuzzer changes.
std::string volume(std::uint32_t x, std::uint32_t y, std::uint32_t z) {
  const auto axis = [](std::uint32_t count) {
    std::vector<double> nodes(count);
    for (std::uint32_t i = 0; i < count; ++i) nodes[i] = i + 0.25 * std::sin(i);
    return *GridAxis::build(std::move(nodes));
  };
  std::vector<std::uint8_t> samples(std::size_t{x} * y * z);
  for (std::size_t n = 0; n < samples.size(); ++n) samples[n] = static_cast<std::uint8_t>(n % 251);
  const ScalarGrid grid = *ScalarGrid::build({axis(x), axis(y), axis(z)}, samples, "fuzz");
  const std::filesystem::path path =
      std::filesystem::temp_directory_path() / ("asperity-brick-fuzz-" + std::to_string(::getpid()));
  const auto written = write_brick_file(path, grid);
  require(written.ok(), "a volume");
  std::ifstream stream(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  std::filesystem::remove(path);
  return bytes;
}

std::vector<std::string> corpus() {
  std::vector<std::string> files;
  for (const char* mode : {"0", "1"}) {
    for (const std::string& bytes : {volume(5, 4, 3), volume(2, 33, 2)}) {
      files.push_back(mode + bytes);
      files.push_back(mode + bytes.substr(0, 600));
    }
  }
  return files;
}

}  // namespace

int main(int argc, char** argv) {
  return asperity::fuzz::run(argc, argv, "brick", corpus());
}

#endif
