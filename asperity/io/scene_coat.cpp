// The coat of a surface in a scene file.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>

#include "asperity/field/mesostructure_generators.h"
#include "asperity/io/image_io.h"
#include "asperity/io/scene_reader.h"

namespace asperity {
namespace {

const std::vector<std::string>& channel_names() {
  static const std::vector<std::string> names{"automatic", "luminance", "red", "green", "blue", "alpha"};
  return names;
}

/// What a JSON file beside a measured height image says of it (m).
struct Sidecar {
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

/// Reads a formula's parameters; every one that the formula does not take is refused by name. What they must be to one
/// another (a flank within its rim) the formula itself checks.
class HeightGeneratorReader {
 public:
  explicit HeightGeneratorReader(ObjectReader& reader) : reader_(reader) {}

  MesostructureSpec read() {
    spec_.kind = read_kind();
    spec_.size = reader_.integer("size", 512, 2, 8192);
    refuse_others();
    spec_ = completed(spec_);
    if (takes("count")) spec_.count = reader_.integer("count", spec_.count, 1, std::max(1, spec_.size / 2));
    if (takes("number")) read_number();
    if (takes("seed")) read_seed();
    if (takes("wall")) spec_.wall = share("wall", spec_.wall, 0.5);
    if (takes("width")) spec_.width = share("width", *spec_.width, 1.0);
    if (takes("flank")) spec_.flank = share("flank", own_flank(), 0.25);
    if (takes("radius")) read_radius();
    if (takes("rim")) spec_.rim = share("rim", spec_.rim, 0.5);
    if (takes("field")) spec_.field = share("field", spec_.field, 1.0);
    if (takes("overlap")) spec_.overlap = share("overlap", spec_.overlap, 0.9);
    if (takes("hurst")) spec_.hurst = reader_.number("hurst", spec_.hurst, Range{0.05, 1.0});
    if (takes("octaves")) spec_.octaves = reader_.integer("octaves", *spec_.octaves, 1, 12);
    return spec_;
  }

 private:
  MesostructureKind read_kind() {
    const std::string name = reader_.text("generator", "");
    if (reader_.failed()) return MesostructureKind::flat;
    Result<MesostructureKind> parsed = parse_mesostructure_kind(name);
    if (parsed) return *parsed;
    reader_.fail(std::move(parsed).error().at(reader_.place_of("generator")));
    return MesostructureKind::flat;
  }

  [[nodiscard]] bool takes(std::string_view parameter) const {
    const auto taken = parameters_of(spec_.kind);
    return std::find(taken.begin(), taken.end(), parameter) != taken.end();
  }

  void refuse_others() {
    for (const SceneObjectKeys& entry : scene_object_keys()) {
      if (entry.object != "height generator") continue;
      for (const std::string& key : entry.keys) {
        if (key != "generator" && key != "size" && !takes(key)) reader_.refuse({key}, "by this generator");
      }
    }
  }

  double share(std::string_view key, double fallback, double most) {
    return reader_.quantity(key, Dimension::ratio, fallback, Range{0.0, most});
  }

  /// The groove's follows from its width, which may be stated.
  [[nodiscard]] double own_flank() const {
    MesostructureSpec open = spec_;
    open.flank.reset();
    return *completed(open).flank;
  }

  void read_number() {
    if (spec_.number || reader_.has("number"))
      spec_.number = reader_.integer("number", spec_.number.value_or(1), 1, 2000);
  }

  void read_seed() {
    if (spec_.kind == MesostructureKind::rings && !spec_.number) {
      reader_.refuse({"seed"}, "by the fixed arrangement (\"number\" scatters features)");
    } else {
      spec_.seed = reader_.seed("seed", spec_.seed);
    }
  }

  void read_radius() {
    const SceneJson* given = reader_.raw("radius");
    const bool one = spec_.kind == MesostructureKind::groove;
    if (given != nullptr && given->is_array() && !one) {
      read_radius_range(*given);
    } else if (given != nullptr || one) {
      const double radius = reader_.quantity("radius", Dimension::ratio, spec_.radius->high, Range{0.001, 0.25});
      spec_.radius = ShareRange{radius, radius};
    } else {
      reader_.write("radius", SceneJson::array({spec_.radius->low, spec_.radius->high}));
    }
  }

