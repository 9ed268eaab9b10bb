#include <memory>
#include <utility>
#include <vector>

#include "asperity/surface/custom/surface.h"
#include "asperity/surface/parametric/surface.h"
#include "bench/rows.h"
#include "bench/slide.h"

namespace asperity::bench {

namespace {

/// The sphere as a program of one's own would write it.
struct OwnSphere {
  [[nodiscard]] FieldSample eval(const Vec3& p) const noexcept {
    FieldSample sample;
    const double length = p.norm();
    sample.value = length - sphere_radius;
    if (length > 0.0) sample.gradient = p / length;
    return sample;
  }
  [[nodiscard]] Box bounds() const { return {Vec3::Constant(-sphere_radius), Vec3::Constant(sphere_radius)}; }
};

/// One that also says how much it bends.
struct OwnSmoothSphere : OwnSphere {
  [[nodiscard]] double bend() const { return 1.0 / sphere_radius; }
  [[nodiscard]] double grain() const { return sphere_radius; }
};

Result<Row> formula_row(const std::string& name, const Surface& surface, const std::shared_ptr<const Slide>& slide,
                        double friction) {
  Instance sphere;
  sphere.name = "sphere";
  sphere.surface = surface;
  sphere.sides = Sides::front;
  sphere.material.static_friction = 1.5 * friction;
  sphere.material.dynamic_friction = friction;
  return sliding_row(name, {sphere}, slide);
}

}  // namespace

Result<Group> measure_formula(const Effort& effort, double clock_cost) {
  Group group;
  group.kind = "formula";
  ParametricSettings settings;
  settings.shape = ParametricShape::sphere;
  settings.radius = sphere_radius;
  ASPERITY_TRY(ParametricSurface parametric, ParametricSurface::build(settings));
  ASPERITY_TRY(CustomSurface plain, CustomSurface::build(OwnSphere{}));
  ASPERITY_TRY(CustomSurface smooth, CustomSurface::build(OwnSmoothSphere{}));
  const std::vector<std::pair<std::string, Surface>> surfaces = {
      {"parametric sphere", std::make_shared<const ParametricSurface>(std::move(parametric))},
      {"a program's own, value and gradient", std::make_shared<const CustomSurface>(std::move(plain))},
      {"a program's own, and its bend", std::make_shared<const CustomSurface>(std::move(smooth))}};
  Slide path;
  path.direction = wandering_directions(effort.ticks());
  path.surface.assign(path.direction.size(), sphere_radius);
  const auto slide = std::make_shared<const Slide>(std::move(path));
  std::vector<Row> rows;
  for (const auto& [name, surface] : surfaces) {
    for (const double friction : {0.0, 0.2}) {
      ASPERITY_TRY(Row row, formula_row(friction > 0.0 ? name + ", friction" : name, surface, slide, friction));
      rows.push_back(std::move(row));
    }
  }
  group.rows = measure(rows, effort, clock_cost);
  return group;
}

}  // namespace asperity::bench
