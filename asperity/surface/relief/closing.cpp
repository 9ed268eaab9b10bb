#include "asperity/surface/relief/closing.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "asperity/core/fixed_vector.h"
#include "asperity/surface/relief/bake.h"
#include "asperity/surface/relief/detail/halfspaces.h"
#include "asperity/surface/relief/detail/weights.h"
#include "asperity/surface/relief/view.h"

namespace asperity {

namespace {

// Of the radius: how far a ball may reach into the solid before it counts as touching elsewhere, and how far the height
// along a ray may still move when it is taken.
constexpr double touch_of_radius = 2e-5;
constexpr double rest_of_radius = 2e-6;
// A place is settled when its ball is free to this share of the radius.
constexpr double settled_of_radius = 1e-3;
// Of the radius: rises below this are not called changes.
constexpr double change_of_radius = 1e-3;
// Texels around a triangle that hold the surface as it goes on; those farther out repeat the outermost.
constexpr double true_border = 3.2;

int segments_of(double length, double spacing) {
  return std::max(1, static_cast<int>(std::ceil(length / spacing)));
}

double longest_edge(const TriangleMesh& mesh, std::uint32_t face) {
  const auto [a, b, c] = mesh.corners(face);
  return std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
}

/// Points of a displaced surface about `spacing` apart, found by cells: what a ball may touch.
class SurfaceSamples {
 public:
  struct Sample {
    Vec3 point;
    std::uint32_t face;
    float u;
    float v;
  };

  SurfaceSamples(const ReliefSurface& surface, double cell, double spacing) : cell_(cell) {
    const TriangleMesh& mesh = surface.base().mesh();
    origin_ = surface.bounds().lower - Vec3::Constant(2.0 * cell);
    std::vector<Sample> loose;
    for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) {
      const ReliefFrame frame = surface.frame(face);
      const int cuts = segments_of(longest_edge(mesh, face), spacing);
      for (int i = 0; i <= cuts; ++i) {
        for (int j = 0; i + j <= cuts; ++j) {
          const double u = static_cast<double>(i) / cuts;
          const double v = static_cast<double>(j) / cuts;
          loose.push_back({surface.point(frame, u, v).point, face, static_cast<float>(u), static_cast<float>(v)});
        }
      }
    }
    // Sorted by cell, in the order of their making within each: the answer does not depend on the machine.
    std::unordered_map<std::uint64_t, Range> counts;
    counts.reserve(loose.size() / 8 + 16);
    for (const Sample& one : loose) ++counts[key_of(cell_of(one.point))].count;
    std::size_t sum = 0;
    std::vector<std::uint64_t> keys;
    keys.reserve(counts.size());
    for (const auto& [key, range] : counts) keys.push_back(key);
    std::sort(keys.begin(), keys.end());
    for (const std::uint64_t key : keys) {
      Range& range = counts[key];
      range.first = sum;
      sum += range.count;
      range.count = 0;
    }
    samples_.resize(loose.size());
    for (const Sample& one : loose) {
      Range& range = counts[key_of(cell_of(one.point))];
      samples_[range.first + range.count++] = one;
    }
    ranges_ = std::move(counts);
  }

  /// Visits every sample nearer to c than `bound`, which is at most the cell, with its squared distance.
  template <class Visit>
  void for_each_near(const Vec3& c, double bound, Visit&& visit) const {
    const Eigen::Array3i low = cell_of(c - Vec3::Constant(bound));
    const Eigen::Array3i high = cell_of(c + Vec3::Constant(bound));
    const double square = bound * bound;
    for (int z = low[2]; z <= high[2]; ++z) {
      for (int y = low[1]; y <= high[1]; ++y) {
        for (int x = low[0]; x <= high[0]; ++x) {
          const auto found = ranges_.find(key_of(Eigen::Array3i(x, y, z)));
          if (found == ranges_.end()) continue;
          for (std::size_t i = found->second.first; i < found->second.first + found->second.count; ++i) {
            const double distance = (samples_[i].point - c).squaredNorm();
            if (distance < square) visit(samples_[i], distance);
          }
        }
      }
    }
  }

