#include "asperity/geometry/generators.h"

#include <algorithm>
#include <cmath>

#include "asperity/core/rng.h"
#include "asperity/geometry/index_table.h"

namespace asperity {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

constexpr double shortest = 1e-9;
constexpr double longest = 1e9;

/// `value` moved into [low, high]; not-a-number becomes `low`.
double within(double value, double low, double high) {
  return value >= low ? std::min(value, high) : low;
}
double length_within(double value) {
  return within(value, shortest, longest);
}

/// A side beside a longer one; thinner cells would count as without area.
double side_within(double value, double longer) {
  return within(value, 1e-7 * longer, longest);
}

std::uint32_t index(int value) {
  return static_cast<std::uint32_t>(value);
}

MeshSource icosahedron() {
  MeshSource source;
  const double golden = std::numbers::phi;
  for (const double a : {-1.0, 1.0}) {
    for (const double b : {-golden, golden}) {
      source.positions.emplace_back(0.0, a, b);
      source.positions.emplace_back(a, b, 0.0);
      source.positions.emplace_back(b, 0.0, a);
    }
  }
  // The faces are the triples of vertices that are all one edge (2) apart, turned outward.
  const auto& p = source.positions;
  const auto adjacent = [&](std::uint32_t i, std::uint32_t j) { return (p[i] - p[j]).squaredNorm() < 4.5; };
  for (std::uint32_t i = 0; i < 12; ++i) {
    for (std::uint32_t j = i + 1; j < 12; ++j) {
      for (std::uint32_t k = j + 1; k < 12; ++k) {
        if (!adjacent(i, j) || !adjacent(j, k) || !adjacent(i, k)) continue;
        const bool outward = (p[j] - p[i]).cross(p[k] - p[i]).dot(p[i]) > 0.0;
        source.triangles.push_back(outward ? Triangle{i, j, k} : Triangle{i, k, j});
      }
    }
  }
  for (Vec3& position : source.positions) position.normalize();
  return source;
}

/// Numbers the distinct edges of triangles in the order in which they come up.
class EdgeNumbers {
 public:
  explicit EdgeNumbers(std::size_t most) : table_(most) {}
  /// The number of the edge between two vertices; size() as it was before where the edge is new.
  std::uint32_t operator()(std::uint32_t a, std::uint32_t b) {
    const std::uint64_t key = (std::uint64_t{std::min(a, b)} << 32U) | std::max(a, b);
    const std::uint32_t known = table_.find_or_insert(mixed_bits(key), size(), [&](auto i) { return keys_[i] == key; });
    if (known != no_index) return known;
    keys_.push_back(key);
    return size() - 1;
  }
  [[nodiscard]] std::uint32_t size() const { return static_cast<std::uint32_t>(keys_.size()); }

 private:
  IndexTable table_;
  std::vector<std::uint64_t> keys_;
};

/// Cuts every triangle in four at its edges' midpoints, moved out to the unit sphere.
void subdivide_on_sphere(MeshSource& source) {
  EdgeNumbers edges(source.triangles.size() * 3 / 2);
  const auto first = static_cast<std::uint32_t>(source.positions.size());
  const auto midpoint = [&](std::uint32_t a, std::uint32_t b) {
    const std::uint32_t place = first + edges(a, b);
    if (place == source.positions.size())
      source.positions.push_back((source.positions[a] + source.positions[b]).normalized());
    return place;
  };
  std::vector<Triangle> finer;
  finer.reserve(4 * source.triangles.size());
  for (const auto& [a, b, c] : source.triangles) {
    const std::uint32_t ab = midpoint(a, b);
    const std::uint32_t bc = midpoint(b, c);
    const std::uint32_t ca = midpoint(c, a);
    finer.insert(finer.end(), {Triangle{a, ab, ca}, Triangle{ab, b, bc}, Triangle{ca, bc, c}, Triangle{ab, bc, ca}});
  }
  source.triangles = std::move(finer);
}

/// Mean over the distinct edges: an edge of two triangles counts once.
double mean_edge_of(const MeshSource& source) {
  EdgeNumbers edges(3 * source.triangles.size());
  double sum = 0.0;
  for (const Triangle& t : source.triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t next = edges.size();
      if (edges(t[i], t[(i + 1) % 3]) == next)
        sum += (source.positions[t[i]] - source.positions[t[(i + 1) % 3]]).norm();
    }
  }
  return sum / edges.size();
}

