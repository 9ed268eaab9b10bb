// What no sidecar and no raw bytes may do to the volume reader: crash, throw, allocate beyond what was allowed, answer
// a volume whose samples do not fill its axes, or an error that says nothing. The sidecar ends at the first byte 0;
// what follows are the samples.

#include <cmath>
#include <cstdlib>

#include "asperity/io/volume_io.h"
#include "tests/fuzz/fuzz_driver.h"

namespace {

using namespace asperity;

void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "broken: %s\n", what);
  std::abort();
}

void check(const VolumeSource& source) {
  std::size_t nodes = 1;
  for (const GridAxis& axis : source.axes()) {
    require(axis.size() >= 2, "an axis has two nodes or more");
    for (std::uint32_t i = 1; i < axis.size(); ++i) require(axis.node(i) > axis.node(i - 1), "an axis increases");
    nodes *= axis.size();
  }
  if (const auto* grid = std::get_if<ScalarGrid>(&source.data)) {
    require(grid->size() == nodes, "samples fill the axes");
    require(std::isfinite(grid->lowest()) && grid->lowest() <= grid->highest(), "a range");
    require(grid->unknown() < nodes, "some samples are numbers");
  } else {
    require(std::get_if<VectorGrid>(&source.data)->samples.size() == 3 * nodes, "vectors fill the axes");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  const std::size_t end = std::min(bytes.find('\0'), bytes.size());
  const std::string samples = bytes.substr(std::min(end + 1, bytes.size()));
  VolumeRequest request;
  request.most_bytes = std::size_t{1} << 20U;
  for (const int component : {-1, 1}) {
    request.component = component;
    const auto source = read_sidecar_volume(bytes.substr(0, end), samples, "a.json", request);
    if (source) {
      check(*source);
    } else {
      require(!source.error().what.empty() && !source.error().file.empty(), "an error names its cause and file");
    }
  }
  return 0;
}

#ifndef ASPERITY_FUZZ_WITHOUT_MAIN

namespace {

std::vector<std::string> corpus() {
  const std::string heading = R"({"asperity_volume":1,"file":"a.raw","byte_order":"little",)";
  std::string floats;
  for (int i = 0; i < 24; ++i) floats += std::string("\0\0", 2) + static_cast<char>(i) + "\x40";
  const std::string zero(1, '\0');
  return {heading + R"("size":[2,2,3],"type":"float32","spacing":[1,2,0.5],"origin":[0,-1,1e3]})" + zero +
              floats.substr(0, 48),
          heading + R"("size":[2,3,2],"type":"int16","axes":{"x":[0,1],"y":[3,2,1e-3],"z":[0,1.5]},"unit":"m"})" +
              zero + floats.substr(0, 24),
          heading + R"("size":[2,2,2],"type":"uint8","association":"cell","array":"a","components":1})" + zero +
              floats.substr(0, 8),
          heading + R"("size":[2,2,2],"type":"float32","components":3})" + zero + floats};
}

}  // namespace

int main(int argc, char** argv) {
  return asperity::fuzz::run(argc, argv, "volume", corpus());
}

#endif
