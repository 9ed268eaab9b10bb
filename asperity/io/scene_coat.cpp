// The coat of a surface in a scene file.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "asperity/io/detail/scene_heights.h"
#include "asperity/io/detail/scene_layers.h"
#include "asperity/io/image_io.h"

namespace asperity {
namespace {

class CoatReader {
 public:
  CoatReader(const SceneJson& json, const std::string& place, const TriangleMesh& mesh, SceneContext& context,
             std::string_view object)
      : reader_(json, place, object),
        mesh_(mesh),
        context_(context),
        source_(reader_, context, "height_map", "coat", mesh.mean_edge()) {}

  Result<ScenePart<CoatSource>> read() {
    ASPERITY_CHECK(reader_.status());
    ASPERITY_CHECK(source_.read_source());
    read_mapping();
    magnify_ = reader_.get<double>("magnify");
    ASPERITY_CHECK(reader_.status());
    ASPERITY_CHECK(source_.read_scale(magnify_));
    ASPERITY_TRY(HeightMap heights, source_.build(wrap_, reconstruction_));
    ASPERITY_CHECK(check_amplitude(heights, reader_));
    ASPERITY_TRY(const Vec2 tile, read_tile(heights));
    ASPERITY_TRY(Mesostructure maps, with_normals(std::move(heights), tile));
    CoatSettings settings{mapping_, repeat_, {}};
    if (const SceneJson* stitching = reader_.raw("stitching")) {
      ASPERITY_TRY(settings.stitching, read_stitching(*stitching, reader_.place_of("stitching"), context_, reader_));
    }
    LayerHost host{mesh_.mean_edge(), mapping_ == Mapping::triplanar, tile, wrap_, {}};
    ASPERITY_TRY(host.detail, read_detail(reader_));
    if (host.detail) {
      if (context_.progress) context_.progress("making levels of detail", 0.0);
      ASPERITY_TRY(maps, with_detail(std::move(maps), *host.detail, reader_.place_of("detail")));
    }
    CoatParts parts;
    parts.maps.push_back(std::make_shared<const Mesostructure>(std::move(maps)));
    ASPERITY_CHECK(read_groups(parts, host));
    ASPERITY_TRY(parts.layers, read_layers(reader_, host, context_));
    ASPERITY_TRY(parts.materials, read_material_maps(reader_, host, context_));
    ASPERITY_CHECK(reader_.status());
    return ScenePart<CoatSource>{{std::move(parts), settings}, std::move(reader_.canonical())};
  }

 private:
  /// Maps that groups of faces wear in place of the coat's own.
  Status read_groups(CoatParts& parts, const LayerHost& host) {
    const SceneJson* groups = reader_.raw("groups");
    if (groups == nullptr) return reader_.status();
    parts.map_of_face.assign(mesh_.triangles().size(), 0);
    SceneJson canonical = SceneJson::array();
    for (std::size_t i = 0; i < groups->size(); ++i) {
      ObjectReader group((*groups)[i], reader_.place_of("groups", i), "face group");
      ASPERITY_CHECK(read_faces(group, static_cast<std::uint8_t>(i + 1), parts.map_of_face));
      HeightSourceReader source(group, context_, "height_map", "face group", mesh_.mean_edge());
      ASPERITY_CHECK(source.read_source());
      ASPERITY_CHECK(source.read_scale(magnify_));
      ASPERITY_TRY(HeightMap heights, source.build(wrap_, group.get<Reconstruction>("filter")));
      ASPERITY_CHECK(check_amplitude(heights, group));
      ASPERITY_TRY(Mesostructure maps, Mesostructure::build(std::move(heights), host.tile));
      if (host.detail) {
        ASPERITY_TRY(maps, with_detail(std::move(maps), *host.detail, group.place()));
      }
      parts.maps.push_back(std::make_shared<const Mesostructure>(std::move(maps)));
      canonical.push_back(std::move(group.canonical()));
    }
    reader_.write("groups", std::move(canonical));
    return reader_.status();
  }

  static Status read_faces(ObjectReader& group, std::uint8_t map, std::vector<std::uint8_t>& map_of_face) {
    ASPERITY_CHECK(group.status());
    const SceneJson& ranges = *group.raw("faces");
    for (std::size_t i = 0; i < ranges.size(); ++i) {
      const double first = ranges[i][0].get<double>();
      const double last = ranges[i][1].get<double>();
      if (!(first <= last && last < static_cast<double>(map_of_face.size()))) {
        return bad_value(fmt::format("is {} to {}", first, last), group.place_of("faces", i),
                         fmt::format("faces from 0 to {}, the first one first", map_of_face.size() - 1));
      }
      std::fill(map_of_face.begin() + static_cast<std::ptrdiff_t>(first),
                map_of_face.begin() + static_cast<std::ptrdiff_t>(last) + 1, map);
    }
    group.write("faces", ranges);
    return success();
  }

  void read_mapping() {
    const std::optional<Mapping> given = reader_.get<std::optional<Mapping>>("mapping");
    mapping_ = given.value_or(mesh_.has_uvs() ? Mapping::uv : Mapping::triplanar);
    if (!given && !mesh_.has_uvs()) {
      context_.note(
          "coat: the mesh has no texture coordinates, so the map is projected along the three axes (\"mapping\": "
          "\"triplanar\")");
    }
    wrap_ = reader_.get<Wrap>("wrap");
    reconstruction_ = reader_.get<Reconstruction>("filter");
  }

