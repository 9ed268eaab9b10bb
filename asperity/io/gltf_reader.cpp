#include <fmt/format.h>
#include <tiny_gltf.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <set>

#include "asperity/io/detail/gltf_document.h"
#include "asperity/io/detail/gltf_looks.h"
#include "asperity/io/detail/mesh_readers.h"

namespace asperity::mesh_readers {
namespace {

static_assert(std::endian::native == std::endian::little, "glTF's buffers are little-endian");

/// Bounds what a small file can ask for by placing one mesh many times.
constexpr std::size_t most_triangles = std::size_t{1} << 26U;
constexpr std::size_t most_vertices = 3 * most_triangles;
/// Parts of meshes, counted once for each node.
constexpr std::size_t most_parts = std::size_t{1} << 24U;
/// Bounds the time that parts reading the same data again and again can take.
constexpr std::size_t most_elements = std::size_t{1} << 30U;
/// Elements of an accessor that has no data of its own, only sparse changes to zeros.
constexpr std::size_t most_zeros = std::size_t{1} << 20U;

/// Where a node stands in the scene.
struct Placement {
  Mat3 linear = Mat3::Identity();
  Vec3 offset = Vec3::Zero();
};

Result<Placement> own_placement(const tinygltf::Node& node, const std::string& place) {
  Placement own;
  if (node.matrix.size() == 16) {
    for (int column = 0; column < 3; ++column) {
      for (int row = 0; row < 3; ++row)
        own.linear(row, column) = node.matrix[static_cast<std::size_t>(4 * column + row)];
    }
    own.offset = {node.matrix[12], node.matrix[13], node.matrix[14]};
    if (node.matrix[3] != 0.0 || node.matrix[7] != 0.0 || node.matrix[11] != 0.0 || node.matrix[15] != 1.0) {
      return refused(ErrorCode::file_malformed, "has a projective matrix", place + ".matrix",
                     "sixteen numbers, column by column, the last row 0 0 0 1");
    }
    return own;
  }
  if (node.rotation.size() == 4) {
    const auto& q = node.rotation;  // x y z w
    const double length = std::hypot(std::hypot(q[0], q[1]), std::hypot(q[2], q[3]));
    if (!(length > 1e-6 && std::isfinite(length))) {
      return refused(ErrorCode::file_malformed, "is no rotation", place + ".rotation", "a unit quaternion x y z w");
    }
    own.linear = Quat(q[3] / length, q[0] / length, q[1] / length, q[2] / length).toRotationMatrix();
  }
  if (node.scale.size() == 3) {
    for (int axis = 0; axis < 3; ++axis) own.linear.col(axis) *= node.scale[static_cast<std::size_t>(axis)];
  }
  if (node.translation.size() == 3) own.offset = {node.translation[0], node.translation[1], node.translation[2]};
  return own;
}

/// The elements of an accessor, packed.
struct Elements {
  std::string bytes;
  std::size_t count = 0;

  template <class Number>
  [[nodiscard]] Number at(std::size_t index) const {
    Number number;
    std::memcpy(&number, bytes.data() + index * sizeof number, sizeof number);
    return number;
  }
};

/// Reads accessors; every range is checked against its view and its buffer before it is touched.
class AccessorReader {
 public:
  AccessorReader(const tinygltf::Model& model, GltfDocument& document) : model_(model), document_(document) {}

  [[nodiscard]] const tinygltf::Accessor& accessor(int index) const {
    return model_.accessors[static_cast<std::size_t>(index)];
  }

