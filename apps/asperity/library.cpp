// asperity library: the mesostructures that come with the program, as a list, as pictures and as height maps.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>
#include <vector>

#include "apps/asperity/command.h"
#include "apps/asperity/run.h"
#include "asperity/core/math.h"
#include "asperity/core/units.h"
#include "asperity/field/mesostructure/library.h"
#include "asperity/io/atomic_file.h"
#include "asperity/io/image_io.h"

namespace asperity::program {
namespace {

constexpr int thumbnail_side = 256;  // pixels

struct LibraryOptions {
  std::vector<std::string> names;
  std::string out;
  int size = 512;
};

/// 1, 2 or 5 times a power of ten, at most the value.
double round_number(double value) {
  const double decade = std::pow(10.0, std::floor(std::log10(value) + 1e-9));
  const double mantissa = value / decade * (1.0 + 1e-9);
  return decade * (mantissa >= 5.0 ? 5.0 : mantissa >= 2.0 ? 2.0 : 1.0);
}

/// A tile seen from above, lit from the upper left.
struct Thumbnail {
  Image image;
  double bar = 0.0;           ///< m, length of the scale bar
  double exaggeration = 1.0;  ///< heights are drawn so many times as high
};

/// Slopes along s and t at a texel, across the tile's borders.
Vec2 slope_at(const LibraryRelief& relief, int x, int y) {
  const auto at = [&](int column, int row) {
    const int n = relief.size;
    const auto index = static_cast<std::size_t>((row + n) % n) * static_cast<std::size_t>(n) +
                       static_cast<std::size_t>((column + n) % n);
    return static_cast<double>(relief.heights[index]);
  };
  const double texel = relief.tile.x() / relief.size;
  return Vec2(at(x + 1, y) - at(x - 1, y), at(x, y - 1) - at(x, y + 1)) / (2.0 * texel);
}

/// Heights are drawn so that slopes can be seen: a root mean square of 0.55.
double exaggeration_of(const LibraryRelief& relief) {
  double squares = 0.0;
  for (int y = 0; y < relief.size; ++y) {
    for (int x = 0; x < relief.size; ++x) squares += slope_at(relief, x, y).squaredNorm();
  }
  const double rms = std::sqrt(squares / static_cast<double>(relief.heights.size()));
  return rms > 0.0 ? round_number(1.2 * 0.55 / rms) : 1.0;
}

/// Black in white, in the lower right corner.
void draw_bar(Image& image, double length) {
  const int from = image.width - 10 - static_cast<int>(std::lround(length));
  for (int y = image.height - 15; y < image.height - 8; ++y) {
    for (int x = from - 2; x < image.width - 8; ++x) {
      const bool rim = y == image.height - 15 || y == image.height - 9 || x < from || x >= image.width - 10;
      image.samples[static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(x)] =
          rim ? 255 : 0;
    }
  }
}

/// `relief` has a multiple of the thumbnail's pixels.
Thumbnail draw_thumbnail(const LibraryRelief& relief) {
  Thumbnail thumbnail;
  thumbnail.image = Image{thumbnail_side, thumbnail_side, 1, 8, {}};
  thumbnail.exaggeration = exaggeration_of(relief);
  thumbnail.bar = round_number(0.4 * relief.tile.x());
  const Vec3 light = Vec3(-1.0, 1.0, 1.5).normalized();
  const int block = relief.size / thumbnail_side;
  for (int y = 0; y < thumbnail_side; ++y) {
    for (int x = 0; x < thumbnail_side; ++x) {
      double sum = 0.0;
      for (int j = y * block; j < (y + 1) * block; ++j) {
        for (int i = x * block; i < (x + 1) * block; ++i) {
          const Vec2 slope = thumbnail.exaggeration * slope_at(relief, i, j);
          const double lit = std::max(0.0, Vec3(-slope.x(), -slope.y(), 1.0).normalized().dot(light));
          const auto index =
              static_cast<std::size_t>(j) * static_cast<std::size_t>(relief.size) + static_cast<std::size_t>(i);
          // A little darker in hollows, as under an open sky.
          const double sky = 0.7 + 0.3 * static_cast<double>(relief.heights[index]) / relief.amplitude;
          sum += sky * (0.12 + 0.88 * lit);
        }
      }
      const double grey = std::pow(sum / (block * block), 1.0 / 1.8);
      thumbnail.image.samples.push_back(static_cast<std::uint16_t>(std::lround(255.0 * std::min(grey, 1.0))));
    }
  }
  draw_bar(thumbnail.image, thumbnail.bar / relief.tile.x() * thumbnail_side);
  return thumbnail;
}

Image height_image(const LibraryRelief& relief) {
  Image image{relief.size, relief.size, 1, 16, {}};
  image.samples.reserve(relief.heights.size());
  for (const float height : relief.heights) {
    const double share = std::clamp(static_cast<double>(height) / relief.amplitude, 0.0, 1.0);
    image.samples.push_back(static_cast<std::uint16_t>(std::lround(65535.0 * share)));
  }
  return image;
}

Json sidecar(const LibraryEntry& entry, const LibraryRelief& relief) {
  const double pixel = entry.tile / relief.size;
  return {{"file", entry.name + ".png"},
          {"width", relief.size},
          {"height", relief.size},
          {"pixel_size_m", {pixel, pixel}},
          {"height_min_m", 0.0},
          {"height_max_m", entry.amplitude},
          {"decode", "z = height_min_m + v/65535*(height_max_m-height_min_m)"},
          {"source", fmt::format("{}, mesostructure library: {}", program_name(), entry.summary)}};
}

/// Writes a relief's three files and answers its part of the page.
Result<std::string> write_entry(const LibraryEntry& entry, const LibraryOptions& options) {
  const std::filesystem::path folder = options.out;
  ASPERITY_TRY(const LibraryRelief relief, library_mesostructure(entry.name, options.size));
  ASPERITY_CHECK(write_png(folder / (entry.name + ".png"), height_image(relief)));
  ASPERITY_CHECK(write_file_atomically(folder / (entry.name + ".json"), sidecar(entry, relief).dump(1) + "\n"));
  const bool fits = options.size % (2 * thumbnail_side) == 0;
  ASPERITY_TRY(const LibraryRelief seen,
               fits ? Result<LibraryRelief>(relief) : library_mesostructure(entry.name, 2 * thumbnail_side));
  const Thumbnail thumbnail = draw_thumbnail(seen);
  const std::string picture = entry.name + "-thumbnail.png";
  ASPERITY_CHECK(write_png(folder / picture, thumbnail.image));
  return fmt::format(
      "<figure><a href=\"{0}.png\"><img src=\"{1}\" width=\"{2}\" height=\"{2}\" alt=\"{0}\"></a>"
      "<figcaption><b>{0}</b><br>{3}<br>tile {4}, height {5}; bar {6}, heights drawn x {7:g}</figcaption></figure>\n",
      entry.name, picture, thumbnail_side, entry.summary, format_length(entry.tile), format_length(entry.amplitude),
      format_length(thumbnail.bar), thumbnail.exaggeration);
}

std::string page(const std::string& figures) {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>Mesostructures</title>\n"
      "<style>body{{font:15px/1.4 system-ui,sans-serif;margin:2em;color:#222;background:#fcfcfb}}"
      "main{{display:flex;flex-wrap:wrap;gap:1.5em}}figure{{margin:0;width:{0}px}}img{{display:block}}"
      "figcaption{{font-size:13px;padding-top:.4em}}</style></head>\n"
      "<body><h1>Mesostructures of the library</h1>\n"
      "<p>Each picture shows one tile from above, lit from the upper left; it links to the heights (16-bit grey), "
      "whose "
      "sizes are in the .json beside them.</p>\n<main>\n{1}</main></body></html>\n",
      thumbnail_side, figures);
}

Result<int> write_all(const std::vector<LibraryEntry>& entries, const LibraryOptions& options, const Console& console) {
  ASPERITY_CHECK(make_output_folder(options.out));
  const Progress progress = console.progress();
  std::string figures;
  Json files = Json::array();
  for (std::size_t i = 0; i < entries.size(); ++i) {
    if (progress) progress(entries[i].name, static_cast<double>(i) / static_cast<double>(entries.size()));
    ASPERITY_TRY(const std::string figure, write_entry(entries[i], options));
    figures += figure;
    files.push_back(entries[i].name + ".png");
  }
  const std::filesystem::path index = std::filesystem::path(options.out) / "index.html";
  ASPERITY_CHECK(write_file_atomically(index, page(figures)));
  if (console.json) {
    console.print(Json{{"folder", options.out}, {"page", "index.html"}, {"height_maps", files}});
  } else {
    std::cout << fmt::format("{} mesostructures of {} x {} texels; look at {}\n", entries.size(), options.size,
                             options.size, index.string());
  }
  return exit_success;
}

Result<int> list(const std::vector<LibraryEntry>& entries, const Console& console) {
  if (console.json) {
    Json all = Json::array();
    for (const LibraryEntry& entry : entries) {
      all.push_back(Json{
          {"name", entry.name}, {"tile_m", entry.tile}, {"amplitude_m", entry.amplitude}, {"summary", entry.summary}});
    }
    console.print(all);
    return exit_success;
  }
  std::size_t width = 0;
  for (const LibraryEntry& entry : entries) width = std::max(width, entry.name.size());
  std::cout << fmt::format("{:<{}}  {:>8}  {:>8}\n", "", width, "tile", "height");
  for (const LibraryEntry& entry : entries) {
    std::cout << fmt::format("{:<{}}  {:>8}  {:>8}  {}\n", entry.name, width, format_length(entry.tile),
                             format_length(entry.amplitude), entry.summary);
  }
  return exit_success;
}

Result<int> run_library(const LibraryOptions& options, const Console& console) {
  std::vector<LibraryEntry> entries;
  for (const std::string& name : options.names) {
    Result<LibraryEntry> entry = library_entry(name);
    if (!entry) return std::move(entry).error().at("NAME");
    entries.push_back(std::move(*entry));
  }
  if (entries.empty()) entries.assign(mesostructure_library().begin(), mesostructure_library().end());
  return options.out.empty() ? list(entries, console) : write_all(entries, options, console);
}

}  // namespace

void add_library(Arguments& program, Console& console, Action& action) {
  Arguments command = program.command("library", "List the mesostructures that come along, or draw and write them");
  auto options = std::make_shared<LibraryOptions>();
  command.option("NAME", options->names, "Only these");
  command.option("--out", options->out,
                 "Folder for 16-bit height maps with their sizes (.json), pictures and a page of them");
  command.option("--size", options->size, "Texels a side of the height maps").between(16, 4096).shows_default();
  add_console_options(command, console);
  command.closing_words(
      "Scenes take them by name: \"height_map\": {\"library\": \"linen\"}. Written ones are read by scenes as they "
      "are, "
      "and by other programs.\n"
      "Examples:\n"
      "  asperity library\n"
      "  asperity library --out library\n"
      "  asperity library linen denim --out cloth --size 1024");
  command.when_called(
      [options, &console, &action] { action = [options, &console] { return run_library(*options, console); }; });
}

}  // namespace asperity::program
