#include <fmt/format.h>
#include <openvdb/io/File.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/SignedFloodFill.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <mutex>
#include <new>
#include <sstream>
#include <stdexcept>
#include <unordered_map>

#include "asperity/io/atomic_file.h"
#include "asperity/io/vdb/vdb.h"
#include "asperity/io/vdb/vdb_check.h"
#include "asperity/io/vdb/vdb_library.h"

namespace asperity {
namespace vdb_io {
namespace {

namespace fs = std::filesystem;

constexpr const char* distance_grid = "distance";
constexpr const char* face_grid = "face";
constexpr const char* faces_key = "asperity_mesh_faces";
constexpr const char* outside_key = "asperity_band_outside";
constexpr const char* inside_key = "asperity_band_inside";
/// Of a leaf and what is made of it here.
constexpr std::uint64_t leaf_bytes = 2 * (sizeof(SparseBlock) + 2048);

/// "float" of "Tree_float_5_4_3"; empty: a tree of other measures.
std::string value_type(const GridOutline& grid) {
  constexpr std::string_view before = "Tree_";
  constexpr std::string_view behind = "_5_4_3";
  if (!grid.tree.starts_with(before) || !grid.tree.ends_with(behind)) return {};
  return grid.tree.substr(before.size(), grid.tree.size() - before.size() - behind.size());
}

std::string class_of(const GridOutline& grid) {
  const std::string name = grid.text("class");
  return name.empty() ? "unknown" : name;
}

bool is_distance(const GridOutline& grid) {
  const std::string type = value_type(grid);
  return (type == "float" || type == "double") && class_of(grid) == "level set";
}

/// "\"density\" (float, fog volume)" of each.
std::string listed(const std::vector<GridOutline>& grids) {
  std::string text;
  for (const GridOutline& grid : grids) {
    const std::string type = value_type(grid);
    text += fmt::format("{}\"{}\" ({}, {})", text.empty() ? "" : ", ", shown(grid.name),
                        shown(type.empty() ? grid.tree : type), shown(class_of(grid)));
  }
  return text.empty() ? "no grid" : text;
}

Error in_grid(ErrorCode code, const GridOutline& grid, std::string what, std::string accepted) {
  return refused(code, std::move(what), fmt::format("grid \"{}\"", shown(grid.name)), std::move(accepted));
}

/// The grid that is wanted.
Result<const GridOutline*> chosen(const std::vector<GridOutline>& grids, const SparseRequest& request,
                                  std::vector<std::string>& notes) {
  const GridOutline* first = nullptr;
  std::size_t level_sets = 0;
  for (const GridOutline& grid : grids) {
    if (!request.grid.empty() && grid.name == request.grid && first == nullptr) first = &grid;
    if (request.grid.empty() && is_distance(grid)) {
      if (first == nullptr) first = &grid;
      ++level_sets;
    }
  }
  if (first == nullptr && !request.grid.empty()) {
    return bad_value(fmt::format("holds no grid \"{}\"", request.grid), "grid", listed(grids));
  }
  if (first == nullptr) {
    return refused(ErrorCode::file_unsupported, fmt::format("holds no level set, but {}", listed(grids)), {},
                   "a grid of signed distances: class \"level set\", of float or double");
  }
  if (!is_distance(*first)) {
    const std::string type = value_type(*first);
    return in_grid(
        ErrorCode::file_unsupported, *first,
        fmt::format("is a {} of {}", class_of(*first) == "unknown" ? "grid of no class" : shown(class_of(*first)),
                    shown(type.empty() ? first->tree : type)),
        "a grid of signed distances: class \"level set\", of float or double");
  }
  if (level_sets > 1)
    notes.push_back(fmt::format("of {} level sets the first is read, \"{}\"", level_sets, shown(first->name)));
  return first;
}

/// Voxels have to be cubes along the axes.
Status check_transform(const GridOutline& grid) {
  const double voxel = grid.linear(0, 0);
  constexpr const char* accepted = "cubic voxels along the axes: translation and uniform scale alone";
  if (grid.linear.isZero(0.0))
    return in_grid(ErrorCode::file_unsupported, grid, fmt::format("has a transform {}", shown(grid.map)), accepted);
  const bool cubes = voxel > 0.0 && std::isfinite(voxel) &&
                     (grid.linear - voxel * Mat3::Identity()).cwiseAbs().maxCoeff() <= 1e-6 * voxel;
  if (!cubes || !grid.origin.allFinite()) {
    const Vec3 lengths = grid.linear.colwise().norm();
    return in_grid(ErrorCode::file_unsupported, grid,
                   fmt::format("has voxels of {} x {} x {} (turned, sheared or mirrored where these agree)",
                               lengths.x(), lengths.y(), lengths.z()),
                   accepted);
  }
  return success();
}

std::uint64_t key_of(const openvdb::Coord& leaf) {
  std::uint64_t key = 0;
  for (std::size_t a = 0; a < 3; ++a)
    key = key << 21U | static_cast<std::uint64_t>(((leaf[a] >> 3) + (1 << 20)) & ((1 << 21) - 1));
  return key;
}

/// A file that was checked, opened.
class Reader {
 public:
  Reader(const fs::path& path, std::string_view bytes, const SparseRequest& request)
      : bytes_(bytes), request_(request), file_(path.string()) {}

