// Textures in a scene file: features, what they are mapped by, and what each is felt as.

#include "asperity/io/detail/scene_fine.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "asperity/io/detail/scene_heights.h"
#include "asperity/io/texture_waves.h"
#include "asperity/render/law_registry.h"

namespace asperity {
namespace {

using std::numbers::pi;

/// Lengths of one unit of u and of v where they are longest (m).
Vec2 widest(const ParametricSurface& surface) {
  constexpr int steps = 64;
  Vec2 longest = Vec2::Zero();
  for (int i = 0; i <= steps; ++i) {
    for (int j = 0; j <= steps; ++j) {
      const Vec2 share(static_cast<double>(i) / steps, static_cast<double>(j) / steps);
      const ParametricJet jet = surface.jet(surface.lower() + share.cwiseProduct(surface.upper() - surface.lower()));
      longest = longest.cwiseMax(Vec2(jet.u.norm(), jet.v.norm()));
    }
  }
  return longest;
}

class MappingReader {
 public:
  MappingReader(const SceneJson* json, const std::string& place, const TextureHost& host)
      : reader_(json, place, "feature mapping"), host_(host) {}

  Result<ScenePart<FeatureMapping>> read() {
    const bool parametric = host_.parametric != nullptr;
    settings_.surface = reader_.get("surface", parametric ? IntermediateSurface::uv : IntermediateSurface::plane);
    ASPERITY_CHECK(reader_.status());
    // Which mapping it is that nobody names depends on the surface.
    if (!reader_.has("surface")) {
      const std::string by = fmt::format("by the mapping \"{}\"", to_string(settings_.surface));
      if (parametric) reader_.refuse({"origin", "axis", "reference"}, by);
      if (!parametric) reader_.refuse({"tile"}, by);
      reader_.refuse({"radius", "half_extent"}, by);
    }
    if (settings_.surface == IntermediateSurface::uv) {
      read_tile();
    } else {
      read_frame();
    }
    ASPERITY_CHECK(reader_.status());
    ASPERITY_TRY(FeatureMapping mapping, at_place(FeatureMapping::build(settings_), reader_.place()));
    return ScenePart<FeatureMapping>{std::move(mapping), std::move(reader_.canonical())};
  }

 private:
  void read_tile() {
    Vec2 unit = Vec2::Ones();
    if (host_.parametric != nullptr) {
      unit = widest(*host_.parametric);
    } else if (host_.mesh != nullptr && host_.mesh->has_uvs()) {
      unit = Vec2::Constant(texture_unit(*host_.mesh));
    } else {
      reader_.fail("surface", "is \"uv\", and the surface has no texture coordinates",
                   "\"plane\", \"cylinder\", \"sphere\" or \"box\"", ErrorCode::mismatch);
    }
    settings_.tile = reader_.get("tile", unit);
  }

  void read_frame() {
    settings_.origin = reader_.get<Vec3>("origin", host_.bounds.centre());
    settings_.axis = reader_.get("axis", own_axis()).normalized();
    // Along the coordinate axis that is farthest from the mapping's own.
    const Vec3 along = std::abs(settings_.axis.x()) < 0.9 ? Vec3::UnitX() : Vec3::UnitY();
    const Vec3 wanted = reader_.get("reference", along).normalized();
    const Vec3 across = wanted - wanted.dot(settings_.axis) * settings_.axis;
    if (across.norm() < 1e-3) {
      reader_.fail("reference", "runs along the axis", "a direction at an angle to \"axis\"");
      return;
    }
    settings_.reference = across.normalized();
    const Vec3 extent = extent_along();
    const Vec3 half = 0.5 * extent;
    if (settings_.surface == IntermediateSurface::cylinder)
      settings_.radius = reader_.get("radius", std::max(half.x(), half.y()));
    if (settings_.surface == IntermediateSurface::sphere) settings_.radius = reader_.get("radius", half.maxCoeff());
    if (settings_.surface == IntermediateSurface::box) settings_.half_extent = reader_.get("half_extent", half);
    settings_.range = reader_.find<Vec2>("range");
  }

  /// The middle of a sheet is looked at from above, and so is a vase.
  [[nodiscard]] Vec3 own_axis() const {
    if (host_.parametric != nullptr) return Vec3::UnitZ();
    if (settings_.surface != IntermediateSurface::plane) return Vec3::UnitY();
    constexpr double alike = 0.99;
    const Vec3 extent = host_.bounds.extent();
    int shortest = 1;
    for (const int k : {2, 0}) {
      if (extent[k] < alike * extent[shortest]) shortest = k;
    }
    return Vec3::Unit(shortest);
  }

