#include "asperity/study/series.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <variant>

#include "asperity/render/fine/texture.h"
#include "asperity/render/local_material.h"
#include "asperity/study/follow.h"

namespace asperity {
namespace {

constexpr double no_sample = std::numeric_limits<double>::quiet_NaN();
// A step changes the height by more than this share of the map's range, and more steeply than this, within one texel.
constexpr double step_share = 0.25;
constexpr double step_slope = 1.0;
// Weaker forces have no direction worth comparing (N).
constexpr double least_force = 1e-3;

const Coat* coat_of(const Surface& surface) {
  const auto* relief = std::get_if<std::shared_ptr<const ReliefSurface>>(&surface);
  return relief ? &(*relief)->coat() : nullptr;
}

/// The base mesh under a felt point, object frame.
struct BasePoint {
  std::uint32_t face = no_index;
  Vec3 barycentric = Vec3::Zero();
  Vec3 up = Vec3::UnitZ();     // gradient of the signed distance from the base
  double height = 0.0;         // signed distance (m)
  double relief = 0.0;         // height of the coat over it (m)
  Vec3 slope = Vec3::UnitZ();  // gradient of what a coated surface's zero set is
};

BasePoint base_point(const MeshSurface& base, const Vec3& p, SurfaceCache& cache) {
  const Foot foot = base.view(cache).nearest(p, infinity);
  BasePoint point;
  if (!foot.found()) return point;
  point.face = foot.element;
  point.barycentric = foot.at;
  const bool outside = (p - foot.point).dot(pseudonormal(base.mesh(), foot.element, foot.at)) >= 0.0;
  point.height = outside ? foot.distance : -foot.distance;
  point.up = outside ? foot.normal : Vec3(-foot.normal);
  if (foot.distance == 0.0) point.up = base.mesh().face_normal(foot.element);
  return point;
}

/// Whether the relief has a step within one texel of `at`, looked for along `direction`. Object frame.
bool step_along(const TriangleMesh& mesh, const Coat& coat, const BasePoint& at, const Vec3& direction) {
  const BarycentricFrame frame = barycentric_frame(mesh, at.face);
  const Vec3 flat = direction - direction.dot(frame.normal) * frame.normal;
  if (flat.norm() < 1e-9) return false;
  const Vec3 texel = coat.texel_size() * flat.normalized();
  const Vec3 rate(frame.gradient[0].dot(texel), frame.gradient[1].dot(texel), frame.gradient[2].dot(texel));
  const double least = std::max(step_share * (coat.highest() - coat.lowest()), step_slope * coat.texel_size());
  // Half-texel samples from -1.5 to 1.5 texels: every pair one texel apart whose nearer end lies within one texel.
  double heights[7];
  for (int i = 0; i < 7; ++i) heights[i] = coat.sample(mesh, at.face, at.barycentric + 0.5 * (i - 3) * rate).height;
  for (int i = 0; i + 2 < 7; ++i) {
    if (std::abs(heights[i + 2] - heights[i]) > least) return true;
  }
  return false;
}

/// Derives one tick after the other; keeps the caches of the queries.
class SeriesBuilder {
 public:
  SeriesBuilder(const Scene& scene, const StrokePath& path, const SeriesSettings& settings)
      : scene_(scene),
        shapes_(settings.exact != nullptr ? *settings.exact : scene),
        edge_reach_(settings.edge_reach),
        path_(path),
        caches_(std::make_unique<SurfaceCache[]>(scene.instances().size())),
        followed_(followed_instance(scene)) {}

  void add(const TraceRecord& tick) {
    const StrokePose pose = path_.pose(tick.probe.time);
    const bool stroking = pose.phase == StrokePhase::contact;
    const Vec3& position = tick.probe.pose.position;
    out_.time.push_back(tick.probe.time.count());
    out_.stroking.push_back(stroking ? 1 : 0);
    out_.distance.push_back(stroking ? pose.distance + (position - pose.point).dot(pose.tangent) : no_sample);
    out_.force.push_back(tick.commanded.norm());
    out_.normal.push_back(tick.commanded.dot(pose.normal));
    out_.tangential.push_back(tick.commanded.dot(pose.tangent));
    out_.friction.push_back(tick.rendered.parts.friction.dot(pose.tangent));
    out_.texture.push_back(tick.rendered.parts.texture.dot(pose.tangent));
    out_.update.push_back(tick.update_seconds);
    double follow = no_sample;
    if (followed_ != nullptr) {
      const IsoSurface& iso = *iso_of(followed_->surface);
      follow = follow_error(iso.view(follow_cache_, 0, iso.threshold_at(tick.probe.time)),
                            followed_->world_from_object.apply_inverse(position));
    }
    out_.follow.push_back(follow);
    add_energy(tick);
    add_surface(tick, pose.tangent);
    last_ = &tick;
  }

