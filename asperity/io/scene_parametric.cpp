// A surface given by a formula, in a scene file.

#include <fmt/format.h>

#include <algorithm>

#include "asperity/io/detail/scene_fine.h"

namespace asperity {
namespace {

/// Reads the members that the shape takes; others are refused by name.
Result<ParametricSettings> read_shape(ObjectReader& surface) {
  const SceneJson& json = *surface.raw("parametric");
  ObjectReader reader(json, surface.place_of("parametric"), "parametric");
  reader.require("shape", "a shape's name");
  ParametricSettings settings;
  settings.shape = reader.choice("shape", ParametricShape::plane);
  ASPERITY_CHECK(reader.status());
  const auto& taken = parametric_parameters(settings.shape);
  const auto takes = [&](const std::string& key) { return std::find(taken.begin(), taken.end(), key) != taken.end(); };
  reader.refuse_unless([&](const std::string& key) { return key == "shape" || takes(key); },
                       fmt::format("by the shape \"{}\"", parametric_name(settings.shape)));
  const auto length = [&](const char* key, double& value) {
    if (takes(key)) value = reader.quantity(key, Dimension::length, value, Range::positive());
  };
  length("width", settings.width);
  length("depth", settings.depth);
  length("radius", settings.radius);
  length("tube", settings.tube);
  length("height", settings.height);
  if (takes("neck")) settings.neck = reader.quantity("neck", Dimension::ratio, settings.neck, Range{0.05, 0.95});
  length("scale", settings.scale);
  surface.take("parametric", std::move(reader));
  ASPERITY_CHECK(surface.status());
  return settings;
}

}  // namespace

Status read_parametric(ObjectReader& surface, const Law& law, SceneContext& context, Instance& instance,
                       TexturePart& texture) {
  surface.refuse(
      {"mesh", "volume", "iso", "implicit", "units", "fit", "search", "coat", "on_overlap", "shell_directions"},
      "beside a parametric surface");
  ASPERITY_CHECK(surface.status());
  ASPERITY_TRY(ParametricSettings settings, read_shape(surface));
  instance.name = surface.text("name", parametric_name(settings.shape));
  ASPERITY_CHECK(surface.status());
  ASPERITY_TRY(ParametricSurface shape, at_place(ParametricSurface::build(settings), surface.place_of("parametric")));
  instance.sides = surface.choice_or_auto<Sides>("sides");
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