  /// Of the bounds, along reference, axis x reference, axis.
  [[nodiscard]] Vec3 extent_along() const {
    const Vec3 edges[3] = {settings_.reference, settings_.axis.cross(settings_.reference), settings_.axis};
    Vec3 extent;
    for (int k = 0; k < 3; ++k) extent[k] = edges[k].cwiseAbs().dot(host_.bounds.extent());
    return extent;
  }

  ObjectReader reader_;
  const TextureHost& host_;
  FeatureMappingSettings settings_;
};

/// One feature. `around`: length along u after which the mapping comes back (m), 0 where it does not.
class FeatureReader {
 public:
  FeatureReader(const SceneJson& json, const std::string& place, double around, SceneContext& context)
      : reader_(json, place, "feature"), around_(around), context_(context) {}

  Result<SurfaceFeature> read() {
    ASPERITY_CHECK(reader_.status());
    reader_.read("type", spec_.kind);
    if (around_ <= 0.0) reader_.refuse({"count"}, "by a mapping that does not go around (\"wavelength\" is)");
    reader_.read("direction", spec_.direction);
    if (reader_.reads("height_map")) ASPERITY_CHECK(read_heights());
    reader_.read("amplitude", spec_.amplitude);
    if (reader_.reads("count")) read_wavelength();
    reader_.read("phase", spec_.phase);
    reader_.read("centre", spec_.centre);
    reader_.read("wall", spec_.wall);
    if (reader_.reads("average_roughness")) read_roughness();
    reader_.read("correlation_length", spec_.correlation_length);
    reader_.read("seed", spec_.seed);
    // What goes around comes back where it started.
    spec_.period = Vec2(around_, 0.0);
    reader_.read("period", spec_.period);
    ASPERITY_CHECK(reader_.status());
    return placed(SurfaceFeature::build(spec_));
  }

  [[nodiscard]] ObjectReader& reader() { return reader_; }
  /// The same, an error of the feature by the key that a scene writes.
  template <class T>
  [[nodiscard]] Result<T> placed(Result<T> result) const {
    if (!result && result.error().place == "kind") result.error().place = "type";
    if (!result && result.error().place == "heights") result.error().place = "height_map";
    return at_place(std::move(result), reader_.place());
  }

 private:
  /// R_q, or R_a of a Gaussian surface.
  void read_roughness() {
    if (reader_.has("average_roughness")) {
      spec_.roughness = std::sqrt(0.5 * std::numbers::pi) * reader_.get("average_roughness", 0.0);
    } else {
      reader_.read("roughness", spec_.roughness);
    }
  }

  void read_wavelength() {
    const bool two = spec_.kind == FeatureKind::grid || spec_.kind == FeatureKind::map;
    // One length keeps a map's pixels square.
    const double second = spec_.heights ? static_cast<double>(spec_.heights->height()) / spec_.heights->width() : 1.0;
    const SceneJson* given = reader_.raw("wavelength");
    if (reader_.has("count")) {
      const int count = reader_.get("count", 1);
      const double length = around_ * std::abs(std::cos(spec_.direction)) / count;
      spec_.wavelength = Vec2(length, two ? second * length : 0.0);
      reader_.canonical().erase("count");
    } else if (given == nullptr && !(sidecar_size_.x() > 0.0)) {
      reader_.fail(
          "wavelength", "is missing",
          fmt::format("{} above 0 ({}){}", two ? "one length or two" : "a length", accepted_units(Dimension::length),
                      around_ > 0.0 ? ", or \"count\", how often it fits around" : ""));
    } else if (given == nullptr) {
      spec_.wavelength = sidecar_size_;
    } else if (!two || !given->is_array()) {
      const double length = reader_.get("wavelength", 0.0);
      spec_.wavelength = Vec2(length, two ? second * length : 0.0);
    } else {
      reader_.read("wavelength", spec_.wavelength);
    }
    if (two) {
      reader_.write("wavelength", spec_.wavelength);
    } else {
      reader_.write("wavelength", spec_.wavelength.x());
    }
  }