  Result<SparseFile> read(const Progress& progress) {
    ASPERITY_TRY(grids_, outline(bytes_));
    for (const GridOutline& grid : grids_) {
      const std::string type = value_type(grid);
      const bool linear = !grid.linear.isZero(0.0);
      const double points = grid.number("file_voxel_count", 0.0);
      out_.entries.push_back({shown(grid.name), shown(type.empty() ? grid.tree : type), class_of(grid),
                              linear ? (grid.linear.isDiagonal() ? grid.linear(0, 0) : grid.linear.col(0).norm()) : 0.0,
                              points > 0.0 && points < 1e18 ? static_cast<std::size_t>(points) : 0});
    }
    ASPERITY_TRY(const GridOutline* distance, chosen(grids_, request_, out_.notes));
    ASPERITY_CHECK(check_transform(*distance));
    // All at once: with delayed loading a file that goes away later would matter.
    file_.open(false);
    if (progress) progress("reading grid", 0.0);
    ASPERITY_CHECK(value_type(*distance) == "double" ? read_distance<openvdb::DoubleGrid>(*distance)
                                                     : read_distance<openvdb::FloatGrid>(*distance));
    std::string left_out;
    for (const GridOutline& grid : grids_) {
      if (&grid == distance) continue;
      ASPERITY_TRY(const bool taken, read_companion(grid, *distance));
      if (!taken) left_out += fmt::format("{}\"{}\"", left_out.empty() ? "" : ", ", shown(grid.name));
    }
    if (!left_out.empty()) out_.notes.push_back(fmt::format("grids left out: {}", left_out));
    if (progress) progress("reading grid", 1.0);
    return std::move(out_);
  }

 private:
  template <class Grid>
  Result<typename Grid::Ptr> load(const GridOutline& grid) {
    using Value = typename Grid::ValueType;
    if (!grid.parent.empty()) {
      return in_grid(ErrorCode::file_unsupported, grid, fmt::format("shares the tree of \"{}\"", shown(grid.parent)),
                     "a grid with a tree of its own");
    }
    ASPERITY_TRY(const TreeSize size, check_tree(bytes_, grid, sizeof(Value), std::is_floating_point_v<Value>));
    const std::uint64_t needed =
        (size.leaves + size.tiles) * leaf_bytes + size.nodes_5 * 300'000 + size.nodes_4 * 40'000;
    if (needed > request_.most_bytes) {
      return in_grid(ErrorCode::too_large, grid, fmt::format("would take {} MiB", needed >> 20U),
                     fmt::format("at most {} MiB", request_.most_bytes >> 20U));
    }
    const auto loaded =
        openvdb::gridPtrCast<Grid>(file_.readGrid(openvdb::io::GridDescriptor::nameAsString(grid.unique_name)));
    if (loaded == nullptr)
      return in_grid(ErrorCode::file_malformed, grid, "is not of the type that it declares", "a whole .vdb file");
    loaded->tree().voxelizeActiveTiles();
    return loaded;
  }