 private:
  struct Range {
    std::size_t first = 0;
    std::size_t count = 0;
  };
  [[nodiscard]] Eigen::Array3i cell_of(const Vec3& p) const {
    return ((p - origin_) / cell_).array().floor().cast<int>();
  }
  [[nodiscard]] static std::uint64_t key_of(const Eigen::Array3i& cell) {
    const auto part = [](int i) { return static_cast<std::uint64_t>(static_cast<std::uint32_t>(i)) & 0x1fffffU; };
    return part(cell[0]) | part(cell[1]) << 21U | part(cell[2]) << 42U;
  }

  double cell_;
  Vec3 origin_;
  std::vector<Sample> samples_;
  std::unordered_map<std::uint64_t, Range> ranges_;
};

/// Where a ball touches the surface.
struct Contact {
  ReliefPlace place;
  Vec3 point = Vec3::Zero();
  Vec3 normal = Vec3::Zero();  ///< unit, towards the ball's centre from outside
  double distance = 0.0;       ///< signed, of the centre (m)
};
using Contacts = FixedVector<Contact, 8>;

/// A line over a place of the base.
struct ShellRay {
  Vec3 origin;
  Vec3 direction;
  [[nodiscard]] Vec3 at(double height) const { return origin + height * direction; }
};

class Closer {
 public:
  Closer(const ReliefSurface& surface, double radius, double spacing)
      : surface_(surface),
        radius_(radius),
        spacing_(spacing),
        // A sample lies up to 0.6 spacings beside the point that the ball touches, and is farther off by so much at
        // most while what is touched is not sharper than an eighth of the radius.
        margin_(9.0 * 0.18 * spacing * spacing / radius),
        samples_(surface, radius + margin_, spacing) {}

  /// Lowest height over `from`'s ray, at or above `height`, at which a free ball holds the point. The relief lies at
  /// `height` there. Not a number where none was found.
  [[nodiscard]] double closed_height(const ShellRay& ray, double height, const ReliefPlace& from) {
    const ReliefPoint start = surface_.point(from.frame, from.u, from.v);
    Contacts contacts;
    contacts.push_back({from, start.point, start.front, radius_});
    const Vec3 centre = start.point + radius_ * start.front;
    if (!add_touched(centre, contacts)) return height;
    double best = settle(ray, height, centre, contacts);
    if (!beyond_wall(ray, height, best)) {
      // A small rise is the lowest there is: nothing lies between.
      if (best - height <= 0.25 * radius_ / ray.direction.norm()) return best;
    } else {
      best = std::numeric_limits<double>::quiet_NaN();
    }
    const double from_above = settle_from_above(ray, height);
    if (std::isfinite(from_above) && !(from_above >= best)) best = from_above;
    if (std::isfinite(best) || (last_ - start.point).norm() > 3.0 * radius_) return best;
    // From where the ball lay over the texel before.
    contacts.clear();
    best = settle(ray, height, last_, contacts);
    return beyond_wall(ray, height, best) ? std::numeric_limits<double>::quiet_NaN() : best;
  }

 private:
  [[nodiscard]] bool at_rim(const ReliefPlace& place) const {
    const TriangleMesh& mesh = surface_.base().mesh();
    for (int k = 0; k < 3; ++k) {
      if (coordinate(k, place.u, place.v) <= 1e-12 && mesh.neighbour(place.frame.face, (k + 1) % 3) == no_index)
        return true;
    }
    return false;
  }