  void read_radius_range(const SceneJson& given) {
    const char* accepted = "a share of the tile from 0.001 to 0.25, or two [smallest, largest]";
    if (given.size() != 2 || !given[0].is_number() || !given[1].is_number()) {
      reader_.fail("radius", "is no pair of numbers", accepted);
      return;
    }
    spec_.radius = ShareRange{given[0].get<double>(), given[1].get<double>()};
    reader_.write("radius", given);
  }

  ObjectReader& reader_;
  MesostructureSpec spec_;
};

class CoatReader {
 public:
  CoatReader(const SceneJson& json, const std::string& place, const TriangleMesh& mesh, SceneContext& context)
      : reader_(json, place, "coat"), mesh_(mesh), context_(context) {}

  Result<ScenePart<Coat>> read() {
    ASPERITY_CHECK(reader_.status());
    ASPERITY_CHECK(read_source());
    read_mapping();
    magnify_ = reader_.number("magnify", 1.0, Range::positive());
    ASPERITY_CHECK(reader_.status());
    read_heights_scale();
    ASPERITY_CHECK(reader_.status());
    ASPERITY_TRY(HeightMap heights, generated_ ? generated_heights() : image_heights());
    ASPERITY_CHECK(check_amplitude(heights));
    ASPERITY_TRY(const Vec2 tile, read_tile(heights));
    ASPERITY_TRY(Mesostructure maps, with_normals(std::move(heights), tile));
    CoatSettings settings{mapping_, repeat_, {}};
    if (const SceneJson* stitching = reader_.raw("stitching")) {
      ASPERITY_TRY(settings.stitching, read_stitching(*stitching, reader_.place_of("stitching"), context_, reader_));
    }
    Result<Coat> coat = Coat::build(mesh_, std::make_shared<const Mesostructure>(std::move(maps)), settings);
    if (!coat) return std::move(coat).error().at(reader_.place());
    return ScenePart<Coat>{std::move(*coat), std::move(reader_.canonical())};
  }

 private:
  Status read_source() {
    const SceneJson* map = reader_.raw("height_map");
    if (map == nullptr) {
      reader_.fail("height_map", "is missing", "an image file (PNG, JPEG) or an object with a generator");
    } else if (map->is_object()) {
      generated_ = true;
      read_generator(*map);
      reader_.refuse({"channel", "white_is", "height_range"}, "for a generated height map");
    } else if (map->is_string()) {
      return read_image_source(map->get_ref<const std::string&>());
    } else {
      reader_.fail_type("height_map", *map, "an image file (PNG, JPEG) or an object with a generator");
    }
    return reader_.status();
  }

  void read_generator(const SceneJson& json) {
    ObjectReader generator(json, reader_.place_of("height_map"), "height generator");
    spec_ = HeightGeneratorReader(generator).read();
    reader_.take("height_map", std::move(generator));
  }

  Status read_image_source(const std::string& file) {
    path_ = context_.resolve(file);
    if (context_.progress) context_.progress("reading height map", 0.0);
    Result<Image> image = read_image(path_);
    if (!image) {
      Error error = std::move(image).error().in_file(path_.string());
      if (error.place.empty()) error.place = reader_.place_of("height_map");
      return error;
    }
    image_ = std::move(*image);
    reader_.write("height_map", path_.string());
    static const std::vector<std::string> white{"high", "deep"};
    channel_ = static_cast<Channel>(reader_.choice("channel", channel_names(), 0));
    white_is_deep_ = reader_.choice("white_is", white, 0) == 1;
    return read_sidecar();
  }

