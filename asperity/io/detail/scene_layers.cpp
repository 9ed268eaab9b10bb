// What a coat has beside its heights: levels of detail, further layers, maps of the material.

#include "asperity/io/detail/scene_layers.h"

#include <fmt/format.h>

#include "asperity/io/detail/scene_heights.h"
#include "asperity/io/image_io.h"

namespace asperity {
namespace {

Result<CoatLayer> read_solid(ObjectReader& reader) {
  SolidSpec spec;
  reader.read_all(spec);
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
  const auto filter = reader.get<Reconstruction>("filter");
  CoatLayer layer;
  Vec2 tile = host.tile;
  if (host.triplanar) {
    reader.refuse({"repeat"}, "by the triplanar mapping (\"tile\" is the size of one repeat)");
    tile = reader.get("tile", source.sidecar() ? source.tile() : tile);
  } else {
    reader.refuse({"tile"}, "by this mapping (\"repeat\" says how often the map fits into one of the coat's)");
    const auto repeat = reader.get<double>("repeat");
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
                                                     MaterialChannel channel, const std::string& object,
                                                     const LayerHost& host, SceneContext& context,
                                                     SceneJson& canonical) {
  ObjectReader reader(json, place, object);
  ASPERITY_CHECK(reader.status());
  HeightSourceReader source(reader, context, "image", to_string(channel), 0.0);
  ASPERITY_CHECK(source.read_source());
  const double low = reader.get("low", 1.0);
  const double high = reader.get("high", 1.0);
  // Nothing between two texels may lie outside them.
  ASPERITY_TRY(HeightMap values, source.build_between(low, high, host.wrap, Reconstruction::bilinear));
  canonical = std::move(reader.canonical());
  return std::make_shared<const HeightMap>(std::move(values));
}

/// Directions of least friction: red along s, green along t, half grey none.
Status read_lay_map(const SceneJson& json, const std::string& place, const LayerHost& host, SceneContext& context,
                    MaterialMaps::Parts& parts, SceneJson& canonical) {
  ObjectReader reader(json, place, "lay map");
  ASPERITY_CHECK(reader.status());
  const std::filesystem::path path = context.resolve(reader.get("image", std::string()));
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
  reader.read_all(detail);
  ASPERITY_CHECK(reader.status());
  coat.take("detail", std::move(reader));
  return std::optional<DetailSettings>(detail);
}

Result<std::vector<CoatLayer>> read_layers(ObjectReader& coat, const LayerHost& host, SceneContext& context) {
  std::vector<CoatLayer> layers;
  const SceneJson* json = coat.raw("layers");
  if (json == nullptr) return layers;
  SceneJson canonical = SceneJson::array();
  for (std::size_t i = 0; i < json->size(); ++i) {
    ObjectReader reader((*json)[i], coat.place_of("layers", i), "layer");
    ASPERITY_CHECK(reader.status());
    ASPERITY_TRY(CoatLayer layer, reader.has("solid") ? read_solid(reader) : read_map(reader, host, context));
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
    const std::string& object = scene_object("material maps").row(to_string(channel), *json)->type.word;
    ASPERITY_TRY(parts.channels[c],
                 read_values(*map, reader.place_of(to_string(channel)), channel, object, host, context, canonical));
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
