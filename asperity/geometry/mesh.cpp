#include "asperity/geometry/mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <span>
#include <utility>

#include "asperity/core/parallel_for.h"
#include "asperity/geometry/detail/face_measures.h"
#include "asperity/geometry/index_table.h"

namespace asperity {
namespace {

using Triangle = TriangleMesh::Triangle;

// Beyond these the squares and products of lengths that every query forms would leave the range of a double.
constexpr double largest_coordinate = 1e60;
constexpr double smallest_edge = 1e-60;
constexpr double smallest_relative_area = 1e-12;
// Vertices or triangles that a thread takes at a time.
constexpr std::size_t elements_a_share = 8192;
constexpr std::size_t most_triangles = (std::size_t{1} << 32U) / 3 - 1;  // three 32-bit corner entries each

Error bad_mesh(std::string what, std::string place, std::string accepted) {
  return {ErrorCode::bad_mesh, std::move(what), {}, std::move(place), std::move(accepted)};
}

Status check_source(const MeshSource& source, const MeshBuildSettings& settings) {
  if (!(settings.scale > 0.0) || !std::isfinite(settings.scale)) {
    return bad_value(fmt::format("the mesh scale is {}", settings.scale), "scale",
                     "a finite number above 0 (metres per unit of the file)");
  }
  if (source.triangles.empty()) return bad_mesh("has no triangles", {}, "at least one triangle with area");
  if (source.triangles.size() > most_triangles || source.positions.size() >= no_index) {
    return bad_mesh("has too many triangles or vertices", {}, "up to 1.4e9 triangles and 4.2e9 vertices");
  }
  if (!source.corner_uvs.empty() && source.corner_uvs.size() != source.triangles.size()) {
    return bad_mesh(fmt::format("has UVs for {} of {} triangles", source.corner_uvs.size(), source.triangles.size()),
                    {}, "UVs for every triangle, or for none");
  }
  return success();
}

Status scale_positions(std::vector<Vec3>& positions, double scale) {
  for (std::size_t i = 0; i < positions.size(); ++i) {
    // Adding zero turns -0 into +0, so that equal coordinates have equal bits.
    positions[i] = (positions[i] * scale).array() + 0.0;
    if ((positions[i].array().abs() <= largest_coordinate).all()) continue;
    const bool finite = positions[i].allFinite();
    return bad_mesh(finite ? "has a coordinate beyond 1e60 m" : "has a coordinate that is not finite",
                    fmt::format("vertex {} (counted from 0)", i), "finite coordinates");
  }
  return success();
}

Status check_uvs(const std::vector<std::array<Vec2f, 3>>& corner_uvs) {
  for (std::size_t i = 0; i < corner_uvs.size(); ++i) {
    const auto& uvs = corner_uvs[i];
    if (uvs[0].allFinite() && uvs[1].allFinite() && uvs[2].allFinite()) continue;
    return bad_mesh("has a texture coordinate that is not finite", fmt::format("triangle {} (counted from 0)", i),
                    "finite texture coordinates");
  }
  return success();
}

std::uint64_t hash_of(const Vec3& position) {
  std::uint64_t hash = mixed_bits(std::bit_cast<std::uint64_t>(position.x()));
  hash = mixed_bits(hash + std::bit_cast<std::uint64_t>(position.y()));
  return mixed_bits(hash + std::bit_cast<std::uint64_t>(position.z()));
}

/// Merges equal positions in place, in order of first use; answers where each source vertex went.
std::vector<std::uint32_t> weld(std::vector<Vec3>& positions) {
  std::vector<std::uint32_t> moved_to(positions.size());
  IndexTable table(positions.size());
  std::uint32_t kept = 0;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const Vec3 position = positions[i];
    const std::uint32_t same = table.find_or_insert(hash_of(position), kept,
                                                    [&](std::uint32_t other) { return positions[other] == position; });
    if (same == no_index) positions[kept] = position;
    moved_to[i] = same == no_index ? kept++ : same;
  }
  positions.resize(kept);
  return moved_to;
}

bool degenerate(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a;
  const Vec3 ac = c - a;
  const double longest_squared = std::max({ab.squaredNorm(), ac.squaredNorm(), (c - b).squaredNorm()});
  if (longest_squared < smallest_edge * smallest_edge) return true;
  // Divided first, so that the square inside the norm cannot underflow for a small triangle.
  return 0.5 * (ab / longest_squared).cross(ac).norm() < smallest_relative_area;
}

Triangle sorted(Triangle triangle) {
  if (triangle[0] > triangle[1]) std::swap(triangle[0], triangle[1]);
  if (triangle[1] > triangle[2]) std::swap(triangle[1], triangle[2]);
  if (triangle[0] > triangle[1]) std::swap(triangle[0], triangle[1]);
  return triangle;
}

/// Points the triangles at the welded vertices. Errors: index out of range.
Status remap_triangles(MeshSource& source, const std::vector<std::uint32_t>& moved_to) {
  for (std::size_t i = 0; i < source.triangles.size(); ++i) {
    for (std::uint32_t& corner : source.triangles[i]) {
      if (corner >= moved_to.size()) {
        return bad_mesh(fmt::format("refers to vertex {} of {}", corner, moved_to.size()),
                        fmt::format("triangle {} (counted from 0)", i),
                        fmt::format("vertex indices from 0 to {}", std::ptrdiff_t(moved_to.size()) - 1));
      }
      corner = moved_to[corner];
    }
  }
  return success();
}

enum class Verdict : std::uint8_t { kept, degenerate, duplicate };

/// Marks triangles with the same corners as an earlier one.
void mark_duplicates(const MeshSource& source, std::vector<Verdict>& verdicts) {
  // Those with the same least corner lie together, ascending.
  std::vector<std::uint32_t> first(source.positions.size() + 1, 0);
  const auto least = [&](std::size_t face) {
    const Triangle& t = source.triangles[face];
    return std::min({t[0], t[1], t[2]});
  };
  for (std::size_t face = 0; face < verdicts.size(); ++face) {
    if (verdicts[face] == Verdict::kept) ++first[least(face)];
  }
  std::uint32_t sum = 0;
  for (std::uint32_t& start : first) start = std::exchange(sum, sum + start);
  std::vector<std::uint32_t> faces(sum);
  for (std::size_t face = 0; face < verdicts.size(); ++face) {
    if (verdicts[face] == Verdict::kept) faces[first[least(face)]++] = static_cast<std::uint32_t>(face);
  }
  // Filling has moved each start to the next one's.
  parallel_for(source.positions.size(), {.grain = elements_a_share}, [&](std::size_t vertex) {
    const std::span<std::uint32_t> around(faces.data() + (vertex == 0 ? 0 : first[vertex - 1]),
                                          faces.data() + first[vertex]);
    constexpr std::size_t few = 16;
    if (around.size() > few) {
      std::sort(around.begin(), around.end(), [&](std::uint32_t one, std::uint32_t other) {
        const Triangle a = sorted(source.triangles[one]);
        const Triangle b = sorted(source.triangles[other]);
        return a < b || (a == b && one < other);
      });
    }
    for (std::size_t i = 1; i < around.size(); ++i) {
      const Triangle key = sorted(source.triangles[around[i]]);
      for (std::size_t k = around.size() > few ? i - 1 : 0; k < i; ++k) {
        if (sorted(source.triangles[around[k]]) == key) verdicts[around[i]] = Verdict::duplicate;
      }
    }
  });
}

/// Removes triangles without area and repeated ones, keeping order and UVs aligned.
void drop_unusable_triangles(MeshSource& source, MeshReport& report) {
  std::vector<Verdict> verdicts(source.triangles.size(), Verdict::kept);
  parallel_for(verdicts.size(), {.grain = elements_a_share}, [&](std::size_t face) {
    const auto& [a, b, c] = source.triangles[face];
    const auto& p = source.positions;
    if (degenerate(p[a], p[b], p[c])) verdicts[face] = Verdict::degenerate;
  });
  mark_duplicates(source, verdicts);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < verdicts.size(); ++i) {
    if (verdicts[i] == Verdict::degenerate) ++report.dropped_degenerate;
    if (verdicts[i] == Verdict::duplicate) ++report.dropped_duplicate;
    if (verdicts[i] != Verdict::kept) continue;
    source.triangles[kept] = source.triangles[i];
    if (!source.corner_uvs.empty()) source.corner_uvs[kept] = source.corner_uvs[i];
    ++kept;
  }
  source.triangles.resize(kept);
  if (!source.corner_uvs.empty()) source.corner_uvs.resize(kept);
}

