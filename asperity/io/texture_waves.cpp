#include "asperity/io/texture_waves.h"

#include <algorithm>
#include <cmath>

#include "asperity/surface/tangents.h"

namespace asperity {
namespace {

constexpr std::size_t most_places = 256;
constexpr double level = 1e-6;  // m/m: features that run less far along the surface do not change on it

/// Length of feature coordinate that is passed on a metre of the surface, where it is most.
double steepness(const SurfaceFeature& feature, const MappedPlace& place, const Vec3& normal) {
  const Vec3 du = surface_gradient(place.du, normal);
  const Vec3 dv = surface_gradient(place.dv, normal);
  switch (feature.spec().kind) {
    case FeatureKind::grating:
    case FeatureKind::triangular:
    case FeatureKind::serrated: {
      const double direction = feature.spec().direction;
      return (std::cos(direction) * du + std::sin(direction) * dv).norm();
    }
    default: return std::max(du.norm(), dv.norm());
  }
}

class Places {
 public:
  explicit Places(const Instance& instance)
      : instance_(instance), mapping_(instance.fine->settings().mapping), mesh_(base_of(instance.surface)) {}

  [[nodiscard]] bool by_coordinates() const { return mapping_.settings().surface == IntermediateSurface::uv; }
  /// The mesh whose texture coordinates are the mapping, or nullptr.
  [[nodiscard]] const MeshSurface* coordinates() const {
    const bool has = by_coordinates() && parametric_of(instance_.surface) == nullptr && mesh_ != nullptr;
    return has && mesh_->mesh().has_uvs() ? mesh_ : nullptr;
  }

  /// Where a point of the stroke lies in the plane of the features. Object frame.
  const MappedPlaces& at(const Vec3& point) {
    places_.clear();
    if (!by_coordinates()) {
      mapping_.map(point, places_);
    } else if (const ParametricSurface* surface = parametric_of(instance_.surface)) {
      const Foot foot = surface->view().nearest(point, infinity);
      if (!foot.found()) return places_;
      const ParametricJet jet = surface->jet(foot.at.head<2>());
      MappedPlace place;
      parameter_gradients(jet.u, jet.v, place.du, place.dv);
      place.du *= mapping_.settings().tile.x();
      place.dv *= mapping_.settings().tile.y();
      places_.push_back(place);
    } else if (const MeshSurface* mesh = coordinates()) {
      const Foot foot = mesh->view(cache_).nearest(point, infinity);
      if (foot.found()) places_.push_back(mapping_.on_mesh(mesh->mesh(), foot.element, point));
    }
    return places_;
  }

 private:
  const Instance& instance_;
  const FeatureMapping& mapping_;
  const MeshSurface* mesh_;
  SurfaceCache cache_;
  MappedPlaces places_;
};

}  // namespace

WaveRange waves_along(const Instance& instance, const SurfaceFeature& feature, const StrokePath& path) {
  const double nominal = feature.wavelength();
  Places places(instance);
  double least = infinity;
  double most = 0.0;
  std::size_t looked_at = 0;
  const auto look = [&](const MappedPlace& place, const Vec3& normal) {
    ++looked_at;
    const double steep = steepness(feature, place, normal);
    if (!(steep > level)) return;
    least = std::min(least, steep);
    most = std::max(most, steep);
  };
  if (!path.recorded()) {
    const std::size_t step = std::max<std::size_t>(1, path.points().size() / most_places);
    for (std::size_t i = 0; i < path.points().size(); i += step) {
      const Vec3 normal = instance.world_from_object.rotate_inverse(path.normals()[i]);
      for (const MappedPlace& place : places.at(instance.world_from_object.apply_inverse(path.points()[i])))
        look(place, normal);
    }
  } else if (const MeshSurface* surface = places.coordinates()) {
    const TriangleMesh& mesh = surface->mesh();
    const std::size_t faces = mesh.triangles().size();
    const std::size_t step = std::max<std::size_t>(1, faces / most_places);
    for (std::size_t face = 0; face < faces; face += step) {
      const auto index = static_cast<std::uint32_t>(face);
      const Vec3 point = mesh.corners(index)[0];
      look(instance.fine->settings().mapping.on_mesh(mesh, index, point), mesh.face_normal(index));
    }
  }
  if (looked_at == 0) return {nominal, nominal, true};
  if (!(most > 0.0)) return {0.0, 0.0, false};
  return {nominal / most, nominal / least, true};
}

}  // namespace asperity