void scale_to_mean_edge(MeshSource& source, double mean_edge) {
  const double factor = length_within(mean_edge) / mean_edge_of(source);
  for (Vec3& position : source.positions) position *= factor;
}

/// UVs that run once over the bounding rectangle of flat positions in z = 0.
void set_planar_uvs(MeshSource& source) {
  Box bounds;
  for (const Vec3& position : source.positions) bounds.include(position);
  source.corner_uvs.clear();
  source.corner_uvs.reserve(source.triangles.size());
  for (const Triangle& t : source.triangles) {
    std::array<Vec2f, 3>& uvs = source.corner_uvs.emplace_back();
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec3 part = (source.positions[t[i]] - bounds.lower).cwiseQuotient(bounds.extent());
      uvs[i] = part.head<2>().cast<float>();
    }
  }
}

TrialMeshSettings checked(TrialMeshSettings settings) {
  settings.columns = std::clamp(settings.columns, 1, 1000);
  settings.rows = std::clamp(settings.rows, 1, 1000);
  settings.mean_edge = length_within(settings.mean_edge);
  return settings;
}

/// Rows of cells of two triangles each in z = 0: `place(i, j)` of the vertex in column i and row j; cells are cut from
/// their first corner to the last one, and the other way in even rows where they are to `zigzag`.
template <class PlaceOf>
MeshSource sheet(std::uint32_t columns, std::uint32_t rows, bool zigzag, const PlaceOf& place) {
  MeshSource source;
  source.positions.reserve(std::size_t{columns + 1} * (rows + 1));
  source.triangles.reserve(std::size_t{2} * columns * rows);
  for (std::uint32_t j = 0; j <= rows; ++j) {
    for (std::uint32_t i = 0; i <= columns; ++i) source.positions.push_back(place(i, j));
  }
  for (std::uint32_t j = 0; j < rows; ++j) {
    for (std::uint32_t i = 0; i < columns; ++i) {
      const std::uint32_t a = j * (columns + 1) + i;
      const std::uint32_t d = a + columns + 1;
      const bool back = zigzag && j % 2 == 0;
      source.triangles.push_back({a, a + 1, back ? d : d + 1});
      source.triangles.push_back({back ? a + 1 : a, d + 1, d});
    }
  }
  set_planar_uvs(source);
  return source;
}

/// M_a with edge 1: vertex row j lies at y = j * sqrt(3)/2, odd rows shifted by half an edge.
MeshSource unit_lattice(const TrialMeshSettings& settings) {
  const double height = std::sqrt(3.0) / 2.0;
  return sheet(index(settings.columns), index(settings.rows), true, [&](std::uint32_t i, std::uint32_t j) {
    const double x = i + 0.5 * (j % 2) - 0.5 * settings.columns - 0.25;
    return Vec3(x, (j - 0.5 * settings.rows) * height, 0.0);
  });
}

/// Number of columns whose cells come nearest to squares, among the divisors of `cells`.
std::uint32_t squarest_columns(double width, double depth, std::uint32_t cells) {
  std::uint32_t best = 1;
  double least = infinity;
  for (std::uint32_t divisor = 1; divisor <= cells; ++divisor) {
    if (cells % divisor != 0) continue;
    const double rows = static_cast<double>(cells / divisor);
    const double off_square = std::abs(std::log((width / divisor) / (depth / rows)));
    if (off_square >= least) continue;
    least = off_square;
    best = divisor;
  }
  return best;
}