  Status read_heights() {
    HeightSourceReader source(reader_, context_, "height_map", "feature", 0.0);
    ASPERITY_CHECK(source.read_source());
    ASPERITY_CHECK(source.read_scale(1.0));
    const auto filter = reader_.get<Reconstruction>("filter");
    ASPERITY_CHECK(reader_.status());
    ASPERITY_TRY(HeightMap heights, source.build(Wrap::repeat, filter));
    if (source.sidecar()) sidecar_size_ = source.tile();
    spec_.heights = std::make_shared<const HeightMap>(std::move(heights));
    return success();
  }

  ObjectReader reader_;
  double around_ = 0.0;
  SceneContext& context_;
  FeatureSpec spec_;
  Vec2 sidecar_size_ = Vec2::Zero();  ///< m, of one repeat as measured; 0: not known
};

class TextureReader {
 public:
  TextureReader(ObjectReader& surface, const TextureHost& host, const Law& law, SceneContext& context)
      : reader_(*surface.raw("texture"), surface.place_of("texture"), "texture"),
        coated_(surface.has("coat")),
        host_(host),
        law_(law),
        context_(context),
        scales_(feature_scales(context.device.position_resolution)) {}

  Result<TexturePart> read() {
    ASPERITY_CHECK(reader_.status());
    part_.given = true;
    ASPERITY_TRY(ScenePart<FeatureMapping> mapping,
                 MappingReader(reader_.raw("mapping"), reader_.place_of("mapping"), host_).read());
    part_.fine.mapping = std::move(mapping.value);
    reader_.write("mapping", std::move(mapping.canonical));
    reader_.read_all(part_.fine);
    if (part_.fine.source == TextureSource::coat) {
      check_coat();
    } else {
      as_ = reader_.get<std::optional<FeatureScale>>("as");
      ASPERITY_CHECK(read_features());
      note_seam();
    }
    ASPERITY_CHECK(reader_.status());
    return std::move(part_);
  }

  [[nodiscard]] ObjectReader& reader() { return reader_; }

 private:
  void check_coat() {
    if (!coated_ || host_.mesh == nullptr) {
      reader_.fail("source", "is \"coat\", and the surface has none", "\"features\", or a mesh with a coat",
                   ErrorCode::unsupported_pair);
    } else if (!law_.feels_mesh_alone()) {
      // It would be felt twice (formulation, amendment 8).
      reader_.fail("source", fmt::format("is \"coat\", whose relief the law \"{}\" feels already", law_name(law_)),
                   "\"features\", or the law \"god-object\", which feels the bare mesh", ErrorCode::unsupported_pair);
    }
  }

  Status read_features() {
    const SceneJson* features = reader_.raw("features");
    if (features == nullptr) return success();
    const bool one = features->is_object();
    SceneJson canonical = SceneJson::array();
    for (std::size_t i = 0; i < (one ? 1 : features->size()); ++i) {
      const std::string place = one ? reader_.place_of("features") : reader_.place_of("features", i);
      ASPERITY_CHECK(read_feature(one ? *features : (*features)[i], place, canonical.emplace_back()));
    }
    reader_.write("features", std::move(canonical));
    return success();
  }

  /// Length along u after which the mapping comes back, 0 where it does not.
  [[nodiscard]] double around() const {
    const ParametricSurface* surface = host_.parametric;
    const FeatureMappingSettings& mapping = part_.fine.mapping.settings();
    if (mapping.surface != IntermediateSurface::uv) return part_.fine.mapping.circumference();
    if (surface == nullptr || !surface->closed_u()) return 0.0;
    return mapping.tile.x() * (surface->upper().x() - surface->lower().x());
  }

  /// A closed surface's parameters come back as a cylinder's angle does.
  [[nodiscard]] Status check_closed(const SurfaceFeature& feature) const {
    const auto closes = [](const SurfaceFeature& laid, double length) -> Status {
      FeatureMappingSettings round;
      round.surface = IntermediateSurface::cylinder;
      round.radius = length / (2.0 * pi);
      ASPERITY_TRY(const FeatureMapping cylinder, FeatureMapping::build(round));
      return cylinder.check(laid);
    };
    const ParametricSurface* surface = host_.parametric;
    const FeatureMappingSettings& mapping = part_.fine.mapping.settings();
    if (surface == nullptr || mapping.surface != IntermediateSurface::uv) return success();
    const Vec2 lengths = mapping.tile.cwiseProduct(surface->upper() - surface->lower());
    if (surface->closed_u()) ASPERITY_CHECK(closes(feature, lengths.x()));
    if (!surface->closed_v()) return success();
    FeatureSpec turned = feature.spec();
    turned.direction -= 0.5 * pi;
    std::swap(turned.period.x(), turned.period.y());
    ASPERITY_TRY(const SurfaceFeature laid, SurfaceFeature::build(turned));
    return closes(laid, lengths.y());
  }

