#include "asperity/surface/coat.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <vector>

#include "asperity/core/processor.h"
#include "asperity/surface/detail/four.h"
#include "asperity/surface/detail/triplanar.h"

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
    const std::array<Vec2f, 3> uvs = mesh.uvs(face);
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

Status check_repeat(const Vec2& repeat) {
  if (repeat.allFinite() && repeat.minCoeff() > 0.0 && repeat.maxCoeff() <= most_repeats) return success();
  return bad_value(fmt::format("is {} x {}", repeat.x(), repeat.y()), "repeat", "numbers above 0, at most 1e9");
}

Error bad_mapping(std::string what) {
  return refused(ErrorCode::mismatch, std::move(what), "mapping", "\"triplanar\" or \"per_face\"");
}

/// Size of a texel on the surface (m): the median over a sample of the faces; 0 when no face spans any.
double median_texel(const TriangleMesh& mesh, const Mesostructure& maps, const CoatSettings& settings) {
  const HeightMap& heights = maps.heights();
  if (settings.mapping == Mapping::triplanar)
    return std::min(maps.tile().x() / heights.width(), maps.tile().y() / heights.height());
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
  if (sizes.empty()) return 0.0;
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  return *middle;
}

/// Marks the vertices at whose edges texture coordinates differ between the two faces, other than by whole repeats.
/// Leaves `marked` empty when there are none.
void mark_uv_seams(const TriangleMesh& mesh, const CoatSettings& settings, bool repeats,
                   std::vector<std::uint8_t>& marked) {
  const auto mark = [&](std::uint32_t face, int edge) {
    if (marked.empty()) marked.resize(mesh.positions().size(), 0);
    for (int end = 0; end < 2; ++end) marked[mesh.triangles()[face][static_cast<std::size_t>((edge + end) % 3)]] = 1;
  };
  const auto same = [&](const Vec2& a, const Vec2& b) {
    const Vec2 apart = a - b;
    for (int k = 0; k < 2; ++k) {
      // Texture coordinates are stored as floats.
      const double off = repeats ? apart[k] - std::round(apart[k]) : apart[k];
      if (std::abs(off) > 1e-6 * (1.0 + std::abs(a[k]))) return false;
    }
    return true;
  };
  for (std::uint32_t face = 0; face < mesh.triangles().size(); ++face) {
    const auto here = corner_coordinates(mesh, face, settings);
    for (int edge = 0; edge < 3; ++edge) {
      const std::uint32_t other = mesh.neighbour(face, edge);
      if (other == no_index || other < face) continue;
      const auto there = corner_coordinates(mesh, other, settings);
      Vec2 shift[2];
      for (int end = 0; end < 2; ++end) {
        const auto k = static_cast<std::size_t>((edge + end) % 3);
        const std::size_t j = mesh.corner_of(other, mesh.triangles()[face][k]);
        // An end that does not fit counts as one repeat off.
        shift[end] = same(here[k], there[j]) ? Vec2(here[k] - there[j]) : Vec2(end + 1.0, 0.0);
        if (!same(here[k], there[j])) mark(face, edge);
      }
      // Both ends fit, but by different whole repeats: the edge runs another way through the map.
      if ((shift[0] - shift[1]).norm() > 0.5) mark(face, edge);
    }
  }
}

/// What a map says, by u and v along which its texture coordinates change so.
HeightJet along(const HeightCurvature& map, const Vec2& st_u, const Vec2& st_v) noexcept {
  const auto second = [&](const Vec2& a, const Vec2& b) {
    return map.ss * a.x() * b.x() + map.st * (a.x() * b.y() + a.y() * b.x()) + map.tt * a.y() * b.y();
  };
  return {map.height,         map.gradient.dot(st_u), map.gradient.dot(st_v),
          second(st_u, st_u), second(st_u, st_v),     second(st_v, st_v)};
}

}  // namespace

BarycentricFrame barycentric_frame(const TriangleMesh& mesh, std::uint32_t face) noexcept {
  const auto [a, b, c] = mesh.corners(face);
  return barycentric_frame(a, b, c);
}