/// Removes vertices that no triangle uses; answers how many.
std::size_t drop_unused_vertices(MeshSource& source) {
  std::vector<std::uint32_t> moved_to(source.positions.size(), no_index);
  for (const Triangle& triangle : source.triangles) {
    for (const std::uint32_t corner : triangle) moved_to[corner] = 0;
  }
  std::uint32_t kept = 0;
  for (std::size_t i = 0; i < moved_to.size(); ++i) {
    if (moved_to[i] == no_index) continue;
    source.positions[kept] = source.positions[i];
    moved_to[i] = kept++;
  }
  const std::size_t dropped = source.positions.size() - kept;
  if (dropped == 0) return 0;
  source.positions.resize(kept);
  for (Triangle& triangle : source.triangles) {
    for (std::uint32_t& corner : triangle) corner = moved_to[corner];
  }
  return dropped;
}

std::uint32_t find_root(std::vector<std::uint32_t>& parents, std::uint32_t element) {
  while (parents[element] != element) {
    parents[element] = parents[parents[element]];
    element = parents[element];
  }
  return element;
}

/// Joins two sets; answers whether they were apart.
bool join(std::vector<std::uint32_t>& parents, std::uint32_t a, std::uint32_t b) {
  a = find_root(parents, a);
  b = find_root(parents, b);
  if (a == b) return false;
  parents[std::max(a, b)] = std::min(a, b);
  return true;
}

