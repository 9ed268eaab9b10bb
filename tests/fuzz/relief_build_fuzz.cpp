// What no mesh, map or setting may do to a relief: crash, throw, answer a number that is not finite where the base is
// finite, or leave the bounds that it states. The bytes are read as small numbers: vertices, triangles, heights,
// settings.

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <memory>

#include "asperity/surface/relief/view.h"
#include "tests/fuzz/fuzz_driver.h"

namespace {

using namespace asperity;

void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "broken: %s\n", what);
  std::abort();
}

/// Numbers out of bytes; zeros when they have run out.
class Bytes {
 public:
  Bytes(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}
  std::uint8_t byte() { return next_ < size_ ? data_[next_++] : std::uint8_t{0}; }
  /// -1 to 1 in steps of 1/127, now and then with a last bit of its own, so that some are all but equal.
  double coordinate() {
    const auto whole = static_cast<std::int8_t>(byte());
    return whole == -128 ? 1.0 + 1e-9 * byte() : whole / 127.0;
  }
  [[nodiscard]] bool done() const { return next_ >= size_; }

 private:
  const std::uint8_t* data_;
  std::size_t size_;
  std::size_t next_ = 0;
};

MeshSource mesh_from(Bytes& bytes) {
  MeshSource source;
  const std::uint32_t vertices = 3U + bytes.byte() % 14U;
  for (std::uint32_t i = 0; i < vertices; ++i) {
    const double x = bytes.coordinate();
    const double y = bytes.coordinate();
    source.positions.emplace_back(x, y, bytes.coordinate());
  }
  const std::uint32_t triangles = 1U + bytes.byte() % 24U;
  for (std::uint32_t i = 0; i < triangles; ++i) {
    const std::uint32_t a = bytes.byte() % vertices;
    const std::uint32_t b = bytes.byte() % vertices;
    source.triangles.push_back({a, b, bytes.byte() % vertices});
  }
  if (bytes.byte() % 2U == 0) {
    for (std::uint32_t i = 0; i < triangles; ++i) {
      std::array<Vec2f, 3> uvs;
      for (Vec2f& uv : uvs) {
        const auto s = static_cast<float>(bytes.coordinate());
        uv = Vec2f(s, static_cast<float>(bytes.coordinate()));
      }
      source.corner_uvs.push_back(uvs);
    }
  }
  return source;
}

std::shared_ptr<const Mesostructure> maps_from(Bytes& bytes) {
  const int size = 2 + bytes.byte() % 4;
  const double amplitude = std::pow(10.0, -4.0 + (bytes.byte() % 6));
  std::vector<float> heights;
  for (int i = 0; i < size * size; ++i) heights.push_back(static_cast<float>(amplitude * bytes.coordinate()));
  const auto how = static_cast<Reconstruction>(bytes.byte() % 3);
  auto map = HeightMap::build(std::move(heights), size, size, bytes.byte() % 2 == 0 ? Wrap::repeat : Wrap::clamp, how);
  require(map.ok(), "finite heights make a map");
  const double tile = std::pow(10.0, -2.0 + (bytes.byte() % 4));
  auto maps = Mesostructure::build(std::move(*map), Vec2(tile, tile));
  return maps.ok() ? std::make_shared<const Mesostructure>(std::move(*maps)) : nullptr;
}

CoatSettings settings_from(Bytes& bytes) {
  CoatSettings settings;
  settings.mapping = static_cast<Mapping>(bytes.byte() % 3);
  settings.repeat = Vec2(0.1 + bytes.byte() % 8, 0.1 + bytes.byte() % 8);
  settings.stitching.folds = static_cast<FoldMode>(bytes.byte() % 2);
  settings.stitching.blend = static_cast<Blend>(bytes.byte() % 5);
  settings.stitching.rho = bytes.byte() / 700.0;
  if (settings.stitching.blend == Blend::image) {
    const int count = bytes.byte() % 5;
    for (int i = 0; i < count; ++i) settings.stitching.blend_map.push_back(bytes.byte() / 200.0);
  }
  return settings;
}