  Status read_feature(const SceneJson& json, const std::string& place, SceneJson& canonical) {
    FeatureReader one(json, place, around(), context_);
    ASPERITY_TRY(SurfaceFeature feature, one.read());
    const std::optional<FeatureScale> as = one.reader().get("as", as_);
    ASPERITY_CHECK(one.reader().status());
    ASPERITY_CHECK(one.placed(part_.fine.mapping.check(feature)));
    ASPERITY_CHECK(one.placed(check_closed(feature)));
    canonical = std::move(one.reader().canonical());
    const FeatureScale own = scale_of(feature.wavelength(), scales_);
    const FeatureScale scale = as.value_or(own);
    note_scale(feature, own, scale);
    if (scale == FeatureScale::shape) ASPERITY_CHECK(check_geometry(feature, place));
    (scale == FeatureScale::friction  ? part_.fine.micro
     : scale == FeatureScale::texture ? part_.fine.texture
                                      : part_.geometry)
        .push_back(std::move(feature));
    return success();
  }

  void note_scale(const SurfaceFeature& feature, FeatureScale own, FeatureScale scale) {
    const std::string below = format_length(scales_.friction_below);
    const std::string from = format_length(scales_.shape_from);
    const std::string why = own == FeatureScale::friction  ? fmt::format("finer than {} is friction", below)
                            : own == FeatureScale::texture ? fmt::format("{} to {} is texture", below, from)
                                                           : fmt::format("{} and more is shape", from);
    context_.note(fmt::format("surface \"{}\": {} of {} is felt as {}{} ({})", host_.name,
                              feature_name(feature.spec().kind), format_length(feature.wavelength()), scale_name(scale),
                              own == scale ? "" : ", as the scene asks", why));
  }

  /// What is wrapped over a range need not close: says where it steps, and by how much.
  void note_seam() {
    const FeatureMapping& mapping = part_.fine.mapping;
    if (!mapping.settings().range) return;
    constexpr int places = 1024;
    const FeatureMapping::Seam seam = mapping.seam();
    const double reach = host_.bounds.extent().norm();
    double step = 0.0;
    for (int i = 0; i <= places; ++i) {
      const double v = reach * (static_cast<double>(i) / places - 0.5);
      double here = 0.0;
      for (const auto* features : {&part_.fine.texture, &part_.geometry}) {
        for (const SurfaceFeature& feature : *features)
          here += feature.sample(Vec2(seam.last, v)).height - feature.sample(Vec2(seam.first, v)).height;
      }
      step = std::max(step, std::abs(here));
    }
    constexpr double nothing = 1e-9;  // m
    if (step < nothing) return;
    constexpr double degree = pi / 180.0;
    context_.note(fmt::format(
        "surface \"{}\": features wrapped over a range have a seam {:.4g} deg from the reference: what lies there is "
        "felt as a step of up to {}",
        host_.name, seam.angle / degree, format_length(step)));
  }

  [[nodiscard]] Status check_geometry(const SurfaceFeature& feature, const std::string& place) const {
    const IntermediateSurface mapping = part_.fine.mapping.settings().surface;
    const auto not_geometry = [&](std::string why, std::string accepted) {
      return refused(ErrorCode::unsupported_pair,
                     fmt::format("{} of {} would be geometry, {}", feature_name(feature.spec().kind),
                                 format_length(feature.wavelength()), why),
                     place, fmt::format("\"as\": \"texture\", {}", accepted));
    };
    if (!host_.rigid.empty())
      return not_geometry(fmt::format("and this is {}", host_.rigid),
                          "or a mesh without a coat, or a parametric surface");
    if (host_.parametric != nullptr && mapping != IntermediateSurface::uv)
      return not_geometry("which lies in the parameters of this surface", "or the mapping \"uv\"");
    if (host_.parametric != nullptr) return success();
    if (mapping == IntermediateSurface::box)
      return not_geometry("and a box's six planes make no one map", "or another mapping");
    if (law_.feels_mesh_alone())
      return not_geometry(fmt::format("which the law \"{}\" does not feel", law_name(law_)), "or the law \"proxy\"");
    return success();
  }