MeshSource rectangle(double width, double depth, std::uint32_t columns, std::uint32_t rows) {
  return sheet(columns, rows, false, [&](std::uint32_t i, std::uint32_t j) {
    return Vec3((static_cast<double>(i) / columns - 0.5) * width, (static_cast<double>(j) / rows - 0.5) * depth, 0.0);
  });
}

/// Position on ring `ring`, `step` of 6 * ring around, of a cup of radius 1 whose rim is at `opening`.
Vec3 cup_point(int ring, int step, int rings, double opening) {
  const double polar = opening * ring / rings;
  const double around = ring == 0 ? 0.0 : 2.0 * std::numbers::pi * step / (6.0 * ring);
  return {std::sin(polar) * std::cos(around), std::sin(polar) * std::sin(around), -std::cos(polar)};
}

/// One of six sectors between ring - 1 and ring; `inner` and `outer` are the indices of the rings' first vertices.
void add_cup_sector(MeshSource& source, std::uint32_t ring, std::uint32_t sector, std::uint32_t inner,
                    std::uint32_t outer) {
  const std::uint32_t inner_count = ring == 1 ? 1 : 6 * (ring - 1);
  const auto in = [&](std::uint32_t k) { return inner + (sector * (ring - 1) + k) % inner_count; };
  const auto out = [&](std::uint32_t k) { return outer + (sector * ring + k) % (6 * ring); };
  for (std::uint32_t k = 0; k < ring; ++k) {
    source.triangles.push_back({in(k), out(k), out(k + 1)});
    if (k + 1 < ring) source.triangles.push_back({in(k), out(k + 1), in(k + 1)});
  }
}

/// A mesh whose triangles are cut into `parts` * `parts`: its vertices are the base's, then those inside its edges,
/// then those inside its faces, in the order in which the faces come to them.
class Displacement {
 public:
  Displacement(const TriangleMesh& base, std::uint32_t parts)
      : base_(base), parts_(parts), edges_(3 * base.triangles().size()), points_(base.positions().size()) {}

  MeshSource along(const HeightOverFace& height) {
    for (std::uint32_t face = 0; face < base_.triangles().size(); ++face) cut(face, height);
    MeshSource source;
    source.triangles = std::move(triangles_);
    source.corner_uvs = std::move(uvs_);
    source.positions.reserve(points_.size());
    for (const Point& point : points_)
      source.positions.push_back(point.place + (point.heights / point.faces) * point.direction);
    return source;
  }

 private:
  struct Point {
    Vec3 place = Vec3::Zero();
    Vec3 direction = Vec3::Zero();
    double heights = 0.0;  // sum over the faces that share it
    double faces = 1.0;
  };

  void cut(std::uint32_t face, const HeightOverFace& height) {
    number_edges(face);
    row_.clear();
    std::vector<std::uint32_t> above;
    for (std::uint32_t j = 0; j <= parts_; ++j) {
      above = std::move(row_);
      row_.clear();
      for (std::uint32_t i = 0; i + j <= parts_; ++i) row_.push_back(add(face, i, j, height));
      for (std::uint32_t i = 0; j > 0 && i < row_.size(); ++i) {
        emit(face, {above[i], above[i + 1], row_[i]}, {Step{i, j - 1}, Step{i + 1, j - 1}, Step{i, j}});
        if (i + 1 < row_.size())
          emit(face, {above[i + 1], row_[i + 1], row_[i]}, {Step{i + 1, j - 1}, Step{i + 1, j}, Step{i, j}});
      }
    }
  }

  /// Steps from the first corner towards the second and the third.
  struct Step {
    std::uint32_t i = 0;
    std::uint32_t j = 0;
  };
  [[nodiscard]] Vec3 barycentric(const Step& at) const { return Vec3(parts_ - at.i - at.j, at.i, at.j) / parts_; }

