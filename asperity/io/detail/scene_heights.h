#pragma once
// Heights of a scene: an image or a formula, and what its grey means. Coats, features and friction maps read them.
// Internal to io.

#include <filesystem>
#include <optional>
#include <string>

#include "asperity/field/height/map.h"
#include "asperity/field/mesostructure/generators.h"
#include "asperity/field/mesostructure/library.h"
#include "asperity/io/detail/scene_reader.h"
#include "asperity/io/image_io.h"

namespace asperity {

/// What a JSON file beside a measured height image says of it (m).
struct HeightSidecar {
  std::string file;
  int width = 0;
  int height = 0;
  double low = 0.0;
  double high = 0.0;
  Vec2 pixel = Vec2::Zero();
};

/// Heights from black to white (m), before magnifying.
struct HeightScale {
  double amplitude = 0.0;
  double offset = 0.0;
};

/// Reads where heights come from, then what they measure, then makes the map. [build]
class HeightSourceReader {
 public:
  /// `key` holds the image or the formula. `who` begins notes. `mean_edge`: of the mesh (m), which heights may be
  /// shares of; 0: there is none.
  HeightSourceReader(ObjectReader& reader, SceneContext& context, std::string key, std::string who, double mean_edge)
      : reader_(reader), context_(context), key_(std::move(key)), who_(std::move(who)), mean_edge_(mean_edge) {}

  /// Reads `key` and `channel`.
  Status read_source();
  /// Reads `white_is`, `height`, `offset` and `height_range`.
  Status read_scale(double magnify);
  /// The heights of the scale that was read.
  Result<HeightMap> build(Wrap wrap, Reconstruction reconstruction) const;
  /// Values from `black` to `white` in place of heights.
  Result<HeightMap> build_between(double black, double white, Wrap wrap, Reconstruction reconstruction) const;

  [[nodiscard]] const std::optional<HeightSidecar>& sidecar() const { return sidecar_; }
  /// Size of one repeat (m), where a sidecar or the library tells it.
  [[nodiscard]] Vec2 tile() const {
    return {sidecar_->pixel.x() * sidecar_->width, sidecar_->pixel.y() * sidecar_->height};
  }
  [[nodiscard]] bool from_library() const { return !library_.heights.empty(); }

 private:
  void read_generator(const SceneJson& json);
  Status read_library(const SceneJson& json);
  Status read_floats();
  Status read_image_source(const std::string& file);
  Status read_sidecar();
  [[nodiscard]] Result<double> height_of(const SceneJson& value, const std::string& place, const Range& range) const;
  [[nodiscard]] std::string accepted_height(const Range& range) const;
  double read_height(const char* key, double fallback, const Range& range);
  void read_range(const SceneJson& range);
  [[nodiscard]] Result<HeightMap> image_heights(const HeightMapSettings& settings) const;
  [[nodiscard]] Result<HeightMap> generated_heights(double amplitude, double offset, Wrap wrap,
                                                    Reconstruction reconstruction) const;

  ObjectReader& reader_;
  SceneContext& context_;
  std::string key_;
  std::string who_;
  double mean_edge_ = 0.0;
  bool generated_ = false;
  MesostructureSpec spec_;
  std::filesystem::path path_;
  Image image_;
  FloatImage floats_;      ///< of an OpenEXR file, in place of the image
  LibraryRelief library_;  ///< of the library, in place of a formula
  Channel channel_ = Channel::automatic;
  bool white_is_deep_ = false;
  std::optional<HeightSidecar> sidecar_;
  bool stored_metres_ = false;  ///< floats are metres, not a range to be scaled
  double magnify_ = 1.0;
  HeightScale scale_;
};

}  // namespace asperity
