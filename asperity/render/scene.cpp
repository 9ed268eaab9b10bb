#include "asperity/render/scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "asperity/core/identity.h"
#include "asperity/core/units.h"
#include "asperity/render/contact/fine.h"
#include "asperity/render/law_registry.h"
#include "asperity/render/local_material.h"
#include "asperity/surface/relief/mesh.h"

namespace asperity {

namespace {

/// The relief as a mesh, where the law feels that; the one that the instance brings if it was made from the same.
Status make_dense(Instance& instance, std::size_t index) {
  if (instance.law.facts().proxy != LawProxy::dense_mesh) {
    instance.dense.reset();
    return success();
  }
  const ReliefSurface& relief = **std::get_if<std::shared_ptr<const ReliefSurface>>(&instance.surface);
  const std::uint64_t identity = relief.identity();
  const int asked = instance.law.facets().subdivisions;
  const int subdivisions = asked > 0 ? asked : texel_subdivisions(relief);
  if (instance.dense != nullptr && instance.dense->relief == identity && instance.dense->subdivisions == subdivisions)
    return success();
  Result<TriangleMesh> mesh = tessellate(relief, subdivisions);
  if (!mesh) return std::move(mesh).error().at(fmt::format("surfaces[{}].law", index));
  instance.dense = std::make_shared<const DenseMesh>(
      DenseMesh{identity, subdivisions, MeshSurface(TriangleIndex::build(std::move(mesh).value()))});
  return success();
}

/// Whether the law's reach lies within the band that the potential is stored in.
Status check_potential(const Instance& instance, const std::string& place, const SceneSettings& settings) {
  const ImplicitSurface& surface = *implicit_of(instance.surface);
  const LawReach reach = instance.law.outside();
  // In the hand's lengths, as the law and the probe are.
  const double most = settings.view.zoom * (surface.reach_outside() - surface.offset());
  if (reach.distance + settings.probe_radius <= most) return success();
  const bool of_law = reach.distance > most;
  return bad_value(fmt::format("is {}, and \"{}\" stores its potential up to {} outside",
                               format_length(of_law ? reach.distance : settings.probe_radius), instance.name,
                               format_length(surface.grid().outside())),
                   of_law ? fmt::format("{}.law.{}", place, reach.option) : std::string("probe.radius"),
                   fmt::format("at most {}, or a wider implicit.band_outside",
                               format_length(std::max(0.0, of_law ? most : most - reach.distance))));
}

/// What a law needs that the surface has not; nothing where it has all.
std::string lacking(const Law& law, const Instance& instance) {
  const bool volume = iso_of(instance.surface) != nullptr;
  const bool triangles = !volume && base_of(instance.surface) != nullptr;
  const bool relief = relief_of(instance) != nullptr;
  switch (law.facts().needs) {
    case LawNeeds::triangles:
      if (!triangles) return "triangles";
      break;
    case LawNeeds::coat:
      if (!relief) return "a coat";
      break;
    case LawNeeds::field:
      if (!volume) return "a volume";
      break;
    case LawNeeds::potential:
      if (implicit_of(instance.surface) == nullptr) return "an implicit surface";
      break;
    case LawNeeds::nothing: break;
  }
  return law.lacks(instance);
}

/// Names of the built-in and registered laws that can be felt on a surface, by those of them that `takes` holds for.
template <class Takes>
std::string laws_for(const Instance& instance, const Takes& takes) {
  std::string names;
  for (const LawKind* kind : law_kinds()) {
    const Law law(*kind);
    if (takes(law) && lacking(law, instance).empty())
      names += (names.empty() ? "" : ", ") + std::string(kind->facts->name);
  }
  return names;
}

/// Whether the law can be felt on the surface at all.
Status check_pair(const Instance& instance, const std::string& place) {
  const std::string lacks = lacking(instance.law, instance);
  if (lacks.empty()) return success();
  constexpr const char* kinds[] = {"a bare mesh",          "a relief",
                                   "an isosurface",        "an implicit surface",
                                   "a parametric surface", "a surface of its own"};
  return refused(ErrorCode::unsupported_pair,
                 fmt::format("the law \"{}\" needs {}, and \"{}\" is {}", law_name(instance.law), lacks, instance.name,
                             kinds[instance.surface.index()]),
                 place + ".law", laws_for(instance, [](const Law&) { return true; }));
}

/// Whether what a coat adds beside its heights can be felt by the law.
Status check_coat(const Instance& instance, const std::string& place, double probe_radius) {
  const ReliefSurface* relief = relief_of(instance);
  const bool proxy = instance.law.facts().proxy == LawProxy::surface;
  const bool by_coat = instance.law.facts().coat == LawCoat::moment;
  const auto refuse = [&](std::string what, const char* where, const char* accepted) {
    return refused(ErrorCode::unsupported_pair, std::move(what), place + where, accepted);
  };
  const MaterialMaps* maps = relief != nullptr ? relief->coat().materials() : nullptr;
  const bool sticky = instance.material.stickiness > 0.0 || (maps != nullptr && maps->has(MaterialChannel::stickiness));
  if (sticky && (relief == nullptr || !proxy || probe_radius > 0.0)) {
    return refuse(fmt::format("is sticky, which a point feels on a coated mesh by the law \"proxy\" alone, and \"{}\" "
                              "is felt otherwise",
                              instance.name),
                  ".material.stickiness", "0, or law proxy, a coat and probe.radius 0");
  }
  const bool draws = instance.material.magnetism > 0.0 || (maps != nullptr && maps->has(MaterialChannel::magnetism));
  if (draws && (relief == nullptr || !by_coat || probe_radius > 0.0)) {
    return refuse(
        fmt::format("draws the probe, which a point feels on a coated mesh by the laws proxy, height-field and "
                    "mesostructure alone, and \"{}\" is felt otherwise",
                    instance.name),
        ".material.magnetism", "0, or one of those laws, a coat and probe.radius 0");
  }
  if (relief != nullptr && relief->coat().moves() && !by_coat) {
    return refuse(
        fmt::format("changes with time, and the law \"{}\" feels a coat that stands still", law_name(instance.law)),
        ".coat", "the laws proxy, height-field or mesostructure, or layers without a frequency and a drift");
  }
  return success();
}

/// Whether the law feels a probe of that radius, as far out as it has to.
Status check_radius(const Instance& instance, const std::string& place, const SceneSettings& settings) {
  if (settings.probe_radius > 0.0 && !instance.law.takes_ball()) {
    return refused(ErrorCode::unsupported_pair,
                   fmt::format("the law \"{}\" touches with a point, not with a radius of {}", law_name(instance.law),
                               format_length(settings.probe_radius)),
                   place + ".law",
                   laws_for(instance, [](const Law& law) { return law.takes_ball(); }) + ", or probe.radius 0");
  }
  return instance.law.facts().needs == LawNeeds::potential ? check_potential(instance, place, settings) : success();
}

Status check(const Instance& instance, std::size_t index, const SceneSettings& settings) {
  const std::string place = fmt::format("surfaces[{}]", index);
  if (std::visit([](const auto& surface) { return surface == nullptr; }, instance.surface)) {
    return bad_value("holds no surface", place + ".surface",
                     "a mesh, relief, isosurface, implicit, parametric or custom surface");
  }
  ASPERITY_CHECK(check_pair(instance, place));
  ASPERITY_CHECK(check_fine(instance, place));
  ASPERITY_CHECK(check_coat(instance, place, settings.probe_radius));
  if (auto valid = validate(instance.law); !valid) return std::move(valid).error().at(place + ".law");
  if (auto valid = validate(instance.material); !valid) return std::move(valid).error().at(place + ".material");
  ASPERITY_CHECK(check_radius(instance, place, settings));
  const Pose& pose = instance.world_from_object;
  if (!pose.position.allFinite() || !pose.orientation.coeffs().allFinite() ||
      std::abs(pose.orientation.norm() - 1.0) > 1e-9) {
    return Error{
        ErrorCode::bad_value, "is not a finite position and unit quaternion", {}, place + ".pose", "finite numbers"};
  }
  return success();
}

}  // namespace

Status takes_ball(const Instance& instance, const SceneSettings& settings) {
  ASPERITY_CHECK(check_pair(instance, instance.name));
  ASPERITY_CHECK(check_coat(instance, instance.name, settings.probe_radius));
  return check_radius(instance, instance.name, settings);
}

namespace {

/// An effect as it stands in a scene that is shown `zoom` times its size.
FieldEffect magnified(const FieldEffect& effect, double zoom) {
  FieldEffect out = effect;
  out.largest_force *= zoom;
  double factor = zoom;
  if (effect.kind == FieldEffectKind::viscosity || effect.kind == FieldEffectKind::pao ||
      effect.kind == FieldEffectKind::viscosity_scalars)
    factor = zoom * zoom;
  // Its gradient is steeper by as much as the force is less.
  if (effect.kind == FieldEffectKind::gradient) factor = 1.0;
  std::vector<TransferFunction::Point> points(effect.transfer.points().begin(), effect.transfer.points().end());
  for (TransferFunction::Point& point : points) point.answer *= factor;
  if (Result<TransferFunction> transfer = TransferFunction::build(std::move(points)))
    out.transfer = std::move(*transfer);
  return out;
}

/// Laws, material and friction of an instance as they stand in a scene that is shown `zoom` times its size. Lengths of
/// the scene are that much shorter than the hand's, energies and times are the same.
void magnify(Instance& instance, double zoom) {
  const double force = zoom;
  const double stiffness = zoom * zoom;
  const double speed = 1.0 / zoom;
  instance.zoom = zoom;
  if (instance.fine != nullptr && instance.fine->settings().resolution > 0.0) {
    FineSettings fine = instance.fine->settings();
    fine.resolution /= zoom;
    // Only a length has changed, which stays one: it builds.
    if (Result<FineFeatures> built = FineFeatures::build(std::move(fine)))
      instance.fine = std::make_shared<const FineFeatures>(std::move(*built));
  }
  Material& material = instance.material;
  material.stiffness *= stiffness;
  material.damping *= stiffness;
  material.viscosity *= stiffness;
  material.magnetism *= stiffness;
  material.magnetic_band /= zoom;
  material.stickiness *= force;
  FrictionLaw& friction = material.friction;
  friction.stiffness *= stiffness;
  friction.damping *= stiffness;
  friction.viscosity *= stiffness;
  friction.break_away *= force;
  friction.stick_speed *= speed;
  friction.stribeck_speed *= speed;
  instance.law = magnified(instance.law, zoom);
}

Status check(const SceneSettings& settings) {
  const auto bad = [](const char* place, double value, const char* accepted) {
    return bad_value(fmt::format("is {}", value), place, accepted);
  };
  const auto length = [](double value) { return std::isfinite(value) && value >= 0.0; };
  if (!length(settings.probe_radius))
    return bad("probe.radius", settings.probe_radius, "a length of 0 or more (m, mm)");
  if (!length(settings.tip_radius)) return bad("probe.tip", settings.tip_radius, "a length of 0 or more (m, mm)");
  if (!length(settings.tool_length))
    return bad("probe.tool_length", settings.tool_length, "a length of 0 or more (m, mm)");
  if (!(std::abs(settings.tool_axis.squaredNorm() - 1.0) <= 1e-6))
    return bad("probe.tool_axis", settings.tool_axis.norm(), "a direction of length 1");
  if (auto valid = validate(settings.view); !valid) return std::move(valid).error().at("view");
  if (!length(settings.handover.count()))
    return bad("handover", settings.handover.count(), "a time of 0 or more (s, ms)");
  if (!length(settings.change_power)) return bad("change_power", settings.change_power, "a power of 0 or more (W)");
  if (!length(settings.energy_capacity))
    return bad("energy_capacity", settings.energy_capacity, "an energy of 0 or more (J)");
  if (!(settings.level_rate > 0.0)) return bad("level_rate", settings.level_rate, "levels a second, above 0");
  const std::uint32_t budget = settings.budget.value_or(0);
  if (budget > 0 && budget < SceneSettings::least_budget)
    return bad_value(fmt::format("is {}", budget), "budget",
                     fmt::format("{} evaluations or more, or 0: no limit", SceneSettings::least_budget));
  return success();
}

/// Where an instance may be until its motion ends.
Box swept_bounds(const Instance& instance, const Box& local) {
  const Box here = transformed(local, instance.world_from_object);
  const Motion& motion = instance.motion;
  if (!motion.moves()) return here;
  const Vec3& origin = instance.world_from_object.position;
  double reach = 0.0;
  for (unsigned k = 0; k < 8; ++k) reach = std::max(reach, (here.corner(k) - origin).norm());
  const bool turns = !motion.velocity.angular.isZero(0.0);
  Box all = here;
  if (turns) {
    all = Box();
    all.include(origin);
    all = all.grown(reach);
  }
  // A motion without an end goes anywhere that a device may.
  constexpr double farthest = 1e6;
  const Vec3 way = motion.horizon.count() * motion.velocity.linear;
  const Vec3 last = way.allFinite() ? way : Vec3(Vec3::Constant(0.0));
  Box moved = all;
  moved.lower += last;
  moved.upper += last;
  all.include(moved.lower);
  all.include(moved.upper);
  return way.allFinite() ? all : all.grown(farthest);
}

/// Whether its coat moves or has levels of detail, and its law feels which.
bool feels_changing_coat(const Instance& instance) {
  const ReliefSurface* relief = relief_of(instance);
  return relief != nullptr && instance.law.facts().coat == LawCoat::moment &&
         (relief->coat().moves() || relief->coat().levels() > 0);
}

/// Whether the surface may move or change its shape under the probe.
bool changes(const Instance& instance) {
  if (instance.motion.moves()) return true;
  if (iso_of(instance.surface) != nullptr) return false;
  const MeshSurface* base = base_of(instance.surface);
  if (base != nullptr && base->index().identity() != base->index().lineage()) return true;
  return feels_changing_coat(instance);
}

InstanceFacts facts_of(const Instance& instance, double probe_radius) {
  const Material& material = instance.material;
  InstanceFacts facts;
  facts.identity = surface_identity(instance.surface);
  facts.radius = probe_radius;
  facts.sides = sides_of(instance);
  facts.constrains = instance.law.constrains();
  facts.smooth = follows_smoothly(instance);
  facts.facets = instance.law.facts().proxy == LawProxy::facets;
  facts.by_planes = facts.facets || instance.law.facts().proxy == LawProxy::dense_mesh;
  facts.volume = iso_of(instance.surface) != nullptr;
  facts.varies = has_local_material(instance);
  facts.holds_friction = proxy_holds_friction(instance);
  // The dynamic coefficient is at most the static one.
  facts.rubs = facts.holds_friction && (facts.varies || material.static_friction > 0.0);
  facts.adds_friction = adds_friction(instance);
  facts.moves = instance.motion.moves();
  facts.at_origin = !facts.moves && instance.world_from_object.is_identity();
  facts.changes = facts.constrains && changes(instance);
  facts.moment = feels_changing_coat(instance);
  facts.draws = attraction_reach(instance) > 0.0;
  facts.custom = !is_built_in(instance.law);
  facts.printed = (!facts.custom && instance.law.facts().unpaid) || instance.law.formulation() == Formulation::literal;
  return facts;
}

Status check_motion(const Instance& instance, std::size_t index) {
  const Motion& motion = instance.motion;
  const bool finite = motion.velocity.linear.allFinite() && motion.velocity.angular.allFinite() &&
                      std::isfinite(motion.since.count()) && motion.horizon.count() >= 0.0;
  const bool volume = iso_of(instance.surface) != nullptr;
  const std::string place = fmt::format("surfaces[{}].motion", index);
  if (!finite) return bad_value("is not finite", place, "finite velocities, a horizon of 0 s or more");
  if (volume && motion.moves())
    return Error{
        ErrorCode::unsupported_pair, "moves a volume", {}, place, "motion of meshes, reliefs and parametric surfaces"};
  return success();
}

/// What a magnet gives to a hand that it draws in (J).
double well_of(const Instance& instance) noexcept {
  Material material = instance.material;
  if (const ImplicitSurface* implicit = implicit_of(instance.surface))
    material.stiffness = std::max(material.stiffness, static_cast<double>(implicit->grid().stiffest()));
  double well = instance.law.well(material);
  if (attraction_reach(instance) > 0.0) {
    const MaterialMaps* maps = relief_of(instance)->coat().materials();
    const bool map = maps != nullptr && maps->has(MaterialChannel::magnetism);
    const double magnetism = map ? maps->most(MaterialChannel::magnetism) : instance.material.magnetism;
    well += magnetism * instance.material.magnetic_band * instance.material.magnetic_band / 6.0;
  }
  return well;
}

}  // namespace

Result<Scene> Scene::build(std::vector<Instance> instances, double probe_radius, std::vector<FieldEffect> effects) {
  SceneSettings settings;
  settings.probe_radius = probe_radius;
  return build(std::move(instances), settings, std::move(effects));
}

Result<Scene> Scene::build(std::vector<Instance> instances, const SceneSettings& settings,
                           std::vector<FieldEffect> effects) {
  ASPERITY_CHECK(check(settings));
  if (instances.empty() && effects.empty()) {
    return bad_value("holds nothing to touch", "surfaces", "at least one surface or effect");
  }
  for (std::size_t i = 0; i < effects.size(); ++i) {
    if (auto valid = validate(effects[i]); !valid) return std::move(valid).error().at(fmt::format("effects[{}]", i));
  }
  Scene scene;
  scene.settings_ = settings;
  for (std::size_t i = 0; i < instances.size(); ++i) {
    ASPERITY_CHECK(check(instances[i], i, settings));
    ASPERITY_CHECK(check_motion(instances[i], i));
    if (settings.view.zoom != 1.0 && relief_of(instances[i]) == nullptr && has_local_material(instances[i])) {
      return refused(ErrorCode::unsupported_pair,
                     fmt::format("zooms, and the material of \"{}\" is stored in its volume", instances[i].name),
                     "view.zoom", "1, or an implicit surface of one material");
    }
    ASPERITY_CHECK(make_dense(instances[i], i));
    // Room for the probe and for the skin that it rests on, and for what draws it.
    Box bounds = surface_bounds(instances[i].surface);
    // A deforming mesh may come out of its bounds before the next scene: room for that.
    constexpr double room = 0.02;
    if (const MeshSurface* base = base_of(instances[i].surface); base != nullptr &&
                                                                 iso_of(instances[i].surface) == nullptr &&
                                                                 base->index().identity() != base->index().lineage())
      bounds = bounds.grown(room * bounds.diagonal());
    scene.bounds_.push_back(swept_bounds(
        instances[i], bounds.grown(scene.probe_radius() + attraction_reach(instances[i]) / settings.view.zoom +
                                   1e-6 * bounds.diagonal())));
  }
  scene.direct_ = settings.view.identity();
  for (const FieldEffect& effect : effects)
    scene.reads_bricks_ = scene.reads_bricks_ || effect.field->bricks() != nullptr;
  for (const Instance& instance : instances) {
    const IsoSurface* iso = iso_of(instance.surface);
    scene.reads_bricks_ = scene.reads_bricks_ || (iso != nullptr && iso->field().bricks() != nullptr);
    scene.moves_ = scene.moves_ || instance.motion.moves();
    scene.lends_ += well_of(instance);
  }
  scene.felt_ = std::move(instances);
  scene.felt_effects_ = std::move(effects);
  if (settings.view.zoom != 1.0) {
    scene.given_ = scene.felt_;
    for (Instance& instance : scene.felt_) magnify(instance, settings.view.zoom);
    scene.given_effects_ = scene.felt_effects_;
    for (FieldEffect& effect : scene.felt_effects_) effect = magnified(effect, settings.view.zoom);
  }
  for (const Instance& instance : scene.felt_) {
    scene.facts_.push_back(facts_of(instance, scene.probe_radius()));
    scene.changes_ = scene.changes_ || scene.facts_.back().changes;
    scene.draws_ = scene.draws_ || scene.facts_.back().draws;
  }
  std::vector<std::uint32_t> order(scene.bounds_.size());
  std::iota(order.begin(), order.end(), 0U);
  scene.plant(order, 0, order.size());
  scene.epoch_ = next_identity();
  return scene;
}

/// Grows the tree over a part of the instances, halved along its longest side until few are left.
void Scene::plant(std::vector<std::uint32_t>& order, std::size_t from, std::size_t to) {
  constexpr std::size_t few = 8;
  if (to - from <= few) {
    for (std::size_t i = from; i < to; ++i)
      tree_.push_back({bounds_[order[i]], static_cast<std::uint32_t>(tree_.size() + 1), order[i]});
    return;
  }
  Box all;
  for (std::size_t i = from; i < to; ++i) all.include(bounds_[order[i]]);
  int axis = 0;
  all.extent().maxCoeff(&axis);
  const std::size_t middle = (from + to) / 2;
  const auto at = [&](std::size_t i) { return order.begin() + static_cast<std::ptrdiff_t>(i); };
  std::nth_element(at(from), at(middle), at(to), [&](std::uint32_t a, std::uint32_t b) {
    return bounds_[a].lower[axis] + bounds_[a].upper[axis] < bounds_[b].lower[axis] + bounds_[b].upper[axis];
  });
  const std::size_t node = tree_.size();
  tree_.push_back({all, 0, no_index});
  plant(order, from, middle);
  plant(order, middle, to);
  tree_[node].past = static_cast<std::uint32_t>(tree_.size());
}

Box Scene::world_bounds() const noexcept {
  Box all;
  for (const Box& box : bounds_) all.include(box);
  for (const FieldEffect& effect : effects())
    all.include(transformed(effect.field->bounds(), effect.world_from_object));
  return all;
}

std::size_t Scene::memory_bytes() const noexcept {
  std::size_t bytes = sizeof(*this);
  for (const Instance& instance : instances()) {
    if (instance.dense != nullptr) bytes += sizeof(DenseMesh) + instance.dense->surface.index().memory_bytes();
    if (const ImplicitSurface* implicit = implicit_of(instance.surface)) {
      bytes += implicit->memory_bytes();
    } else if (const ParametricSurface* parametric = parametric_of(instance.surface)) {
      bytes += parametric->memory_bytes();
    } else if (const CustomSurface* custom = custom_of(instance.surface)) {
      bytes += custom->memory_bytes();
    } else if (const IsoSurface* iso = iso_of(instance.surface)) {
      bytes += iso->field().memory_bytes();
    } else if (const auto* relief = std::get_if<std::shared_ptr<const ReliefSurface>>(&instance.surface)) {
      bytes += (*relief)->base().index().memory_bytes() + (*relief)->coat().memory_bytes();
    } else {
      bytes += (*std::get_if<std::shared_ptr<const MeshSurface>>(&instance.surface))->index().memory_bytes();
    }
  }
  for (const FieldEffect& effect : effects()) bytes += sizeof(FieldEffect) + effect.field->memory_bytes();
  return bytes;
}

}  // namespace asperity