  /// Moves a contact to the surface's point that is nearest to the centre, as far as the surface leads there.
  void follow(Contact& contact, const Vec3& centre) const {
    ReliefPoint spot = surface_.point(contact.place.frame, contact.place.u, contact.place.v);
    WorkCount count;
    descend(surface_, contact.place, spot, 1.0, {.point = centre, .may_leave = false}, count);
    contact.point = spot.point;
    const Vec3 offset = centre - contact.point;
    contact.distance = offset.norm();
    Vec3 outward = spot.front;
    const Vec3 barycentric(1.0 - contact.place.u - contact.place.v, contact.place.u, contact.place.v);
    if (barycentric.minCoeff() <= 1e-12)
      outward += pseudonormal(surface_.base().mesh(), contact.place.frame.face, barycentric).normalized();
    if (contact.distance <= 1e-9 * radius_) {
      contact.normal = outward.normalized();
      return;
    }
    contact.normal = offset / contact.distance;
    // Beside a rim there is no inside; straight behind one there is.
    if (contact.normal.dot(outward) < (at_rim(contact.place) ? -0.5 : 0.0)) {
      contact.normal = -contact.normal;
      contact.distance = -contact.distance;
    }
  }

  /// Adds what a ball at `centre` reaches into and `contacts` do not hold yet; whether there was anything.
  bool add_touched(const Vec3& centre, Contacts& contacts) {
    const double bound = radius_ + margin_;
    struct Tried {
      Vec3 point;
      double distance;
    };
    FixedVector<Tried, 24> tried;
    for (const Contact& one : contacts) tried.push_back({one.point, one.distance});
    // What lies beside a place that was followed to its nearest point, and is no nearer than that, says nothing new.
    const double apart = 1.8 * spacing_;
    const auto known = [&](const Vec3& point, double distance) {
      for (const Tried& one : tried) {
        if ((one.point - point).squaredNorm() < apart * apart && one.distance <= distance + 1e-9 * radius_) return true;
      }
      return false;
    };
    near_.clear();
    samples_.for_each_near(centre, bound, [&](const SurfaceSamples::Sample& sample, double square) {
      const double distance = std::sqrt(square);
      if (!known(sample.point, distance)) near_.push_back({distance, &sample});
    });
    std::sort(near_.begin(), near_.end(), [](const Near& a, const Near& b) {
      return a.distance < b.distance || (a.distance == b.distance && a.sample < b.sample);
    });
    bool added = false;
    for (const Near& one : near_) {
      if (contacts.size() == contacts.capacity() || tried.size() == tried.capacity()) break;
      if (known(one.sample->point, one.distance)) continue;
      Contact contact;
      contact.place = {surface_.frame(one.sample->face), static_cast<double>(one.sample->u),
                       static_cast<double>(one.sample->v)};
      follow(contact, centre);
      tried.push_back({one.sample->point, contact.distance});
      if (contact.distance >= radius_ * (1.0 - touch_of_radius)) continue;
      const auto same = [&](const Contact& other) { return (other.point - contact.point).norm() < 1e-5 * radius_; };
      if (std::any_of(contacts.begin(), contacts.end(), same)) continue;
      contacts.push_back(contact);
      added = true;
    }
    return added;
  }

  /// Whether the way up the ray to `to` leads through the surface, or `to` is no number: then the ball lies on another
  /// side of it.
  [[nodiscard]] bool beyond_wall(const ShellRay& ray, double from, double to) const {
    if (!std::isfinite(to)) return true;
    const double scale = ray.direction.norm();
    if ((to - from) * scale <= 0.1 * radius_) return false;
    SurfaceCache cache;
    return surface_.view(cache).first_touch({ray.at(from + 1e-3 * radius_ / scale), ray.at(to)}, Sides::both).hit;
  }

  /// The same from a ball that was let down the ray until it touched.
  [[nodiscard]] double settle_from_above(const ShellRay& ray, double height) {
    constexpr int most_steps = 64;
    const double scale = ray.direction.norm();
    double level = height + radius_ / scale;
    Contacts contacts;
    for (int i = 0; i < most_steps; ++i) {
      contacts.clear();
      if (!add_touched(ray.at(level), contacts)) {
        if (i == 0 || beyond_wall(ray, height, level)) break;
        // Free: what it touched last is what it comes down on.
        const double settled = settle(ray, height, ray.at(level), contacts);
        return beyond_wall(ray, height, settled) ? std::numeric_limits<double>::quiet_NaN() : settled;
      }
      double least = radius_;
      for (const Contact& one : contacts) least = std::min(least, one.distance);
      level += std::clamp(radius_ - least, 0.05 * radius_, radius_) / scale;
    }
    return std::numeric_limits<double>::quiet_NaN();
  }

