#include "asperity/study/picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "asperity/io/image_io.h"
#include "asperity/study/detail/camera.h"
#include "asperity/study/detail/ray_cast.h"
#include "asperity/study/detail/shading.h"
#include "asperity/study/detail/stroke_layer.h"

namespace asperity {
namespace {

constexpr std::size_t most_framing_points = 20000;
// A stroke smaller than this share of the scene gets a view of its own surroundings.
constexpr double small_stroke = 0.25;
constexpr double surroundings = 0.75;  // of the stroke's size, on every side
// The pass that measures the cost casts a ray each so many pixels.
constexpr int sparse = 8;
constexpr int largest_block = 3;
constexpr double smallest_size = 0.67;
constexpr double uneven_cost = 2.4;     // of a ray where the surface is uneven, relative to the mean one
constexpr double edge_share = 0.2;      // of the budget that smooth edges may always have
constexpr double outline_share = 0.03;  // of the pixels, which an outline takes: it is smooth in every picture

Vec3 average_normal(const StrokePath& path) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& normal : path.normals()) sum += normal;
  const double size = sum.norm();
  return size > 0.2 * static_cast<double>(path.normals().size()) ? Vec3(sum / size) : Vec3(Vec3::UnitY());
}

void add_corners(const Box& box, std::vector<Vec3>& points) {
  for (unsigned k = 0; k < 8; ++k) points.push_back(box.corner(k));
}

/// What there is to see: of a volume its isosurface alone.
Box visible_bounds(const Scene& scene) {
  Box all;
  for (std::size_t i = 0; i < scene.instances().size(); ++i) {
    const Instance& instance = scene.instances()[i];
    const IsoSurface* iso = iso_of(instance.surface);
    all.include(iso != nullptr ? transformed(iso->surface_bounds(), instance.world_from_object)
                               : scene.world_bounds(i));
  }
  return all;
}

/// What the view has to hold: the whole scene, or the surroundings of a stroke that is small in it.
std::vector<Vec3> framing_points(const Scene& scene, const StrokePath& path) {
  Box stroke;
  for (const Vec3& point : path.points()) stroke.include(point);
  const Box all = visible_bounds(scene);
  std::vector<Vec3> points;
  if (stroke.diagonal() < small_stroke * all.diagonal()) {
    const Box around = stroke.grown(surroundings * stroke.diagonal());
    add_corners({around.lower.cwiseMax(all.lower), around.upper.cwiseMin(all.upper)}, points);
    return points;
  }
  for (const Instance& instance : scene.instances()) {
    if (base_of(instance.surface) == nullptr) {
      const IsoSurface* iso = iso_of(instance.surface);
      std::vector<Vec3> corners;
      add_corners(iso != nullptr ? iso->surface_bounds() : surface_bounds(instance.surface), corners);
      for (const Vec3& corner : corners) points.push_back(instance.world_from_object.apply(corner));
      continue;
    }
    const auto positions = base_mesh(instance.surface).positions();
    const std::size_t stride = positions.size() / most_framing_points + 1;
    for (std::size_t i = 0; i < positions.size(); i += stride)
      points.push_back(instance.world_from_object.apply(positions[i]));
  }
  for (const Vec3& point : path.points()) points.push_back(point);
  return points;
}

/// How a picture is drawn so that it stays within its budget of time.
struct Detail {
  int block = 1;          // pixels between the rays of smooth parts
  double size = 1.0;      // of the picture, relative to what was asked
  std::size_t edges = 0;  // pixels that may be cast again
};

/// Seconds for a picture of `pixels` with `block`. Uneven cells lie along lines: their share grows with the block.
double predict(const CastCost& cost, double pixels, int block) {
  const double uneven = std::min(1.0, cost.uneven * block / sparse);
  return cost.seconds_per_ray * pixels * (block == 1 ? 1.0 : 1.0 / (block * block) + uneven_cost * uneven);
}

Detail choose_detail(const CastCost& cost, double pixels, double budget) {
  Detail detail;
  double seconds = predict(cost, pixels, 1);
  for (int block = 2; block <= largest_block && seconds > (1.0 - edge_share) * budget; ++block) {
    if (predict(cost, pixels, block) >= seconds) continue;
    detail.block = block;
    seconds = predict(cost, pixels, block);
  }
  if (seconds > budget) detail.size = std::max(smallest_size, std::sqrt(budget / seconds));
  const double drawn = pixels * detail.size * detail.size;
  const double left = std::max(edge_share * budget, budget - seconds);
  const double affordable = std::min(drawn, left / (4.0 * uneven_cost * std::max(cost.seconds_per_ray, 1e-12)));
  detail.edges = static_cast<std::size_t>(std::max(outline_share * drawn, affordable));
  return detail;
}

