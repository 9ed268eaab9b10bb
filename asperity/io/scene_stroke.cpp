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
    const std::string name = reader_.text("type", to_string(stroke_.type));
    ASPERITY_CHECK(reader_.status());
    ASPERITY_TRY(stroke_.type, at_place(find_stroke_type(name), reader_.place()));
    refuse_other_types_keys();
    ASPERITY_CHECK(read_shape());
    if (stroke_.type != StrokeType::recorded) read_motion();
    read_sampling();
    ASPERITY_CHECK(reader_.status());
    return ScenePart<StrokeSettings>{std::move(stroke_), std::move(reader_.canonical())};
  }

 private:
  void refuse_other_types_keys() {
    const StrokeType type = stroke_.type;
    const auto only_for = [&](bool mine, std::initializer_list<std::string_view> keys) {
      if (!mine) reader_.refuse(keys, fmt::format("by a {} stroke", to_string(type)));
    };
    const bool round = type == StrokeType::circle || type == StrokeType::spiral;
    only_for(type == StrokeType::line || type == StrokeType::raster, {"start", "end"});
    only_for(round, {"centre", "radius", "turns"});
    only_for(round || type == StrokeType::raster, {"axis"});
    only_for(type == StrokeType::raster || type == StrokeType::spiral, {"pitch"});
    only_for(type == StrokeType::raster, {"rows"});
    only_for(type == StrokeType::polyline, {"points"});
    only_for(type == StrokeType::recorded, {"path"});
    only_for(type != StrokeType::recorded,
             {"speed", "depth", "normal_force", "approach_height", "approach_speed", "repeats", "back_and_forth"});
  }

  Status read_shape() {
    switch (stroke_.type) {
      case StrokeType::raster:
        raster_defaults();
        stroke_.axis = reader_.direction("axis", stroke_.axis);
        stroke_.rows = reader_.integer("rows", stroke_.rows, 1, 100000);
        stroke_.pitch = scaled_length("pitch", 0.0, true);
        [[fallthrough]];
      case StrokeType::line:
        stroke_.start = point("start", stroke_.start);
        stroke_.end = point("end", stroke_.end);
        break;
      case StrokeType::spiral: stroke_.pitch = scaled_length("pitch", 0.0, true); [[fallthrough]];
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
    stroke_.axis = reader_.direction("axis", stroke_.axis);
    stroke_.radius = scaled_length("radius", 0.3 * std::min(bounds_.extent().x(), bounds_.extent().z()), false);
    stroke_.turns = reader_.number("turns", stroke_.type == StrokeType::spiral ? 4.0 : 1.0, Range{0.0, 1e4, true});
  }

  void read_points() {
    const SceneJson* points = reader_.raw("points");
    const char* accepted = "two or more points, each [x, y, z]";
    if (points == nullptr) return reader_.require("points", accepted);
    if (!points->is_array()) return reader_.fail_type("points", *points, accepted);
    SceneJson canonical = SceneJson::array();
    for (std::size_t i = 0; i < points->size() && !reader_.failed(); ++i) {
      const Vec3 p = point_of((*points)[i], fmt::format("points[{}]", i), Vec3::Zero());
      stroke_.points.push_back(p);
      canonical.push_back({p.x(), p.y(), p.z()});
    }
    reader_.write("points", std::move(canonical));
  }

  Status read_recorded() {
    const std::string file = reader_.required_text("path", "a CSV file with time, x, y, z, or a trace");
    ASPERITY_CHECK(reader_.status());
    const std::string path = context_.resolve(file).string();
    ASPERITY_TRY(stroke_.recorded, in_file(read_recorded_path(path), path, reader_.place_of("path")));
    stroke_.repeats = 1;
    stroke_.back_and_forth = false;
    reader_.write("path", path);
    return success();
  }

  void read_motion() {
    stroke_.speed = reader_.quantity("speed", Dimension::speed, stroke_.speed, Range::positive());
    if (const auto force = reader_.optional_quantity("normal_force", Dimension::force, Range::positive())) {
      reader_.refuse({"depth"}, "beside normal_force");
      stroke_.press = PressMode::force;
      stroke_.normal_force = *force;
    } else {
      stroke_.depth = reader_.quantity("depth", Dimension::length, stroke_.depth);
    }
    stroke_.approach_height =
        reader_.quantity("approach_height", Dimension::length, stroke_.approach_height, Range::not_negative());
    stroke_.approach_speed =
        reader_.quantity("approach_speed", Dimension::speed, stroke_.approach_speed, Range::positive());
    stroke_.repeats = reader_.integer("repeats", 1, 1, 100000);
    stroke_.back_and_forth = reader_.boolean("back_and_forth", false);
  }

  void read_sampling() {
    stroke_.sample_spacing = reader_.optional_quantity("sample_spacing", Dimension::length, Range::positive());
    stroke_.normal_smoothing = reader_.optional_quantity("normal_smoothing", Dimension::length, Range::not_negative());
  }

  [[nodiscard]] Vec3 at_fraction(const Vec3& fraction) const {
    return bounds_.lower + fraction.cwiseProduct(bounds_.extent());
  }

  Vec3 point(std::string_view key, const Vec3& fallback) {
    const SceneJson* value = reader_.raw(key);
    const Vec3 p = value == nullptr ? fallback : point_of(*value, key, fallback);
    reader_.write(key, p);
    return p;
  }

  /// Coordinates in m, or with a unit, or as a share of the bounds ("0%" the lower end, "100%" the upper).
  Vec3 point_of(const SceneJson& value, std::string_view key, const Vec3& fallback) {
    const char* accepted = "[x, y, z], each a length (m, or with a unit) or a share of the bounds (\"50%\")";
    if (!value.is_array()) {
      reader_.fail_type(key, value, accepted);
    } else if (value.size() != 3) {
      reader_.fail(key, fmt::format("has {} coordinates", value.size()), accepted);
    }
    Vec3 p = fallback;
    for (std::size_t i = 0; i < 3 && !reader_.failed(); ++i)
      p[static_cast<int>(i)] = coordinate(value[i], fmt::format("{}[{}]", key, i), static_cast<int>(i));
    return p;
  }
  double coordinate(const SceneJson& value, const std::string& key, int axis) {
    if (value.is_number()) return value.get<double>();
    if (!value.is_string()) {
      reader_.fail_type(key, value, "a length (m, or with a unit) or a share of the bounds (\"50%\")");
      return 0.0;
    }
    const auto& text = value.get_ref<const std::string&>();
    const bool share = text.find('%') != std::string::npos;
    const double number = reader_.value_or(
        at_place(parse_quantity(text, share ? Dimension::ratio : Dimension::length), reader_.place_of(key)), 0.0);
    return share ? bounds_.lower[axis] + number * bounds_.extent()[axis] : number;
  }

  /// A length, or a share of the bounds' largest extent.
  double scaled_length(std::string_view key, double fallback, bool zero_allowed) {
    const Range range = zero_allowed ? Range::not_negative() : Range::positive();
    const SceneJson* value = reader_.raw(key);
    const std::string text = value != nullptr && value->is_string() ? value->get<std::string>() : std::string();
    if (text.find('%') == std::string::npos) return reader_.quantity(key, Dimension::length, fallback, range);
    Result<double> share = parse_quantity(text, Dimension::ratio);
    if (!share || !range.holds(*share)) {
      reader_.fail(key, fmt::format("\"{}\" is no share of the object's largest side", text),
                   "\"30%\", or a length above 0");
      return fallback;
    }
    const double length = *share * bounds_.extent().maxCoeff();
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