  /// Contacts that have come together, and those that the ball has left, are dropped.
  void prune(Contacts& contacts) const {
    Contacts kept;
    for (const Contact& one : contacts) {
      bool doubled = false;
      for (const Contact& other : kept) doubled = doubled || (one.point - other.point).norm() < 1e-6 * radius_;
      if (!doubled && one.distance < 1.3 * radius_) kept.push_back(one);
    }
    contacts = kept;
  }

  /// Minimises the height over all places of a free ball that holds the point: Newton's steps along the ray and against
  /// the walls at once. Where walls are convex towards the ball they stay a little on the free side.
  [[nodiscard]] double settle(const ShellRay& ray, double lowest, Vec3 centre, Contacts& contacts) {
    constexpr int most_steps = 120;
    constexpr int patient_steps = 24;
    double height = lowest;
    const double scale = ray.direction.norm();
    for (int step = 0; step < most_steps; ++step) {
      const Vec3 x = ray.at(height);
      for (Contact& one : contacts) follow(one, centre);
      prune(contacts);
      HalfSpace walls[8];
      std::size_t count = 0;
      for (const Contact& one : contacts)
        walls[count++] = {one.normal, radius_ - one.distance + one.normal.dot(centre - x)};
      const NearestInHalfSpaces nearest = nearest_in_halfspaces({walls, count}, 1e-9 * radius_);
      if (!nearest.found) return std::numeric_limits<double>::quiet_NaN();
      Vec3 move = x + nearest.point - centre;
      const double most_move = 0.5 * radius_;
      const bool cut = move.norm() > most_move;
      if (cut) move *= most_move / move.norm();
      // Between walls that bend the ball may swing to and fro.
      if (step >= patient_steps) move *= 0.5;
      centre += move;
      const Vec3 reach = centre - x;
      const double away = reach.norm();
      double rise = 0.0;
      if (!cut && away > 0.0) {
        const double along = std::max(0.1 * scale, reach.dot(ray.direction) / away);
        rise = std::clamp((away - radius_) / along, -0.5 * radius_, 0.5 * radius_);
        rise = std::max(lowest - height, rise);
        height += rise;
      }
      const bool touched = contacts.size() < contacts.capacity() && add_touched(centre, contacts);
      if (touched || cut) continue;
      if (move.norm() <= rest_of_radius * radius_ && std::abs(rise) * scale <= rest_of_radius * radius_) {
        last_ = centre;
        return height;
      }
    }
    // Out of steps: what was reached stands when it is close.
    for (Contact& one : contacts) {
      follow(one, centre);
      if (one.distance < radius_ * (1.0 - settled_of_radius)) return std::numeric_limits<double>::quiet_NaN();
    }
    if ((centre - ray.at(height)).norm() > radius_ * (1.0 + settled_of_radius))
      return std::numeric_limits<double>::quiet_NaN();
    return height;
  }

  struct Near {
    double distance;
    const SurfaceSamples::Sample* sample;
  };

