#include "asperity/surface/coat.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace asperity {

namespace {

// More repeats than this would make slopes that no double, let alone a hand, can follow.
constexpr double most_repeats = 1e9;

struct TextureFrame {
  Vec2 st;          ///< texture coordinates
  Vec3 gradient_s;  ///< of s over the surface (1/m)
  Vec3 gradient_t;
};

std::array<Vec2, 3> corner_coordinates(const TriangleMesh& mesh, std::uint32_t face,
                                       const CoatSettings& settings) noexcept {
  std::array<Vec2, 3> st;
  if (settings.mapping == Mapping::per_face) {
    st = {Vec2(0.0, 0.0), Vec2(1.0, 0.0), Vec2(0.5, 0.5 * std::numbers::sqrt3)};
  } else {
    const auto& uvs = mesh.uvs(face);
    for (std::size_t i = 0; i < 3; ++i) st[i] = uvs[i].cast<double>();
  }
  for (Vec2& corner : st) corner = corner.cwiseProduct(settings.repeat);
  return st;
}

TextureFrame texture_frame(const TriangleMesh& mesh, std::uint32_t face, const BarycentricFrame& frame,
                           const Vec3& barycentric, const CoatSettings& settings) noexcept {
  const auto st = corner_coordinates(mesh, face, settings);
  TextureFrame texture{Vec2::Zero(), Vec3::Zero(), Vec3::Zero()};
  for (std::size_t i = 0; i < 3; ++i) {
    texture.st += barycentric[static_cast<int>(i)] * st[i];
    texture.gradient_s += st[i].x() * frame.gradient[i];
    texture.gradient_t += st[i].y() * frame.gradient[i];
  }
  return texture;
}

/// Slope (m/m) that a tangent-space normal stands for. Normals as flat as this bound are steeper than any hand can
/// follow.
Vec2 slope_of(const Vec3& normal) noexcept {
  const double up = std::max(normal.z(), 1e-3);
  return {-normal.x() / up, -normal.y() / up};
}

Vec3 unit_or_zero(const Vec3& v) noexcept {
  const double length = v.norm();
  return length > 0.0 ? Vec3(v / length) : Vec3(Vec3::Zero());
}

}  // namespace

BarycentricFrame barycentric_frame(const TriangleMesh& mesh, std::uint32_t face) noexcept {
  const auto [a, b, c] = mesh.corners(face);
  const Vec3 cross = (b - a).cross(c - a);
  const double twice_area = cross.norm();
  BarycentricFrame frame;
  frame.normal = cross / twice_area;
  frame.corner = a;
  frame.gradient[1] = frame.normal.cross(a - c) / twice_area;
  frame.gradient[2] = frame.normal.cross(b - a) / twice_area;
  frame.gradient[0] = -frame.gradient[1] - frame.gradient[2];
  return frame;
}

Result<Coat> Coat::build(const TriangleMesh& mesh, std::shared_ptr<const Mesostructure> maps,
                         const CoatSettings& settings) {
  if (!settings.repeat.allFinite() || settings.repeat.minCoeff() <= 0.0 || settings.repeat.maxCoeff() > most_repeats) {
    return Error{ErrorCode::bad_value,
                 fmt::format("is {} x {}", settings.repeat.x(), settings.repeat.y()),
                 {},
                 "repeat",
                 "numbers above 0, at most 1e9"};
  }
  if (settings.mapping == Mapping::uv && !mesh.has_uvs()) {
    return Error{ErrorCode::mismatch,
                 "is \"uv\", but the mesh has no texture coordinates",
                 {},
                 "mapping",
                 "\"triplanar\" or \"per_face\""};
  }
  Coat coat;
  coat.maps_ = std::move(maps);
  coat.settings_ = settings;
  const HeightMap& heights = coat.maps_->heights();
  if (settings.mapping == Mapping::triplanar) {
    coat.texel_size_ = std::min(coat.maps_->tile().x() / heights.width(), coat.maps_->tile().y() / heights.height());
    return coat;
  }
  std::vector<double> sizes;
  const auto faces = static_cast<std::uint32_t>(mesh.triangles().size());
  const std::uint32_t stride = std::max(1U, faces / 4096U);
  for (std::uint32_t face = 0; face < faces; face += stride) {
    const auto corners = corner_coordinates(mesh, face, settings);
    const Vec2 one = corners[1] - corners[0];
    const Vec2 other = corners[2] - corners[0];
    if (one.x() * other.y() == one.y() * other.x()) continue;
    const TextureFrame texture =
        texture_frame(mesh, face, barycentric_frame(mesh, face), Vec3(1.0, 0.0, 0.0), settings);
    const double texels =
        std::max(texture.gradient_s.norm() * heights.width(), texture.gradient_t.norm() * heights.height());
    if (texels > 0.0 && std::isfinite(texels)) sizes.push_back(1.0 / texels);
  }
  if (sizes.empty()) {
    return Error{ErrorCode::mismatch,
                 "is \"uv\", but the texture coordinates span no area on any face looked at",
                 {},
                 "mapping",
                 "\"triplanar\" or \"per_face\""};
  }
  std::nth_element(sizes.begin(), sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2), sizes.end());
  coat.texel_size_ = sizes[sizes.size() / 2];
  return coat;
}