std::size_t count_components(std::size_t vertices, const std::vector<Triangle>& triangles) {
  std::vector<std::uint32_t> parents(vertices);
  for (std::size_t i = 0; i < vertices; ++i) parents[i] = static_cast<std::uint32_t>(i);
  std::size_t components = vertices;
  for (const Triangle& t : triangles) {
    if (join(parents, t[0], t[1])) --components;
    if (join(parents, t[0], t[2])) --components;
  }
  return components;
}

void list_faces_of_vertices(std::size_t vertices, const std::vector<Triangle>& triangles,
                            std::vector<std::uint32_t>& offsets, std::vector<std::uint32_t>& faces) {
  offsets.assign(vertices + 1, 0);
  for (const Triangle& t : triangles) {
    for (const std::uint32_t corner : t) ++offsets[corner + 1];
  }
  for (std::size_t i = 1; i < offsets.size(); ++i) offsets[i] += offsets[i - 1];
  faces.resize(3 * triangles.size());
  // Filling moves each start to the next vertex's start; shifting them back afterwards saves a second array.
  for (std::uint32_t face = 0; face < triangles.size(); ++face) {
    for (const std::uint32_t corner : triangles[face]) faces[offsets[corner]++] = face;
  }
  for (std::size_t i = vertices; i > 0; --i) offsets[i] = offsets[i - 1];
  offsets[0] = 0;
}

void add_notes(const MeshReport& report, std::size_t unused_vertices, std::vector<std::string>& notes) {
  const auto note = [&](std::size_t count, const char* text) {
    if (count > 0) notes.push_back(fmt::format("{} {}", count, text));
  };
  note(report.welded_vertices, "vertices merged with another at the same position");
  note(report.dropped_degenerate, "triangles without area left out");
  note(report.dropped_duplicate, "triangles with the same corners as an earlier one left out");
  note(unused_vertices, "vertices that no triangle uses left out");
}

