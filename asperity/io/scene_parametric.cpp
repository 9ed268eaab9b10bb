// A surface given by a formula, in a scene file.

#include "asperity/io/detail/scene_fine.h"

namespace asperity {
namespace {

Result<ParametricSettings> read_shape(ObjectReader& surface) {
  ObjectReader reader(surface.raw("parametric"), surface.place_of("parametric"), "parametric");
  ParametricSettings settings;
  reader.read_all(settings);
  surface.take("parametric", std::move(reader));
  ASPERITY_CHECK(surface.status());
  return settings;
}

}  // namespace

Status read_parametric(ObjectReader& surface, const Law& law, SceneContext& context, Instance& instance,
                       TexturePart& texture) {
  ASPERITY_TRY(ParametricSettings settings, read_shape(surface));
  instance.name = surface.get<std::string>("name", parametric_name(settings.shape));
  ASPERITY_CHECK(surface.status());
  ASPERITY_TRY(ParametricSurface shape, at_place(ParametricSurface::build(settings), surface.place_of("parametric")));
  instance.sides = surface.get<std::optional<Sides>>("sides");
  TextureHost host;
  host.name = instance.name;
  host.bounds = shape.bounds();
  host.parametric = &shape;
  ASPERITY_TRY(texture, read_texture(surface, host, law, context));
  if (!texture.geometry.empty()) {
    settings.features = texture.geometry;
    settings.tile = texture.fine.mapping.settings().tile;
    // The error says "features" itself.
    ASPERITY_TRY(shape, at_place(ParametricSurface::build(settings), surface.place_of("texture")));
  }
  instance.surface = std::make_shared<const ParametricSurface>(std::move(shape));
  return surface.status();
}

}  // namespace asperity
