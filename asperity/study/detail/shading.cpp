#include "asperity/study/detail/shading.h"

#include <algorithm>
#include <cmath>

namespace asperity {
namespace {

constexpr Colour background{0.984F, 0.984F, 0.980F};
const Vec3 albedo(0.80, 0.79, 0.765);
// Hollows are looked for at these shares of the image's height.
constexpr double occlusion_radii[] = {0.006, 0.03};
constexpr double occlusion_strength = 0.55;

float to_srgb(double linear) {
  const double v = std::clamp(linear, 0.0, 1.0);
  return static_cast<float>(v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1.0 / 2.4) - 0.055);
}

/// Mean depth of the hits within a square around each pixel, by running sums along rows and then columns.
std::vector<double> blurred_depth(const PixelGrid& grid, int radius) {
  const int columns = grid.columns;
  const int rows = grid.rows;
  const auto index = [&](int x, int y) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(x);
  };
  std::vector<double> sums(grid.pixels.size(), 0.0);
  std::vector<double> counts(grid.pixels.size(), 0.0);
  for (int y = 0; y < rows; ++y) {
    double sum = 0.0;
    double count = 0.0;
    const auto add = [&](int x, double sign) {
      if (x < 0 || x >= columns || !grid.at(x, y).hit()) return;
      sum += sign * grid.at(x, y).depth;
      count += sign;
    };
    for (int x = -radius; x < columns; ++x) {
      add(x + radius, 1.0);
      add(x - radius - 1, -1.0);
      if (x < 0) continue;
      sums[index(x, y)] = sum;
      counts[index(x, y)] = count;
    }
  }
  std::vector<double> means(grid.pixels.size(), 0.0);
  for (int x = 0; x < columns; ++x) {
    double sum = 0.0;
    double count = 0.0;
    for (int y = -radius; y < rows; ++y) {
      if (y + radius < rows) sum += sums[index(x, y + radius)], count += counts[index(x, y + radius)];
      if (y - radius - 1 >= 0) sum -= sums[index(x, y - radius - 1)], count -= counts[index(x, y - radius - 1)];
      if (y >= 0 && count > 0.5) means[index(x, y)] = sum / count;
    }
  }
  return means;
}

/// Share of light that reaches each pixel: less where it lies deeper than its surroundings.
std::vector<double> occlusion(const PixelGrid& grid, const Camera& camera) {
  std::vector<double> light(grid.pixels.size(), 1.0);
  for (const double share : occlusion_radii) {
    const int radius = std::max(1, static_cast<int>(std::lround(share * grid.rows)));
    const std::vector<double> means = blurred_depth(grid, radius);
    for (std::size_t i = 0; i < light.size(); ++i) {
      if (!grid.pixels[i].hit()) continue;
      // Depth below the surroundings in units of the square's own size there.
      const double size = share * camera.height * camera.pixel * grid.pixels[i].depth;
      const double hollow = std::clamp((grid.pixels[i].depth - means[i]) / size, 0.0, 1.0);
      light[i] *= 1.0 - occlusion_strength * hollow;
    }
  }
  return light;
}

/// The lights of the scene, fixed to the camera and the touched side.
struct Lights {
  Vec3 key;
  Vec3 fill;
  Vec3 up;
};

Colour lit(const Pixel& pixel, const Lights& lights, double open) {
  const double key = std::max(0.0, pixel.normal.dot(lights.key));
  const double fill = std::max(0.0, pixel.normal.dot(lights.fill));
  const double sky = 0.5 + 0.5 * pixel.normal.dot(lights.up);
  const Vec3 light = key * Vec3(0.86, 0.84, 0.80) + fill * Vec3(0.12, 0.13, 0.15) + open * sky * Vec3(0.32, 0.33, 0.35);
  // Where closing has filled something in, another material is seen.
  const Vec3 paint = pixel.filled > 0.0 ? Vec3(albedo.cwiseProduct(Vec3(1.0, 0.62, 0.35))) : Vec3(albedo);
  const Vec3 colour = (paint.array() * light.array() * (0.45 + 0.55 * open)).matrix();
  return {to_srgb(colour.x()), to_srgb(colour.y()), to_srgb(colour.z())};
}

}  // namespace

Shaded shade(const PixelGrid& grid, std::span<const EdgePixel> edges, const Camera& camera, const Vec3& up) {
  // A key light from the left that grazes the touched side shows its relief.
  const Vec3 front = (-camera.forward + camera.forward.dot(up) * up).normalized();
  const Lights lights{(-0.80 * camera.right + 0.62 * up - 0.10 * front).normalized(),
                      (0.70 * camera.right + 0.30 * up + 0.60 * front).normalized(), up};
  const std::vector<double> open = occlusion(grid, camera);
  Shaded out{grid.columns, grid.rows, {}, {}};
  out.colours.reserve(grid.pixels.size());
  out.depths.reserve(grid.pixels.size());
  for (std::size_t i = 0; i < grid.pixels.size(); ++i) {
    const Pixel& pixel = grid.pixels[i];
    out.colours.push_back(pixel.hit() ? lit(pixel, lights, open[i]) : background);
    out.depths.push_back(static_cast<float>(pixel.depth));
  }
  for (const EdgePixel& edge : edges) {
    Colour mean{};
    for (const Pixel& quarter : edge.quarters) {
      const Colour colour = quarter.hit() ? lit(quarter, lights, open[edge.index]) : background;
      for (std::size_t c = 0; c < 3; ++c) mean[c] += 0.25F * colour[c];
    }
    out.colours[edge.index] = mean;
  }
  return out;
}

}  // namespace asperity
