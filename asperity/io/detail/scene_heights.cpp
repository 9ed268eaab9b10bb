// Heights in a scene file: coats, features that are maps, and maps of friction read them alike.

#include "asperity/io/detail/scene_heights.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>

#include "asperity/io/image_io.h"

namespace asperity {
namespace {

/// Reads a formula's parameters. What they must be to one another (a flank within its rim) the formula itself checks.
class HeightGeneratorReader {
 public:
  explicit HeightGeneratorReader(ObjectReader& reader) : reader_(reader) {}

  MesostructureSpec read() {
    spec_.kind = reader_.value_or(parse_mesostructure_kind(reader_.get("generator", std::string("flat"))),
                                  MesostructureKind::flat);
    spec_.size = reader_.get<int>("size");
    spec_ = completed(spec_);
    reader_.read("count", spec_.count);
    if (spec_.number || reader_.has("number")) spec_.number = reader_.get("number", spec_.number.value_or(1));
    reader_.read("seed", spec_.seed);
    reader_.read("wall", spec_.wall);
    reader_.read("width", spec_.width);
    if (reader_.reads("flank")) spec_.flank = reader_.get("flank", own_flank());
    if (reader_.reads("radius")) read_radius();
    reader_.read("field", spec_.field);
    if (reader_.has("rim") || (reader_.reads("rim") && spec_.field < 1.0)) spec_.rim = reader_.get("rim", own_rim());
    reader_.read("overlap", spec_.overlap);
    reader_.read("hurst", spec_.hurst);
    reader_.read("octaves", spec_.octaves);
    return spec_;
  }

 private:
  [[nodiscard]] double own_rim() const { return completed(spec_).rim.value_or(0.0); }

  /// The groove's follows from its width, which may be stated.
  [[nodiscard]] double own_flank() const {
    MesostructureSpec open = spec_;
    open.flank.reset();
    return *completed(open).flank;
  }

  void read_radius() {
    const SceneJson* given = reader_.raw("radius");
    if (given != nullptr && given->is_array()) {
      spec_.radius = ShareRange{(*given)[0].get<double>(), (*given)[1].get<double>()};
      reader_.write("radius", *given);
    } else if (given != nullptr || spec_.kind == MesostructureKind::groove) {
      const double radius = reader_.get("radius", spec_.radius->high);
      spec_.radius = ShareRange{radius, radius};
    } else {
      reader_.write("radius", Vec2(spec_.radius->low, spec_.radius->high));
    }
  }

