#pragma once
// What rays of a picture meet. Private to study.

#include <cstddef>
#include <memory>
#include <vector>

#include "asperity/core/progress.h"
#include "asperity/render/scene.h"
#include "asperity/study/detail/camera.h"

namespace asperity {

/// What one ray saw.
struct Pixel {
  double depth = infinity;     ///< along the camera's forward axis (m); infinity: nothing
  Vec3 normal = Vec3::Zero();  ///< unit, towards the eye; bent by a texture
  Place place = {};            ///< as the surface names it
  double filled = 0.0;         ///< 1 where closing has raised the relief
  [[nodiscard]] bool hit() const { return depth < infinity; }
};

/// Casts rays through the surfaces' own queries. One per thread: it keeps their caches. [main]
class RayCaster {
 public:
  RayCaster(const Scene& scene, const Camera& camera)
      : scene_(&scene), camera_(&camera), caches_(std::make_unique<SurfaceCache[]>(scene.instances().size())) {}
  /// The nearest surface through image place (x, y).
  [[nodiscard]] Pixel cast(double x, double y);

 private:
  const Scene* scene_;
  const Camera* camera_;
  std::unique_ptr<SurfaceCache[]> caches_;
};

/// One pixel a place of the image, row by row.
struct PixelGrid {
  int columns = 0;
  int rows = 0;
  std::vector<Pixel> pixels;
  [[nodiscard]] std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(x);
  }
  [[nodiscard]] const Pixel& at(int x, int y) const { return pixels[index(x, y)]; }
};

/// Casts the camera's image with at most `threads` threads (0: one a processor). A ray each `block` pixels each way; in
/// between, cells whose corners lie on one smooth patch are interpolated and all others cast pixel by pixel. Block 1
/// casts every pixel. [main]
PixelGrid cast_image(const Scene& scene, const Camera& camera, int block, unsigned threads, const Progress& progress);

/// What a picture will take, from the lattice of an image with a ray each `block` pixels.
struct CastCost {
  double seconds_per_ray = 0.0;  ///< wall time, all threads together
  double uneven = 0.0;           ///< share of the cells that are not smooth
};
CastCost measure_cost(const Scene& scene, const Camera& camera, int block, unsigned threads);

/// A pixel on an edge of the image and what four rays within it saw.
struct EdgePixel {
  std::size_t index = 0;
  Pixel quarters[4];
};

/// Casts the pixels that differ most from a neighbour (outline, jump of depth, bend of more than about 11 degrees), at
/// most `most` of them, four times. [main]
std::vector<EdgePixel> cast_edges(const Scene& scene, const Camera& camera, const PixelGrid& grid, std::size_t most,
                                  unsigned threads);

}  // namespace asperity