  Status read_sidecar() {
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
    Sidecar sidecar;
    sidecar.file = path.filename().string();
    sidecar.low = member("height_min_m");
    sidecar.high = member("height_max_m");
    const bool sizes = member("width") == image_.width && member("height") == image_.height;
    const SceneJson pixel = json->contains("pixel_size_m") ? (*json)["pixel_size_m"] : SceneJson();
    if (pixel.is_array() && pixel.size() == 2) sidecar.pixel = Vec2(number(pixel[0]), number(pixel[1]));
    if (!sizes || !(sidecar.high >= sidecar.low) || !(sidecar.pixel.minCoeff() > 0.0) || !sidecar.pixel.allFinite()) {
      return Error{
          ErrorCode::mismatch,
          fmt::format("does not describe the image beside it, which has {} x {} pixels", image_.width, image_.height),
          path.string(),
          {},
          "width, height, pixel_size_m [x, y], height_min_m, height_max_m of that image"};
    }
    sidecar_ = sidecar;
    return success();
  }

  void read_mapping() {
    static const std::vector<std::string> mappings{"auto", "uv", "per_face", "triplanar"};
    static const std::vector<std::string> wraps{"repeat", "clamp"};
    static const std::vector<std::string> filters{"nearest", "bilinear", "bspline"};
    switch (reader_.choice("mapping", mappings, 0)) {
      case 1: mapping_ = Mapping::uv; break;
      case 2: mapping_ = Mapping::per_face; break;
      case 3: mapping_ = Mapping::triplanar; break;
      default:
        mapping_ = mesh_.has_uvs() ? Mapping::uv : Mapping::triplanar;
        if (!mesh_.has_uvs()) {
          context_.note(
              "coat: the mesh has no texture coordinates, so the map is projected along the three axes (\"mapping\": "
              "\"triplanar\")");
        }
    }
    wrap_ = reader_.choice("wrap", wraps, 0) == 0 ? Wrap::repeat : Wrap::clamp;
    reconstruction_ = static_cast<Reconstruction>(reader_.choice("filter", filters, 2));
  }

  /// What a height may be, for messages.
  [[nodiscard]] static std::string accepted_height(const Range& range) {
    const bool signed_height = range.low < 0.0;
    return fmt::format("a length{} ({}), or a share of the mean edge (\"10 %\")", signed_height ? "" : " of 0 or more",
                       accepted_units(Dimension::length));
  }

  /// A length, or a share of the mean edge (the papers' shorthand), in metres.
  Result<double> height_of(const SceneJson& value, const std::string& place, const Range& range) const {
    const auto wrong = [&](ErrorCode code, std::string what) {
      return Error{code, std::move(what), {}, place, accepted_height(range)};
    };
    double height = 0.0;
    if (value.is_string()) {
      const auto& text = value.get_ref<const std::string&>();
      const bool share = text.find('%') != std::string::npos;
      Result<double> parsed = parse_quantity(text, share ? Dimension::ratio : Dimension::length);
      if (!parsed && share)
        return wrong(ErrorCode::bad_value, fmt::format("\"{}\" is no share of the mean edge", text));
      if (!parsed) return wrong(ErrorCode::bad_value, parsed.error().what);
      height = share ? *parsed * mesh_.mean_edge() : *parsed;
    } else if (value.is_number()) {
      height = value.get<double>();
    } else {
      return wrong(ErrorCode::bad_type, fmt::format("is {}", json_type(value)));
    }
    if (std::isfinite(height) && range.holds(height)) return height;
    return wrong(ErrorCode::bad_value, value.is_string() ? fmt::format("is {}", value.get_ref<const std::string&>())
                                                         : fmt::format("is {:.6g}", height));
  }

  double read_height(const char* key, double fallback, const Range& range) {
    const SceneJson* value = reader_.raw(key);
    double height = fallback;
    if (value != nullptr) {
      Result<double> read = height_of(*value, reader_.place_of(key), range);
      if (!read) {
        reader_.fail(std::move(read).error());
        return fallback;
      }
      height = *read;
    }
    reader_.write(key, height);
    return height;
  }

