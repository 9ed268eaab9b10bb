#include "asperity/geometry/winding_number.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace asperity {
namespace {

constexpr std::uint32_t winding_leaf_size = 8;

/// Area-weighted moments of a cluster's normals about its centre c: the integrals of n, n (x - c) and
/// n (x - c)(x - c) / 2, which the derivatives of the solid angle's kernel are contracted with.
struct Moments {
  double area = 0.0;           ///< m²
  Vec3 centre = Vec3::Zero();  ///< area centroid (m)
  Vec3 zeroth = Vec3::Zero();
  Mat3 first = Mat3::Zero();                                             ///< row: component of n
  std::array<Mat3, 3> second{Mat3::Zero(), Mat3::Zero(), Mat3::Zero()};  ///< one for each component of n
};

Moments moments_about(const TriangleMesh& mesh, const std::uint32_t* begin, const std::uint32_t* end) {
  Moments sum;
  for (const std::uint32_t* face = begin; face != end; ++face) {
    const auto [a, b, c] = mesh.corners(*face);
    const double area = 0.5 * (b - a).cross(c - a).norm();
    sum.area += area;
    sum.centre += area / 3.0 * (a + b + c);
  }
  // Areas below the range of double would leave no centroid.
  sum.centre = sum.area > 0.0 ? Vec3(sum.centre / sum.area) : mesh.corners(*begin)[0];
  for (const std::uint32_t* face = begin; face != end; ++face) {
    const auto corners = mesh.corners(*face);
    const Vec3 vector_area = 0.5 * (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    Vec3 middle = Vec3::Zero();
    Mat3 spread = Mat3::Zero();
    for (const Vec3& corner : corners) {
      const Vec3 from_centre = corner - sum.centre;
      middle += from_centre / 3.0;
      spread += from_centre * from_centre.transpose();
    }
    // Mean of (x - c)(x - c) over a triangle.
    spread = (spread + 9.0 * middle * middle.transpose()) / 12.0;
    sum.zeroth += vector_area;
    sum.first += vector_area * middle.transpose();
    for (int i = 0; i < 3; ++i) sum.second[static_cast<std::size_t>(i)] += 0.5 * vector_area[i] * spread;
  }
  return sum;
}

/// The same moments about another centre.
Moments moved(const Moments& from, const Vec3& centre) {
  Moments to = from;
  const Vec3 shift = from.centre - centre;
  to.centre = centre;
  to.first += from.zeroth * shift.transpose();
  for (int i = 0; i < 3; ++i) {
    const Mat3 mixed = shift * from.first.row(i);
    to.second[static_cast<std::size_t>(i)] +=
        0.5 * (mixed + mixed.transpose() + from.zeroth[i] * shift * shift.transpose());
  }
  return to;
}

Moments joined(const Moments& a, const Moments& b) {
  const double area = a.area + b.area;
  const double part = area > 0.0 ? b.area / area : 0.5;
  const Vec3 centre = a.centre + part * (b.centre - a.centre);
  Moments sum = moved(a, centre);
  const Moments other = moved(b, centre);
  sum.area = area;
  sum.zeroth += other.zeroth;
  sum.first += other.first;
  for (std::size_t i = 0; i < 3; ++i) sum.second[i] += other.second[i];
  return sum;
}

/// Which coefficient of a homogeneous polynomial in x, y, z the product of these coordinates belongs to: ordered by how
/// many of them are not x, then by how many are z.
template <class... Axes>
std::size_t product_index(Axes... axes) {
  const int others = (... + (axes > 0 ? 1 : 0));
  return static_cast<std::size_t>(others * (others + 1) / 2 + (... + (axes == 2 ? 1 : 0)));
}

/// With r = x - p, R = |r|, u = r / R the kernel r / R³ has the derivatives (I - 3 u u) / R³ and
/// (-3 (I u + two turns of it) + 15 u u u) / R⁴. As u u = 1, both contractions are homogeneous polynomials in u.
std::array<double, 6> quadrupole_of(const Mat3& first) {
  std::array<double, 6> coefficients{};
  for (int i = 0; i < 3; ++i) {
    coefficients[product_index(i, i)] += first.trace();
    for (int j = 0; j < 3; ++j) coefficients[product_index(i, j)] -= 3.0 * first(i, j);
  }
  return coefficients;
}

std::array<double, 10> octupole_of(const std::array<Mat3, 3>& second) {
  std::array<double, 10> coefficients{};
  for (int i = 0; i < 3; ++i) {
    const Mat3& moment = second[static_cast<std::size_t>(i)];
    double linear = moment.trace();
    for (int j = 0; j < 3; ++j) {
      linear += 2.0 * second[static_cast<std::size_t>(j)](j, i);
      for (int k = 0; k < 3; ++k) coefficients[product_index(i, j, k)] += 15.0 * moment(j, k);
    }
    for (int j = 0; j < 3; ++j) coefficients[product_index(i, j, j)] -= 3.0 * linear;
  }
  return coefficients;
}

}  // namespace

class WindingNumber::Builder {
 public:
  explicit Builder(WindingNumber& tree) : tree_(tree), mesh_(*tree.mesh_) {}