  Result<Elements> read(int index) {
    const tinygltf::Accessor& from = accessor(index);
    const std::string place = fmt::format("accessors[{}]", index);
    const std::size_t size = element_size(from.componentType, from.type);
    if (size == 0) {
      return refused(ErrorCode::file_malformed, fmt::format("has the component type {}", from.componentType), place,
                     "5120, 5121, 5122, 5123, 5125 or 5126");
    }
    if (from.count > most_elements - elements_read_) {
      return refused(ErrorCode::too_large, fmt::format("brings the scene to more than {} elements read", most_elements),
                     place, "a scene that reads its data less often");
    }
    elements_read_ += from.count;
    Elements elements;
    elements.count = from.count;
    if (from.bufferView >= 0) {
      ASPERITY_TRY(const View view, view_of(from.bufferView, from.byteOffset, from.count, size, place));
      elements.bytes.resize(from.count * size);
      for (std::size_t i = 0; i < from.count; ++i) {
        std::memcpy(elements.bytes.data() + i * size, view.data + i * view.stride, size);
      }
    } else if (!from.sparse.isSparse) {
      return refused(ErrorCode::bad_mesh, "has no data", place,
                     "an accessor with a bufferView (compressed geometry is not read)");
    } else if (from.count > most_zeros) {
      return refused(ErrorCode::too_large, fmt::format("has {} elements without data of their own", from.count), place,
                     fmt::format("up to {}", most_zeros));
    } else {
      elements.bytes.resize(from.count * size);
    }
    if (from.sparse.isSparse) ASPERITY_CHECK(change_sparsely(from, size, place, elements));
    return elements;
  }

 private:
  struct View {
    const char* data = nullptr;
    std::size_t stride = 0;
  };

  static std::size_t element_size(int component_type, int type) {
    std::size_t component = 0;
    switch (component_type) {
      case TINYGLTF_COMPONENT_TYPE_BYTE:
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE: component = 1; break;
      case TINYGLTF_COMPONENT_TYPE_SHORT:
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT: component = 2; break;
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
      case TINYGLTF_COMPONENT_TYPE_FLOAT: component = 4; break;
      default: return 0;
    }
    const int components = tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(type));
    return components > 0 ? component * static_cast<std::size_t>(components) : 0;
  }

  Result<View> view_of(int index, std::size_t offset, std::size_t count, std::size_t size, const std::string& place) {
    const tinygltf::BufferView& view = model_.bufferViews[static_cast<std::size_t>(index)];
    const std::string view_place = fmt::format("bufferViews[{}]", index);
    ASPERITY_TRY(const std::string_view buffer, document_.buffer(static_cast<std::size_t>(view.buffer)));
    if (view.byteOffset > buffer.size() || view.byteLength > buffer.size() - view.byteOffset) {
      return refused(ErrorCode::bad_mesh,
                     fmt::format("reaches from byte {} over {} bytes in a buffer of {}", view.byteOffset,
                                 view.byteLength, buffer.size()),
                     view_place, "views that lie within their buffer");
    }
    const std::size_t stride = view.byteStride == 0 ? size : view.byteStride;
    if (stride < size) {
      return refused(ErrorCode::file_malformed,
                     fmt::format("has a stride of {} for elements of {} bytes", stride, size), view_place,
                     "a stride that holds an element");
    }
    const std::size_t room = view.byteLength - std::min(offset, view.byteLength);
    if (count > 0 && (room < size || count - 1 > (room - size) / stride)) {
      return refused(ErrorCode::bad_mesh,
                     fmt::format("has {} elements of {} bytes, {} apart, from byte {} of a view of {}", count, size,
                                 stride, offset, view.byteLength),
                     place, "accessors that lie within their buffer view");
    }
    return View{buffer.data() + view.byteOffset + std::min(offset, view.byteLength), stride};
  }

  Status change_sparsely(const tinygltf::Accessor& from, std::size_t size, const std::string& place,
                         Elements& elements) {
    const auto& sparse = from.sparse;
    const std::string at = place + ".sparse";
    const bool unsigned_type = sparse.indices.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE ||
                               sparse.indices.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ||
                               sparse.indices.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
    const std::size_t index_size = element_size(sparse.indices.componentType, TINYGLTF_TYPE_SCALAR);
    if (!unsigned_type) {
      return refused(ErrorCode::file_malformed, "has indices of no unsigned type", at, "5121, 5123 or 5125");
    }
    const auto count = static_cast<std::size_t>(sparse.count);
    ASPERITY_TRY(
        const View indices,
        view_of(sparse.indices.bufferView, static_cast<std::size_t>(sparse.indices.byteOffset), count, index_size, at));
    ASPERITY_TRY(const View values, view_of(sparse.values.bufferView,
                                            static_cast<std::size_t>(sparse.values.byteOffset), count, size, at));
    for (std::size_t i = 0; i < count; ++i) {
      std::uint32_t index = 0;
      std::memcpy(&index, indices.data + i * indices.stride, index_size);
      if (index >= elements.count) {
        return refused(ErrorCode::bad_mesh, fmt::format("changes element {} of {}", index, elements.count), at,
                       "indices of elements that are there");
      }
      std::memcpy(elements.bytes.data() + index * size, values.data + i * values.stride, size);
    }
    return success();
  }