  /// First of the parts_ - 1 points inside each edge of `face`, made when no face before has the edge.
  void number_edges(std::uint32_t face) {
    const Triangle& t = base_.triangles()[face];
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k];
      const std::uint32_t b = t[(k + 1) % 3];
      const std::uint32_t number = edges_(a, b);
      if (number == first_inside_.size()) {
        first_inside_.push_back(index_of_next());
        points_.resize(points_.size() + parts_ - 1);
      }
      edge_[k] = first_inside_[number];
      forward_[k] = a < b;
    }
  }

  std::uint32_t add(std::uint32_t face, std::uint32_t i, std::uint32_t j, const HeightOverFace& height) {
    const Triangle& t = base_.triangles()[face];
    const std::uint32_t rest = parts_ - i - j;
    const auto inside = [&](std::size_t k, std::uint32_t step) {
      return edge_[k] + (forward_[k] ? step : parts_ - step) - 1;
    };
    std::uint32_t id = 0;
    if (rest == parts_ || i == parts_ || j == parts_) {
      id = t[rest == parts_ ? 0 : (i == parts_ ? 1 : 2)];
    } else if (j == 0) {
      id = inside(0, i);
    } else if (rest == 0) {
      id = inside(1, j);
    } else if (i == 0) {
      id = inside(2, rest);
    } else {
      id = index_of_next();
      points_.emplace_back();
    }
    const Vec3 b = barycentric({i, j});
    Point& point = points_[id];
    if (point.direction.isZero(0.0)) {
      const auto corners = base_.corners(face);
      point.place = b[0] * corners[0] + b[1] * corners[1] + b[2] * corners[2];
      point.direction = direction(face, b);
    } else {
      point.faces += 1.0;
    }
    point.heights += height(face, b);
    return id;
  }

  [[nodiscard]] Vec3 direction(std::uint32_t face, const Vec3& b) const {
    const Triangle& t = base_.triangles()[face];
    const Vec3 mixed =
        b[0] * base_.vertex_normal(t[0]) + b[1] * base_.vertex_normal(t[1]) + b[2] * base_.vertex_normal(t[2]);
    const double length = mixed.norm();
    return length > 1e-6 ? Vec3(mixed / length) : base_.face_normal(face);
  }

  void emit(std::uint32_t face, const Triangle& triangle, const std::array<Step, 3>& steps) {
    triangles_.push_back(triangle);
    if (!base_.has_uvs()) return;
    std::array<Vec2f, 3>& uvs = uvs_.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3f b = barycentric(steps[k]).cast<float>();
      const std::array<Vec2f, 3> corners = base_.uvs(face);
      uvs[k] = b[0] * corners[0] + b[1] * corners[1] + b[2] * corners[2];
    }
  }

  [[nodiscard]] std::uint32_t index_of_next() const { return static_cast<std::uint32_t>(points_.size()); }

  const TriangleMesh& base_;
  std::uint32_t parts_;
  EdgeNumbers edges_;
  std::vector<std::uint32_t> first_inside_;  // the first point inside each of the edges numbered so far
  std::array<std::uint32_t, 3> edge_{};      // of the face at hand
  std::array<bool, 3> forward_{};
  std::vector<std::uint32_t> row_;
  std::vector<Point> points_;
  std::vector<Triangle> triangles_;
  std::vector<std::array<Vec2f, 3>> uvs_;
};

/// Smooth random function on the unit sphere, |value| <= 1: a few waves of random direction and phase.
class RandomWaves {
 public:
  explicit RandomWaves(Rng& rng) {
    for (Wave& wave : waves_) {
      const double z = rng.uniform(-1.0, 1.0);
      const double around = rng.uniform(0.0, 2.0 * std::numbers::pi);
      const double across = std::sqrt(1.0 - z * z);
      const double frequency = rng.uniform(1.0, 6.0);
      wave.direction = frequency * Vec3(across * std::cos(around), across * std::sin(around), z);
      wave.phase = rng.uniform(0.0, 2.0 * std::numbers::pi);
      wave.amplitude = rng.uniform(0.2, 1.0) / frequency;
      total_ += wave.amplitude;
    }
  }
  [[nodiscard]] double at(const Vec3& direction) const {
    double sum = 0.0;
    for (const Wave& wave : waves_) sum += wave.amplitude * std::sin(wave.direction.dot(direction) + wave.phase);
    return sum / total_;
  }