BarycentricFrame barycentric_frame(const Vec3& a, const Vec3& b, const Vec3& c) noexcept {
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
  return build(mesh, CoatParts{{std::move(maps)}, {}, {}, nullptr}, settings);
}

Result<Coat> Coat::build(const TriangleMesh& mesh, std::vector<std::shared_ptr<const Mesostructure>> maps,
                         std::vector<std::uint8_t> map_of_face, const CoatSettings& settings) {
  return build(mesh, CoatParts{std::move(maps), std::move(map_of_face), {}, nullptr}, settings);
}

Result<Coat> Coat::build(const TriangleMesh& mesh, CoatParts parts, const CoatSettings& settings) {
  auto& [maps, map_of_face, layers, materials] = parts;
  ASPERITY_CHECK(check_repeat(settings.repeat));
  if (auto valid = validate(settings.stitching); !valid) return std::move(valid).error().at("stitching");
  if (settings.mapping == Mapping::uv && !mesh.has_uvs())
    return bad_mapping("is \"uv\", but the mesh has no texture coordinates");
  const auto most = map_of_face.empty() ? std::uint8_t{0} : *std::max_element(map_of_face.begin(), map_of_face.end());
  if (maps.empty() || most >= maps.size() || (!map_of_face.empty() && map_of_face.size() != mesh.triangles().size())) {
    return refused(
        ErrorCode::mismatch,
        fmt::format("{} maps, {} faces named, {} triangles", maps.size(), map_of_face.size(), mesh.triangles().size()),
        "map_of_face", "one number of a map for every triangle");
  }
  Coat coat;
  coat.mesh_ = mesh.fingerprint();
  coat.mesh_triangles_ = mesh.triangles().size();
  coat.settings_ = settings;
  coat.lowest_ = infinity;
  coat.highest_ = -infinity;
  for (const auto& one : maps) {
    const HeightRange all = one->range();
    coat.lowest_ = std::min(coat.lowest_, all.lowest);
    coat.highest_ = std::max(coat.highest_, all.highest);
  }
  coat.maps_ = std::move(maps);
  coat.map_of_face_ = std::move(map_of_face);
  coat.materials_ = std::move(materials);
  ASPERITY_CHECK(coat.take_layers(std::move(layers)));
  coat.texel_size_ = coat.finest_grain(mesh);
  if (coat.texel_size_ == 0.0)
    return bad_mapping("is \"uv\", but the texture coordinates span no area on any face looked at");
  coat.find_seams(mesh);
  return coat;
}

Status Coat::check_fits(const TriangleMesh& mesh) const {
  if (mesh.fingerprint() == mesh_) return success();
  const std::size_t triangles = mesh.triangles().size();
  return refused(ErrorCode::mismatch,
                 triangles == mesh_triangles_
                     ? fmt::format("was laid on another mesh of {} triangles than this one", triangles)
                     : fmt::format("was laid on a mesh of {} triangles, this one has {}", mesh_triangles_, triangles),
                 "coat", "a coat that Coat::build has laid on the base's own mesh");
}

Status Coat::take_layers(std::vector<CoatLayer> layers) {
  if (layers.size() > most_layers) {
    return refused(ErrorCode::too_large, fmt::format("are {}", layers.size()), "layers",
                   fmt::format("at most {}", most_layers));
  }
  for (std::size_t i = 0; i < layers.size(); ++i) {
    const CoatLayer& layer = layers[i];
    const std::string place = fmt::format("layers[{}]", i);
    if ((layer.maps == nullptr) == (layer.solid == nullptr))
      return refused(ErrorCode::mismatch, "names neither or both of a map and a solid", place, "one of them");
    if (Status fits = check_repeat(layer.repeat); !fits) return std::move(fits).error().at(place);
    if (layer.solid != nullptr) {
      places_ = true;
      moves_ = moves_ || layer.solid->moves();
      lowest_ -= layer.solid->spec().amplitude;
      highest_ += layer.solid->spec().amplitude;
    } else {
      const HeightRange all = layer.maps->range();
      lowest_ += all.lowest;
      highest_ += all.highest;
    }
  }
  layers_ = std::move(layers);
  return success();
}

