#include "asperity/render/contact/fine.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "asperity/render/fine/texture.h"
#include "asperity/render/law_registry.h"
#include "asperity/surface/tangents.h"

namespace asperity {

namespace {

/// Where the contact lies in the plane of the features.
void place_contact(const Instance& instance, const Place& place, const Vec3& point, MappedPlaces& out) noexcept {
  const FeatureMapping& mapping = instance.fine->settings().mapping;
  if (mapping.settings().surface != IntermediateSurface::uv) {
    mapping.map(point, out);
    return;
  }
  if (const ParametricSurface* surface = parametric_of(instance.surface)) {
    const Vec2& tile = mapping.settings().tile;
    const Vec2 uv = place.at.head<2>();
    const ParametricJet jet = surface->jet(uv);
    MappedPlace mapped;
    mapped.uv = uv.cwiseProduct(tile);
    parameter_gradients(jet.u, jet.v, mapped.du, mapped.dv);
    mapped.du *= tile.x();
    mapped.dv *= tile.y();
    out.push_back(mapped);
    return;
  }
  const MeshSurface* mesh = base_of(instance.surface);
  if (mesh != nullptr && place.element < mesh->mesh().triangles().size())
    out.push_back(mapping.on_mesh(mesh->mesh(), place.element, point));
}

/// The gradient as the printed example takes it (erratum c), which needs a formula that gives the angle by the height:
/// triangles and voxels have none.
void as_printed(const Instance& instance, const Place& at, const Vec3& point, MappedPlaces& places) noexcept {
  const ParametricSurface* surface = parametric_of(instance.surface);
  if (surface == nullptr) return;
  const Vec3 normal = surface->normal(surface->jet(at.at.head<2>()));
  for (MappedPlace& place : places) instance.fine->settings().mapping.count_angle_twice(point, normal, place);
}

/// Height of a texture over its surface and the height's gradient in space.
struct TextureSample {
  double height = 0.0;           ///< m
  Vec3 gradient = Vec3::Zero();  ///< m/m
  bool faded = false;
};

/// How much of a feature is felt at a place whose coordinates have these gradients along the surface, at a `velocity`
/// along it.
double felt_share(const SurfaceFeature& feature, double steepness, const MappedPlace& place, const Vec3& normal,
                  const FineMotion& motion, double resolution) noexcept {
  constexpr double whole_from = 4.0;  // steps a wavelength, as texture_share has it
  const double wavelength = feature.wavelength();
  const Vec2 across = feature.across(place.uv);
  // How many metres of feature a metre of surface passes, and how many the probe passes in a second.
  double density = 0.0;
  double passed = 0.0;
  if (!across.isZero()) {
    const Vec3 wave = surface_gradient(across.x() * place.du + across.y() * place.dv, normal);
    density = wave.squaredNorm();
    passed = std::abs(motion.velocity.dot(wave));
  } else {
    const Vec3 du = surface_gradient(place.du, normal);
    const Vec3 dv = surface_gradient(place.dv, normal);
    density = std::max(du.squaredNorm(), dv.squaredNorm());
    passed = std::sqrt(density * surface_gradient(motion.velocity, normal).squaredNorm());
  }
  const double finest = whole_from * resolution;
  const bool renderable =
      wavelength >= whole_from * passed * motion.dt.count() && wavelength * wavelength >= finest * finest * density;
  constexpr double most_slope = FineFeatures::most_slope;
  const bool crowded = steepness * steepness * density > most_slope * most_slope;
  if (renderable && !crowded) return 1.0;
  const double root = std::sqrt(density);
  const double share = texture_share(wavelength / root, passed / root, motion.dt, resolution);
  return crowded ? share * most_slope / (steepness * root) : share;
}

TextureSample sample_features(const FineFeatures& fine, const MappedPlaces& places, const Vec3& normal,
                              const FineMotion& motion, double resolution) noexcept {
  TextureSample out;
  for (const MappedPlace& place : places) {
    double height = 0.0;
    Vec2 gradient = Vec2::Zero();
    const std::vector<SurfaceFeature>& features = fine.settings().texture;
    for (std::size_t i = 0; i < features.size(); ++i) {
      const SurfaceFeature& feature = features[i];
      const double share = felt_share(feature, fine.steepness(i), place, normal, motion, resolution);
      out.faded = out.faded || share < 1.0;
      if (share == 0.0) continue;
      const FeatureSample here = feature.sample(place.uv);
      height += share * here.height;
      gradient += share * here.gradient;
    }
    out.height += place.weight * height;
    out.gradient += place.weight * (gradient.x() * place.du + gradient.y() * place.dv) + height * place.dweight;
  }
  return out;
}

/// The coat of a mesh that is felt as its bare base: heights as they are blended over its edges, or the slope that its
/// normal map draws.
TextureSample sample_coat(const ReliefView& view, Formulation formulation, std::uint32_t element,
                          const Vec3& point) noexcept {
  const ReliefSurface& relief = view.surface();
  TextureSample out;
  const TriangleMesh& mesh = relief.base().mesh();
  if (element >= mesh.triangles().size()) return out;
  const BarycentricFrame frame = barycentric_frame(mesh, element);
  const Vec3 place = frame.coordinates(point);
  if (formulation == Formulation::literal) {
    const CoatSample coat = relief.coat_sample(element, place, view.moment());
    constexpr double least_rise = 0.1;  // a normal that lies flat has no slope
    const double rise = std::max(least_rise, coat.normal.dot(frame.normal));
    out.height = coat.height;
    out.gradient = -(coat.normal - coat.normal.dot(frame.normal) * frame.normal) / rise;
    return out;
  }
  const HeightJet jet = relief.height(view.frame(element), place[1], place[2]);
  out.height = jet.height;
  out.gradient = jet.u * frame.gradient[1] + jet.v * frame.gradient[2];
  return out;
}

/// A sheet's coat rises on its front: seen from behind it is a hollow.
bool from_behind(const ReliefSurface& relief, std::uint32_t element, const Vec3& normal) noexcept {
  const TriangleMesh& mesh = relief.base().mesh();
  return element < mesh.triangles().size() && normal.dot(mesh.face_normal(element)) < 0.0;
}

/// What a step of the probe makes of a step along the surface: below a convex surface the foot runs ahead.
Vec3 at_probe(const Vec3& gradient, const LawForce& law, double depth) noexcept {
  if (!law.bends) return gradient;
  const Mat3 shrink = Mat3::Identity() - depth * law.bend;
  constexpr double least = 0.05;  // nearer to the centre of the bend the foot means nothing
  return shrink.determinant() > least ? Vec3(shrink.inverse() * gradient) : gradient;
}

/// Eq. 12.
void add_printed_texture(const TextureSample& texture, LawForce& law) noexcept {
  law.texture = -law.push * texture.gradient;
  law.force += law.texture;
  law.height = texture.height;
}

/// Slope of k p^2 / 2 with p the penetration to the relief, whose crests lie on the surface. False: the relief is not
/// touched.
bool add_relief_texture(const TextureSample& texture, double highest, double stiffness, LawForce& law) noexcept {
  const double depth = law.push / stiffness;
  const double penetration = depth + std::min(0.0, texture.height - highest);
  law.height = texture.height - highest;
  if (!(penetration > 0.0)) return false;
  const double push = stiffness * penetration;
  const Vec3 slope = at_probe(surface_gradient(texture.gradient, law.normal), law, depth);
  const Vec3 relief = push * (law.normal - slope);
  law.spring += relief - law.push * law.normal;
  law.stiffness = stiffness * (1.0 + slope.squaredNorm());
  law.stored = 0.5 * stiffness * penetration * penetration;
  law.texture = relief - law.push * law.normal;
  law.force += law.texture;
  // Damping was measured against the constraint's whole push.
  const double along = law.force.dot(law.normal);
  if (along < 0.0) law.force -= along * law.normal;
  law.push = push;
  law.penetration = penetration;
  return true;
}

/// The relief whose coat says which way friction is least, or nullptr.
const ReliefSurface* lay_of(const Instance& instance) noexcept {
  const ReliefSurface* relief = relief_of(instance);
  const MaterialMaps* maps = relief != nullptr ? relief->coat().materials() : nullptr;
  return maps != nullptr && maps->has_lay() ? relief : nullptr;
}

/// Coefficients by direction of the features' lay at a place and by what interlocks there; answers the direction (u, v)
/// across which they are largest, zero where all are alike.
Vec2 shape_by_lay(const FineFeatures& fine, const Vec2& uv, FrictionCoefficients& coefficients) noexcept {
  const FrictionLay& ratios = fine.settings().lay;
  const Vec2 lay = fine.across(uv);
  coefficients.stiffness_ratio = ratios.stiffness_ratio;
  if (!fine.interlocks()) {
    const bool shaped = ratios.still_ratio < 1.0 || ratios.sliding_ratio < 1.0 || ratios.stiffness_ratio < 1.0;
    if (!shaped || lay.isZero()) return Vec2::Zero();
    coefficients.still_ratio = ratios.still_ratio;
    coefficients.sliding_ratio = ratios.sliding_ratio;
    return lay;
  }
  const LayMatrix added = fine.interlock(uv);
  const double still = coefficients.still;
  const double sliding = coefficients.sliding;
  const LayMatrix holds = LayMatrix::of(still, still * ratios.still_ratio, lay) + added;
  const LayMatrix slides = LayMatrix::of(sliding, sliding * ratios.sliding_ratio, lay) + added;
  Vec2 axis = slides.principal();
  if (axis.isZero()) axis = holds.principal();
  if (axis.isZero() && ratios.stiffness_ratio < 1.0) axis = lay;
  const Vec2 across = axis.isZero() ? Vec2(Vec2::UnitX()) : axis;
  const Vec2 aside(-across.y(), across.x());
  const auto ratio = [](double along, double most) { return most > 0.0 ? std::min(1.0, along / most) : 1.0; };
  coefficients.still = holds.along(across);
  coefficients.sliding = slides.along(across);
  coefficients.still_ratio = ratio(holds.along(aside), coefficients.still);
  coefficients.sliding_ratio = ratio(slides.along(aside), coefficients.sliding);
  return axis;
}

/// Coefficients of a place, and across which direction they are largest.
void shape_friction(const FineFeatures& fine, const MappedPlaces& places, const Vec3& normal, Vec3& last_across,
                    FrictionCoefficients& coefficients) noexcept {
  const FineSettings& settings = fine.settings();
  double factor = 1.0;
  if (settings.friction_map.factors != nullptr) {
    factor = 0.0;
    for (const MappedPlace& place : places) {
      const Vec2 st = place.uv.cwiseQuotient(settings.friction_map.tile);
      factor += place.weight * std::max(0.0, settings.friction_map.factors->height_at(st));
    }
  }
  const MappedPlace& place = places[0];
  coefficients.still *= factor;
  coefficients.sliding *= factor;
  const Vec2 axis = shape_by_lay(fine, place.uv, coefficients);
  // Where the lay is lost (the centre of circles, a cylinder's axis) it goes on as it was.
  Vec3 way = surface_gradient(axis.x() * place.du + axis.y() * place.dv, normal);
  double square = way.squaredNorm();
  const bool lost = !(square > 0.0);
  if (lost) {
    way = surface_gradient(last_across, normal);
    square = way.squaredNorm();
  }
  if (square > 0.0) {
    coefficients.across = (1.0 / std::sqrt(square)) * way;
    if (!lost) last_across = coefficients.across;
  } else {
    coefficients.still_ratio = coefficients.sliding_ratio = coefficients.stiffness_ratio = 1.0;
  }
  coefficients.formulation = settings.lay.formulation;
}

void add_friction(const Touched& touch, const Material& material, double stiffness, const MappedPlaces& places,
                  const FineMotion& motion, LawForce& law) noexcept {
  const Instance& instance = *touch.instance;
  OfLaw& held = touch.contact->law;
  FrictionContact contact;
  contact.normal = law.normal;
  contact.push = std::max(0.0, law.push);
  contact.motion = motion.moved;
  contact.velocity = motion.velocity;
  contact.stiffness = stiffness;
  contact.dt = motion.dt;
  FrictionCoefficients& coefficients = contact.coefficients;
  coefficients.still = std::max(material.static_friction, material.dynamic_friction);
  coefficients.sliding = material.dynamic_friction;
  if (const FineFeatures* fine = instance.fine.get(); fine != nullptr && fine->shapes_friction() && !places.empty())
    shape_friction(*fine, places, law.normal, held.across, coefficients);
  if (const ReliefSurface* relief = lay_of(instance)) {
    double strength = 0.0;
    const Vec3 along = mapped_lay(
        *relief, coat_place(relief->view(*touch.cache, touch.moment), touch.resting_place(), law.point), strength);
    const Vec3 across = law.normal.cross(along);
    const double length = across.norm();
    if (strength > 0.0 && length > 0.0) {
      coefficients.across = across / length;
      coefficients.still_ratio = coefficients.sliding_ratio = 1.0 - strength;
    }
  }
  const Vec3 force = friction_force(material.friction, contact, held.friction);
  law.held = friction_energy(held.friction);
  law.drawn = friction_spring(contact, held.friction);
  law.friction = force;
  law.force += force;
}

/// Whether there is any friction to be felt.
bool resists(const Instance& instance, const Material& material) noexcept {
  const FrictionLaw& law = material.friction;
  return material.static_friction > 0.0 || material.dynamic_friction > 0.0 || law.viscosity > 0.0 ||
         law.break_away > 0.0 || (instance.fine != nullptr && instance.fine->interlocks());
}

}  // namespace

bool proxy_holds_friction(const Instance& instance) noexcept {
  if (instance.law.facts().proxy != LawProxy::surface) return false;
  if (instance.fine != nullptr && (instance.fine->has_texture() || instance.fine->shapes_friction())) return false;
  if (lay_of(instance) != nullptr) return false;
  const FrictionLaw& law = instance.material.friction;
  return law.kind == FrictionKind::implicit_coulomb && law.stiffness == 0.0 && law.damping == 0.0 &&
         law.break_away == 0.0;
}

bool adds_friction(const Instance& instance) noexcept {
  if (instance.law.facts().proxy == LawProxy::surface) return !proxy_holds_friction(instance);
  return instance.material.friction_named || (instance.fine != nullptr && instance.fine->shapes_friction());
}

bool add_fine_forces(const Touched& touch, const Material& material, bool friction, double stiffness,
                     const FineMotion& motion, LawForce& law) noexcept {
  const Instance& instance = *touch.instance;
  OfLaw& held = touch.contact->law;
  if (!law.contact || !(law.push > 0.0)) {
    held.friction = {};
    return false;
  }
  MappedPlaces places;
  const FineFeatures* fine = instance.fine.get();
  bool faded = false;
  if (fine != nullptr) {
    const FineSettings& settings = fine->settings();
    const bool literal = settings.formulation == Formulation::literal;
    const bool from_coat = settings.source == TextureSource::coat;
    const Place place{law.element, false, touch.contact->first().at};
    if (!from_coat || fine->shapes_friction()) place_contact(instance, place, law.point, places);
    if (literal) as_printed(instance, place, law.point, places);
    if (fine->has_texture()) {
      const ReliefSurface* relief = relief_of(instance);
      TextureSample texture;
      double highest = fine->highest();
      if (from_coat && relief != nullptr) {
        texture = sample_coat(relief->view(*touch.cache, touch.moment), settings.formulation, law.element, law.point);
        highest = relief->coat().highest();
        if (from_behind(*relief, law.element, law.normal)) {
          texture = {-texture.height, -texture.gradient, texture.faded};
          highest = -relief->coat().lowest();
        }
      } else {
        texture = sample_features(*fine, places, law.normal, motion, settings.resolution);
      }
      faded = texture.faded;
      if (literal) {
        add_printed_texture(texture, law);
      } else if (!add_relief_texture(texture, highest, stiffness, law)) {
        // In a valley of the relief: nothing is touched.
        held.friction = {};
        law.contact = false;
        return faded;
      }
    }
  }
  if (friction && resists(instance, material)) add_friction(touch, material, stiffness, places, motion, law);
  return faded;
}

TextureShape texture_at(const Instance& instance, const Place& place, const Vec3& point, const Vec3& normal,
                        double resolution) noexcept {
  if (instance.fine == nullptr || !instance.fine->has_texture()) return {};
  const FineSettings& settings = instance.fine->settings();
  TextureSample texture;
  double highest = instance.fine->highest();
  const ReliefSurface* relief = relief_of(instance);
  if (settings.source == TextureSource::coat && relief != nullptr) {
    SurfaceCache own;
    texture = sample_coat(relief->view(own), settings.formulation, place.element, point);
    highest = relief->coat().highest();
    if (from_behind(*relief, place.element, normal)) {
      texture = {-texture.height, -texture.gradient, texture.faded};
      highest = -relief->coat().lowest();
    }
  } else {
    MappedPlaces places;
    place_contact(instance, place, point, places);
    texture = sample_features(*instance.fine, places, normal, {}, resolution);
  }
  if (settings.formulation == Formulation::literal) highest = 0.0;
  return {texture.height - highest, surface_gradient(texture.gradient, normal)};
}

Status check_fine(const Instance& instance, const std::string& place) {
  if (instance.fine == nullptr) return success();
  const FineSettings& fine = instance.fine->settings();
  const auto refuse = [&](std::string what, std::string accepted) {
    return refused(ErrorCode::unsupported_pair, std::move(what), place + ".texture", std::move(accepted));
  };
  if (fine.source == TextureSource::coat) {
    if (relief_of(instance) == nullptr)
      return refuse(fmt::format("takes its heights from a coat, and \"{}\" has none", instance.name),
                    "\"features\", or a coat on a mesh");
    if (!instance.law.feels_mesh_alone())
      return refuse(
          fmt::format("takes its heights from a coat, which the law \"{}\" feels already", law_name(instance.law)),
          "the law \"god-object\", which feels the bare mesh");
  }
  const bool mapped = !fine.texture.empty() || instance.fine->shapes_friction();
  if (mapped && fine.mapping.settings().surface == IntermediateSurface::uv &&
      parametric_of(instance.surface) == nullptr) {
    const MeshSurface* mesh = base_of(instance.surface);
    if (mesh == nullptr)
      return refuse(fmt::format("is mapped by texture coordinates, and \"{}\" has no mesh", instance.name),
                    "mapping by plane, cylinder, sphere or box");
    if (!mesh->mesh().has_uvs())
      return refuse(fmt::format("is mapped by texture coordinates, and the mesh of \"{}\" has none", instance.name),
                    "mapping by plane, cylinder, sphere or box, or a mesh with texture coordinates");
    const ImplicitSurface* implicit = implicit_of(instance.surface);
    if (implicit != nullptr && !implicit->grid().has_faces())
      return refuse(
          fmt::format("is mapped by texture coordinates, and the grid of \"{}\" knows no faces", instance.name),
          "mapping by plane, cylinder, sphere or box");
  }
  return success();
}

}  // namespace asperity