 private:
  struct Wave {
    Vec3 direction;
    double phase = 0.0;
    double amplitude = 0.0;
  };
  std::array<Wave, 8> waves_;
  double total_ = 0.0;
};

}  // namespace

MeshSource icosphere(int subdivisions, double radius) {
  MeshSource source = icosahedron();
  const int times = std::clamp(subdivisions, 0, 9);
  for (int i = 0; i < times; ++i) subdivide_on_sphere(source);
  const double checked_radius = length_within(radius);
  for (Vec3& position : source.positions) position *= checked_radius;
  const std::array<Vec2f, 3> equilateral = {Vec2f(0.0F, 0.0F), Vec2f(1.0F, 0.0F),
                                            Vec2f(0.5F, static_cast<float>(std::sqrt(3.0) / 2.0))};
  source.corner_uvs.assign(source.triangles.size(), equilateral);
  return source;
}

double icosphere_radius_for_edge(int subdivisions, double mean_edge) {
  return length_within(mean_edge) / mean_edge_of(icosphere(subdivisions, 1.0));
}

MeshSource plane_grid(double width, double depth, int columns, int rows) {
  const double longer = std::max(length_within(width), length_within(depth));
  return rectangle(side_within(width, longer), side_within(depth, longer), index(std::clamp(columns, 1, 2048)),
                   index(std::clamp(rows, 1, 2048)));
}

MeshSource plane_grid(double width, double depth, std::uint32_t triangles) {
  const std::uint32_t cells = std::clamp(triangles, 2U, 4'194'304U) / 2;
  const double longer = std::max(length_within(width), length_within(depth));
  const double checked_width = side_within(width, longer);
  const double checked_depth = side_within(depth, longer);
  const std::uint32_t columns = squarest_columns(checked_width, checked_depth, cells);
  return rectangle(checked_width, checked_depth, columns, cells / columns);
}

MeshSource trial_mesh_a(const TrialMeshSettings& settings) {
  const TrialMeshSettings used = checked(settings);
  MeshSource source = unit_lattice(used);
  for (Vec3& position : source.positions) position *= used.mean_edge;
  return source;
}

namespace {

/// Bends the unit lattice along its rows: row after row stands where the profile (y, z) says.
void lay_along(MeshSource& lattice, const TrialMeshSettings& settings, const std::vector<Vec2>& profile) {
  const Vec2 middle(0.5 * (profile.front().x() + profile.back().x()), 0.0);
  const std::size_t stride = static_cast<std::size_t>(settings.columns) + 1;
  for (std::size_t i = 0; i < lattice.positions.size(); ++i) {
    Vec3& position = lattice.positions[i];
    const Vec2 row = profile[i / stride] - middle;
    position = settings.mean_edge * Vec3(position.x(), row.x(), row.y());
  }
}

/// Height of a strip of the unit lattice.
const double strip = std::sqrt(3.0) / 2.0;

std::vector<Vec2> arch_profile(double largest_fold, int rows) {
  const int middle = rows / 2;
  const auto fold = [&](int row) { return rows > 1 ? largest_fold * std::exp2(-std::abs(row - middle)) : 0.0; };
  double turn = 0.0;
  for (int row = 1; row < rows; ++row) turn += fold(row);
  std::vector<Vec2> profile = {Vec2::Zero()};
  double slope = 0.5 * turn;
  for (int row = 1; row <= rows; ++row) {
    profile.push_back(profile.back() + strip * Vec2(std::cos(slope), std::sin(slope)));
    slope -= fold(row);
  }
  return profile;
}

}  // namespace