double Coat::finest_grain(const TriangleMesh& mesh) const {
  double finest = infinity;
  for (const auto& one : maps_) finest = std::min(finest, median_texel(mesh, *one, settings_));
  for (const CoatLayer& layer : layers_) {
    if (layer.solid != nullptr) {
      // As many samples a wavelength as make a spline follow a wave to a per cent.
      constexpr double samples = 8.0;
      finest = std::min(finest, layer.solid->grain() / samples);
    } else {
      CoatSettings laid = settings_;
      laid.repeat = settings_.repeat.cwiseProduct(layer.repeat);
      finest = std::min(finest, median_texel(mesh, *layer.maps, laid));
    }
  }
  return finest;
}

void Coat::find_seams(const TriangleMesh& mesh) {
  if (maps_.size() > 1) {
    has_seams_ = true;
    return;
  }
  if (settings_.mapping == Mapping::triplanar) return;
  bool relief = false;
  const auto look = [&](const Mesostructure& maps, const Vec2& repeat) {
    const HeightRange all = maps.range();
    if (!(all.lowest < all.highest)) return;
    relief = true;
    CoatSettings laid = settings_;
    laid.repeat = repeat;
    if (settings_.mapping == Mapping::uv)
      mark_uv_seams(mesh, laid, maps.heights().wrap() == Wrap::repeat, seam_vertices_);
  };
  look(*maps_.front(), settings_.repeat);
  for (const CoatLayer& layer : layers_) {
    if (layer.maps != nullptr) look(*layer.maps, settings_.repeat.cwiseProduct(layer.repeat));
  }
  has_seams_ = relief && (settings_.mapping == Mapping::per_face || !seam_vertices_.empty());
}

std::size_t Coat::memory_bytes() const noexcept {
  std::size_t bytes =
      sizeof(*this) + map_of_face_.capacity() + seam_vertices_.capacity() + maps_.capacity() * sizeof(maps_.front());
  for (const auto& maps : maps_) bytes += maps->memory_bytes();
  for (const CoatLayer& layer : layers_)
    bytes += sizeof(layer) + (layer.maps != nullptr ? layer.maps->memory_bytes() : sizeof(SolidMesostructure));
  if (materials_ != nullptr) bytes += materials_->memory_bytes();
  return bytes;
}

CoatFrame Coat::frame(const TriangleMesh& mesh, std::uint32_t face, const CoatMoment& moment) const noexcept {
  CoatFrame frame;
  frame.maps = &maps_on(face);
  frame.layers = layers_;
  frame.moment = moment;
  frame.level = moment.level;
  frame.triplanar = settings_.mapping == Mapping::triplanar;
  if (frame.maps->detail() != nullptr) {
    const auto [a, b, c] = mesh.corners(face);
    frame.twice_area = (b - a).cross(c - a).norm();
  }
  if (!frame.triplanar) {
    const auto st = corner_coordinates(mesh, face, settings_);
    frame.st = st[0];
    frame.st_u = st[1] - st[0];
    frame.st_v = st[2] - st[0];
    if (!places_) return frame;
  }
  const TriangleMesh::Triangle& t = mesh.triangles()[face];
  frame.point = mesh.positions()[t[0]];
  frame.point_u = mesh.positions()[t[1]] - frame.point;
  frame.point_v = mesh.positions()[t[2]] - frame.point;
  if (!frame.triplanar) return frame;
  frame.normal = mesh.vertex_normal(t[0]);
  frame.normal_u = mesh.vertex_normal(t[1]) - frame.normal;
  frame.normal_v = mesh.vertex_normal(t[2]) - frame.normal;
  return frame;
}