  const tinygltf::Model& model_;
  GltfDocument& document_;
  std::size_t elements_read_ = 0;
};

/// Walks the scene and gathers its triangles.
class SceneGatherer {
 public:
  SceneGatherer(const tinygltf::Model& model, GltfDocument& document, const PrimitiveLooks* looks)
      : model_(model), accessors_(model, document), looks_(looks) {
    source_.notes = std::move(document.notes());
  }

  Result<GltfTriangles> run() {
    source_.notes.emplace_back("lengths are metres, as glTF defines them");
    measure_meshes();
    ASPERITY_TRY(const std::vector<int> roots, roots_of_scene());
    // Counted before anything is read: a small file can place a mesh very often.
    ASPERITY_CHECK(walk(
        roots, [&](std::size_t mesh, const Placement&, const std::string& place) { return count_mesh(mesh, place); }));
    source_.positions.reserve(total_.vertices);
    source_.triangles.reserve(total_.triangles);
    ASPERITY_CHECK(walk(roots, [&](std::size_t mesh, const Placement& placement, const std::string& place) {
      return add_mesh(mesh, placement, place);
    }));
    if (source_.triangles.empty()) {
      return refused(ErrorCode::bad_mesh,
                     fmt::format("has no triangles in its scene ({} meshes, {} parts of points or lines)",
                                 model_.meshes.size(), pointlike_),
                     {}, "a scene with at least one triangle");
    }
    finish();
    return GltfTriangles{std::move(source_), std::move(look_of_triangle_)};
  }

 private:
  Result<std::vector<int>> roots_of_scene() {
    if (!model_.scenes.empty()) {
      const int scene = std::max(model_.defaultScene, 0);
      if (model_.scenes.size() > 1) {
        source_.notes.push_back(
            fmt::format("scene {} of {} is read, the others are left out", scene, model_.scenes.size()));
      }
      return model_.scenes[static_cast<std::size_t>(scene)].nodes;
    }
    std::vector<bool> is_child(model_.nodes.size(), false);
    for (const tinygltf::Node& node : model_.nodes) {
      for (const int child : node.children) is_child[static_cast<std::size_t>(child)] = true;
    }
    std::vector<int> roots;
    for (std::size_t i = 0; i < is_child.size(); ++i) {
      if (!is_child[i]) roots.push_back(static_cast<int>(i));
    }
    source_.notes.emplace_back("has no scene: everything in it is read");
    return roots;
  }

  /// Depth first without recursion. glTF's nodes form trees: reaching one twice is an error, so no cycle can hold.
  template <class Visit>
  Status walk(const std::vector<int>& roots, const Visit& visit) {
    for (std::size_t mesh = 0; model_.nodes.empty() && mesh < model_.meshes.size(); ++mesh) {
      ASPERITY_CHECK(visit(mesh, Placement{}, fmt::format("meshes[{}]", mesh)));
    }
    struct Waiting {
      int node;
      Placement parent;
    };
    std::vector<Waiting> stack;
    std::vector<bool> reached(model_.nodes.size(), false);
    for (std::size_t i = roots.size(); i-- > 0;) stack.push_back({roots[i], {}});
    while (!stack.empty()) {
      const Waiting waiting = stack.back();
      stack.pop_back();
      const auto index = static_cast<std::size_t>(waiting.node);
      const std::string place = fmt::format("nodes[{}]", index);
      if (reached[index]) {
        return refused(ErrorCode::file_malformed, "is reached twice: by two parents, or by itself", place,
                       "nodes that form trees");
      }
      reached[index] = true;
      const tinygltf::Node& node = model_.nodes[index];
      ASPERITY_TRY(const Placement own, own_placement(node, place));
      const Placement here{waiting.parent.linear * own.linear,
                           waiting.parent.linear * own.offset + waiting.parent.offset};
      if (node.mesh >= 0) ASPERITY_CHECK(visit(static_cast<std::size_t>(node.mesh), here, place));
      // A chain of children that share one node's list could grow the stack without end before it is found out.
      if (stack.size() + node.children.size() > model_.nodes.size()) {
        return refused(ErrorCode::file_malformed, "has more children than there are nodes", place,
                       "nodes that form trees");
      }
      for (std::size_t i = node.children.size(); i-- > 0;) stack.push_back({node.children[i], here});
    }
    return success();
  }