  RunSeries take() { return std::move(out_); }

 private:
  /// An implicit surface without texture, offset or shell is judged by the mesh that it was made from.
  static bool has_exact_mesh(const Surface& surface) {
    const ImplicitSurface* implicit = implicit_of(surface);
    return implicit != nullptr && implicit->is_mesh();
  }

  /// The probe as it is in the scene.
  [[nodiscard]] Vec3 in_scene(const TraceRecord& tick) const {
    const View& view = scene_.settings().view;
    return view.identity() ? tick.probe.pose.position : view.to_scene(tick.probe.pose.position);
  }
  /// The hand's force along the scene's axes (N).
  [[nodiscard]] Vec3 force_in_scene(const TraceRecord& tick) const {
    const View& view = scene_.settings().view;
    return view.identity() ? tick.rendered.wrench.force : Vec3(view.orientation * tick.rendered.wrench.force);
  }
  /// The hand's force over a length of the scene (N/m).
  double scene_stiffness(const Instance& instance, const TraceRecord& tick) {
    return scene_.settings().view.zoom * stiffness_at(instance, tick);
  }
  static Pose pose_of(const Instance& instance, const TraceRecord& tick) {
    return instance.motion.at(instance.world_from_object, tick.probe.time);
  }

  /// A tick in the frame of what is touched.
  struct Felt {
    Pose pose;   ///< of the object
    Vec3 force;  ///< the hand's (N)
    /// The proxy, or the probe where the law has none; of a ball that is led, where it touches.
    Vec3 point;
    double above;  ///< how far a ball's middle is above what it touches, if it is that (m)
  };
  [[nodiscard]] Felt in_object(const Instance& instance, const TraceRecord& tick) const {
    const Pose pose = pose_of(instance, tick);
    const double radius = scene_.probe_radius();
    const bool led = instance.law.constrains();
    const Vec3& proxy = radius > 0.0 ? tick.rendered.contact.point : tick.rendered.proxy;
    return {pose, pose.rotate_inverse(force_in_scene(tick)), pose.apply_inverse(led ? proxy : in_scene(tick)),
            led ? 0.0 : radius};
  }

  [[nodiscard]] const Instance* touched(const TraceRecord& tick) const {
    const std::uint32_t index = tick.rendered.contact.instance;
    const bool known = tick.rendered.flags.has(TickFlag::contact) && index < scene_.instances().size();
    return known ? &scene_.instances()[index] : nullptr;
  }

  /// Stiffness of what is touched, where it is touched (N/m).
  double stiffness_at(const Instance& instance, const TraceRecord& tick) {
    const ContactSummary& contact = tick.rendered.contact;
    const Vec3 place = pose_of(instance, tick).apply_inverse(contact.point);
    return local_material(instance, {}, place, {}, caches_[contact.instance]).stiffness;
  }

  void add_energy(const TraceRecord& tick) {
    if (last_) {
      const Vec3 motion = tick.probe.pose.position - last_->probe.pose.position;
      const double done = 0.5 * (tick.commanded + last_->commanded).dot(motion);
      if (std::isfinite(done)) work_ += done;
    }
    out_.work.push_back(work_);
    const Instance* instance = touched(tick);
    const double depth = tick.rendered.contact.penetration;
    double push = instance ? stiffness_at(*instance, tick) * depth : 0.0;
    if (instance && !instance->law.facts().linear)
      push = std::max(0.0, force_in_scene(tick).dot(tick.rendered.contact.normal));
    out_.stored.push_back(0.5 * push * depth + tick.rendered.parts.held);
  }