  template <class Grid>
  Status read_distance(const GridOutline& outline) {
    ASPERITY_TRY(const typename Grid::Ptr grid, load<Grid>(outline));
    SparseSource& source = out_.source;
    out_.grid = outline.name;
    source.voxel = outline.linear(0, 0);
    source.origin = outline.origin;
    const double faces = outline.number(faces_key, 0.0);
    out_.mesh_faces = faces > 0.0 && faces < 4e9 ? static_cast<std::size_t>(faces) : 0;
    const auto background = static_cast<double>(grid->background());
    double lowest = 0.0;
    double highest = 0.0;
    for (auto leaf = grid->tree().cbeginLeaf(); leaf; ++leaf) {
      SparseBlock block;
      for (std::size_t a = 0; a < 3; ++a) block.at[a] = leaf->origin()[a] >> 3;
      for (openvdb::Index n = 0; n < leaf->SIZE; ++n) {
        const auto value = static_cast<float>(leaf->getValue(n));
        if (!std::isfinite(value)) {
          const openvdb::Coord at = leaf->offsetToGlobalCoord(n);
          return in_grid(ErrorCode::file_malformed, outline,
                         fmt::format("holds {} at voxel ({}, {}, {})", value, at.x(), at.y(), at.z()),
                         "finite distances");
        }
        const openvdb::Coord at = leaf->offsetToLocalCoord(n);
        block.value[SparseBlock::index(at.x(), at.y(), at.z())] = value;
        lowest = std::min(lowest, static_cast<double>(value));
        highest = std::max(highest, static_cast<double>(value));
      }
      place_.emplace(key_of(leaf->origin()), source.blocks.size());
      source.blocks.push_back(std::move(block));
    }
    ASPERITY_CHECK(check_spread(outline));
    if (source.blocks.empty())
      return in_grid(ErrorCode::file_unsupported, outline, "is empty", "a level set with active voxels");
    if (!(lowest < 0.0) || !(highest > 0.0) || !(background > 0.0) || !std::isfinite(background)) {
      return in_grid(ErrorCode::file_unsupported, outline,
                     fmt::format("has distances from {} to {} and {} beyond", lowest, highest, background),
                     "signed distances, negative inside, positive outside");
    }
    // Ours say the band exactly; values are rounded.
    const double outside = outline.number(outside_key, background);
    const double inside = outline.number(inside_key, -background);
    source.outside = static_cast<double>(static_cast<float>(outside)) >= highest ? outside : highest;
    source.inside = static_cast<double>(static_cast<float>(inside)) <= lowest ? inside : lowest;
    if (std::is_same_v<Grid, openvdb::DoubleGrid>)
      out_.notes.push_back(fmt::format("\"{}\" is of doubles: kept in single precision", shown(outline.name)));
    if (outline.half) out_.notes.push_back(fmt::format("\"{}\" was stored in half precision", shown(outline.name)));
    return success();
  }

  /// Blocks far from each other would need a large table to be found in.
  [[nodiscard]] Status check_spread(const GridOutline& outline) const {
    constexpr double entry_bytes = 24.0;
    double bytes = entry_bytes;
    for (std::size_t a = 0; a < 3; ++a) {
      std::int32_t low = std::numeric_limits<std::int32_t>::max();
      std::int32_t high = std::numeric_limits<std::int32_t>::min();
      for (const SparseBlock& block : out_.source.blocks) {
        low = std::min(low, block.at[a]);
        high = std::max(high, block.at[a]);
      }
      bytes *= std::max(static_cast<double>(high) - static_cast<double>(low) + 3.0, 1.0);
    }
    // Most files are mostly empty; this one is nothing else.
    const double most = std::min(static_cast<double>(request_.most_bytes), 2147483648.0);
    if (bytes <= most) return success();
    return in_grid(ErrorCode::too_large, outline,
                   fmt::format("spreads its voxels over a box of {:.3g} blocks", bytes / entry_bytes),
                   fmt::format("at most {:.3g}", most / entry_bytes));
  }