  /// What a scene holds, or a mesh adds to it.
  struct Amount {
    std::size_t vertices = 0;
    std::size_t triangles = 0;
    std::size_t parts = 0;
  };

  /// Adds without passing over: counts in a file may be any number.
  static void add(std::size_t& sum, std::size_t more, std::size_t most) { sum += std::min(more, most + 1 - sum); }

  void measure_meshes() {
    for (const tinygltf::Mesh& mesh : model_.meshes) {
      Amount& amount = amounts_.emplace_back();
      std::set<int> placed;
      for (const tinygltf::Primitive& primitive : mesh.primitives) {
        const auto position = primitive.attributes.find("POSITION");
        add(amount.parts, 1, most_parts);
        if (primitive.mode < TINYGLTF_MODE_TRIANGLES || position == primitive.attributes.end()) continue;
        const std::size_t vertices = accessors_.accessor(position->second).count;
        if (placed.insert(position->second).second) add(amount.vertices, vertices, most_vertices);
        const std::size_t corners = primitive.indices >= 0 ? accessors_.accessor(primitive.indices).count : vertices;
        add(amount.triangles, triangles_of(primitive.mode, corners), most_triangles);
      }
    }
  }

  static std::size_t triangles_of(int mode, std::size_t corners) {
    return mode == TINYGLTF_MODE_TRIANGLES ? corners / 3 : corners - std::min<std::size_t>(corners, 2);
  }

  Status count_mesh(std::size_t mesh, const std::string& place) {
    const Amount& amount = amounts_[mesh];
    add(total_.vertices, amount.vertices, most_vertices);
    add(total_.triangles, amount.triangles, most_triangles);
    add(total_.parts, amount.parts, most_parts);
    const auto check = [&](std::size_t count, std::size_t most, const char* what) -> Status {
      if (count <= most) return success();
      return refused(ErrorCode::too_large, fmt::format("brings the scene to more than {} {}", most, what), place,
                     "a scene that fits, its instances counted one by one");
    };
    ASPERITY_CHECK(check(total_.vertices, most_vertices, "vertices"));
    ASPERITY_CHECK(check(total_.triangles, most_triangles, "triangles"));
    return check(total_.parts, most_parts, "parts");
  }

  Status add_mesh(std::size_t mesh, const Placement& placement, const std::string& node_place) {
    used_.resize(model_.meshes.size(), false);
    used_[mesh] = true;
    const auto& primitives = model_.meshes[mesh].primitives;
    first_vertex_.clear();
    for (std::size_t i = 0; i < primitives.size(); ++i) {
      look_ = looks_ != nullptr ? &looks_->at(mesh).at(i) : nullptr;
      ASPERITY_CHECK(
          add_primitive(primitives[i], placement, fmt::format("meshes[{}].primitives[{}]", mesh, i), node_place));
    }
    return success();
  }