  void add_surface(const TraceRecord& tick, const Vec3& tangent) {
    out_.followed.push_back(no_sample);
    out_.relief.push_back(no_sample);
    out_.direction_error.push_back(no_sample);
    out_.near_step.push_back(0);
    out_.near_edge.push_back(0);
    const Instance* instance = touched(tick);
    if (!instance) return;
    if (instance->fine != nullptr && instance->fine->has_texture()) {
      add_textured(*instance, tick);
      return;
    }
    const Surface& shape = shapes_.instances()[tick.rendered.contact.instance].surface;
    if (iso_of(shape) != nullptr && !has_exact_mesh(shape)) {
      const IsoSurface& iso = *iso_of(shape);
      // The proxy is also held from the inside.
      add_smooth(*instance,
                 iso.view(caches_[tick.rendered.contact.instance].cells, 0, iso.threshold_at(tick.probe.time)),
                 iso.bounds(), tick, instance->law.constrains());
      if (const ImplicitSurface* implicit = implicit_of(shape); implicit != nullptr && implicit->mesh() != nullptr)
        add_texture(*instance, *implicit, tick);
      return;
    }
    const auto smooth = [&](const auto& surface) {
      add_smooth(*instance, surface.view(), surface.bounds(), tick, true);
    };
    if (const ParametricSurface* parametric = parametric_of(shape)) return smooth(*parametric);
    if (const CustomSurface* custom = custom_of(shape)) return smooth(*custom);
    const MeshSurface& base = *base_of(shape);
    const bool proxied = instance->law.constrains();
    const auto [pose, force, felt, above] = in_object(*instance, tick);
    SurfaceCache& cache = caches_[tick.rendered.contact.instance];
    BasePoint at = base_point(base, felt, cache);
    if (at.face == no_index) return;
    out_.near_edge.back() = near_sharp_edge(base, felt - at.height * at.up) ? 1 : 0;
    // Judged by the finest level, as it was then.
    const ReliefSurface* relief = relief_of(*instance);
    const bool moves = relief != nullptr && relief->coat().moves();
    in_shell(shape, felt, cache, {0.0, moves ? tick.probe.time.count() : 0.0}, at);
    add_height(shape, at, (proxied ? 0.0 : force.dot(at.up) / scene_stiffness(*instance, tick)) - above, force);
    add_direction(*instance, shape, at, force);
    if (const Coat* coat = coat_of(shape)) {
      const Vec3 along = pose.rotate_inverse(tangent);
      const bool near =
          step_along(base.mesh(), *coat, at, along) || step_along(base.mesh(), *coat, at, along.cross(at.up));
      out_.near_step.back() = near ? 1 : 0;
    }
  }

  /// Whether an edge that folds sharply comes within the reach of a point of the base.
  bool near_sharp_edge(const MeshSurface& base, const Vec3& point) const {
    constexpr double sharp = 0.9396926207859084;  // cosine of 20 degrees
    const TriangleMesh& mesh = base.mesh();
    Box box;
    box.include(point);
    bool near = false;
    base.index().for_each_in_box(box.grown(edge_reach_), [&](std::uint32_t face) {
      for (int edge = 0; edge < 3 && !near; ++edge) {
        const std::uint32_t other = mesh.neighbour(face, edge);
        if (other == no_index || mesh.face_normal(face).dot(mesh.face_normal(other)) > sharp) continue;
        const auto corners = mesh.corners(face);
        const Vec3& from = corners[static_cast<std::size_t>(edge)];
        const Vec3 way = corners[static_cast<std::size_t>((edge + 1) % 3)] - from;
        const double t = std::clamp((point - from).dot(way) / way.squaredNorm(), 0.0, 1.0);
        near = (point - from - t * way).norm() <= edge_reach_;
      }
    });
    return near;
  }

  /// Heights over a surface without triangles, without its features; on the side touched where it is felt from either.
  template <class View>
  void add_smooth(const Instance& instance, const View& view, const Box& bounds, const TraceRecord& tick,
                  bool either_side) {
    auto [pose, force, felt, above] = in_object(instance, tick);
    if (!instance.law.constrains()) felt += force / scene_stiffness(instance, tick);
    const Foot foot = view.nearest(felt, bounds.diagonal());
    if (!foot.found()) return;
    const Vec3 front = view.front(foot);
    const double side = either_side && force.dot(front) < 0.0 ? -1.0 : 1.0;
    const double over = (felt - foot.point).dot(front) < 0.0 ? -foot.distance : foot.distance;
    double height = 0.0;
    if constexpr (std::is_same_v<View, ParametricView>) height = view.spot(foot.at.template head<2>()).height;
    out_.followed.back() = side * (height + over) - above;
    out_.relief.back() = side * height;
    if (!(force.norm() >= least_force) || front.isZero()) return;
    const Vec3 outward = side * front;
    out_.direction_error.back() = std::atan2(outward.cross(force).norm(), outward.dot(force));
  }

  /// Heights over the smooth surface that wears a texture: what is felt against the texture as it is.
  void add_textured(const Instance& instance, const TraceRecord& tick) {
    const Pose pose = pose_of(instance, tick);
    const ContactSummary& contact = tick.rendered.contact;
    const Vec3 force = pose.rotate_inverse(force_in_scene(tick));
    const Vec3 point = pose.apply_inverse(contact.point);
    const Vec3 normal = pose.rotate_inverse(contact.normal);
    Place place{contact.element};
    if (const ParametricSurface* parametric = parametric_of(instance.surface)) {
      const Foot foot = parametric->view().nearest(point, parametric->bounds().diagonal());
      if (!foot.found()) return;
      place.at = foot.at;
    }
    const TextureShape shape = texture_at(instance, place, point, normal, 0.0);
    const double over = (pose.apply_inverse(in_scene(tick)) - point).dot(normal) - scene_.probe_radius();
    out_.followed.back() = over + force.dot(normal) / scene_stiffness(instance, tick);
    out_.relief.back() = shape.height;
    if (!(force.norm() >= least_force)) return;
    const Vec3 reference = normal - shape.gradient;
    out_.direction_error.back() = std::atan2(reference.cross(force).norm(), reference.dot(force));
  }