  void read_heights_scale() {
    if (const SceneJson* range = reader_.raw("height_range")) {
      reader_.refuse({"height", "offset"}, "beside height_range");
      read_range(*range);
      return;
    }
    constexpr double papers_best = 0.1;  // hrm-2010, 5.3: the share of the edge that is perceived best
    const bool flat = generated_ && spec_.kind == MesostructureKind::flat;
    const bool from_sidecar = sidecar_ && !reader_.has("height") && !reader_.has("offset");
    if (from_sidecar) {
      scale_ = {sidecar_->high - sidecar_->low, white_is_deep_ ? sidecar_->high : sidecar_->low};
      reader_.write("height", scale_.amplitude);
      reader_.write("offset", scale_.offset);
      context_.note(fmt::format("coat: heights {} to {} from {}", format_length(sidecar_->low),
                                format_length(sidecar_->high), sidecar_->file));
      return;
    }
    // `magnify` scales what the scene says; the default is a share of the mesh as it is.
    const double fallback = flat ? 0.0 : papers_best * mesh_.mean_edge() / magnify_;
    scale_.amplitude = read_height("height", fallback, flat ? Range{} : Range::not_negative());
    scale_.offset = read_height("offset", 0.0, Range{});
    if (!reader_.has("height") && !flat) {
      context_.note(
          fmt::format("coat: no height is stated; 10 % of the mean edge is taken, {} (\"height\" chooses otherwise)",
                      format_length(magnify_ * fallback)));
    }
  }

  void read_range(const SceneJson& range) {
    if (!range.is_array() || range.size() != 2) {
      reader_.fail_type("height_range", range, "two lengths [lowest, highest]");
      return;
    }
    double ends[2] = {0.0, 0.0};
    for (std::size_t i = 0; i < 2; ++i) {
      Result<double> end = height_of(range[i], fmt::format("{}[{}]", reader_.place_of("height_range"), i), Range{});
      if (!end) {
        reader_.fail(std::move(end).error());
        return;
      }
      ends[i] = *end;
    }
    if (ends[1] < ends[0]) reader_.fail("height_range", "has its higher end first", "two lengths [lowest, highest]");
    scale_ = {ends[1] - ends[0], white_is_deep_ ? ends[1] : ends[0]};
    reader_.write("height_range", SceneJson::array({ends[0], ends[1]}));
  }

  Result<HeightMap> image_heights() {
    const HeightMapSettings settings{magnify_ * scale_.amplitude, magnify_ * scale_.offset, white_is_deep_, wrap_,
                                     reconstruction_};
    Result<HeightMap> heights = HeightMap::build(image_, channel_, settings);
    if (!heights) {
      Error error = std::move(heights).error().in_file(path_.string());
      const char* asked = channel_ == Channel::automatic ? "height_map" : "channel";
      error.place = reader_.place_of(error.place.empty() ? asked : error.place.c_str());
      if (error.code == ErrorCode::bad_value) error.code = ErrorCode::bad_map;
      return error;
    }
    if (channel_ == Channel::automatic && !heights->channel().reason.empty()) {
      context_.note(fmt::format("coat: heights are read from the {} channel ({})",
                                to_string(heights->channel().channel), heights->channel().reason));
    }
    return heights;
  }

  Result<HeightMap> generated_heights() {
    spec_.amplitude = magnify_ * scale_.amplitude;
    Result<std::vector<float>> heights = generate_heights(spec_);
    if (!heights) return std::move(heights).error().at(reader_.place_of("height_map"));
    const double offset = magnify_ * scale_.offset;
    if (offset != 0.0) {
      for (float& height : *heights) height = static_cast<float>(static_cast<double>(height) + offset);
    }
    Result<HeightMap> map = HeightMap::build(std::move(*heights), spec_.size, spec_.size, wrap_, reconstruction_);
    if (!map) return std::move(map).error().at(reader_.place());
    return map;
  }

  Status check_amplitude(const HeightMap& heights) {
    constexpr double remesh_share =
        0.2;  // hrm-2010, 5.3: beyond it the rendering becomes unstable; from 15 % on: remesh
    const double highest = std::max(std::abs(heights.lowest()), std::abs(heights.highest()));
    const double half = 0.5 * mesh_.bounds().diagonal();
    const char* key = reader_.has("height_range") ? "height_range" : (reader_.has("height") ? "height" : "height_map");
    if (highest > half) {
      return Error{ErrorCode::bad_value,
                   fmt::format("gives a relief of {} on an object with a diagonal of {}", format_length(highest),
                               format_length(2.0 * half)),
                   {},
                   reader_.place_of(key),
                   fmt::format("heights of at most half the diagonal ({})", format_length(half))};
    }
    const double range = heights.highest() - heights.lowest();
    if (range > remesh_share * mesh_.mean_edge()) {
      context_.note(
          fmt::format("coat: relief of {} is {:.0f} % of the mean edge ({}); hrm-2010 found instabilities beyond 20 % "
                      "and suggests geometry instead beyond 15 %",
                      format_length(range), 100.0 * range / mesh_.mean_edge(), format_length(mesh_.mean_edge())));
    }
    return success();
  }