  ObjectReader reader_;
  bool coated_ = false;
  const TextureHost& host_;
  const Law& law_;
  SceneContext& context_;
  FeatureScales scales_;
  std::optional<FeatureScale> as_;  ///< nothing: by wavelength
  TexturePart part_;
};

}  // namespace

Result<TexturePart> read_texture(ObjectReader& surface, const TextureHost& host, const Law& law,
                                 SceneContext& context) {
  if (!surface.has("texture")) {
    TexturePart part;
    ASPERITY_TRY(ScenePart<FeatureMapping> mapping,
                 MappingReader(nullptr, surface.place_of("texture.mapping"), host).read());
    part.fine.mapping = std::move(mapping.value);
    return part;
  }
  TextureReader reader(surface, host, law, context);
  ASPERITY_TRY(TexturePart part, reader.read());
  surface.take("texture", std::move(reader.reader()));
  ASPERITY_CHECK(surface.status());
  return part;
}

Status attach_fine(const ObjectReader& surface, TexturePart texture, const FinePart& material,
                   const SceneContext& context, Instance& instance) {
  FineSettings& fine = texture.fine;
  const bool shapes_friction = material.lay_given || material.friction_map.factors != nullptr;
  const bool felt = fine.source == TextureSource::coat || !fine.texture.empty() || !fine.micro.empty();
  if (texture.given && !felt && !shapes_friction && texture.geometry.empty()) {
    return bad_value("has no features", surface.place_of("texture.features"),
                     "a feature or an array of them (without them, a lay or a friction map of the material)");
  }
  if (!felt && !shapes_friction) return success();
  const bool replaced = base_of(instance.surface) != nullptr && !texture.geometry.empty() &&
                        fine.mapping.settings().surface == IntermediateSurface::uv;
  if (replaced) {
    return refused(
        ErrorCode::unsupported_pair, "is \"uv\", and features that become geometry take the mesh's texture coordinates",
        surface.place_of("texture.mapping.surface"), "\"plane\", \"cylinder\" or \"sphere\", or features of one kind");
  }
  fine.lay = material.lay;
  fine.friction_map = material.friction_map;
  fine.resolution = context.device.position_resolution;
  ASPERITY_TRY(FineFeatures built, at_place(FineFeatures::build(std::move(fine)), surface.place_of("texture")));
  instance.fine = std::make_shared<const FineFeatures>(std::move(built));
  return success();
}

void note_rendering(const Instance& instance, const StrokePath& path, double speed, double rate,
                    SceneContext& context) {
  if (instance.fine == nullptr || instance.fine->settings().texture.empty()) return;
  const FineSettings& fine = instance.fine->settings();
  for (const SurfaceFeature& feature : fine.texture) {
    const WaveRange waves = waves_along(instance, feature, path);
    if (!waves.changes) {
      context.note(fmt::format(
          "surface \"{}\": {} of {} does not change along the surface under the stroke, as the mapping \"{}\" lays it "
          "there: no texture is felt of it (another axis, direction or mapping lays it along the surface)",
          instance.name, feature_name(feature.spec().kind), format_length(feature.wavelength()),
          to_string(fine.mapping.settings().surface)));
      continue;
    }
    const double share = texture_share(waves.shortest, speed, Seconds(1.0 / rate), fine.resolution);
    const std::string size = waves.longest < 1.01 * waves.shortest
                                 ? format_length(waves.shortest)
                                 : fmt::format("{} to {}", format_length(waves.shortest), format_length(waves.longest));
    const std::string levels =
        fine.resolution > 0.0
            ? fmt::format("{:.4g} levels of {}", waves.shortest / fine.resolution, format_length(fine.resolution))
            : std::string("as many levels as wanted");
    context.note(fmt::format("surface \"{}\": {} of {} under the stroke: {} and {:.4g} samples of the shortest wave{}",
                             instance.name, feature_name(feature.spec().kind), size, levels,
                             waves.shortest * rate / speed,
                             share < 1.0 ? fmt::format(", where it is faded to {:.0f} %", 100.0 * share) : ""));
  }
}

}  // namespace asperity