  Status add_primitive(const tinygltf::Primitive& primitive, const Placement& placement, const std::string& place,
                       const std::string& node_place) {
    if (primitive.mode < TINYGLTF_MODE_TRIANGLES) {
      ++pointlike_;
      return success();
    }
    const auto position = primitive.attributes.find("POSITION");
    if (position == primitive.attributes.end()) {
      ++shapeless_;
      return success();
    }
    const std::size_t vertices = accessors_.accessor(position->second).count;
    ASPERITY_TRY(const std::uint32_t first, positions(position->second, placement, place, node_place));
    std::vector<std::uint32_t> indices;
    ASPERITY_TRY(const std::size_t corners, corner_count(primitive, vertices, place, indices));
    const auto corner = [&](std::size_t i) { return indices.empty() ? static_cast<std::uint32_t>(i) : indices[i]; };
    std::vector<Vec2f> uvs;
    const std::string set = fmt::format("TEXCOORD_{}", look_ != nullptr ? look_->texcoord : 0);
    if (const auto uv = primitive.attributes.find(set); uv != primitive.attributes.end()) {
      ASPERITY_TRY(uvs, texture_coordinates(uv->second, vertices, fmt::format("{}.attributes.{}", place, set)));
    } else if (look_ != nullptr && look_->needs_uvs) {
      source_.notes.push_back(fmt::format("{} has maps, but no {}: they are flat there", place, set));
    }
    add_triangles(primitive.mode, corners, corner, first, uvs, placement.linear.determinant() < 0.0);
    return success();
  }

  /// The place in `source_.positions` of an accessor's first vertex. Parts of a mesh often share one accessor.
  Result<std::uint32_t> positions(int index, const Placement& placement, const std::string& place,
                                  const std::string& node_place) {
    if (const auto known = first_vertex_.find(index); known != first_vertex_.end()) return known->second;
    const tinygltf::Accessor& accessor = accessors_.accessor(index);
    if (accessor.type != TINYGLTF_TYPE_VEC3 || accessor.componentType != TINYGLTF_COMPONENT_TYPE_FLOAT) {
      return refused(ErrorCode::file_unsupported, "has positions that are not three floats",
                     place + ".attributes.POSITION", "VEC3 of 5126 (KHR_mesh_quantization is not read)");
    }
    ASPERITY_TRY(const Elements elements, accessors_.read(index));
    const auto first = static_cast<std::uint32_t>(source_.positions.size());
    for (std::size_t i = 0; i < elements.count; ++i) {
      const Vec3 local(static_cast<double>(elements.at<float>(3 * i)),
                       static_cast<double>(elements.at<float>(3 * i + 1)),
                       static_cast<double>(elements.at<float>(3 * i + 2)));
      const Vec3 placed = placement.linear * local + placement.offset;
      if (!placed.allFinite()) {
        const bool own = !local.allFinite();
        return refused(ErrorCode::bad_mesh,
                       fmt::format("vertex {} (counted from 0) {}", i, own ? "is not finite" : "is moved to infinity"),
                       own ? place : node_place, "finite coordinates");
      }
      source_.positions.push_back(placed);
    }
    first_vertex_.emplace(index, first);
    return first;
  }

  /// How many corners the primitive has; its indices, checked, where it has some.
  Result<std::size_t> corner_count(const tinygltf::Primitive& primitive, std::size_t vertices, const std::string& place,
                                   std::vector<std::uint32_t>& indices) {
    const bool indexed = primitive.indices >= 0;
    const std::size_t corners = indexed ? accessors_.accessor(primitive.indices).count : vertices;
    const bool list = primitive.mode == TINYGLTF_MODE_TRIANGLES;
    if (list && corners % 3 != 0) ++incomplete_;
    if (!list && corners > 0 && corners < 3) ++incomplete_;
    if (!indexed) return corners;
    const tinygltf::Accessor& accessor = accessors_.accessor(primitive.indices);
    const std::string at = place + ".indices";
    const bool wide = accessor.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
    const bool narrow = accessor.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE;
    if (accessor.type != TINYGLTF_TYPE_SCALAR ||
        !(wide || narrow || accessor.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT)) {
      return refused(ErrorCode::file_malformed, "are not unsigned whole numbers", at, "SCALAR of 5121, 5123 or 5125");
    }
    ASPERITY_TRY(const Elements elements, accessors_.read(primitive.indices));
    indices.reserve(corners);
    for (std::size_t i = 0; i < corners; ++i) {
      const std::uint32_t index = wide     ? elements.at<std::uint32_t>(i)
                                  : narrow ? std::uint32_t{elements.at<std::uint8_t>(i)}
                                           : std::uint32_t{elements.at<std::uint16_t>(i)};
      if (index >= vertices) {
        return refused(ErrorCode::bad_mesh, fmt::format("refer to vertex {} of {}", index, vertices), at,
                       "indices of vertices that are there");
      }
      indices.push_back(index);
    }
    return corners;
  }