  ObjectReader& reader_;
  MesostructureSpec spec_;
};

}  // namespace

Status HeightSourceReader::read_source() {
  const SceneJson* map = reader_.raw(key_);
  if (map == nullptr) return reader_.status();
  if (map->is_string()) return read_image_source(map->get_ref<const std::string&>());
  generated_ = true;
  if (map->contains("library")) return read_library(*map);
  read_generator(*map);
  return reader_.status();
}

void HeightSourceReader::read_generator(const SceneJson& json) {
  ObjectReader generator(json, reader_.place_of(key_), "height generator");
  spec_ = HeightGeneratorReader(generator).read();
  reader_.take(key_, std::move(generator));
}

Status HeightSourceReader::read_library(const SceneJson& json) {
  ObjectReader reader(json, reader_.place_of(key_), "library relief");
  const auto name = reader.get("library", std::string());
  const auto size = reader.get<int>("size");
  const auto seed = reader.get<std::uint64_t>("seed");
  ASPERITY_CHECK(reader.status());
  ASPERITY_TRY(library_, at_place(library_mesostructure(name, size, seed), reader.place_of("library")));
  sidecar_ = HeightSidecar{"the library", size, size, 0.0, library_.amplitude, library_.tile / size};
  reader_.take(key_, std::move(reader));
  return success();
}

/// Floats as the file stores them: metres, unless the scene says what their range stands for.
Status HeightSourceReader::read_floats() {
  const std::string channel = reader_.get<std::string>("channel");
  ASPERITY_CHECK(reader_.status());
  ASPERITY_TRY(floats_, in_file(read_float_image(path_, channel), path_.string(), reader_.place_of("channel")));
  reader_.write(key_, path_.string());
  return success();
}

Status HeightSourceReader::read_image_source(const std::string& file) {
  path_ = context_.resolve(file);
  if (context_.progress) context_.progress("reading height map", 0.0);
  if (lower_extension(path_) == ".exr") return read_floats();
  ASPERITY_TRY(image_, in_file(read_image(path_), path_.string(), reader_.place_of(key_)));
  reader_.write(key_, path_.string());
  const auto channel = reader_.get<std::string>("channel");
  const std::optional<Channel> known = value_named<Channel>(channel);
  if (!known) reader_.fail("channel", fmt::format("\"{}\" is not known", channel), name_list<Channel>("\""));
  channel_ = known.value_or(Channel::automatic);
  return read_sidecar();
}

Status HeightSourceReader::read_sidecar() {
  std::filesystem::path path = path_;
  path.replace_extension(".json");
  std::ifstream stream(path, std::ios::binary);
  if (!stream) return success();
  const std::string text{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  Result<SceneJson> json = parse_scene_json(text, path.string());
  // A file of that name need not be about heights at all.
  if (!json || !json->is_object() || !json->contains("height_min_m") || !json->contains("height_max_m"))
    return success();
  const auto number = [&](const SceneJson& value) { return value.is_number() ? value.get<double>() : std::nan(""); };
  const auto member = [&](const char* key) { return json->contains(key) ? number((*json)[key]) : std::nan(""); };
  HeightSidecar sidecar{path.filename().string(), image_.width, image_.height, member("height_min_m"),
                        member("height_max_m")};
  const bool sizes = member("width") == image_.width && member("height") == image_.height;
  const SceneJson pixel = json->contains("pixel_size_m") ? (*json)["pixel_size_m"] : SceneJson();
  if (pixel.is_array() && pixel.size() == 2) sidecar.pixel = Vec2(number(pixel[0]), number(pixel[1]));
  if (!sizes || !(sidecar.high >= sidecar.low) || !(sidecar.pixel.minCoeff() > 0.0) || !sidecar.pixel.allFinite()) {
    return refused_file(
        ErrorCode::mismatch,
        fmt::format("does not describe the image beside it, which has {} x {} pixels", image_.width, image_.height),
        path.string(), "width, height, pixel_size_m [x, y], height_min_m, height_max_m of that image");
  }
  sidecar_ = sidecar;
  return success();
}

/// What a height may be, for messages.
std::string HeightSourceReader::accepted_height(const Range& range) const {
  const bool signed_height = range.low < 0.0;
  return fmt::format("a length{} ({}){}", signed_height ? "" : " of 0 or more", accepted_units(Dimension::length),
                     mean_edge_ > 0.0 ? ", or a share of the mean edge (\"10 %\")" : "");
}

/// A length, or a share of the mean edge (the papers' shorthand), in metres.
Result<double> HeightSourceReader::height_of(const SceneJson& value, const std::string& place,
                                             const Range& range) const {
  const auto wrong = [&](ErrorCode code, std::string what) {
    return refused(code, std::move(what), place, accepted_height(range));
  };
  const bool share = value.is_string() && value.get_ref<const std::string&>().find('%') != std::string::npos;
  if (share && mean_edge_ <= 0.0) return wrong(ErrorCode::bad_value, "is a share, and there is no mesh it could be of");
  const auto read = from_option<double>(value_of(value, OptionType::length_or_share()));
  const double height = share ? read * mean_edge_ : read;
  if (std::isfinite(height) && range.holds(height)) return height;
  return wrong(ErrorCode::bad_value, value.is_string() ? fmt::format("is {}", value.get_ref<const std::string&>())
                                                       : fmt::format("is {:.6g}", height));
}

double HeightSourceReader::read_height(const char* key, double fallback, const Range& range) {
  const SceneJson* value = reader_.raw(key);
  const double height =
      value == nullptr ? fallback : reader_.value_or(height_of(*value, reader_.place_of(key), range), fallback);
  reader_.write(key, height);
  return height;
}

Status HeightSourceReader::read_scale(double magnify) {
  magnify_ = magnify;
  if (!generated_) white_is_deep_ = reader_.get<std::string>("white_is") == "deep";
  if (const SceneJson* range = reader_.raw("height_range")) {
    read_range(*range);
    return reader_.status();
  }
  const bool flat = generated_ && library_.heights.empty() && spec_.kind == MesostructureKind::flat;
  if (!floats_.values.empty() && !reader_.has("height")) {
    // Values in metres, moved by an offset.
    scale_ = {1.0, read_height("offset", 0.0, Range{})};
    context_.note(fmt::format(
        "{}: heights {} to {}, in metres as the EXR file stores them (\"height\" or "
        "\"height_range\" says what its range stands for otherwise)",
        who_, format_length(static_cast<double>(floats_.lowest)), format_length(static_cast<double>(floats_.highest))));
    stored_metres_ = true;
    return reader_.status();
  }
  if (sidecar_ && !reader_.has("height") && !reader_.has("offset")) {
    scale_ = {sidecar_->high - sidecar_->low, white_is_deep_ ? sidecar_->high : sidecar_->low};
    reader_.write("height", scale_.amplitude);
    reader_.write("offset", scale_.offset);
    context_.note(fmt::format("{}: heights {} to {} from {}", who_, format_length(sidecar_->low),
                              format_length(sidecar_->high), sidecar_->file));
    return reader_.status();
  }
  if (mean_edge_ <= 0.0 && !flat && !reader_.has("height")) {
    reader_.fail("height", "is missing", accepted_height(Range::not_negative()));
    return reader_.status();
  }
  constexpr double papers_best = 0.1;  // hrm-2010, 5.3: the share of the edge that is perceived best
  // `magnify` scales what the scene says; the default is a share of the mesh as it is.
  const double fallback = flat ? 0.0 : papers_best * mean_edge_ / magnify_;
  scale_.amplitude = read_height("height", fallback, flat ? Range{} : Range::not_negative());
  scale_.offset = read_height("offset", 0.0, Range{});
  if (!reader_.has("height") && !flat) {
    context_.note(
        fmt::format("{}: no height is stated; 10 % of the mean edge is taken, {} (\"height\" chooses otherwise)", who_,
                    format_length(magnify_ * fallback)));
  }
  return reader_.status();
}

void HeightSourceReader::read_range(const SceneJson& range) {
  double ends[2] = {0.0, 0.0};
  for (std::size_t i = 0; i < 2; ++i)
    ends[i] = reader_.value_or(height_of(range[i], reader_.place_of("height_range", i), Range{}), 0.0);
  if (ends[1] < ends[0]) reader_.fail("height_range", "has its higher end first", "two lengths [lowest, highest]");
  scale_ = {ends[1] - ends[0], white_is_deep_ ? ends[1] : ends[0]};
  reader_.write("height_range", Vec2(ends[0], ends[1]));
}

Result<HeightMap> HeightSourceReader::build(Wrap wrap, Reconstruction reconstruction) const {
  const double amplitude = magnify_ * scale_.amplitude;
  const double offset = magnify_ * scale_.offset;
  if (generated_) return generated_heights(amplitude, offset, wrap, reconstruction);
  return image_heights({amplitude, offset, white_is_deep_, wrap, reconstruction});
}

Result<HeightMap> HeightSourceReader::build_between(double black, double white, Wrap wrap,
                                                    Reconstruction reconstruction) const {
  if (generated_) return generated_heights(white - black, black, wrap, reconstruction);
  return image_heights({std::abs(white - black), black, white < black, wrap, reconstruction});
}

Result<HeightMap> HeightSourceReader::image_heights(const HeightMapSettings& settings) const {
  if (!floats_.values.empty()) {
    Result<HeightMap> heights = float_heights(floats_, settings, !stored_metres_);
    if (!heights) return std::move(heights).error().in_file(path_.string()).at(reader_.place_of(key_));
    context_.note(fmt::format("{}: heights are read from the channel {} ({})", who_, floats_.channel, floats_.reason));
    return heights;
  }
  Result<HeightMap> heights = HeightMap::build(image_, channel_, settings);
  if (!heights) {
    Error error = std::move(heights).error().in_file(path_.string());
    error.place =
        reader_.place_of(!error.place.empty() ? error.place : (channel_ == Channel::automatic ? key_ : "channel"));
    if (error.code == ErrorCode::bad_value) error.code = ErrorCode::bad_map;
    return error;
  }
  if (channel_ == Channel::automatic && !heights->channel().reason.empty()) {
    context_.note(fmt::format("{}: heights are read from the {} channel ({})", who_,
                              to_string(heights->channel().channel), heights->channel().reason));
  }
  return heights;
}

Result<HeightMap> HeightSourceReader::generated_heights(double amplitude, double offset, Wrap wrap,
                                                        Reconstruction reconstruction) const {
  MesostructureSpec spec = spec_;
  // A formula's amplitude is not negative but where it is the height itself.
  if (!library_.heights.empty()) {
    const double scale = library_.amplitude > 0.0 ? amplitude / library_.amplitude : 0.0;
    std::vector<float> heights = library_.heights;
    for (float& height : heights) height = static_cast<float>(scale * static_cast<double>(height) + offset);
    return at_place(HeightMap::build(std::move(heights), library_.size, library_.size, wrap, reconstruction),
                    reader_.place());
  }
  const bool flipped = amplitude < 0.0 && spec.kind != MesostructureKind::flat;
  spec.amplitude = flipped ? -amplitude : amplitude;
  ASPERITY_TRY(std::vector<float> heights, at_place(generate_heights(spec), reader_.place_of(key_)));
  if (flipped || offset != 0.0) {
    const double sign = flipped ? -1.0 : 1.0;
    for (float& height : heights) height = static_cast<float>(sign * static_cast<double>(height) + offset);
  }
  return at_place(HeightMap::build(std::move(heights), spec.size, spec.size, wrap, reconstruction), reader_.place());
}

}  // namespace asperity
