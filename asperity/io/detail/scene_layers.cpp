// What a coat has beside its heights: levels of detail, further layers, maps of the material.

#include "asperity/io/detail/scene_layers.h"

#include <fmt/format.h>

#include "asperity/io/detail/scene_heights.h"
#include "asperity/io/image_io.h"

namespace asperity {
namespace {

constexpr double fastest = 100.0;       // m/s
constexpr double most_frequency = 1e4;  // Hz: beyond any device's rate
constexpr double most_factor = 1e3;

/// Reads a solid's numbers; every one that the kind does not take is refused by name.
Result<CoatLayer> read_solid(ObjectReader& reader) {
  reader.refuse({"height_map", "channel", "height", "height_range", "offset", "white_is", "repeat", "tile", "filter"},
                "by a solid");
  SolidSpec spec;
  spec.kind = reader.choice("solid", SolidKind::noise);
  const bool noise = spec.kind == SolidKind::noise;
  const bool round = spec.kind == SolidKind::rings || spec.kind == SolidKind::pulse;
  const bool directed = spec.kind == SolidKind::waves;
  const char* by = "by this solid";
  if (!noise) reader.refuse({"drift", "octaves", "persistence", "seed"}, by);
  if (noise) reader.refuse({"frequency"}, by);
  if (noise || spec.kind == SolidKind::pulse) reader.refuse({"phase"}, by);
  if (!round) reader.refuse({"centre"}, by);
  if (!directed) reader.refuse({"direction"}, by);
  spec.amplitude = reader.quantity("amplitude", Dimension::length, spec.amplitude, Range::positive());
  spec.wavelength = reader.quantity("wavelength", Dimension::length, spec.wavelength, Range::positive());
  if (directed) spec.direction = reader.direction("direction", spec.direction);
  if (round) spec.centre = reader.lengths("centre", spec.centre);
  if (!noise) {
    if (spec.kind != SolidKind::pulse) spec.phase = reader.quantity("phase", Dimension::angle, 0.0);
    spec.frequency = reader.quantity("frequency", Dimension::frequency, 0.0, Range{0.0, most_frequency});
  } else {
    spec.drift = reader.vector("drift", Dimension::speed, spec.drift, fastest);
    spec.octaves = reader.integer("octaves", spec.octaves, 1, 8);
    spec.persistence = reader.number("persistence", spec.persistence, Range{0.0, 1.0});
    spec.seed = reader.seed("seed", spec.seed);
  }
  ASPERITY_CHECK(reader.status());
  ASPERITY_TRY(SolidMesostructure solid, at_place(SolidMesostructure::build(spec), reader.place()));
  CoatLayer layer;
  layer.solid = std::make_shared<const SolidMesostructure>(std::move(solid));
  return layer;
}

/// Reads a layer that is a map, laid as the coat is.
Result<CoatLayer> read_map(ObjectReader& reader, const LayerHost& host, SceneContext& context) {
  HeightSourceReader source(reader, context, "height_map", "layer", host.mean_edge);
  ASPERITY_CHECK(source.read_source());
  ASPERITY_CHECK(source.read_scale(1.0));
  const auto filter = reader.choice("filter", Reconstruction::quadratic_bspline);
  CoatLayer layer;
  Vec2 tile = host.tile;
  if (host.triplanar) {
    reader.refuse({"repeat"}, "by the triplanar mapping (\"tile\" is the size of one repeat)");
    tile = reader.pair("tile", Dimension::length, source.sidecar() ? source.tile() : tile, Range::positive());
  } else {
    reader.refuse({"tile"}, "by this mapping (\"repeat\" says how often the map fits into one of the coat's)");
    const double repeat = reader.number("repeat", 1.0, Range::positive());
    layer.repeat = Vec2(repeat, repeat);
    tile = host.tile / repeat;
  }
  ASPERITY_CHECK(reader.status());
  ASPERITY_TRY(HeightMap heights, source.build(host.wrap, filter));
  ASPERITY_TRY(Mesostructure maps, Mesostructure::build(std::move(heights), tile));
  if (host.detail) {
    ASPERITY_TRY(maps, with_detail(std::move(maps), *host.detail, reader.place()));
  }
  layer.maps = std::make_shared<const Mesostructure>(std::move(maps));
  return layer;
}

/// Values over the surface, from black to white.
Result<std::shared_ptr<const HeightMap>> read_values(const SceneJson& json, const std::string& place,
                                                     MaterialChannel channel, const LayerHost& host,
                                                     SceneContext& context, SceneJson& canonical) {
  ObjectReader reader(json, place, "material map");
  ASPERITY_CHECK(reader.status());
  HeightSourceReader source(reader, context, "image", to_string(channel), 0.0);
  ASPERITY_CHECK(source.read_source());
  const auto value = [&](const char* key) {
    const Range range = channel == MaterialChannel::stiffness ? Range::positive() : Range::not_negative();
    reader.require(key, "what black (low) and white (high) stand for");
    switch (channel) {
      case MaterialChannel::stiffness:
      case MaterialChannel::magnetism: return reader.quantity(key, Dimension::stiffness, 1.0, range);
      case MaterialChannel::damping:
      case MaterialChannel::viscosity: return reader.quantity(key, Dimension::damping, 1.0, range);
      case MaterialChannel::stickiness: return reader.quantity(key, Dimension::force, 1.0, range);
      case MaterialChannel::friction: break;
    }
    return reader.number(key, 1.0, Range{0.0, most_factor});
  };
  const double low = value("low");
  const double high = value("high");
  ASPERITY_CHECK(reader.status());
  // Nothing between two texels may lie outside them.
  ASPERITY_TRY(HeightMap values, source.build_between(low, high, host.wrap, Reconstruction::bilinear));
  canonical = std::move(reader.canonical());
  return std::make_shared<const HeightMap>(std::move(values));
}

/// Directions of least friction: red along s, green along t, half grey none.
Status read_lay_map(const SceneJson& json, const std::string& place, const LayerHost& host, SceneContext& context,
                    MaterialMaps::Parts& parts, SceneJson& canonical) {
  ObjectReader reader(json, place, "lay map");
  const std::string name =
      reader.required_text("image", "an image file whose red and green are the direction, 0.5 none");
  ASPERITY_CHECK(reader.status());
  const std::filesystem::path path = context.resolve(name);
  reader.write("image", path.string());
  ASPERITY_TRY(const Image image, in_file(read_image(path), path.string()));
  const HeightMapSettings settings{2.0, -1.0, false, host.wrap, Reconstruction::bilinear};
  for (const Channel channel : {Channel::red, Channel::green}) {
    ASPERITY_TRY(HeightMap component,
                 at_place(in_file(HeightMap::build(image, channel, settings), path.string()), place));
    auto& into = channel == Channel::red ? parts.lay_s : parts.lay_t;
    into = std::make_shared<const HeightMap>(std::move(component));
  }
  canonical = std::move(reader.canonical());
  return success();
}

}  // namespace

Result<Mesostructure> with_detail(Mesostructure maps, const DetailSettings& detail, const std::string& place) {
  ASPERITY_TRY(DetailPyramid pyramid, at_place(DetailPyramid::build(maps.heights(), maps.tile(), detail), place));
  return maps.with_detail(std::make_shared<const DetailPyramid>(std::move(pyramid)));
}

Result<std::optional<DetailSettings>> read_detail(ObjectReader& coat) {
  const SceneJson* json = coat.raw("detail");
  if (json == nullptr) return std::optional<DetailSettings>{};
  const SceneJson wrapped = json->is_string() ? SceneJson{{"kind", *json}} : *json;
  ObjectReader reader(wrapped, coat.place_of("detail"), "detail");
  DetailSettings detail;
  detail.kind = reader.choice("kind", DetailKind::low_pass);
  detail.finest = reader.quantity("finest", Dimension::length, 0.0, Range::not_negative());
  detail.levels = reader.integer("levels", 0, 0, DetailPyramid::most_levels);
  ASPERITY_CHECK(reader.status());
  coat.take("detail", std::move(reader));
  return std::optional<DetailSettings>(detail);
}

Result<std::vector<CoatLayer>> read_layers(ObjectReader& coat, const LayerHost& host, SceneContext& context) {
  std::vector<CoatLayer> layers;
  const SceneJson* json = coat.raw("layers");
  if (json == nullptr) return layers;
  if (!json->is_array() || json->size() > Coat::most_layers) {
    coat.fail_type("layers", *json, fmt::format("an array of at most {} maps and solids", Coat::most_layers));
    return *coat.error();
  }
  SceneJson canonical = SceneJson::array();
  for (std::size_t i = 0; i < json->size(); ++i) {
    ObjectReader reader((*json)[i], coat.place_of("layers", i), "layer");
    ASPERITY_CHECK(reader.status());
    const bool solid = reader.has("solid");
    if (!solid) {
      reader.refuse({"amplitude", "wavelength", "direction", "centre", "phase", "frequency", "drift", "octaves",
                     "persistence", "seed"},
                    fmt::format("by a map (\"solid\" names one of {})", name_list<SolidKind>()));
      ASPERITY_CHECK(reader.status());
    }
    ASPERITY_TRY(CoatLayer layer, solid ? read_solid(reader) : read_map(reader, host, context));
    ASPERITY_CHECK(reader.status());
    layers.push_back(std::move(layer));
    canonical.push_back(std::move(reader.canonical()));
  }
  coat.write("layers", std::move(canonical));
  return layers;
}

Result<std::shared_ptr<const MaterialMaps>> read_material_maps(ObjectReader& coat, const LayerHost& host,
                                                               SceneContext& context) {
  const SceneJson* json = coat.raw("maps");
  if (json == nullptr) return std::shared_ptr<const MaterialMaps>();
  ObjectReader reader(*json, coat.place_of("maps"), "material maps");
  ASPERITY_CHECK(reader.status());
  MaterialMaps::Parts parts;
  for (std::size_t c = 0; c < mapped_channels; ++c) {
    const auto channel = static_cast<MaterialChannel>(c);
    const SceneJson* map = reader.raw(to_string(channel));
    if (map == nullptr) continue;
    SceneJson canonical;
    ASPERITY_TRY(parts.channels[c],
                 read_values(*map, reader.place_of(to_string(channel)), channel, host, context, canonical));
    reader.write(to_string(channel), std::move(canonical));
  }
  if (const SceneJson* lay = reader.raw("lay")) {
    SceneJson canonical;
    ASPERITY_CHECK(read_lay_map(*lay, reader.place_of("lay"), host, context, parts, canonical));
    reader.write("lay", std::move(canonical));
  }
  ASPERITY_TRY(MaterialMaps maps, at_place(MaterialMaps::build(std::move(parts)), reader.place()));
  coat.take("maps", std::move(reader));
  return std::make_shared<const MaterialMaps>(std::move(maps));
}

}  // namespace asperity
