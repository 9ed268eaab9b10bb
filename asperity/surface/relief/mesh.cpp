#include "asperity/surface/relief/mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "asperity/geometry/index_table.h"

namespace asperity {

namespace {

/// Cuts the faces of a base one after the other; places on common edges and vertices are made once.
class Tessellation {
 public:
  Tessellation(const ReliefSurface& surface, int parts)
      : surface_(surface),
        base_(surface.base().mesh()),
        parts_(static_cast<std::uint32_t>(parts)),
        edges_(3 * base_.triangles().size()),
        sums_(base_.positions().size(), Vec3::Zero()),
        faces_(base_.positions().size(), 0) {}

  MeshSource run() {
    MeshSource source;
    const std::size_t cells = std::size_t{parts_} * parts_;
    source.triangles.reserve(base_.triangles().size() * cells);
    for (std::uint32_t face = 0; face < base_.triangles().size(); ++face) cut(face, source.triangles);
    for (std::size_t i = 0; i < sums_.size(); ++i) sums_[i] /= static_cast<double>(faces_[i]);
    source.positions = std::move(sums_);
    return source;
  }

 private:
  void cut(std::uint32_t face, std::vector<TriangleMesh::Triangle>& out) {
    number_edges(face);
    const ReliefFrame frame = surface_.frame(face);
    std::vector<std::uint32_t> below;
    std::vector<std::uint32_t> row;
    for (std::uint32_t j = 0; j <= parts_; ++j) {
      below.swap(row);
      row.clear();
      for (std::uint32_t i = 0; i + j <= parts_; ++i) row.push_back(add(frame, i, j));
      for (std::uint32_t i = 0; j > 0 && i < row.size(); ++i) {
        out.push_back({below[i], below[i + 1], row[i]});
        if (i + 1 < row.size()) out.push_back({below[i + 1], row[i + 1], row[i]});
      }
    }
  }

  /// First of the parts - 1 places inside each edge of the face, made when no face before has the edge.
  void number_edges(std::uint32_t face) {
    const TriangleMesh::Triangle& t = base_.triangles()[face];
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k];
      const std::uint32_t b = t[(k + 1) % 3];
      const std::uint64_t key = (std::uint64_t{std::min(a, b)} << 32U) | std::max(a, b);
      const auto next = static_cast<std::uint32_t>(keys_.size());
      const std::uint32_t known = edges_.find_or_insert(mixed_bits(key), next, [&](auto e) { return keys_[e] == key; });
      if (known == no_index) {
        keys_.push_back(key);
        first_inside_.push_back(make(parts_ - 1));
      }
      edge_[k] = first_inside_[known == no_index ? next : known];
      forward_[k] = a < b;
    }
  }

  std::uint32_t make(std::uint32_t count) {
    const auto first = static_cast<std::uint32_t>(sums_.size());
    sums_.resize(sums_.size() + count, Vec3::Zero());
    faces_.resize(sums_.size(), 0);
    return first;
  }

  /// Number of the grid's corner (i, j) of a face.
  std::uint32_t number(std::uint32_t face, std::uint32_t i, std::uint32_t j) {
    const TriangleMesh::Triangle& t = base_.triangles()[face];
    const std::uint32_t rest = parts_ - i - j;
    if (rest == parts_ || i == parts_ || j == parts_) return t[rest == parts_ ? 0 : (i == parts_ ? 1 : 2)];
    const auto inside = [&](std::size_t k, std::uint32_t step) {
      return edge_[k] + (forward_[k] ? step : parts_ - step) - 1;
    };
    if (j == 0) return inside(0, i);
    if (rest == 0) return inside(1, j);
    if (i == 0) return inside(2, rest);
    return make(1);
  }

  std::uint32_t add(const ReliefFrame& frame, std::uint32_t i, std::uint32_t j) {
    const std::uint32_t id = number(frame.face, i, j);
    const Vec2 at = grid_place(static_cast<int>(i), static_cast<int>(j), static_cast<int>(parts_));
    sums_[id] += surface_.point(frame, at.x(), at.y()).point;
    ++faces_[id];
    return id;
  }

  const ReliefSurface& surface_;
  const TriangleMesh& base_;
  std::uint32_t parts_;
  IndexTable edges_;
  std::vector<std::uint64_t> keys_;
  std::vector<std::uint32_t> first_inside_;
  std::uint32_t edge_[3] = {0, 0, 0};
  bool forward_[3] = {true, true, true};
  std::vector<Vec3> sums_;            ///< of a place, over the faces that share it
  std::vector<std::uint32_t> faces_;  ///< how many do
};

Error too_many(std::size_t faces, int subdivisions, int most) {
  return refused(ErrorCode::too_large,
                 fmt::format("is {}: {} base triangles would become {:.3g}", subdivisions, faces,
                             static_cast<double>(faces) * subdivisions * subdivisions),
                 "subdivisions",
                 most > 0 ? fmt::format("1 to {}, for at most {} triangles", most, most_tessellated_triangles)
                          : fmt::format("a base of at most {} triangles", most_tessellated_triangles));
}

Error too_few(int subdivisions) {
  return bad_value(fmt::format("is {}", subdivisions), "subdivisions", "1 or more");
}

/// Most cuts along an edge that keep `faces` faces within a number of triangles.
int most_cuts(std::size_t faces, std::size_t triangles) {
  return static_cast<int>(std::sqrt(static_cast<double>(triangles) / static_cast<double>(faces)));
}

}  // namespace

Result<TriangleMesh> tessellate(const ReliefSurface& surface, int subdivisions) {
  if (subdivisions < 1) return too_few(subdivisions);
  const std::size_t faces = surface.base().mesh().triangles().size();
  const int most = most_cuts(faces, most_tessellated_triangles);
  if (subdivisions > most) return too_many(faces, subdivisions, most);
  MeshBuildSettings settings;
  // The base's own orientation, whatever a folded relief does to the volume.
  settings.orient_outward = false;
  return TriangleMesh::build(Tessellation(surface, subdivisions).run(), settings);
}

int texel_subdivisions(const ReliefSurface& surface) {
  const TriangleMesh& mesh = surface.base().mesh();
  const double texels = std::ceil(mesh.mean_edge() / surface.coat().texel_size());
  const int most = most_cuts(mesh.triangles().size(), most_chosen_triangles);
  return std::max(1, texels < most ? static_cast<int>(texels) : most);
}

}  // namespace asperity