CoatFrame Coat::layer_frame(const CoatFrame& frame, const CoatLayer& layer) const noexcept {
  CoatFrame laid = frame;
  laid.maps = layer.maps.get();
  laid.st = frame.st.cwiseProduct(layer.repeat);
  laid.st_u = frame.st_u.cwiseProduct(layer.repeat);
  laid.st_v = frame.st_v.cwiseProduct(layer.repeat);
  if (frame.level > 0.0) {
    // The level of another map that leaves out as much as this one's.
    const DetailPyramid* own = frame.maps->detail();
    const DetailPyramid* other = layer.maps->detail();
    laid.level = 0.0;
    if (own != nullptr && other != nullptr) {
      const int below = std::min(static_cast<int>(frame.level), own->levels());
      const double above = own->scale(std::min(below + 1, own->levels()));
      const double part = frame.level - below;
      const double scale = part > 0.0 ? own->scale(below) + part * (above - own->scale(below)) : own->scale(below);
      laid.level = other->level_of_scale(scale);
    }
  }
  return laid;
}

HeightJet Coat::layered_jet(const CoatFrame& frame, double u, double v) const noexcept {
  HeightJet sum = own_jet(frame, u, v);
  for (const CoatLayer& layer : frame.layers) {
    HeightJet more;
    if (layer.solid != nullptr) {
      const SolidJet solid = layer.solid->jet(place_at(frame, u, v), frame.moment.time);
      const Vec3 along_u = solid.second * frame.point_u;
      const Vec3 along_v = solid.second * frame.point_v;
      more = {solid.height,
              solid.gradient.dot(frame.point_u),
              solid.gradient.dot(frame.point_v),
              along_u.dot(frame.point_u),
              along_u.dot(frame.point_v),
              along_v.dot(frame.point_v)};
    } else {
      more = own_jet(layer_frame(frame, layer), u, v);
    }
    sum.add(more);
  }
  return sum;
}

double Coat::own_height(const CoatFrame& frame, double u, double v) const noexcept {
  if (!frame.triplanar) return frame.maps->height(frame.st + u * frame.st_u + v * frame.st_v, frame.level);
  const Vec3 point = place_at(frame, u, v);
  const Vec3 normal = frame.normal + u * frame.normal_u + v * frame.normal_v;
  const Vec2& tile = frame.maps->tile();
  const double least = triplanar_threshold * normal.squaredNorm();
  double sum = 0.0;
  double weight = 0.0;
  double last = 0.0;
  double last_weight = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    const double q = normal[axis] * normal[axis] - least;
    if (q <= 0.0) continue;
    last = frame.maps->height(seen_along(axis, point, tile), frame.level);
    last_weight = q * q;
    sum += last_weight * last;
    weight += last_weight;
  }
  // Where one axis alone counts, it is what is seen along that.
  if (last_weight == weight) return last;
  return sum / weight;
}

void Coat::heights(const CoatFrame& frame, const Lanes& u, const Lanes& v, Lanes& heights) const noexcept {
  if (!frame.layers.empty()) {
    for (std::size_t i = 0; i < lanes; ++i) heights[i] = layered_jet(frame, u[i], v[i]).height;
    return;
  }
  if (frame.triplanar) return triplanar_heights(frame, u, v, heights);
  Lanes s;
  Lanes t;
  for (std::size_t i = 0; i < lanes; ++i) {
    s[i] = frame.st.x() + u[i] * frame.st_u.x() + v[i] * frame.st_v.x();
    t[i] = frame.st.y() + u[i] * frame.st_u.y() + v[i] * frame.st_v.y();
  }
  frame.maps->heights(s, t, frame.level, heights);
}