/// One number for all that a mesh is made of.
std::uint64_t fingerprint_of(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                             std::span<const std::array<Vec2f, 3>> corner_uvs) {
  std::uint64_t sum = mixed_bits(positions.size() + (triangles.size() << 32U) + corner_uvs.size());
  const auto take = [&](std::uint64_t bits) { sum = mixed_bits(std::rotl(sum, 5) + bits); };
  for (const Vec3& p : positions) {
    for (int a = 0; a < 3; ++a) take(std::bit_cast<std::uint64_t>(p[a]));
  }
  for (const Triangle& t : triangles) {
    take(t[0] | std::uint64_t{t[1]} << 32U);
    take(t[2]);
  }
  for (const std::array<Vec2f, 3>& uvs : corner_uvs) {
    for (const Vec2f& uv : uvs)
      take(std::bit_cast<std::uint32_t>(uv.x()) | std::uint64_t{std::bit_cast<std::uint32_t>(uv.y())} << 32U);
  }
  return sum;
}

}  // namespace

/// Walks the edges vertex by vertex: the edges at one vertex are few and lie together in memory, so that sorting them
/// there is several times faster than one sort over all edges.
class TriangleMesh::EdgeSurvey {
 public:
  /// What is counted into `report` and listed in `odd` does not depend on how many threads there are.
  static void run(const TriangleMesh& mesh, MeshReport& report, std::vector<OddEdge>& odd) {
    const std::size_t vertices = mesh.positions().size();
    std::vector<EdgeSurvey> shares((vertices + elements_a_share - 1) / elements_a_share, EdgeSurvey(mesh));
    parallel_for(shares.size(), {}, [&](std::size_t i) {
      const std::size_t last = std::min(vertices, (i + 1) * elements_a_share);
      for (std::size_t vertex = i * elements_a_share; vertex < last; ++vertex)
        shares[i].survey(static_cast<std::uint32_t>(vertex));
    });
    for (const EdgeSurvey& share : shares) {
      report.boundary_edges += share.report_.boundary_edges;
      report.nonmanifold_edges += share.report_.nonmanifold_edges;
      report.misoriented_edges += share.report_.misoriented_edges;
      report.nonmanifold_vertices += share.report_.nonmanifold_vertices;
      odd.insert(odd.end(), share.odd_.begin(), share.odd_.end());
    }
    odd.shrink_to_fit();
  }

 private:
  explicit EdgeSurvey(const TriangleMesh& mesh) : mesh_(mesh) {}

  /// One triangle's use of the edge between the surveyed vertex and `other`.
  struct Use {
    std::uint32_t other;
    std::uint32_t fan_and_direction;  ///< position in the vertex's face list, times two, plus one if it leaves
    friend bool operator<(const Use& a, const Use& b) { return a.other < b.other; }
  };

  void survey(std::uint32_t vertex) {
    const auto faces = mesh_.faces_of_vertex(vertex);
    uses_.clear();
    parents_.resize(faces.size());
    for (std::uint32_t i = 0; i < faces.size(); ++i) {
      const Triangle& t = mesh_.triangles()[faces[i]];
      const std::size_t corner = mesh_.corner_of(faces[i], vertex);
      uses_.push_back({t[(corner + 1) % 3], 2 * i + 1});
      uses_.push_back({t[(corner + 2) % 3], 2 * i});
      parents_[i] = i;
    }
    std::sort(uses_.begin(), uses_.end());
    std::size_t fans = faces.size();
    for (std::size_t first = 0; first < uses_.size();) {
      std::size_t last = first + 1;
      for (; last < uses_.size() && uses_[last].other == uses_[first].other; ++last) {
        if (join(parents_, uses_[first].fan_and_direction / 2, uses_[last].fan_and_direction / 2)) --fans;
      }
      if (uses_[first].other > vertex) count_edge(vertex, first, last);
      first = last;
    }
    if (fans > 1) ++report_.nonmanifold_vertices;
  }

  void count_edge(std::uint32_t vertex, std::size_t first, std::size_t last) {
    if (last - first != 2) odd_.push_back({vertex, uses_[first].other, static_cast<std::uint32_t>(last - first)});
    if (last - first == 1) ++report_.boundary_edges;
    if (last - first > 2) ++report_.nonmanifold_edges;
    const bool same_way = (uses_[first].fan_and_direction & 1U) == (uses_[last - 1].fan_and_direction & 1U);
    if (last - first == 2 && same_way) ++report_.misoriented_edges;
  }

