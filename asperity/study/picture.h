#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>

#include "asperity/core/progress.h"
#include "asperity/core/result.h"
#include "asperity/core/trace_record.h"
#include "asperity/device/stroke.h"
#include "asperity/field/height/image.h"
#include "asperity/render/scene.h"

namespace asperity {

/// Size and cost of a picture.
struct PictureSettings {
  int width = 900;      ///< pixels, 16 to 4096
  int height = 600;     ///< pixels, 16 to 4096
  int threads = 0;      ///< at most so many, up to 64; 0: one a processor
  double budget = 1.6;  ///< s of wall time to aim at, above 0; detail is given up where a coarse pass says that it
                        ///< would be exceeded
};

/// A picture of what is touched, and the stroke over it coloured by the force felt there.
struct Picture {
  Image image;      ///< 8-bit RGB; smaller than asked where the budget does not allow more, at least two thirds of it
  std::string png;  ///< the same, encoded
  double force_low =
      0.0;  ///< N, of the first colour: the force that 2 % of the contact stays below, or 0 where all is alike
  double force_high = 0.0;  ///< N, of the last colour: the force that 2 % of the contact exceeds
  int block = 1;            ///< 1: a ray or more for each pixel; above: smooth parts have one each `block` pixels
  std::string caption;      ///< what is seen, for people: the extent of the view in mm
};

/// Casts the surfaces' own segment queries, so that what is seen is what is felt. The view is a three-quarter one from
/// above the touched side and holds the stroke with its surroundings. Errors: bad_value (a setting, by name). [main]
Result<Picture> render_picture(const Scene& scene, const StrokePath& path, std::span<const TraceRecord> records,
                               const PictureSettings& settings = {}, const Progress& progress = {});

/// Perceptual colour of a fraction 0 ... 1 (dark violet over green to yellow), sRGB. [any]
std::array<std::uint8_t, 3> force_colour(double fraction);

}  // namespace asperity