namespace {

/// Heights of a triplanar coat at four places, each as own_height answers it to the bit.
ASPERITY_FOUR void triplanar_of_four(const CoatFrame& frame, const Lanes& at_u, const Lanes& at_v, Lanes& heights) {
  using four::Wide;
  Wide u;
  Wide v;
  std::memcpy(&u, at_u.data(), sizeof(u));
  std::memcpy(&v, at_v.data(), sizeof(v));
  const Vec2& tile = frame.maps->tile();
  Lanes s[3];
  Lanes t[3];
  Wide squared[3];
  for (std::size_t k = 0; k < 3; ++k) {
    const auto axis = static_cast<int>(k);
    const Wide place = frame.point[axis] + u * frame.point_u[axis] + v * frame.point_v[axis];
    const Wide along_s = place / tile.x();
    const Wide along_t = tile.x() == tile.y() ? along_s : place / tile.y();
    std::memcpy(s[k].data(), &along_s, sizeof(along_s));
    std::memcpy(t[k].data(), &along_t, sizeof(along_t));
    const Wide normal = frame.normal[axis] + u * frame.normal_u[axis] + v * frame.normal_v[axis];
    squared[k] = normal * normal;
  }
  const Wide least = triplanar_threshold * (squared[0] + squared[1] + squared[2]);
  Wide sum{};
  Wide total{};
  Wide last{};
  Wide last_weight{};
  for (std::size_t k = 0; k < 3; ++k) {
    const Wide above = squared[k] - least;
    const Wide share = above > 0.0 ? above : Wide{};
    const Wide weight = share * share;
    if (!(weight[0] + weight[1] + weight[2] + weight[3] > 0.0)) continue;
    Lanes of_map;
    frame.maps->heights(s[(k + 1) % 3], t[(k + 2) % 3], frame.level, of_map);
    Wide height;
    std::memcpy(&height, of_map.data(), sizeof(height));
    sum += weight * height;
    total += weight;
    last = weight > 0.0 ? height : last;
    last_weight = weight > 0.0 ? weight : last_weight;
  }
  // Where one axis alone counts, it is what is seen along that.
  const Wide mixed = sum / (total > 0.0 ? total : Wide{1.0, 1.0, 1.0, 1.0});
  const Wide height = last_weight == total ? last : mixed;
  std::memcpy(heights.data(), &height, sizeof(height));
}

#if defined(__x86_64__)
[[gnu::target("avx2")]] void triplanar_by_avx2(const CoatFrame& frame, const Lanes& u, const Lanes& v,
                                               Lanes& heights) noexcept {
  triplanar_of_four(frame, u, v, heights);
}
#endif

}  // namespace

void Coat::triplanar_heights(const CoatFrame& frame, const Lanes& u, const Lanes& v, Lanes& heights) noexcept {
#if defined(__x86_64__)
  if (has_avx2()) return triplanar_by_avx2(frame, u, v, heights);
#endif
  triplanar_of_four(frame, u, v, heights);
}

HeightJet Coat::own_jet(const CoatFrame& frame, double u, double v) const noexcept {
  if (frame.triplanar) return triplanar_jet(frame, u, v);
  const HeightCurvature map = frame.maps->curvature(frame.st + u * frame.st_u + v * frame.st_v, frame.level);
  return along(map, frame.st_u, frame.st_v);
}

HeightJet Coat::triplanar_jet(const CoatFrame& frame, double u, double v) const noexcept {
  const Vec3 point = place_at(frame, u, v);
  const Vec3 normal = frame.normal + u * frame.normal_u + v * frame.normal_v;
  const Vec2& tile = frame.maps->tile();
  HeightJet sum{};     // of w H
  HeightJet weight{};  // of w
  const double length = normal.squaredNorm();
  const auto seen = [&](int axis) {
    const HeightCurvature map = frame.maps->curvature(seen_along(axis, point, tile), frame.level);
    return along(map, seen_along(axis, frame.point_u, tile), seen_along(axis, frame.point_v, tile));
  };
  double above[3];
  int count = 0;
  int last = 0;
  for (int axis = 0; axis < 3; ++axis) {
    above[axis] = normal[axis] * normal[axis] - triplanar_threshold * length;
    if (above[axis] <= 0.0) continue;
    ++count;
    last = axis;
  }
  // Within 27 degrees of an axis its weight says nothing.
  if (count == 1) return seen(last);
  const double length_u = normal.dot(frame.normal_u);
  const double length_v = normal.dot(frame.normal_v);
  for (int axis = 0; axis < 3; ++axis) {
    const double n = normal[axis];
    const double q = above[axis];
    if (q <= 0.0) continue;
    const double nu = frame.normal_u[axis];
    const double nv = frame.normal_v[axis];
    const double q_u = 2.0 * (n * nu - triplanar_threshold * length_u);
    const double q_v = 2.0 * (n * nv - triplanar_threshold * length_v);
    const double q_uu = 2.0 * (nu * nu - triplanar_threshold * frame.normal_u.squaredNorm());
    const double q_uv = 2.0 * (nu * nv - triplanar_threshold * frame.normal_u.dot(frame.normal_v));
    const double q_vv = 2.0 * (nv * nv - triplanar_threshold * frame.normal_v.squaredNorm());
    const double w = q * q;
    const HeightJet own{w,
                        2.0 * q * q_u,
                        2.0 * q * q_v,
                        2.0 * (q_u * q_u + q * q_uu),
                        2.0 * (q_u * q_v + q * q_uv),
                        2.0 * (q_v * q_v + q * q_vv)};
    sum.add(product(own, seen(axis)));
    weight.add(own);
  }
  return quotient(sum, weight, 1.0 / std::max(weight.height, std::numeric_limits<double>::min()));
}