MeshSource trial_mesh_b(double largest_fold, const TrialMeshSettings& settings, TrialBend bend) {
  const TrialMeshSettings used = checked(settings);
  MeshSource source = unit_lattice(used);
  if (bend == TrialBend::arch) {
    lay_along(source, used, arch_profile(within(largest_fold, 1e-3, std::numbers::pi / 4.0), used.rows));
    return source;
  }
  // A face's normal points to the centre, on the sphere, of its circumcircle's image. For two unit triangles beside an
  // edge at the pole these centres are fold = 2 (atan(sqrt(3) x) - atan(x / sqrt(3))) apart, with x = 1 / (4 radius).
  const double t = std::tan(0.5 * within(largest_fold, 1e-3, std::numbers::pi / 4.0));
  const double x = t / (1.0 / std::sqrt(3.0) + std::sqrt(1.0 / 3.0 - t * t));
  const double radius = 0.25 / x;
  for (Vec3& position : source.positions) {
    const double part = position.squaredNorm() / (4.0 * radius * radius);
    position = Vec3(position.x(), position.y(), -2.0 * radius * part) / (1.0 + part);
  }
  scale_to_mean_edge(source, used.mean_edge);
  return source;
}

MeshSource trial_mesh_c(const TrialMeshSettings& settings, std::span<const double> ridge_angles) {
  const TrialMeshSettings used = checked(settings);
  MeshSource source = unit_lattice(used);
  constexpr double pi = std::numbers::pi;
  constexpr std::array<double, 3> papers = {pi / 3.0, pi / 2.0, 2.0 * pi / 3.0};
  if (ridge_angles.empty()) ridge_angles = papers;
  std::vector<Vec2> profile = {Vec2::Zero()};  // y and z of each row
  for (std::size_t j = 0; j < static_cast<std::size_t>(used.rows); ++j) {
    const double ridge = within(ridge_angles[j / 2 % ridge_angles.size()], pi / 18.0, pi);
    const double slope = (j % 2 == 0 ? 0.5 : -0.5) * (pi - ridge);
    profile.push_back(profile.back() + strip * Vec2(std::cos(slope), std::sin(slope)));
  }
  lay_along(source, used, profile);
  return source;
}

MeshSource trial_mesh_e(int rings, double opening, double mean_edge) {
  const int ring_count = std::clamp(rings, 1, 512);
  const double rim = within(opening, 0.1, 3.0);
  MeshSource source;
  std::vector<Vec2f> disc;
  std::uint32_t inner = 0;
  for (int ring = 0; ring <= ring_count; ++ring) {
    const auto outer = static_cast<std::uint32_t>(source.positions.size());
    for (int step = 0; step < std::max(1, 6 * ring); ++step) {
      source.positions.push_back(cup_point(ring, step, ring_count, rim));
      const Vec2 around = ring == 0 ? Vec2::Zero() : Vec2(source.positions.back().head<2>().normalized());
      disc.push_back((Vec2(0.5, 0.5) + 0.5 * ring / ring_count * around).cast<float>());
    }
    for (std::uint32_t sector = 0; ring > 0 && sector < 6; ++sector) {
      add_cup_sector(source, index(ring), sector, inner, outer);
    }
    inner = outer;
  }
  for (const auto& [a, b, c] : source.triangles) source.corner_uvs.push_back({disc[a], disc[b], disc[c]});
  scale_to_mean_edge(source, mean_edge);
  return source;
}

int most_graded_triangles(double grading) {
  const double halvings = -std::log2(within(grading, 0.1, 0.9));
  return static_cast<int>(std::min(40.0, 40.0 / halvings));
}