  /// Heights over the mesh where a texture, or an offset, is what is felt.
  void add_texture(const Instance& instance, const ImplicitSurface& surface, const TraceRecord& tick) {
    const auto [pose, force, felt, above] = in_object(instance, tick);
    SurfaceCache& cache = caches_[tick.rendered.contact.instance];
    const BasePoint at = base_point(*surface.mesh(), felt, cache);
    if (at.face == no_index) return;
    const double deflection = instance.law.constrains() ? 0.0 : force.dot(at.up) / scene_stiffness(instance, tick);
    const double reach = std::max(surface.grid().outside(), -surface.grid().inside());
    const Vec3 base = felt - at.height * at.up;
    const SweptHit met = surface.view(cache).first_touch({base + reach * at.up, base - reach * at.up}, Sides::front);
    out_.followed.back() = met.hit ? at.height + deflection - above : no_sample;
    out_.relief.back() = met.hit ? reach * (1.0 - 2.0 * met.t) : no_sample;
    out_.near_edge.back() = near_sharp_edge(*surface.mesh(), base) ? 1 : 0;
  }

  /// On a coat the shell's coordinates say what is under a point, where its shell reaches.
  static void in_shell(const Surface& shape, const Vec3& felt, SurfaceCache& cache, const CoatMoment& moment,
                       BasePoint& at) {
    const auto* relief = std::get_if<std::shared_ptr<const ReliefSurface>>(&shape);
    if (relief == nullptr) return;
    ShellPlace place;
    if (const ReliefFrame* frame = (*relief)->locate(felt, cache, moment, place)) {
      const FieldSample sample = (*relief)->field(*frame, place);
      at.face = frame->face;
      at.barycentric = place.barycentric();
      at.height = place.height;
      at.relief = sample.height;
      at.slope = sample.gradient;
      return;
    }
    const CoatSample sample = (*relief)->coat_sample(at.face, at.barycentric, moment);
    at.relief = sample.height;
    at.slope = at.up - sample.gradient;
  }

  void add_height(const Surface& shape, const BasePoint& at, double deflection, const Vec3& force) {
    const Coat* coat = coat_of(shape);
    const TriangleMesh& mesh = base_mesh(shape);
    const bool from_behind = force.dot(mesh.face_normal(at.face)) < 0.0 && !coat;
    const double height = from_behind ? -at.height : at.height;
    out_.followed.back() = height + deflection;
    out_.relief.back() = coat ? at.relief : 0.0;
  }

  void add_direction(const Instance& instance, const Surface& shape, const BasePoint& at, const Vec3& force) {
    if (!(force.norm() >= least_force)) return;
    const TriangleMesh& mesh = base_mesh(shape);
    Vec3 reference = mesh.face_normal(at.face);
    if (coat_of(shape) != nullptr) {
      reference = at.slope;
      // A two-sided sheet touched from behind pushes the other way.
      if (instance.law.facts().coat >= LawCoat::relief && instance.law.constrains() && reference.dot(force) < 0.0)
        reference = -reference;
    } else if (reference.dot(force) < 0.0) {
      reference = -reference;
    }
    // The two-argument form keeps small angles, which an arc cosine would round away.
    out_.direction_error.back() = std::atan2(reference.cross(force).norm(), reference.dot(force));
  }

  const Scene& scene_;
  const Scene& shapes_;  ///< what the run is judged by
  double edge_reach_;
  const StrokePath& path_;
  std::unique_ptr<SurfaceCache[]> caches_;
  const Instance* followed_ = nullptr;
  CellCache follow_cache_;
  RunSeries out_;
  const TraceRecord* last_ = nullptr;
  double work_ = 0.0;
};

}  // namespace

double edge_reach_of(const Scene& scene) {
  constexpr double voxels = 1.5;
  double reach = infinity;
  for (const Instance& instance : scene.instances()) {
    const ImplicitSurface* implicit = implicit_of(instance.surface);
    if (implicit != nullptr) reach = std::min(reach, voxels * implicit->grid().voxel());
  }
  return std::isfinite(reach) ? reach : SeriesSettings{}.edge_reach;
}

RunSeries derive_series(std::span<const TraceRecord> records, const Scene& scene, const StrokePath& path,
                        const SeriesSettings& settings) {
  SeriesBuilder builder(scene, path, settings);
  for (const TraceRecord& tick : records) builder.add(tick);
  return builder.take();
}

}  // namespace asperity