CoatSample Coat::sample(const TriangleMesh& mesh, std::uint32_t face, const Vec3& barycentric,
                        const CoatMoment& moment) const noexcept {
  CoatSample sample = settings_.mapping == Mapping::triplanar ? sample_triplanar(mesh, face, barycentric)
                                                              : sample_flat(mesh, face, barycentric);
  if (layers_.empty() && moment.level <= 0.0) return sample;
  // What the layers and the level change, on top of the first map's own normals.
  const HeightJet all = jet(frame(mesh, face, moment), barycentric[1], barycentric[2]);
  const BarycentricFrame base = barycentric_frame(mesh, face);
  const Vec3 gradient = all.u * base.gradient[1] + all.v * base.gradient[2];
  const double up = std::max(1e-3, sample.normal.dot(base.normal));
  const Vec3 slope = base.normal - sample.normal / up;
  sample.normal = (base.normal - slope - (gradient - sample.gradient)).normalized();
  sample.height = all.height;
  sample.gradient = gradient;
  return sample;
}

double Coat::level_for(const CoatFrame& frame, double scale, double height) const noexcept {
  const DetailPyramid* detail = frame.maps->detail();
  if (detail == nullptr) return 0.0;
  double stretch = 1.0;
  if (!frame.triplanar) {
    // How much larger one repeat is here than on the tile that the pyramid's scales were measured on.
    const double area = std::abs(frame.st_u.x() * frame.st_v.y() - frame.st_u.y() * frame.st_v.x());
    const double nominal = area * frame.maps->tile().x() * frame.maps->tile().y();
    if (nominal > 0.0 && frame.twice_area > 0.0) stretch = std::sqrt(frame.twice_area / nominal);
  }
  return std::max(detail->level_of_scale(scale / stretch), detail->level_of_removed(height));
}

LocalMaterial Coat::material(const CoatFrame& frame, double u, double v) const noexcept {
  // Slopes and the lay from texture coordinates to barycentric ones.
  const auto turned = [](LocalMaterial local, const Vec2& st_u, const Vec2& st_v) {
    for (Vec2& slope : local.slope) slope = Vec2(slope.dot(st_u), slope.dot(st_v));
    const double det = st_u.x() * st_v.y() - st_u.y() * st_v.x();
    const Vec2 lay = local.lay;
    local.lay = det == 0.0 ? Vec2(Vec2::Zero())
                           : Vec2((lay.x() * st_v.y() - lay.y() * st_v.x()) / det,
                                  (st_u.x() * lay.y() - st_u.y() * lay.x()) / det);
    return local;
  };
  if (!frame.triplanar)
    return turned(materials_->sample(frame.st + u * frame.st_u + v * frame.st_v), frame.st_u, frame.st_v);
  const Vec3 point = place_at(frame, u, v);
  const Vec3 normal = frame.normal + u * frame.normal_u + v * frame.normal_v;
  const Vec2& tile = frame.maps->tile();
  LocalMaterial sum;
  std::array<Vec2, mapped_channels> weighted;  // sum of d(weight) value
  weighted.fill(Vec2::Zero());
  double total = 0.0;
  Vec2 total_slope = Vec2::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    const double q = normal[axis] * normal[axis] - triplanar_threshold * normal.squaredNorm();
    if (q <= 0.0) continue;
    const Vec2 q_slope(2.0 * (normal[axis] * frame.normal_u[axis] - triplanar_threshold * normal.dot(frame.normal_u)),
                       2.0 * (normal[axis] * frame.normal_v[axis] - triplanar_threshold * normal.dot(frame.normal_v)));
    const double w = q * q;
    const Vec2 w_slope = 2.0 * q * q_slope;
    const LocalMaterial one = turned(materials_->sample(seen_along(axis, point, tile)),
                                     seen_along(axis, frame.point_u, tile), seen_along(axis, frame.point_v, tile));
    for (std::size_t c = 0; c < mapped_channels; ++c) {
      sum.value[c] += w * one.value[c];
      sum.slope[c] += w * one.slope[c];
      weighted[c] += one.value[c] * w_slope;
    }
    sum.lay += w * one.lay;
    sum.lay_strength += w * one.lay_strength;
    total += w;
    total_slope += w_slope;
  }
  const double per = 1.0 / std::max(total, std::numeric_limits<double>::min());
  for (std::size_t c = 0; c < mapped_channels; ++c) {
    sum.value[c] *= per;
    sum.slope[c] = per * (sum.slope[c] + weighted[c] - sum.value[c] * total_slope);
  }
  sum.lay *= per;
  sum.lay_strength *= per;
  return sum;
}