  /// Faces and materials that lie on the same points. Answers whether it was one.
  Result<bool> read_companion(const GridOutline& grid, const GridOutline& distance) {
    const std::string type = value_type(grid);
    const auto names = material_channel_names();
    const auto channel = static_cast<std::size_t>(std::find(names.begin(), names.end(), grid.name) - names.begin());
    const bool is_face = grid.name == face_grid && type == "int32" && !out_.has_faces;
    const bool is_material = channel < names.size() && type == "float";
    if (!is_face && !is_material) return false;
    if (grid.linear != distance.linear || grid.origin != distance.origin) {
      out_.notes.push_back(
          fmt::format("\"{}\" lies on other points than \"{}\"", shown(grid.name), shown(distance.name)));
      return false;
    }
    if (is_face) {
      ASPERITY_CHECK(read_faces(grid));
      out_.has_faces = true;
    } else {
      ASPERITY_CHECK(read_material(grid, channel));
      out_.channels.push_back(grid.name);
    }
    return true;
  }

  Status read_faces(const GridOutline& outline) {
    ASPERITY_TRY(const openvdb::Int32Grid::Ptr grid, load<openvdb::Int32Grid>(outline));
    for (SparseBlock& block : out_.source.blocks) block.face.assign(SparseBlock::points, no_index);
    for (auto voxel = grid->tree().cbeginValueOn(); voxel; ++voxel) {
      SparseBlock* block = block_at(voxel.getCoord());
      if (block == nullptr || *voxel < 0) continue;
      const auto face = static_cast<std::uint32_t>(*voxel);
      if (out_.mesh_faces > 0 && face >= out_.mesh_faces) {
        return in_grid(ErrorCode::file_malformed, outline, fmt::format("names face {} of {}", face, out_.mesh_faces),
                       "faces that the mesh has");
      }
      block->face[point_of(voxel.getCoord())] = face;
    }
    return success();
  }

  Status read_material(const GridOutline& outline, std::size_t channel) {
    ASPERITY_TRY(const openvdb::FloatGrid::Ptr grid, load<openvdb::FloatGrid>(outline));
    for (auto voxel = grid->tree().cbeginValueOn(); voxel; ++voxel) {
      SparseBlock* block = block_at(voxel.getCoord());
      if (block == nullptr) continue;
      const float value = *voxel;
      if (!std::isfinite(value) || value < 0.0F || (channel == 0 && value == 0.0F)) {
        return in_grid(ErrorCode::file_malformed, outline, fmt::format("holds {}", value),
                       channel == 0 ? "finite numbers above 0" : "finite numbers, 0 or more");
      }
      if (block->material.empty()) block->material.resize(SparseBlock::points);
      block->material[point_of(voxel.getCoord())].set(channel, value);
    }
    return success();
  }

  SparseBlock* block_at(const openvdb::Coord& at) {
    const auto found = place_.find(key_of(at));
    return found == place_.end() ? nullptr : &out_.source.blocks[found->second];
  }
  static std::size_t point_of(const openvdb::Coord& at) {
    return SparseBlock::index(at.x() & 7, at.y() & 7, at.z() & 7);
  }