  const ReliefSurface& surface_;
  double radius_;
  double spacing_;
  double margin_;
  SurfaceSamples samples_;
  std::vector<Near> near_;                ///< scratch
  Vec3 last_ = Vec3::Constant(infinity);  ///< centre of the ball that settled last
};

/// Where the relief lies over a place of a triangle's plane, also beyond the triangle, where other faces own the space.
struct RayStart {
  bool exact = false;  ///< false: no prism of the shell holds the surface there; the face's own height, continued
  double height = 0.0;
  ReliefPlace place;
};

/// Whether a place beside a triangle lies across an edge where the base bends away. The relief has a crease there, and
/// its spline is truest when it goes on as the face's own.
bool beyond_convex_edge(const TriangleMesh& mesh, std::uint32_t face, double u, double v) {
  constexpr double flat = 1e-9;
  for (int k = 0; k < 3; ++k) {
    if (coordinate(k, u, v) >= 0.0) continue;
    const int edge = (k + 1) % 3;
    const std::uint32_t other = mesh.neighbour(face, edge);
    if (other == no_index) continue;
    const auto corners = mesh.corners(face);
    const auto from = static_cast<std::size_t>(edge);
    const Vec3 along = (corners[(from + 1) % 3] - corners[from]).normalized();
    if (mesh.face_normal(face).cross(mesh.face_normal(other)).dot(along) > flat) return true;
  }
  return false;
}

RayStart start_over(const ReliefSurface& surface, const ReliefFrame& frame, double u, double v, SurfaceCache& cache) {
  if (u >= 0.0 && v >= 0.0 && u + v <= 1.0) return {true, surface.height(frame, u, v).height, {frame, u, v}};
  HeightJet jet = surface.coat().jet(frame.coat, u, v);
  lower_by_share(frame, u, v, jet);
  const double own = jet.height;
  if (beyond_convex_edge(surface.base().mesh(), frame.face, u, v)) return {false, own, {frame, u, v}};
  const ShellRay ray{frame.prism.base_at(u, v), frame.prism.direction_at(u, v)};
  double height = own;
  constexpr int most_steps = 16;
  for (int i = 0; i < most_steps; ++i) {
    ShellPlace place;
    const ReliefFrame* owner = surface.locate(ray.at(height), cache, {}, place);
    if (owner == nullptr) break;
    const FieldSample sample = surface.field(*owner, place);
    const double rise = sample.gradient.dot(ray.direction);
    if (!(rise > 0.1)) break;
    const double step = sample.value / rise;
    height -= step;
    if (std::abs(step) <= 1e-9 * surface.grain()) return {true, height, {*owner, place.u, place.v}};
  }
  return {false, own, {frame, u, v}};
}

/// Raises texels that did not settle as those around them were raised on average: a hole would be a trap.
void patch(ClosedRelief& closed, const std::vector<AtlasTexel>& unsettled, int texels) {
  std::vector<std::size_t> open;
  for (const AtlasTexel& texel : unsettled) open.push_back(texel.index);
  std::sort(open.begin(), open.end());
  std::vector<float> mean(unsettled.size(), 0.0F);
  for (std::size_t i = 0; i < unsettled.size(); ++i) {
    const AtlasTexel& texel = unsettled[i];
    double sum = 0.0;
    int count = 0;
    for (int y = -2; y <= 2; ++y) {
      for (int x = -2; x <= 2; ++x) {
        const double u = texel.u + static_cast<double>(x) / texels;
        const double v = texel.v + static_cast<double>(y) / texels;
        if (std::max({-u, -v, u + v - 1.0}) * texels > true_border) continue;
        const auto at =
            static_cast<std::size_t>(static_cast<std::ptrdiff_t>(texel.index) + x * texel.right + y * texel.up);
        if (std::binary_search(open.begin(), open.end(), at)) continue;
        sum += static_cast<double>(closed.rise[at]);
        ++count;
      }
    }
    if (count > 0) mean[i] = static_cast<float>(sum / count);
  }
  for (std::size_t i = 0; i < unsettled.size(); ++i) {
    closed.rise[unsettled[i].index] += mean[i];
    closed.atlas.heights[unsettled[i].index] += mean[i];
  }
}

Error closing_error(ErrorCode code, std::string what, std::string place, std::string accepted) {
  return Error{code, std::move(what), {}, std::move(place), std::move(accepted)};
}

constexpr int most_texels = 512;

int texels_for(const ReliefSurface& surface, const ClosingSettings& settings) {
  if (settings.texels > 0) return settings.texels;
  const double fine = std::min(surface.coat().texel_size(), settings.radius / 8.0);
  return std::clamp(static_cast<int>(std::ceil(surface.base().mesh().mean_edge() / fine)), 8, 48);
}

double sample_spacing(const ReliefSurface& surface, double radius) {
  return std::clamp(surface.coat().texel_size(), radius / 16.0, radius / 6.0);
}

Status validate(const ReliefSurface& surface, const ClosingSettings& settings) {
  const double size = surface.bounds().diagonal();
  if (!(settings.radius > 0.0 && settings.radius <= size)) {
    return closing_error(ErrorCode::bad_value, fmt::format("is {:g} m", settings.radius), "radius",
                         fmt::format("above 0 m and at most the size of the surface ({:.3g} m)", size));
  }
  if (settings.texels != 0 && (settings.texels < 2 || settings.texels > most_texels)) {
    return closing_error(ErrorCode::bad_value, fmt::format("is {}", settings.texels), "texels",
                         fmt::format("2 to {} texels along each edge, or 0", most_texels));
  }
  const TriangleMesh& mesh = surface.base().mesh();
  const double spacing = sample_spacing(surface, settings.radius);
  double samples = 0.0;
  for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) {
    const double cuts = std::ceil(longest_edge(mesh, face) / spacing);
    samples += 0.5 * (cuts + 1.0) * (cuts + 2.0);
  }
  const double texels =
      static_cast<double>(mesh.triangles().size()) * std::pow(texels_for(surface, settings) + 24.0, 2.0) / 2.0;
  const double bytes =
      2.0 * static_cast<double>(sizeof(SurfaceSamples::Sample)) * samples + 3.0 * sizeof(float) * texels;
  if (bytes > static_cast<double>(settings.most_memory)) {
    return closing_error(ErrorCode::too_large,
                         fmt::format("needs {:.0f} MiB for {:.3g} places of the surface and {:.3g} texels",
                                     bytes / 1048576.0, samples, texels),
                         "radius",
                         fmt::format("a larger radius, fewer texels, or a bound of memory above {:.0f} MiB",
                                     static_cast<double>(settings.most_memory) / 1048576.0));
  }
  return success();
}

}  // namespace