  Result<std::vector<Vec2f>> texture_coordinates(int index, std::size_t vertices, const std::string& at) {
    const tinygltf::Accessor& accessor = accessors_.accessor(index);
    const int type = accessor.componentType;
    const bool floats = type == TINYGLTF_COMPONENT_TYPE_FLOAT;
    const bool bytes = type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE;
    const bool normalised = accessor.normalized && (bytes || type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT);
    if (accessor.type != TINYGLTF_TYPE_VEC2 || !(floats || normalised)) {
      return refused(ErrorCode::file_unsupported, "are not two floats or normalised whole numbers", at,
                     "VEC2 of 5126, or of 5121 or 5123 normalised");
    }
    if (accessor.count != vertices) {
      return refused(ErrorCode::bad_mesh, fmt::format("are {} for {} vertices", accessor.count, vertices), at,
                     "one for each vertex");
    }
    ASPERITY_TRY(const Elements elements, accessors_.read(index));
    const auto number = [&](std::size_t i) {
      if (floats) return elements.at<float>(i);
      return bytes ? static_cast<float>(elements.at<std::uint8_t>(i)) / 255.0F
                   : static_cast<float>(elements.at<std::uint16_t>(i)) / 65535.0F;
    };
    std::vector<Vec2f> uvs;
    uvs.reserve(vertices);
    for (std::size_t i = 0; i < vertices; ++i) {
      // glTF counts v down from a map's upper edge, OBJ files and the maps here up from its lower one.
      const Vec2f stored(number(2 * i), number(2 * i + 1));
      const Vec2f placed = look_ != nullptr && look_->moved ? look_->transform(stored) : stored;
      uvs.emplace_back(placed.x(), 1.0F - placed.y());
      if (!uvs.back().allFinite()) {
        return refused(ErrorCode::bad_mesh, fmt::format("of vertex {} (counted from 0) are not finite", i), at,
                       "finite coordinates");
      }
    }
    return uvs;
  }

  template <class Corner>
  void add_triangles(int mode, std::size_t corners, const Corner& corner, std::uint32_t first,
                     const std::vector<Vec2f>& uvs, bool mirrored) {
    const auto add = [&](std::size_t i, std::size_t j, std::size_t k) {
      // A mirrored node would show the inside: its triangles turn round.
      if (mirrored) std::swap(j, k);
      const std::array<std::uint32_t, 3> local = {corner(i), corner(j), corner(k)};
      source_.triangles.push_back({first + local[0], first + local[1], first + local[2]});
      if (look_ != nullptr) look_of_triangle_.push_back(look_->number);
      if (uvs.empty()) return;
      source_.corner_uvs.reserve(source_.triangles.capacity());
      source_.corner_uvs.resize(source_.triangles.size(), {Vec2f::Zero(), Vec2f::Zero(), Vec2f::Zero()});
      source_.corner_uvs.back() = {uvs[local[0]], uvs[local[1]], uvs[local[2]]};
      ++with_uvs_;
    };
    if (mode == TINYGLTF_MODE_TRIANGLES) {
      for (std::size_t i = 0; i + 2 < corners; i += 3) add(i, i + 1, i + 2);
    } else if (mode == TINYGLTF_MODE_TRIANGLE_FAN) {
      for (std::size_t i = 1; i + 1 < corners; ++i) add(0, i, i + 1);
    } else {
      for (std::size_t i = 0; i + 2 < corners; ++i) {
        // Equal corners only lead a strip on to its next piece.
        const bool stitch = corner(i) == corner(i + 1) || corner(i + 1) == corner(i + 2) || corner(i) == corner(i + 2);
        if (!stitch) add(i, i + 1 + i % 2, i + 2 - i % 2);
      }
    }
  }