MeshSource trial_mesh_f(int triangles, double mean_edge, double grading) {
  const int count = std::clamp(triangles, 1, most_graded_triangles(grading));
  const double ratio = within(grading, 0.1, 0.9);
  MeshSource source;
  Box bounds;
  // Vertices alternate between two rays that meet on the right, each the foot of the perpendicular from the one before:
  // by the cosine of the rays' angle nearer to their meeting.
  const double half_angle = 0.5 * std::atan2(std::sqrt(1.0 - ratio), std::sqrt(ratio));
  for (int k = 0; k < count + 2; ++k) {
    const double from_tip = std::pow(ratio, 0.5 * k);
    const double tilt = k % 2 == 0 ? -half_angle : half_angle;
    source.positions.emplace_back(-from_tip * std::cos(tilt), from_tip * std::sin(tilt), 0.0);
    bounds.include(source.positions.back());
  }
  for (Vec3& position : source.positions) position -= bounds.centre();
  const std::array<Vec2f, 3> uvs = {Vec2f(1.0F, 0.0F), Vec2f(0.0F, 1.0F), Vec2f(0.0F, 0.0F)};
  for (std::uint32_t k = 0; k < index(count); ++k) {
    const bool even = k % 2 == 0;
    source.triangles.push_back(even ? Triangle{k, k + 2, k + 1} : Triangle{k, k + 1, k + 2});
    source.corner_uvs.push_back(even ? std::array<Vec2f, 3>{uvs[0], uvs[2], uvs[1]} : uvs);
  }
  scale_to_mean_edge(source, mean_edge);
  return source;
}

MeshSource displaced_mesh(const TriangleMesh& base, int subdivisions, const HeightOverFace& height) {
  int times = std::clamp(subdivisions, 0, 10);
  while (times > 0 && (base.triangles().size() << static_cast<unsigned>(2 * times)) > most_displaced_triangles) --times;
  return Displacement(base, 1U << static_cast<unsigned>(times)).along(height);
}

MeshSource trial_mesh_g(int subdivisions, const HeightOverFace& height, double largest_fold,
                        const TrialMeshSettings& settings) {
  return displaced_mesh(TriangleMesh::build(trial_mesh_b(largest_fold, settings)).value(), subdivisions, height);
}

MeshSource box_mesh(const Vec3& size) {
  MeshSource source;
  for (int i = 0; i < 8; ++i) {
    source.positions.emplace_back((i & 1) != 0 ? 0.5 : -0.5, (i & 2) != 0 ? 0.5 : -0.5, (i & 4) != 0 ? 0.5 : -0.5);
  }
  const double longest_side = std::max({length_within(size.x()), length_within(size.y()), length_within(size.z())});
  for (Vec3& position : source.positions) {
    for (int axis = 0; axis < 3; ++axis) position[axis] *= side_within(size[axis], longest_side);
  }
  const std::array<std::array<std::uint32_t, 4>, 6> sides = {
      {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}};
  const std::array<Vec2f, 4> uv = {Vec2f(0.0F, 0.0F), Vec2f(1.0F, 0.0F), Vec2f(1.0F, 1.0F), Vec2f(0.0F, 1.0F)};
  for (const auto& [a, b, c, d] : sides) {
    source.triangles.push_back({a, b, c});
    source.corner_uvs.push_back({uv[0], uv[1], uv[2]});
    source.triangles.push_back({a, c, d});
    source.corner_uvs.push_back({uv[0], uv[2], uv[3]});
  }
  return source;
}

MeshSource random_closed_mesh(std::uint64_t seed, int subdivisions, double radius, double roughness) {
  MeshSource source = icosphere(std::clamp(subdivisions, 0, 8), 1.0);
  Rng rng(seed);
  const RandomWaves waves(rng);
  const double used_radius = length_within(radius);
  const double used_roughness = within(roughness, 0.0, 0.9);
  constexpr double noise_share = 0.1;
  for (Vec3& position : source.positions) {
    const double smooth = (1.0 - noise_share) * waves.at(position);
    const double noise = noise_share * rng.uniform(-1.0, 1.0);
    position *= used_radius * (1.0 + used_roughness * (smooth + noise));
  }
  return source;
}

}  // namespace asperity