Camera resized(Camera camera, double size) {
  const double height = std::max(16.0, std::round(camera.height * size));
  camera.pixel *= camera.height / height;
  camera.width = std::max(16.0, std::round(camera.width * height / camera.height));
  camera.height = height;
  return camera;
}

Status check(const PictureSettings& settings) {
  const auto bad = [](const char* place, const char* accepted) {
    return Error{ErrorCode::bad_value, "is out of range", "", fmt::format("picture.{}", place), accepted};
  };
  if (settings.width < 16 || settings.width > 4096) return bad("width", "16 to 4096 pixels");
  if (settings.height < 16 || settings.height > 4096) return bad("height", "16 to 4096 pixels");
  if (settings.threads < 0 || settings.threads > 64) return bad("threads", "0 (one a processor) to 64");
  if (!(settings.budget > 0.0) || !std::isfinite(settings.budget)) return bad("budget", "a time above 0 s");
  return success();
}

Image to_image(const std::vector<Colour>& colours, int width, int height) {
  Image image{width, height, 3, 8, {}};
  image.samples.reserve(3 * colours.size());
  for (const Colour& colour : colours) {
    for (const float value : colour)
      image.samples.push_back(static_cast<std::uint16_t>(std::lround(255.0F * std::clamp(value, 0.0F, 1.0F))));
  }
  return image;
}

std::string caption(const Camera& camera, const std::vector<Vec3>& framing, int block) {
  Box box;
  for (const Vec3& point : framing) box.include(point);
  const double across = camera.width * camera.pixel * (box.centre() - camera.eye).dot(camera.forward);
  std::string text =
      fmt::format("View {:.3g} mm wide, cast through the same surface queries that are felt.", 1e3 * across);
  if (block > 1)
    text += fmt::format(" Smooth parts are interpolated between rays {} pixels apart to save time.", block);
  return text;
}

}  // namespace

Result<Picture> render_picture(const Scene& scene, const StrokePath& path, std::span<const TraceRecord> records,
                               const PictureSettings& settings, const Progress& progress) {
  ASPERITY_CHECK(check(settings));
  const Vec3 normal = average_normal(path);
  const std::vector<Vec3> framing = framing_points(scene, path);
  const Camera wanted = three_quarter_view(framing, normal, settings.width, settings.height);
  const auto threads = static_cast<unsigned>(settings.threads);
  const CastCost cost = measure_cost(scene, wanted, sparse, threads);
  const Detail detail = choose_detail(cost, wanted.width * wanted.height, settings.budget);
  const Camera camera = resized(wanted, detail.size);
  const PixelGrid grid = cast_image(scene, camera, detail.block, threads, progress);
  const std::vector<EdgePixel> edges = cast_edges(scene, camera, grid, detail.edges, threads);

  const Shaded shaded = shade(grid, edges, camera, normal);
  std::vector<Colour> colours = shaded.colours;
  Picture picture;
  const ForceRange range = draw_stroke(camera, records, shaded, colours);
  picture.force_low = range.low;
  picture.force_high = range.high;
  picture.image = to_image(colours, grid.columns, grid.rows);
  picture.block = detail.block;
  picture.caption = caption(camera, framing, detail.block);
  ASPERITY_TRY(picture.png, encode_png(picture.image));
  return picture;
}

std::array<std::uint8_t, 3> force_colour(double fraction) {
  // Ten stops of viridis (van der Walt and Smith 2015), evenly spaced; straight lines in between.
  static constexpr auto stops = std::to_array<std::array<double, 3>>({{68, 1, 84},
                                                                      {72, 40, 120},
                                                                      {62, 73, 137},
                                                                      {49, 104, 142},
                                                                      {38, 130, 142},
                                                                      {31, 158, 137},
                                                                      {53, 183, 121},
                                                                      {110, 206, 88},
                                                                      {181, 222, 43},
                                                                      {253, 231, 37}});
  const double at = std::isfinite(fraction) ? std::clamp(fraction, 0.0, 1.0) * (stops.size() - 1) : 0.0;
  const std::size_t i = std::min(stops.size() - 2, static_cast<std::size_t>(at));
  const double u = at - static_cast<double>(i);
  std::array<std::uint8_t, 3> colour{};
  for (std::size_t k = 0; k < 3; ++k)
    colour[k] = static_cast<std::uint8_t>(std::lround((1.0 - u) * stops[i][k] + u * stops[i + 1][k]));
  return colour;
}

}  // namespace asperity