CoatSample Coat::sample_flat(const TriangleMesh& mesh, std::uint32_t face, const Vec3& barycentric) const noexcept {
  const BarycentricFrame frame = barycentric_frame(mesh, face);
  const TextureFrame texture = texture_frame(mesh, face, frame, barycentric, settings_);
  const Mesostructure& own = maps_on(face);
  const MesostructureSample maps = own.sample(texture.st);
  CoatSample sample;
  sample.height = maps.height;
  sample.gradient = maps.gradient.x() * texture.gradient_s + maps.gradient.y() * texture.gradient_t;
  if (own.has_normal_map()) {
    // The map's axes as they lie on the triangle (glTF 2.0, MikkTSpace): the bitangent along growing t, the tangent at
    // right angles to it, on the side where s grows.
    const Vec3 bitangent = unit_or_zero(texture.gradient_t);
    const double hand = texture.gradient_s.cross(texture.gradient_t).dot(frame.normal) < 0.0 ? -1.0 : 1.0;
    const Vec3 tangent = hand * bitangent.cross(frame.normal);
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
  const Mesostructure& own = maps_on(face);
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
  // Not yet divided by their sum.
  const Vec3 excess = (normal.array().square() - triplanar_threshold * normal.squaredNorm()).max(0.0);
  const Vec3 power = excess.array().square();
  const double total = std::max(power.sum(), std::numeric_limits<double>::min());
  double height = 0.0;
  Vec3 weighted_gradient = Vec3::Zero();
  Vec3 shading_gradient = Vec3::Zero();
  Vec3 total_gradient = Vec3::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 square_gradient = normal_gradient.transpose() * normal;
    const Vec3 power_gradient =
        4.0 * excess[axis] *
        (normal[axis] * normal_gradient.row(axis).transpose() - triplanar_threshold * square_gradient);
    total_gradient += power_gradient;
    if (power[axis] <= 0.0) continue;
    const int s = (axis + 1) % 3;
    const int t = (axis + 2) % 3;
    const Vec2 tile = own.tile();
    const MesostructureSample maps = own.sample(seen_along(axis, point, tile));
    Vec3 slope = Vec3::Zero();
    slope[s] = maps.gradient.x() / tile.x();
    slope[t] = maps.gradient.y() / tile.y();
    height += power[axis] * maps.height;
    weighted_gradient += power[axis] * slope + maps.height * power_gradient;
    if (own.has_normal_map()) {
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
  const Vec3 shading = own.has_normal_map() ? Vec3(shading_gradient / total) : gradient;
  sample.normal = (frame.normal - (shading - shading.dot(frame.normal) * frame.normal)).normalized();
  return sample;
}

}  // namespace asperity