  const TriangleMesh& mesh_;
  MeshReport report_;
  std::vector<OddEdge> odd_;
  std::vector<Use> uses_;
  std::vector<std::uint32_t> parents_;
};

Result<TriangleMesh> TriangleMesh::build(MeshSource source, const MeshBuildSettings& settings) {
  ASPERITY_CHECK(check_source(source, settings));
  ASPERITY_CHECK(scale_positions(source.positions, settings.scale));
  ASPERITY_CHECK(check_uvs(source.corner_uvs));
  TriangleMesh mesh;
  MeshReport& report = mesh.report_;
  const std::size_t source_vertices = source.positions.size();
  const std::vector<std::uint32_t> moved_to = weld(source.positions);
  report.welded_vertices = source_vertices - source.positions.size();
  ASPERITY_CHECK(remap_triangles(source, moved_to));
  drop_unusable_triangles(source, report);
  if (source.triangles.empty()) {
    return bad_mesh(fmt::format("none of its {} triangles has an area", report.dropped_degenerate), {},
                    "at least one triangle whose corners are not in one line");
  }
  const std::size_t unused_vertices = drop_unused_vertices(source);
  add_notes(report, unused_vertices, source.notes);
  mesh.derive(std::move(source), settings.orient_outward);
  return mesh;
}

void TriangleMesh::derive(MeshSource source, bool orient_outward) {
  positions_ = std::move(source.positions);
  positions_.shrink_to_fit();
  const auto topology = std::make_shared<Topology>();
  topology->triangles = std::move(source.triangles);
  topology->notes = std::move(source.notes);
  topology->triangles.shrink_to_fit();
  list_faces_of_vertices(positions_.size(), topology->triangles, topology->vertex_offsets, topology->vertex_faces);
  topology_ = topology;
  triangles_ = topology->triangles;
  vertex_offsets_ = topology->vertex_offsets.data();
  vertex_faces_ = topology->vertex_faces.data();

  report_.vertices = positions_.size();
  report_.triangles = triangles_.size();
  for (const Vec3& position : positions_) bounds_.include(position);
  EdgeSurvey::run(*this, report_, topology->odd_edges);
  report_.components = count_components(positions_.size(), topology->triangles);
  std::vector<Vec3> sums;
  static_cast<void>(measure_faces(sums));
  if (orient_outward && report_.closed() && report_.oriented() && report_.signed_volume < 0.0) {
    for (Triangle& t : topology->triangles) std::swap(t[1], t[2]);
    for (auto& uvs : source.corner_uvs) std::swap(uvs[1], uvs[2]);
    static_cast<void>(measure_faces(sums));
    topology->notes.emplace_back("normals pointed inward: all triangles were flipped");
  }
  parallel_for(2, {}, [&](std::size_t task) {
    if (task == 0) {
      topology->fingerprint = fingerprint_of(positions_, topology->triangles, source.corner_uvs);
    } else if (!source.corner_uvs.empty()) {
      topology->corner_uvs = CornerUvs(source.corner_uvs, topology->triangles, positions_.size());
    }
  });
  if (!topology->corner_uvs.empty()) corner_uvs_ = &topology->corner_uvs;
}

/// Answers whether some triangle may have lost its area.
bool TriangleMesh::measure_faces(std::vector<Vec3>& sums) {
  const FaceMeasures measures =
      asperity::measure_faces(positions_, triangles_, bounds_.centre(), sums, vertex_normals_);
  report_.area = measures.area;
  report_.signed_volume = measures.signed_volume;
  report_.worst_aspect = measures.worst_aspect;
  report_.min_edge = measures.min_edge;
  report_.max_edge = measures.max_edge;
  // Every triangle has counted its edges; an edge of two triangles is one.
  double doubled_sum = measures.edge_sum;
  double doubled_edges = 3.0 * static_cast<double>(triangles_.size());
  for (const OddEdge& edge : topology_->odd_edges) {
    const double missing = 2.0 - static_cast<double>(edge.triangles);
    doubled_sum += missing * (positions_[edge.from] - positions_[edge.to]).norm();
    doubled_edges += missing;
  }
  report_.mean_edge = doubled_sum / doubled_edges;
  for (std::uint32_t vertex = 0; vertex < vertex_normals_.size(); ++vertex) {
    // Where the triangles around cancel, any one of their normals is as good as another.
    if (vertex_normals_[vertex].x() == 0.0F && vertex_normals_[vertex].isZero(0.0F))
      vertex_normals_[vertex] = face_normal(faces_of_vertex(vertex)[0]).cast<float>();
  }
  return measures.suspect;
}