  Status check_amplitude(const HeightMap& heights, const ObjectReader& from) {
    // hrm-2010, 5.4.1: what exceeds it is a candidate for finer remeshing. Rounding of just 15 % is not beyond it.
    constexpr double remesh_share = 0.15 * (1.0 + 1e-9);
    const double highest = std::max(std::abs(heights.lowest()), std::abs(heights.highest()));
    const double half = 0.5 * mesh_.bounds().diagonal();
    const char* key = from.has("height_range") ? "height_range" : (from.has("height") ? "height" : "height_map");
    if (highest > half) {
      return bad_value(fmt::format("gives a relief of {} on an object with a diagonal of {}", format_length(highest),
                                   format_length(2.0 * half)),
                       from.place_of(key),
                       fmt::format("heights of at most half the diagonal ({})", format_length(half)));
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
    Vec2 tile = Vec2::Zero();
    if (given != nullptr && given->is_array()) {
      tile = reader_.get("tile", tile);
    } else if (given == nullptr && source_.sidecar()) {
      tile = source_.tile();
      reader_.write("tile", tile);
      context_.note(fmt::format("coat: one repeat is {} x {} from {}", format_length(tile.x()), format_length(tile.y()),
                                source_.sidecar()->file));
    } else {
      const double fallback = share * mesh_.bounds().extent().maxCoeff() / magnify_;
      const double width = reader_.get("tile", fallback);
      tile = Vec2(width, width * aspect);
      if (given == nullptr)
        context_.note(
            fmt::format("coat: one repeat of the map is {} wide, a quarter of the object (\"tile\" chooses otherwise)",
                        format_length(magnify_ * width)));
    }
    ASPERITY_CHECK(reader_.status());
    return Vec2(magnify_ * tile);
  }

  void read_repeat() {
    const SceneJson* given = reader_.raw("repeat");
    if (given != nullptr && given->is_array()) {
      repeat_ = reader_.get("repeat", repeat_);
      reader_.write("repeat", *given);
      return;
    }
    // What knows its size is laid at it.
    double fallback = 1.0;
    if (source_.from_library() && given == nullptr) {
      fallback =
          (mapping_ == Mapping::per_face ? mesh_.mean_edge() : texture_unit(mesh_)) / (magnify_ * source_.tile().x());
      context_.note(fmt::format("coat: repeated {:.3g} times over the texture coordinates, so that one repeat is {}",
                                fallback, format_length(magnify_ * source_.tile().x())));
    }
    const double repeat = reader_.get("repeat", fallback);
    repeat_ = Vec2(repeat, repeat);
  }

  /// Mean size of one repeat as the mesh carries it (m).
  [[nodiscard]] Vec2 mapped_tile() const {
    const double side = mapping_ == Mapping::per_face ? mesh_.mean_edge() : texture_unit(mesh_);
    return {side / repeat_.x(), side / repeat_.y()};
  }

  /// Normals of the reconstruction where it is touched, or the papers' normal map of the heights (hrm-2010, section 4).
  Result<Mesostructure> with_own_normals(HeightMap heights, const Vec2& tile) {
    const bool map = reader_.get<std::string>("normals") == "map";
    ASPERITY_CHECK(reader_.status());
    if (!map) return Mesostructure::build(std::move(heights), tile);
    ASPERITY_TRY(NormalMap normals, at_place(NormalMap::build(heights, tile), reader_.place_of("normals")));
    return Mesostructure::build(std::move(heights), std::move(normals), tile);
  }

  Result<Mesostructure> with_normals(HeightMap heights, const Vec2& tile) {
    if (reader_.raw("normal_map") == nullptr) return with_own_normals(std::move(heights), tile);
    const auto name = reader_.get("normal_map", std::string());
    const std::string place = reader_.place_of("normal_map");
    const auto green = reader_.get<GreenConvention>("green");
    ASPERITY_CHECK(reader_.status());
    const std::filesystem::path path = context_.resolve(name);
    reader_.write("normal_map", path.string());
    if (context_.progress) context_.progress("reading normal map", 0.0);
    ASPERITY_TRY(const Image image, in_file(read_image(path), path.string(), place));
    Result<NormalMap> normals = NormalMap::build(image, {green, wrap_, NormalFilter::bilinear});
    if (!normals) {
      Error error = std::move(normals).error().in_file(path.string()).at(place);
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
  HeightSourceReader source_;
  Mapping mapping_ = Mapping::uv;
  Wrap wrap_ = Wrap::repeat;
  Reconstruction reconstruction_ = Reconstruction::quadratic_bspline;
  double magnify_ = 1.0;
  Vec2 repeat_ = Vec2::Ones();
};

}  // namespace

double texture_unit(const TriangleMesh& mesh) {
  double area = 0.0;
  for (std::uint32_t face = 0; mesh.has_uvs() && face < mesh.triangles().size(); ++face) {
    const std::array<Vec2f, 3> uv = mesh.uvs(face);
    const Vec2f a = uv[1] - uv[0];
    const Vec2f b = uv[2] - uv[0];
    area += 0.5 * std::abs(static_cast<double>(a.x()) * static_cast<double>(b.y()) -
                           static_cast<double>(a.y()) * static_cast<double>(b.x()));
  }
  return area > 0.0 ? std::sqrt(mesh.report().area / area) : mesh.mean_edge();
}

Result<ScenePart<CoatSource>> read_coat(const SceneJson& json, const std::string& place, const TriangleMesh& mesh,
                                        SceneContext& context, std::string_view object) {
  return CoatReader(json, place, mesh, context, object).read();
}

}  // namespace asperity