/// Every answer is finite and within what the surface says of itself.
void check_relief(const ReliefSurface& surface, Bytes& bytes) {
  const TriangleMesh& mesh = surface.base().mesh();
  require(std::isfinite(surface.reach()) && surface.skin() > 0.0 && surface.grain() > 0.0, "sizes are sound");
  require(surface.report().fits() == surface.report().advice().empty(), "what does not fit is said");
  const Vec2 whole[3] = {Vec2(0.0, 0.0), Vec2(1.0, 0.0), Vec2(0.0, 1.0)};
  const double slack = 1e-9 * (1.0 + surface.reach());
  const Box bounds = surface.bounds().grown(slack);
  for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) {
    const ReliefFrame frame = surface.frame(face);
    const HeightRange range = surface.range(frame, whole);
    for (const double u : {0.0, 0.02, 0.3, 0.7, 1.0}) {
      for (const double v : {0.0, 0.02, 0.3, 0.7, 1.0}) {
        if (u + v > 1.0) continue;
        const ReliefPoint point = surface.point(frame, u, v);
        require(point.point.allFinite(), "points are finite");
        require(std::isfinite(point.jet.u) && std::isfinite(point.jet.v), "slopes are finite");
        if (point.jet.height < range.lowest - slack || point.jet.height > range.highest + slack) {
          const CoatSettings& coat = surface.coat().settings();
          std::fprintf(
              stderr,
              "height %g outside %g to %g: mapping %d, folds %d, blend %d, rho %g, face %u at %g %g, lowered %d\n",
              point.jet.height, range.lowest, range.highest, static_cast<int>(coat.mapping),
              static_cast<int>(coat.stitching.folds), static_cast<int>(coat.stitching.blend), coat.stitching.rho, face,
              u, v, frame.lowered ? 1 : 0);
        }
        require(point.jet.height >= range.lowest - slack && point.jet.height <= range.highest + slack,
                "heights stay in their range");
        require(
            (point.point.array() >= bounds.lower.array()).all() && (point.point.array() <= bounds.upper.array()).all(),
            "points stay in the bounds");
      }
    }
  }
  SurfaceCache cache;
  for (int i = 0; i < 8; ++i) {
    const double x = 2.0 * bytes.coordinate();
    const double y = 2.0 * bytes.coordinate();
    const Vec3 from(x, y, 2.0 * bytes.coordinate());
    const double to_x = 2.0 * bytes.coordinate();
    const Vec3 to(to_x, 2.0 * bytes.coordinate(), 2.0 * bytes.coordinate());
    const SweptHit hit = surface.view(cache).first_touch({from, to}, i % 2 == 0 ? Sides::both : Sides::front);
    require(!hit.hit || (hit.t >= 0.0 && hit.t <= 1.0 && hit.contact.element < mesh.triangles().size()),
            "a hit lies on the way");
    const Foot foot = surface.view(cache).nearest(from, infinity);
    require(foot.found() && std::isfinite(foot.distance), "there is always a nearest point");
    const FieldSample sample = surface.eval(from, cache);
    require(!std::isnan(sample.value), "the field is a number");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Bytes bytes(data, size);
  const CoatSettings settings = settings_from(bytes);
  ReliefSettings how;
  how.directions = static_cast<ShellDirections>(bytes.byte() % 2);
  how.on_overlap = static_cast<OnOverlap>(bytes.byte() % 2);
  const auto maps = maps_from(bytes);
  auto mesh = TriangleMesh::build(mesh_from(bytes));
  if (!maps || !mesh) return 0;
  auto coat = Coat::build(*mesh, maps, settings);
  if (!coat) {
    require(!coat.error().what.empty() && !coat.error().place.empty(), "an error names its cause and place");
    return 0;
  }
  const auto relief = ReliefSurface::build(MeshSurface(TriangleIndex::build(std::move(*mesh))), std::move(*coat), how);
  if (!relief) {
    require(how.on_overlap == OnOverlap::refuse && !relief.error().what.empty(), "only what was to be refused is");
    return 0;
  }
  require(how.on_overlap == OnOverlap::cure || relief->report().fits(), "what was to be refused is");
  check_relief(*relief, bytes);
  return 0;
}

#ifndef ASPERITY_FUZZ_WITHOUT_MAIN

namespace {

/// Random numbers, one run of them for every mapping, fold mode and blend.
std::vector<std::string> corpus() {
  std::vector<std::string> inputs;
  Rng rng(1);
  for (int mapping = 0; mapping < 3; ++mapping) {
    for (int blend = 0; blend < 5; ++blend) {
      std::string input = {static_cast<char>(mapping), '\1', '\1', static_cast<char>(blend % 2),
                           static_cast<char>(blend),   '\50'};
      for (int i = 0; i < 400; ++i) input.push_back(static_cast<char>(rng.below(256)));
      inputs.push_back(std::move(input));
    }
  }
  return inputs;
}

}  // namespace

int main(int argc, char** argv) {
  return asperity::fuzz::run(argc, argv, "relief", corpus());
}

#endif