CoatSample Coat::sample(const TriangleMesh& mesh, std::uint32_t face, const Vec3& barycentric) const noexcept {
  return settings_.mapping == Mapping::triplanar ? sample_triplanar(mesh, face, barycentric)
                                                 : sample_flat(mesh, face, barycentric);
}

CoatSample Coat::sample_flat(const TriangleMesh& mesh, std::uint32_t face, const Vec3& barycentric) const noexcept {
  const BarycentricFrame frame = barycentric_frame(mesh, face);
  const TextureFrame texture = texture_frame(mesh, face, frame, barycentric, settings_);
  const MesostructureSample maps = maps_->sample(texture.st);
  CoatSample sample;
  sample.height = maps.height;
  sample.gradient = maps.gradient.x() * texture.gradient_s + maps.gradient.y() * texture.gradient_t;
  if (maps_->has_normal_map()) {
    // The map's axes as they lie on the triangle: along growing s and growing t.
    const Vec3 tangent = unit_or_zero(texture.gradient_s);
    const Vec3 bitangent = unit_or_zero(texture.gradient_t);
    const Vec2 slope = slope_of(maps.normal);
    sample.normal = (frame.normal - slope.x() * tangent - slope.y() * bitangent).normalized();
  } else {
    sample.normal = (frame.normal - sample.gradient).normalized();
  }
  return sample;
}

CoatSample Coat::sample_triplanar(const TriangleMesh& mesh, std::uint32_t face,
                                  const Vec3& barycentric) const noexcept {
  const BarycentricFrame frame = barycentric_frame(mesh, face);
  const TriangleMesh::Triangle& corners = mesh.triangles()[face];
  Vec3 point = Vec3::Zero();
  Vec3 normal = Vec3::Zero();
  Mat3 normal_gradient = Mat3::Zero();  // row a: surface gradient of the interpolated normal's component a
  for (std::size_t i = 0; i < 3; ++i) {
    const double weight = barycentric[static_cast<int>(i)];
    const Vec3 vertex_normal = mesh.vertex_normal(corners[i]);
    point += weight * mesh.positions()[corners[i]];
    normal += weight * vertex_normal;
    normal_gradient += vertex_normal * frame.gradient[i].transpose();
  }
  // Fourth powers of the components, not yet divided by their sum.
  const Vec3 power = normal.array().square().square();
  const double total = std::max(power.sum(), std::numeric_limits<double>::min());
  double height = 0.0;
  Vec3 weighted_gradient = Vec3::Zero();
  Vec3 shading_gradient = Vec3::Zero();
  Vec3 total_gradient = Vec3::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 power_gradient =
        4.0 * normal[axis] * normal[axis] * normal[axis] * normal_gradient.row(axis).transpose();
    total_gradient += power_gradient;
    if (power[axis] <= 0.0) continue;
    const int s = (axis + 1) % 3;
    const int t = (axis + 2) % 3;
    const Vec2 tile = maps_->tile();
    const MesostructureSample maps = maps_->sample(Vec2(point[s] / tile.x(), point[t] / tile.y()));
    Vec3 slope = Vec3::Zero();
    slope[s] = maps.gradient.x() / tile.x();
    slope[t] = maps.gradient.y() / tile.y();
    height += power[axis] * maps.height;
    weighted_gradient += power[axis] * slope + maps.height * power_gradient;
    if (maps_->has_normal_map()) {
      const Vec2 given = slope_of(maps.normal);
      slope[s] = given.x();
      slope[t] = given.y();
    }
    shading_gradient += power[axis] * slope;
  }
  CoatSample sample;
  sample.height = height / total;
  const Vec3 gradient = (weighted_gradient - sample.height * total_gradient) / total;
  sample.gradient = gradient - gradient.dot(frame.normal) * frame.normal;
  const Vec3 shading = maps_->has_normal_map() ? Vec3(shading_gradient / total) : gradient;
  sample.normal = (frame.normal - (shading - shading.dot(frame.normal) * frame.normal)).normalized();
  return sample;
}

}  // namespace asperity