  Result<Vec2> read_tile(const HeightMap& heights) {
    const double aspect = static_cast<double>(heights.height()) / heights.width();
    if (mapping_ != Mapping::triplanar) {
      reader_.refuse({"tile"}, "by this mapping, whose size the mesh decides (\"repeat\" changes it)");
      read_repeat();
      ASPERITY_CHECK(reader_.status());
      return mapped_tile();
    }
    reader_.refuse({"repeat"}, "by the triplanar mapping (\"tile\" is the size of one repeat)");
    constexpr double share = 0.25;  // four repeats over the object
    const SceneJson* given = reader_.raw("tile");
    const bool pair = given != nullptr && given->is_array();
    Vec2 tile = Vec2::Zero();
    if (pair) {
      tile = read_tile_pair(*given);
    } else if (given == nullptr && sidecar_) {
      tile = Vec2(sidecar_->pixel.x() * heights.width(), sidecar_->pixel.y() * heights.height());
      reader_.write("tile", SceneJson::array({tile.x(), tile.y()}));
      context_.note(fmt::format("coat: one repeat is {} x {} from {}", format_length(tile.x()), format_length(tile.y()),
                                sidecar_->file));
    } else {
      const double fallback = share * mesh_.bounds().extent().maxCoeff() / magnify_;
      const double width = reader_.quantity("tile", Dimension::length, fallback, Range::positive());
      tile = Vec2(width, width * aspect);
      if (given == nullptr)
        context_.note(
            fmt::format("coat: one repeat of the map is {} wide, a quarter of the object (\"tile\" chooses otherwise)",
                        format_length(magnify_ * width)));
    }
    ASPERITY_CHECK(reader_.status());
    return Vec2(magnify_ * tile);
  }

  Vec2 read_tile_pair(const SceneJson& given) {
    if (given.size() != 2) {
      reader_.fail("tile", fmt::format("has {} lengths", given.size()), "a length, or two [along s, along t]");
      return Vec2::Ones();
    }
    Vec2 tile = Vec2::Ones();
    for (std::size_t i = 0; i < 2; ++i) {
      const SceneJson wrapped = SceneJson{{"tile", given[i]}};
      ObjectReader one(wrapped, fmt::format("{}[{}]", reader_.place_of("tile"), i), "coat");
      tile[static_cast<int>(i)] = one.quantity("tile", Dimension::length, 1.0, Range::positive());
      if (one.error()) {
        Error error = *one.error();
        error.place = one.place();
        reader_.fail(std::move(error));
      }
    }
    reader_.write("tile", SceneJson::array({tile.x(), tile.y()}));
    return tile;
  }

  void read_repeat() {
    const SceneJson* given = reader_.raw("repeat");
    if (given != nullptr && given->is_array()) {
      for (std::size_t i = 0; i < 2 && given->size() == 2; ++i) {
        if (!(*given)[i].is_number() || !((*given)[i].get<double>() > 0.0)) {
          reader_.fail("repeat", "is no pair of numbers above 0", "a number above 0, or two [along s, along t]");
          return;
        }
        repeat_[static_cast<int>(i)] = (*given)[i].get<double>();
      }
      if (given->size() != 2)
        reader_.fail("repeat", fmt::format("has {} numbers", given->size()),
                     "a number above 0, or two [along s, along t]");
      reader_.write("repeat", *given);
      return;
    }
    const double repeat = reader_.number("repeat", 1.0, Range::positive());
    repeat_ = Vec2(repeat, repeat);
  }