  std::string_view bytes_;
  const SparseRequest& request_;
  openvdb::io::File file_;
  std::vector<GridOutline> grids_;
  std::unordered_map<std::uint64_t, std::size_t> place_;
  SparseFile out_;
};

Result<std::string> file_bytes(const fs::path& path, std::size_t most_bytes) {
  std::error_code problem;
  const std::uintmax_t size = fs::is_regular_file(path, problem) ? fs::file_size(path, problem) : 0;
  std::ifstream stream(path, std::ios::binary);
  if (problem || !stream) return refused(ErrorCode::file_missing, "cannot be read", {}, "a readable .vdb file");
  if (size == 0) return refused(ErrorCode::file_empty, "is empty", {}, "a .vdb file");
  if (size > most_bytes) {
    return refused(ErrorCode::too_large, fmt::format("has {} bytes", size), {},
                   fmt::format("at most {} MiB", most_bytes >> 20U));
  }
  std::string bytes(static_cast<std::size_t>(size), '\0');
  stream.read(bytes.data(), static_cast<std::streamsize>(size));
  bytes.resize(static_cast<std::size_t>(stream.gcount()));
  return bytes;
}

/// An archive in memory, with the places of its grids as a file has them.
class MemoryArchive : public openvdb::io::Archive {
 public:
  [[nodiscard]] std::string bytes(const openvdb::GridCPtrVec& grids) const {
    std::stringstream stream(std::ios::in | std::ios::out | std::ios::binary);
    openvdb::io::Archive::write(stream, grids, true, {});
    return std::move(stream).str();
  }
};

template <class Visit>
void for_each_point(const Visit& visit) {
  for (int k = 0; k < SparseBlock::side; ++k) {
    for (int j = 0; j < SparseBlock::side; ++j) {
      for (int i = 0; i < SparseBlock::side; ++i)
        visit(SparseBlock::index(i, j, k), openvdb::FloatTree::LeafNodeType::coordToOffset(openvdb::Coord(i, j, k)));
    }
  }
}

openvdb::Coord origin_of(const SparseBlock& block) {
  return {8 * block.at[0], 8 * block.at[1], 8 * block.at[2]};
}

openvdb::FloatGrid::Ptr distances_of(const SparseSource& source) {
  const auto outside = static_cast<float>(source.outside);
  const auto inside = static_cast<float>(source.inside);
  const auto grid = openvdb::FloatGrid::create(outside);
  for (const SparseBlock& block : source.blocks) {
    auto* leaf = grid->tree().touchLeaf(origin_of(block));
    for_each_point([&](std::size_t from, openvdb::Index to) {
      const float value = block.value[from];
      if (value > inside && value < outside) {
        leaf->setValueOn(to, value);
      } else {
        leaf->setValueOff(to, value);
      }
    });
  }
  // Between the blocks; the blocks themselves are as they are.
  openvdb::tools::signedFloodFillWithValues(grid->tree(), outside, inside, true, 1, 1);
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  grid->setName(distance_grid);
  return grid;
}

openvdb::Int32Grid::Ptr faces_of(const SparseSource& source) {
  const auto grid = openvdb::Int32Grid::create(-1);
  for (const SparseBlock& block : source.blocks) {
    if (block.face.empty()) continue;
    auto* leaf = grid->tree().touchLeaf(origin_of(block));
    for_each_point([&](std::size_t from, openvdb::Index to) {
      if (block.face[from] != no_index) leaf->setValueOn(to, static_cast<openvdb::Int32>(block.face[from]));
    });
  }
  grid->setName(face_grid);
  return grid;
}

openvdb::FloatGrid::Ptr channel_of(const SparseSource& source, std::size_t channel) {
  const auto grid = openvdb::FloatGrid::create(0.0F);
  for (const SparseBlock& block : source.blocks) {
    if (block.material.empty()) continue;
    for_each_point([&](std::size_t from, openvdb::Index to) {
      const float value = block.material[from].get(channel);
      if (!std::isnan(value)) grid->tree().touchLeaf(origin_of(block))->setValueOn(to, value);
    });
  }
  grid->setName(material_channel_names()[channel]);
  return grid;
}

/// Puts the transform into an archive's grids. OpenVDB itself loses the voxel's last digits on the way into a file, and
/// refuses voxels below 14 um.
void place_grids(std::string& bytes, const SparseSource& source) {
  std::array<double, 18> numbers{};
  for (std::size_t a = 0; a < 3; ++a) {
    // Translation, scale, size of a voxel, and what OpenVDB keeps of the scale to save divisions.
    numbers[a] = source.origin[static_cast<int>(a)];
    numbers[3 + a] = numbers[6 + a] = source.voxel;
    numbers[9 + a] = 1.0 / source.voxel;
    numbers[12 + a] = numbers[9 + a] * numbers[9 + a];
    numbers[15 + a] = 0.5 * numbers[9 + a];
  }
  const Result<std::vector<GridOutline>> grids = outline(bytes);
  if (!grids) throw std::runtime_error(grids.error().message());
  for (const GridOutline& grid : *grids) {
    if (grid.map != "UniformScaleTranslateMap") throw std::runtime_error("unexpected transform " + grid.map);
    std::memcpy(bytes.data() + grid.tree_at - sizeof(numbers), numbers.data(), sizeof(numbers));
  }
}

std::string archived(const SparseGrid& grid, std::size_t mesh_faces) {
  const SparseSource source = grid.source();
  // Stands in for the true one (place_grids), as it is of the same kind.
  const auto transform = openvdb::math::Transform::createLinearTransform(0.5);
  transform->postTranslate({1.0, 2.0, 3.0});
  openvdb::GridPtrVec grids;
  grids.push_back(distances_of(source));
  openvdb::GridBase& first = *grids.front();
  first.insertMeta(outside_key, openvdb::DoubleMetadata(source.outside));
  first.insertMeta(inside_key, openvdb::DoubleMetadata(source.inside));
  if (mesh_faces > 0) first.insertMeta(faces_key, openvdb::Int64Metadata(static_cast<openvdb::Int64>(mesh_faces)));
  if (grid.has_faces()) grids.push_back(faces_of(source));
  if (grid.has_materials()) {
    for (std::size_t channel = 0; channel < material_channels; ++channel) {
      openvdb::FloatGrid::Ptr one = channel_of(source, channel);
      if (!one->empty()) grids.push_back(std::move(one));
    }
  }
  openvdb::GridCPtrVec all;
  for (const openvdb::GridBase::Ptr& one : grids) {
    one->setTransform(transform->copy());
    all.push_back(one);
  }
  std::string bytes = MemoryArchive().bytes(all);
  place_grids(bytes, source);
  return bytes;
}

}  // namespace

void initialize() {
  static std::once_flag once;
  std::call_once(once, [] { openvdb::initialize(); });
}

Result<SparseFile> read_file(const fs::path& path, const SparseRequest& request, const Progress& progress) {
  try {
    initialize();
    ASPERITY_TRY(const std::string bytes, file_bytes(path, request.most_bytes));
    return Reader(path, bytes, request).read(progress);
  } catch (const std::bad_alloc&) {
    return refused(ErrorCode::too_large, "needs more memory than there is", {}, "a smaller grid");
  } catch (const std::exception& failure) {
    return refused(ErrorCode::file_malformed, fmt::format("cannot be read ({})", shown(failure.what())), {},
                   "a whole .vdb file");
  }
}

Status write_file(const fs::path& path, const SparseGrid& grid, std::size_t mesh_faces, const Progress& progress) {
  try {
    initialize();
    if (progress) progress("writing grid", 0.0);
    const std::string bytes = archived(grid, mesh_faces);
    ASPERITY_CHECK(write_file_atomically(path, bytes));
    if (progress) progress("writing grid", 1.0);
    return success();
  } catch (const std::bad_alloc&) {
    return refused(ErrorCode::too_large, "needs more memory than there is", {}, "a smaller grid");
  } catch (const std::exception& failure) {
    return refused(ErrorCode::file_unwritable, fmt::format("cannot be written ({})", failure.what()));
  }
}

}  // namespace vdb_io

void register_vdb() {
  register_mesh_voxelizer(vdb_io::voxelize);
  register_sparse_files(vdb_io::read_file, vdb_io::write_file);
}

}  // namespace asperity