  void note(std::size_t count, const char* text) {
    if (count > 0) source_.notes.push_back(fmt::format(fmt::runtime(text), count));
  }

  void finish() {
    note(pointlike_, "{} parts of points or lines left out");
    note(shapeless_, "{} parts without positions left out");
    note(incomplete_, "{} parts end with an incomplete triangle, which is left out");
    std::size_t skinned = 0;
    for (const tinygltf::Node& node : model_.nodes) {
      if (node.skin >= 0 && node.mesh >= 0) ++skinned;
    }
    note(skinned, "{} meshes hang on a skeleton, which is left out: they stand as they are stored, in their node");
    const auto used = static_cast<std::size_t>(std::count(used_.begin(), used_.end(), true));
    if (used < model_.meshes.size()) {
      source_.notes.push_back(fmt::format("{} of {} meshes stand in no node of the scene and are left out",
                                          model_.meshes.size() - used, model_.meshes.size()));
    }
    if (with_uvs_ == source_.triangles.size()) return;
    if (looks_ != nullptr && with_uvs_ > 0) {
      // The maps of some parts must not go with the missing coordinates of others.
      source_.corner_uvs.resize(source_.triangles.size(), {Vec2f::Zero(), Vec2f::Zero(), Vec2f::Zero()});
      return;
    }
    source_.corner_uvs = {};
    if (with_uvs_ > 0) {
      source_.notes.push_back(fmt::format("texture coordinates left out: only {} of {} triangles have them", with_uvs_,
                                          source_.triangles.size()));
    }
  }

  const tinygltf::Model& model_;
  AccessorReader accessors_;
  const PrimitiveLooks* looks_ = nullptr;
  const PrimitiveLook* look_ = nullptr;  ///< of the current primitive
  MeshSource source_;
  std::vector<std::uint32_t> look_of_triangle_;
  std::map<int, std::uint32_t> first_vertex_;  ///< of the accessors that the current node has placed
  std::vector<Amount> amounts_;                ///< of each mesh
  Amount total_;                               ///< of the scene
  std::vector<bool> used_;
  std::size_t with_uvs_ = 0;
  std::size_t pointlike_ = 0;
  std::size_t shapeless_ = 0;
  std::size_t incomplete_ = 0;
};

}  // namespace

Result<GltfTriangles> read_triangles(GltfDocument& document, const PrimitiveLooks* looks) {
  const std::string& json = document.geometry_json();
  if (json.size() > std::numeric_limits<unsigned int>::max()) {
    return refused(ErrorCode::too_large, "has more than 4 GiB of JSON", {}, "a smaller file");
  }
  tinygltf::Model model;
  tinygltf::TinyGLTF reader;
  std::string error;
  std::string warning;
  // The JSON names neither buffers nor images any more: nothing is opened here.
  if (!reader.LoadASCIIFromString(&model, &error, &warning, json.data(), static_cast<unsigned int>(json.size()), {})) {
    while (!error.empty() && (error.back() == '\n' || error.back() == '.')) error.pop_back();
    return refused(ErrorCode::file_malformed, "cannot be read as glTF: " + error.substr(0, 200), {},
                   "a glTF 2.0 file (.gltf or .glb)");
  }
  if (looks != nullptr && looks->size() != model.meshes.size()) {
    return refused(ErrorCode::file_malformed, "has meshes that cannot be read", "meshes", "a complete glTF file");
  }
  return SceneGatherer(model, document, looks).run();
}

Result<MeshSource> read_gltf(std::string_view bytes, const std::filesystem::path* folder) {
  ASPERITY_TRY(GltfDocument document, GltfDocument::open(bytes, folder));
  ASPERITY_TRY(GltfTriangles triangles, read_triangles(document, nullptr));
  return std::move(triangles.mesh);
}

}  // namespace asperity::mesh_readers