  /// Mean size of one repeat as the mesh carries it (m).
  [[nodiscard]] Vec2 mapped_tile() const {
    if (mapping_ == Mapping::per_face) return Vec2(mesh_.mean_edge() / repeat_.x(), mesh_.mean_edge() / repeat_.y());
    double area = 0.0;
    for (std::uint32_t face = 0; mesh_.has_uvs() && face < mesh_.triangles().size(); ++face) {
      const auto& uv = mesh_.uvs(face);
      const Vec2f a = uv[1] - uv[0];
      const Vec2f b = uv[2] - uv[0];
      area += 0.5 * std::abs(static_cast<double>(a.x()) * static_cast<double>(b.y()) -
                             static_cast<double>(a.y()) * static_cast<double>(b.x()));
    }
    const double side = area > 0.0 ? std::sqrt(mesh_.report().area / area) : mesh_.mean_edge();
    return {side / repeat_.x(), side / repeat_.y()};
  }

  /// Normals of the reconstruction where it is touched, or the papers' normal map of the heights (hrm-2010, section 4).
  Result<Mesostructure> with_own_normals(HeightMap heights, const Vec2& tile) {
    static const std::vector<std::string> sources{"heights", "map"};
    reader_.refuse({"green"}, "without normal_map");
    const bool map = reader_.choice("normals", sources, 0) == 1;
    ASPERITY_CHECK(reader_.status());
    if (!map) return Mesostructure::build(std::move(heights), tile);
    Result<NormalMap> normals = NormalMap::build(heights, tile);
    if (!normals) return std::move(normals).error().at(reader_.place_of("normals"));
    return Mesostructure::build(std::move(heights), std::move(*normals), tile);
  }

  Result<Mesostructure> with_normals(HeightMap heights, const Vec2& tile) {
    if (reader_.raw("normal_map") == nullptr) return with_own_normals(std::move(heights), tile);
    static const std::vector<std::string> greens{"up", "down"};
    reader_.refuse({"normals"}, "beside normal_map");
    const std::string name = reader_.text("normal_map", "");
    const auto green = static_cast<GreenConvention>(reader_.choice("green", greens, 0));
    ASPERITY_CHECK(reader_.status());
    const std::filesystem::path path = context_.resolve(name);
    reader_.write("normal_map", path.string());
    if (context_.progress) context_.progress("reading normal map", 0.0);
    Result<Image> image = read_image(path);
    if (!image) {
      Error error = std::move(image).error().in_file(path.string());
      if (error.place.empty()) error.place = reader_.place_of("normal_map");
      return error;
    }
    Result<NormalMap> normals = NormalMap::build(*image, {green, wrap_, NormalFilter::bilinear});
    if (!normals) {
      Error error = std::move(normals).error().in_file(path.string()).at(reader_.place_of("normal_map"));
      error.code = ErrorCode::bad_map;
      return error;
    }
    const NormalAgreement agreement = compare_normals(heights, *normals, tile);
    if (const auto warning = disagreement_warning(agreement)) context_.note("coat: " + *warning);
    if (normals->degenerate_texels() > 0) {
      context_.note(fmt::format("coat: {} texels of the normal map are no direction and count as flat",
                                normals->degenerate_texels()));
    }
    return Mesostructure::build(std::move(heights), std::move(*normals), tile);
  }

  ObjectReader reader_;
  const TriangleMesh& mesh_;
  SceneContext& context_;
  bool generated_ = false;
  MesostructureSpec spec_;
  std::filesystem::path path_;
  Image image_;
  Channel channel_ = Channel::automatic;
  bool white_is_deep_ = false;
  std::optional<Sidecar> sidecar_;
  Mapping mapping_ = Mapping::uv;
  Wrap wrap_ = Wrap::repeat;
  Reconstruction reconstruction_ = Reconstruction::quadratic_bspline;
  double magnify_ = 1.0;
  HeightScale scale_;
  Vec2 repeat_ = Vec2::Ones();
};

}  // namespace

Result<ScenePart<Coat>> read_coat(const SceneJson& json, const std::string& place, const TriangleMesh& mesh,
                                  SceneContext& context) {
  return CoatReader(json, place, mesh, context).read();
}

}  // namespace asperity