  void run() {
    const auto count = static_cast<std::uint32_t>(mesh_.triangles().size());
    tree_.faces_.resize(count);
    centroids_.resize(count);
    for (std::uint32_t face = 0; face < count; ++face) {
      const auto [a, b, c] = mesh_.corners(face);
      tree_.faces_[face] = face;
      centroids_[face] = (a + b + c) / 3.0;
    }
    tree_.nodes_.reserve(4 * std::size_t{count} / winding_leaf_size + 1);
    if (count > 0) add(0, count);
    tree_.nodes_.shrink_to_fit();
  }

 private:
  /// Adds the cluster of faces_[begin, end) and everything below it. As the median halves, the depth is below 32.
  Moments add(std::uint32_t begin, std::uint32_t end) {
    const std::size_t node = tree_.nodes_.size();
    tree_.nodes_.emplace_back();
    Moments moments;
    if (end - begin <= winding_leaf_size) {
      moments = moments_about(mesh_, tree_.faces_.data() + begin, tree_.faces_.data() + end);
      tree_.nodes_[node].first = begin;
      tree_.nodes_[node].count = end - begin;
    } else {
      const std::uint32_t middle = split(begin, end);
      const Moments lower = add(begin, middle);
      moments = joined(lower, add(middle, end));
    }
    Node& added = tree_.nodes_[node];
    added.end = static_cast<std::uint32_t>(tree_.nodes_.size());
    added.centre = moments.centre;
    added.reach_squared = beta * beta * squared_radius(moments.centre, begin, end);
    added.dipole = moments.zeroth;
    added.quadrupole = quadrupole_of(moments.first);
    added.octupole = octupole_of(moments.second);
    return moments;
  }

  std::uint32_t split(std::uint32_t begin, std::uint32_t end) {
    Box box;
    for (std::uint32_t i = begin; i < end; ++i) box.include(centroids_[tree_.faces_[i]]);
    int axis = 0;
    box.extent().maxCoeff(&axis);
    const std::uint32_t middle = begin + (end - begin) / 2;
    const auto faces = tree_.faces_.begin();
    // By the face's number where centroids are equal, so that the tree is the same with every standard library.
    std::nth_element(faces + begin, faces + middle, faces + end, [&](std::uint32_t a, std::uint32_t b) {
      const double at_a = centroids_[a][axis];
      const double at_b = centroids_[b][axis];
      return at_a < at_b || (at_a == at_b && a < b);
    });
    return middle;
  }

  [[nodiscard]] double squared_radius(const Vec3& centre, std::uint32_t begin, std::uint32_t end) const {
    double largest = 0.0;
    for (std::uint32_t i = begin; i < end; ++i) {
      for (const Vec3& corner : mesh_.corners(tree_.faces_[i])) {
        largest = std::max(largest, (corner - centre).squaredNorm());
      }
    }
    return largest;
  }

  WindingNumber& tree_;
  const TriangleMesh& mesh_;
  std::vector<Vec3> centroids_;
};

WindingNumber::WindingNumber(const TriangleMesh& mesh) : mesh_(&mesh) {
  Builder(*this).run();
}

double WindingNumber::expansion(const Node& node, const Vec3& offset, double squared_distance) noexcept {
  const double inverse = 1.0 / std::sqrt(squared_distance);
  const double x = offset.x() * inverse;
  const double y = offset.y() * inverse;
  const double z = offset.z() * inverse;
  const double dipole = node.dipole.x() * x + node.dipole.y() * y + node.dipole.z() * z;
  const auto& q = node.quadrupole;
  const double quadrupole = x * (q[0] * x + q[1] * y + q[2] * z) + y * (q[3] * y + q[4] * z) + q[5] * z * z;
  const auto& o = node.octupole;
  const double octupole = x * (x * (o[0] * x + o[1] * y + o[2] * z) + y * (o[3] * y + o[4] * z) + o[5] * z * z) +
                          y * (y * (o[6] * y + o[7] * z) + o[8] * z * z) + o[9] * z * z * z;
  constexpr double per_sphere = 0.25 * std::numbers::inv_pi;
  return per_sphere * inverse * inverse * (dipole + inverse * (quadrupole + inverse * octupole));
}

double WindingNumber::at(const Vec3& p) const noexcept {
  if (!p.allFinite()) return 0.0;
  double winding = 0.0;
  for (std::size_t i = 0; i < nodes_.size();) {
    const Node& node = nodes_[i];
    const Vec3 offset = node.centre - p;
    const double squared_distance = offset.squaredNorm();
    if (squared_distance > node.reach_squared) {
      winding += expansion(node, offset, squared_distance);
      i = node.end;
      continue;
    }
    for (std::uint32_t k = node.first; k < node.first + node.count; ++k) {
      const auto [a, b, c] = mesh_->corners(faces_[k]);
      winding += triangle_winding(a, b, c, p);
    }
    ++i;
  }
  return winding;
}

double triangle_winding(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& p) noexcept {
  const Vec3 to_a = a - p;
  const Vec3 to_b = b - p;
  const Vec3 to_c = c - p;
  const double length_a = to_a.norm();
  const double length_b = to_b.norm();
  const double length_c = to_c.norm();
  const double volume = to_a.dot(to_b.cross(to_c));
  const double denominator = length_a * length_b * length_c + to_a.dot(to_b) * length_c + to_b.dot(to_c) * length_a +
                             to_c.dot(to_a) * length_b;
  return std::atan2(volume, denominator) * (0.5 * std::numbers::inv_pi);
}

}  // namespace asperity