Status TriangleMesh::place(std::span<const Vec3> positions) {
  if (positions.size() != positions_.size()) {
    return refused(ErrorCode::mismatch, fmt::format("has {} positions", positions.size()), "moved mesh",
                   fmt::format("{}, one for every vertex of the mesh", positions_.size()));
  }
  Box bounds;
  bool in_range = true;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const Vec3 at = positions[i].array() + 0.0;
    positions_[i] = at;
    bounds.include(at);
    in_range = in_range && (at.array().abs() <= largest_coordinate).all();
  }
  bounds_ = bounds;
  return in_range ? success() : scale_positions(positions_, 1.0);
}

Status TriangleMesh::measure(std::vector<Vec3>& sums) {
  if (!measure_faces(sums)) return success();
  for (std::uint32_t face = 0; face < triangles_.size(); ++face) {
    const auto [a, b, c] = corners(face);
    if (!degenerate(a, b, c)) continue;
    return bad_mesh("has lost its area", fmt::format("triangle {} (counted from 0)", face),
                    "positions that leave every triangle an area");
  }
  return success();
}

Result<TriangleMesh> TriangleMesh::moved(std::span<const Vec3> positions) const {
  TriangleMesh mesh = *this;
  ASPERITY_CHECK(mesh.place(positions));
  std::vector<Vec3> sums;
  ASPERITY_CHECK(mesh.measure(sums));
  return mesh;
}

Vec3 TriangleMesh::face_normal(std::uint32_t face) const noexcept {
  const auto [a, b, c] = corners(face);
  return (b - a).cross(c - a).normalized();
}

UnsetVector<FaceCorners> TriangleMesh::face_corners() const {
  constexpr std::size_t share = 4096;
  UnsetVector<FaceCorners> all(triangles_.size());
  parallel_for((all.size() + share - 1) / share, {}, [&](std::size_t i) {
    const std::size_t first = i * share;
    const std::size_t count = std::min(share, all.size() - first);
    measure_corners(positions_, triangles_.subspan(first, count), std::span(all).subspan(first, count));
  });
  return all;
}

std::uint32_t TriangleMesh::neighbour(std::uint32_t face, int edge) const noexcept {
  const Triangle& corners = triangles_[face];
  const auto first = static_cast<std::size_t>(edge);
  std::span<const std::uint32_t> few = faces_of_vertex(corners[first]);
  std::span<const std::uint32_t> many = faces_of_vertex(corners[(first + 1) % 3]);
  if (few.size() > many.size()) std::swap(few, many);
  std::uint32_t found = no_index;
  auto from = many.begin();
  for (const std::uint32_t candidate : few) {
    from = std::lower_bound(from, many.end(), candidate);
    if (from == many.end()) break;
    if (*from != candidate || candidate == face) continue;
    if (found != no_index) return no_index;
    found = candidate;
  }
  return found;
}

std::size_t TriangleMesh::memory_bytes() const noexcept {
  std::size_t bytes = sizeof(*this);
  const auto add = [&](const auto& values) { bytes += values.capacity() * sizeof(values[0]); };
  add(positions_);
  add(vertex_normals_);
  if (topology_ == nullptr) return bytes;
  bytes += sizeof(Topology);
  add(topology_->triangles);
  bytes += topology_->corner_uvs.memory_bytes();
  add(topology_->vertex_offsets);
  add(topology_->vertex_faces);
  add(topology_->odd_edges);
  add(topology_->notes);
  for (const std::string& note : topology_->notes) bytes += note.capacity();
  return bytes;
}

}  // namespace asperity