std::string ClosingReport::summary() const {
  if (changed_texels == 0) return "the ball reaches every place of the relief: nothing was filled";
  std::string text = fmt::format("{:.3g} % of the surface filled, on {} faces; by {:.3g} mm at most, on face {}",
                                 100.0 * changed_share, changed_faces.size(), 1e3 * largest_rise, largest_face);
  if (unsettled_texels > 0)
    text += fmt::format("; {} texels raised as those around them: no place was found there that the ball fits into",
                        unsettled_texels);
  return text;
}

double ClosedRelief::rise_at(std::uint32_t face, const Vec3& barycentric) const noexcept {
  if (face >= atlas.corner_uvs.size() || rise.empty()) return 0.0;
  Vec2 uv = Vec2::Zero();
  for (std::size_t k = 0; k < 3; ++k) uv += barycentric[static_cast<int>(k)] * atlas.corner_uvs[face][k].cast<double>();
  const int x = std::clamp(static_cast<int>(uv.x() * atlas.width), 0, atlas.width - 1);
  const int y = std::clamp(static_cast<int>((1.0 - uv.y()) * atlas.height), 0, atlas.height - 1);
  return static_cast<double>(
      rise[static_cast<std::size_t>(y) * static_cast<std::size_t>(atlas.width) + static_cast<std::size_t>(x)]);
}

