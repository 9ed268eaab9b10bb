// The stroke of a scene file.

#include <fmt/format.h>

#include <algorithm>

#include "asperity/io/detail/scene_reader.h"
#include "asperity/io/recorded_path.h"

namespace asperity {
namespace {

class StrokeReader {
 public:
  StrokeReader(const SceneJson* json, const std::string& place, const Box& bounds, const SceneContext& context)
      : reader_(json, place, "stroke"), bounds_(bounds), context_(context), stroke_(default_stroke(bounds)) {}

  Result<ScenePart<StrokeSettings>> read() {
    ASPERITY_CHECK(reader_.status());
    reader_.read("type", stroke_.type);
    ASPERITY_CHECK(read_shape());
    reader_.read_all(stroke_);
    ASPERITY_CHECK(reader_.status());
    return ScenePart<StrokeSettings>{std::move(stroke_), std::move(reader_.canonical())};
  }

 private:
  Status read_shape() {
    switch (stroke_.type) {
      case StrokeType::raster:
        raster_defaults();
        reader_.read("axis", stroke_.axis);
        reader_.read("rows", stroke_.rows);
        stroke_.pitch = scaled_length("pitch", 0.0);
        [[fallthrough]];
      case StrokeType::line:
        stroke_.start = point("start", stroke_.start);
        stroke_.end = point("end", stroke_.end);
        break;
      case StrokeType::spiral: stroke_.pitch = scaled_length("pitch", 0.0); [[fallthrough]];
      case StrokeType::circle: read_round(); break;
      case StrokeType::polyline: read_points(); break;
      case StrokeType::recorded: return read_recorded();
    }
    return reader_.status();
  }

  /// Where nothing is said, a raster covers the middle of the top.
  void raster_defaults() {
    stroke_.start = at_fraction(Vec3(0.2, 1.0, 0.2));
    stroke_.end = at_fraction(Vec3(0.8, 1.0, 0.8));
  }

  void read_round() {
    stroke_.centre = point("centre", at_fraction(Vec3(0.5, 1.0, 0.5)));
    reader_.read("axis", stroke_.axis);
    stroke_.radius = scaled_length("radius", 0.3 * std::min(bounds_.extent().x(), bounds_.extent().z()));
    stroke_.turns = reader_.get("turns", stroke_.type == StrokeType::spiral ? 4.0 : 1.0);
  }

  void read_points() {
    SceneJson canonical = SceneJson::array();
    for (const SceneJson& given : *reader_.raw("points")) {
      const Vec3 p = point_of(given);
      stroke_.points.push_back(p);
      canonical.push_back({p.x(), p.y(), p.z()});
    }
    reader_.write("points", std::move(canonical));
  }

  Status read_recorded() {
    const std::string path = context_.resolve(reader_.get<std::string>("path")).string();
    ASPERITY_TRY(stroke_.recorded, in_file(read_recorded_path(path), path, reader_.place_of("path")));
    stroke_.repeats = 1;
    stroke_.back_and_forth = false;
    reader_.write("path", path);
    return success();
  }

  [[nodiscard]] Vec3 at_fraction(const Vec3& fraction) const {
    return bounds_.lower + fraction.cwiseProduct(bounds_.extent());
  }

  Vec3 point(std::string_view key, const Vec3& fallback) {
    const SceneJson* value = reader_.raw(key);
    const Vec3 p = value == nullptr ? fallback : point_of(*value);
    reader_.write(key, p);
    return p;
  }

  /// Coordinates in m, or with a unit, or as a share of the bounds ("0%" the lower end, "100%" the upper).
  [[nodiscard]] Vec3 point_of(const SceneJson& value) const {
    Vec3 p;
    for (int k = 0; k < 3; ++k) {
      const SceneJson& given = value[static_cast<std::size_t>(k)];
      const double number = from_option<double>(value_of(given, OptionType::length_or_share()));
      p[k] = is_share(given) ? bounds_.lower[k] + number * bounds_.extent()[k] : number;
    }
    return p;
  }
  static bool is_share(const SceneJson& value) {
    return value.is_string() && value.get_ref<const std::string&>().find('%') != std::string::npos;
  }

  /// A length, or a share of the bounds' largest extent.
  double scaled_length(std::string_view key, double fallback) {
    double length = reader_.get(key, fallback);
    if (reader_.has(key) && is_share(*reader_.raw(key))) length *= bounds_.extent().maxCoeff();
    reader_.write(key, length);
    return length;
  }

  ObjectReader reader_;
  const Box& bounds_;
  const SceneContext& context_;
  StrokeSettings stroke_;
};

}  // namespace

Result<ScenePart<StrokeSettings>> read_stroke(const SceneJson* json, const std::string& place, const Box& bounds,
                                              const SceneContext& context) {
  return StrokeReader(json, place, bounds, context).read();
}

}  // namespace asperity