Result<ClosedRelief> close_relief(const ReliefSurface& surface, const ClosingSettings& settings,
                                  const Progress& progress) {
  if (auto valid = validate(surface, settings); !valid) return std::move(valid).error();
  const TriangleMesh& mesh = surface.base().mesh();
  ClosedRelief closed;
  closed.settings = settings;
  closed.settings.texels = texels_for(surface, settings);
  const int texels = closed.settings.texels;
  ClosingReport& report = closed.report;
  report.tolerance = change_of_radius * settings.radius;
  report.texel_size = mesh.mean_edge() / texels;
  if (progress) progress("sampling the relief", 0.0);
  Closer closer(surface, settings.radius, sample_spacing(surface, settings.radius));
  closed.rise.assign(atlas_texels(mesh.triangles().size(), texels), 0.0F);
  std::vector<AtlasTexel> unsettled;
  // Texels that take after another one: the whole height, or the rise alone.
  std::vector<std::pair<std::size_t, std::size_t>> copies;
  std::vector<std::pair<std::size_t, std::size_t>> continued;
  const auto source_of = [texels](const AtlasTexel& texel, double border) {
    return static_cast<std::size_t>(static_cast<std::ptrdiff_t>(texel.index) +
                                    nearest_texel_within(texel, border, texels));
  };
  ReliefFrame frame;
  std::uint32_t of = no_index;
  std::size_t inside_face = 0;
  std::size_t changed_face = 0;
  double area = 0.0;
  double changed_area = 0.0;
  SurfaceCache cache;
  const auto finish_face = [&] {
    if (of == no_index) return;
    const auto [a, b, c] = mesh.corners(of);
    const double face_area = 0.5 * (b - a).cross(c - a).norm();
    area += face_area;
    if (changed_face > 0) {
      report.changed_faces.push_back(of);
      changed_area += face_area * static_cast<double>(changed_face) / static_cast<double>(inside_face);
    }
    inside_face = changed_face = 0;
  };
  auto baked = bake_relief(
      mesh, texels,
      [&](const AtlasTexel& texel) {
        if (texel.face != of) {
          finish_face();
          of = texel.face;
          frame = surface.frame(of);
        }
        const double beyond = std::max({-texel.u, -texel.v, texel.u + texel.v - 1.0}) * texels;
        if (beyond > true_border) {
          copies.emplace_back(texel.index, source_of(texel, true_border));
          return 0.0;
        }
        const RayStart start = start_over(surface, frame, texel.u, texel.v, cache);
        if (!start.exact) {
          continued.emplace_back(texel.index, source_of(texel, 0.0));
          return start.height;
        }
        const ShellRay ray{frame.prism.base_at(texel.u, texel.v), frame.prism.direction_at(texel.u, texel.v)};
        double height = closer.closed_height(ray, start.height, start.place);
        const bool settled = std::isfinite(height);
        if (!settled) {
          height = start.height;
          unsettled.push_back(texel);
        }
        const double rise = height - start.height;
        closed.rise[texel.index] = static_cast<float>(rise);
        if (beyond <= 0.0) {
          ++report.texels;
          ++inside_face;
          if (!settled) ++report.unsettled_texels;
          if (rise > report.tolerance) {
            ++report.changed_texels;
            ++changed_face;
            if (rise > report.largest_rise) {
              report.largest_rise = rise;
              report.largest_face = of;
            }
          }
        }
        return height;
      },
      progress);
  if (!baked) return std::move(baked).error();
  finish_face();
  closed.atlas = std::move(baked).value();
  patch(closed, unsettled, texels);
  for (const auto& [to, from] : continued) {
    closed.rise[to] = closed.rise[from];
    closed.atlas.heights[to] += closed.rise[from];
  }
  for (const auto& [to, from] : copies) {
    closed.atlas.heights[to] = closed.atlas.heights[from];
    closed.rise[to] = closed.rise[from];
  }
  report.changed_share = area > 0.0 ? changed_area / area : 0.0;
  if (progress) progress("closing the relief", 1.0);
  return closed;
}

Result<std::shared_ptr<const ReliefSurface>> wear_closed(const ReliefSurface& original, const ClosedRelief& closed,
                                                         const ReliefSettings& settings) {
  ASPERITY_TRY(TriangleMesh mesh, with_atlas_uvs(original.base().mesh(), closed.atlas));
  ReliefSettings same = settings;
  same.directions = original.report().directions_relaxed ? ShellDirections::relaxed : ShellDirections::least_squares;
  ASPERITY_TRY(std::shared_ptr<const ReliefSurface> surface, wear_atlas(mesh, closed.atlas, same));
  if (surface->shell().directions != original.shell().directions) {
    return closing_error(ErrorCode::bad_mesh, "the filled relief is higher than the shell over its faces holds",
                         "radius", "a smaller radius, a lower relief, or a finer base mesh");
  }
  return surface;
}

}  // namespace asperity
