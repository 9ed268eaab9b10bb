#include "asperity/field/volume/sparse_grid.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#if defined(__x86_64__)
#include <emmintrin.h>
#endif

#include "asperity/core/identity.h"
#include "asperity/field/volume/places.h"

namespace asperity {

namespace {

constexpr int block_side = SparseBlock::side;
constexpr int apron_side = SparseGrid::brick_side;
constexpr int material_side = block_side + 1;
constexpr std::size_t material_points = material_side * material_side * material_side;
/// Place of a point's material in its brick, 0 … 8 along each axis.
constexpr std::size_t material_index(int i, int j, int k) noexcept {
  return static_cast<std::size_t>(i + material_side * (j + material_side * k));
}
constexpr std::size_t most_table = std::size_t{1} << 27;  // 4,096 voxels a side, some 2 GB

/// Place of a point of a brick's apron, -1 … 9 along each axis.
constexpr std::size_t apron_index(int i, int j, int k) noexcept {
  return static_cast<std::size_t>(i + 1 + apron_side * (j + 1 + apron_side * (k + 1)));
}

/// The first node of those of a cell and of `ring` more around them.
constexpr std::size_t first_node(const std::uint32_t cell[3], int ring) noexcept {
  return apron_index(static_cast<int>(cell[0]) - ring, static_cast<int>(cell[1]) - ring,
                     static_cast<int>(cell[2]) - ring);
}

Status check_material(const PointMaterial& material, const std::string& place) {
  static constexpr const char* accepted[] = {"above 0 (N/m)", "0 or more (N·s/m)", "0 or more", "0 or more",
                                             "0 or more"};
  for (std::size_t channel = 0; channel < material_channels; ++channel) {
    const float value = material.get(channel);
    if (std::isnan(value) || fits_channel(channel, value)) continue;
    return bad_value(fmt::format("is {}", value), fmt::format("{}.{}", place, material_channel_names()[channel]),
                     accepted[channel]);
  }
  return success();
}

Status check_block(const SparseBlock& block, std::size_t number) {
  const std::string place = fmt::format("blocks[{}]", number);
  for (const std::int32_t at : block.at) {
    if (std::abs(static_cast<std::int64_t>(at)) > (1 << 24))
      return bad_value(fmt::format("is at {}", at), place, "places within 16 million blocks of the origin");
  }
  for (std::size_t i = 0; i < block.value.size(); ++i) {
    if (!std::isfinite(block.value[i]))
      return bad_value("is not a finite number", fmt::format("{}.value[{}]", place, i), "distances (m)");
  }
  for (const auto& [entries, part] : {std::pair(block.face.size(), ".face"), {block.material.size(), ".material"}}) {
    if (entries != 0 && entries != SparseBlock::points)
      return bad_value(fmt::format("has {} entries", entries), place + part, "512 or none");
  }
  for (std::size_t i = 0; i < block.material.size(); ++i)
    ASPERITY_CHECK(check_material(block.material[i], fmt::format("{}.material[{}]", place, i)));
  return success();
}

Status check_source(const SparseSource& source) {
  const auto check_length = [](double value, double sign, const char* place) -> Status {
    if (sign * value > 0.0 && std::isfinite(value)) return success();
    return bad_value(fmt::format("is {}", value), place,
                     fmt::format("a length {} 0 (m)", sign > 0.0 ? "above" : "below"));
  };
  ASPERITY_CHECK(check_length(source.voxel, 1.0, "voxel"));
  if (!source.origin.allFinite()) return bad_value("is not finite", "origin", "three finite lengths (m)");
  ASPERITY_CHECK(check_length(source.outside, 1.0, "outside"));
  ASPERITY_CHECK(check_length(source.inside, -1.0, "inside"));
  if (source.blocks.empty()) return bad_value("holds none", "blocks", "at least one block");
  if (source.blocks.size() > SparseGrid::most_bricks) {
    return refused(ErrorCode::too_large, fmt::format("holds {} blocks", source.blocks.size()), "blocks",
                   fmt::format("at most {}", SparseGrid::most_bricks));
  }
  for (std::size_t b = 0; b < source.blocks.size(); ++b) ASPERITY_CHECK(check_block(source.blocks[b], b));
  return success();
}

/// Of a brick's apron, `Count` along each axis.
template <int Count>
void copy_nodes(const float* first, double* out) noexcept {
  for (int k = 0; k < Count; ++k) {
    for (int j = 0; j < Count; ++j) {
      const float* row = first + apron_side * (j + apron_side * k);
      for (int i = 0; i < Count; ++i) *out++ = static_cast<double>(row[i]);
    }
  }
}

/// Two by two, which is faster than one by one.
using Pair = double __attribute__((vector_size(16)));

/// Both nodes of a cell's edge along x, from the first one.
[[gnu::always_inline]] inline Pair edge_at(const float* node) noexcept {
#if defined(__x86_64__)
  double both;  // the bytes of two nodes
  std::memcpy(&both, node, sizeof(both));
  return _mm_cvtps_pd(_mm_castpd_ps(_mm_set_sd(both)));
#else
  return Pair{static_cast<double>(node[0]), static_cast<double>(node[1])};
#endif
}

/// Value and gradient of the trilinear interpolant of a cell, from its edges along x: e01 is that at y 0, z 1.
[[gnu::always_inline]] inline Potential interpolated(Pair e00, Pair e10, Pair e01, Pair e11, const double at[3],
                                                     double per_voxel) noexcept {
  // Along y and z first: both ends of the edges at once.
  const Pair slope_y_low = e10 - e00;
  const Pair slope_y_high = e11 - e01;
  const Pair low = e00 + at[1] * slope_y_low;
  const Pair slope_z = e01 + at[1] * slope_y_high - low;
  const Pair ends = low + at[2] * slope_z;
  const Pair slope_y = slope_y_low + at[2] * (slope_y_high - slope_y_low);
  const double slope_x = ends[1] - ends[0];
  return {ends[0] + at[0] * slope_x, per_voxel * Vec3(slope_x, slope_y[0] + at[0] * (slope_y[1] - slope_y[0]),
                                                      slope_z[0] + at[0] * (slope_z[1] - slope_z[0]))};
}

/// The trilinear value of a cell, and the centre differences at its eight nodes, interpolated: of the rows of four
/// nodes along x around it, by y and z 0 to 3, `inner` answers the middle two, `outer` the others.
template <class Inner, class Outer>
[[gnu::always_inline]] inline Potential by_centre_differences(const Inner& inner, const Outer& outer,
                                                              const double at[3], double per_voxel) noexcept {
  const double x[2] = {1.0 - at[0], at[0]};
  const double y[2] = {1.0 - at[1], at[1]};
  const double z[2] = {1.0 - at[2], at[2]};
  const auto between = [&](const auto& rows, int j) { return z[0] * rows(j, 1) + z[1] * rows(j, 2); };
  const auto along_z = [&](int j) { return z[0] * (inner(j, 2) - inner(j, 0)) + z[1] * (inner(j, 3) - inner(j, 1)); };
  const Pair low = between(inner, 1);
  const Pair high = between(inner, 2);
  const Pair middle = y[0] * low + y[1] * high;
  const Pair ends = y[0] * between(outer, 1) + y[1] * between(outer, 2);
  const Pair slope_y = y[0] * (high - between(inner, 0)) + y[1] * (between(inner, 3) - low);
  const Pair slope_z = y[0] * along_z(1) + y[1] * along_z(2);
  const Vec3 differences(x[0] * (middle[1] - ends[0]) + x[1] * (ends[1] - middle[0]),
                         x[0] * slope_y[0] + x[1] * slope_y[1], x[0] * slope_z[0] + x[1] * slope_z[1]);
  return {x[0] * middle[0] + x[1] * middle[1], (0.5 * per_voxel) * differences};
}

}  // namespace

std::span<const char* const> material_channel_names() {
  static constexpr const char* names[] = {"stiffness", "damping", "static_friction", "dynamic_friction", "roughness"};
  return names;
}

bool fits_channel(std::size_t channel, float value) noexcept {
  return std::isfinite(value) && (channel == 0 ? value > 0.0F : value >= 0.0F);
}

/// Marks what is beyond the band as outside or inside: each connected part takes the side of the stored points that it
/// touches.
void SparseGrid::settle_signs(const std::vector<const SparseBlock*>& blocks) {
  constexpr std::int32_t open = -3;
  std::replace(table_.begin(), table_.end(), inside_entry, open);
  const auto touching = [](const SparseBlock& block, std::size_t axis, bool low) {
    double sum = 0.0;
    for (int b = 0; b < block_side; ++b) {
      for (int a = 0; a < block_side; ++a) {
        int at[3] = {a, a, a};
        at[axis] = low ? 0 : block_side - 1;
        at[(axis + 1) % 3] = a;
        at[(axis + 2) % 3] = b;
        sum += static_cast<double>(block.value[SparseBlock::index(at[0], at[1], at[2])]);
      }
    }
    return sum;
  };
  std::vector<std::size_t> part;
  const std::size_t step[3] = {1, counts_[0], static_cast<std::size_t>(counts_[0]) * counts_[1]};
  for (std::size_t seed = 0; seed < table_.size(); ++seed) {
    if (table_[seed] != open) continue;
    part.assign(1, seed);
    table_[seed] = outside_entry;
    double sum = 0.0;
    for (std::size_t n = 0; n < part.size(); ++n) {
      const std::size_t entry = part[n];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::size_t here = entry / step[axis] % counts_[axis];
        for (const bool up : {false, true}) {
          if (up ? here + 1 >= counts_[axis] : here == 0) continue;
          const std::size_t next = up ? entry + step[axis] : entry - step[axis];
          if (table_[next] == open) {
            table_[next] = outside_entry;
            part.push_back(next);
          } else if (blocks[next] != nullptr) {
            sum += touching(*blocks[next], axis, up);
          }
        }
      }
    }
    if (sum >= 0.0) continue;
    for (const std::size_t entry : part) table_[entry] = inside_entry;
  }
}

/// Makes the bricks of the wanted entries, aprons included.
void SparseGrid::fill(const std::vector<const SparseBlock*>& blocks, const std::vector<bool>& wanted) {
  const auto step_y = static_cast<std::ptrdiff_t>(counts_[0]);
  const std::ptrdiff_t step_z = step_y * static_cast<std::ptrdiff_t>(counts_[1]);
  for (std::size_t entry = 0; entry < table_.size(); ++entry) {
    if (!wanted[entry] || table_[entry] < 0) continue;
    // A brick is never on the table's border, so that all its neighbours are entries.
    const SparseBlock* around[3][3][3];
    float beyond[3][3][3];
    bool any_material = false;
    for_each_in_cube(0, 3, [&](int x, int y, int z) {
      const auto at =
          static_cast<std::size_t>(static_cast<std::ptrdiff_t>(entry) + (x - 1) + (y - 1) * step_y + (z - 1) * step_z);
      around[z][y][x] = blocks[at];
      beyond[z][y][x] = table_[at] < 0 ? constant(table_[at]) : 0.0F;
      const bool reaches = x > 0 && y > 0 && z > 0;
      any_material = any_material || (reaches && blocks[at] != nullptr && !blocks[at]->material.empty());
    });
    auto brick = std::make_shared<Brick>();
    for_each_in_cube(-1, block_side + 2, [&](int i, int j, int k) {
      const int x = (i + block_side) / block_side;
      const int y = (j + block_side) / block_side;
      const int z = (k + block_side) / block_side;
      const SparseBlock* from = around[z][y][x];
      brick->value[apron_index(i, j, k)] =
          from != nullptr ? from->value[SparseBlock::index(i - (x - 1) * block_side, j - (y - 1) * block_side,
                                                           k - (z - 1) * block_side)]
                          : beyond[z][y][x];
    });
    const SparseBlock& own = *around[1][1][1];
    brick->face = own.face;
    brick->owns_material = !own.material.empty();
    if (any_material) {
      brick->material.resize(material_points);
      for_each_in_cube(0, material_side, [&](int i, int j, int k) {
        const SparseBlock* from = around[1 + k / block_side][1 + j / block_side][1 + i / block_side];
        if (from == nullptr || from->material.empty()) return;
        brick->material[material_index(i, j, k)] =
            from->material[SparseBlock::index(i % block_side, j % block_side, k % block_side)];
      });
    }
    bricks_[static_cast<std::size_t>(table_[entry])] = std::move(brick);
  }
}

void SparseGrid::finish() {
  identity_ = next_identity();
  lowest_ = highest_ = bricks_.front()->value[apron_index(0, 0, 0)];
  has_faces_ = true;
  has_materials_ = false;
  stiffest_ = 0.0F;
  std::vector<ValueRange> ranges(table_.size());
  for_each_place(std::array<std::uint32_t, 3>{}, counts_, [&](std::uint32_t i, std::uint32_t j, std::uint32_t k) {
    const std::size_t entry = table_index(i, j, k);
    ValueRange& range = ranges[entry];
    if (table_[entry] >= 0) {
      const Brick& brick = *bricks_[static_cast<std::size_t>(table_[entry])];
      for (const float value : brick.value) range.include({value, value});
      has_faces_ = has_faces_ && !brick.face.empty();
      has_materials_ = has_materials_ || brick.owns_material;
      for (const PointMaterial& material : brick.material) stiffest_ = std::fmax(stiffest_, material.stiffness);
      lowest_ = std::min(lowest_, range.lower);
      highest_ = std::max(highest_, range.upper);
      return;
    }
    const float value = constant(table_[entry]);
    range.include({value, value});
    // Its outermost cells and their rings reach into stored neighbours.
    std::array<std::uint32_t, 3> first{i, j, k};
    std::array<std::uint32_t, 3> last{};
    for (std::size_t a = 0; a < 3; ++a) {
      last[a] = std::min(first[a] + 2, counts_[a]);
      first[a] -= std::min(first[a], 1U);
    }
    bool lonely = true;
    for_each_place(first, last, [&](std::uint32_t x, std::uint32_t y, std::uint32_t z) {
      lonely = lonely && table_[table_index(x, y, z)] < 0;
    });
    if (lonely) return;
    constexpr std::uint32_t outermost[4] = {0, 3, 6, 7};
    double samples[64];
    for_each_in_cube(0, 4, [&](int x, int y, int z) {
      const std::uint32_t cell[3] = {block_side * i + outermost[x], block_side * j + outermost[y],
                                     block_side * k + outermost[z]};
      // Rings of four nodes from these cells on cover all that the brick's cells read at its border.
      cell_samples(cell, 1, samples);
      for (const double sample : samples) range.include({static_cast<float>(sample), static_cast<float>(sample)});
    });
  });
  for (std::size_t a = 0; a < 3; ++a) extent_[static_cast<int>(a)] = static_cast<double>(brick_cells) * counts_[a];
  octree_ = MinMaxOctree::build(counts_, brick_cells, std::move(ranges));
}

Result<SparseGrid> SparseGrid::build(SparseSource source) {
  ASPERITY_CHECK(check_source(source));
  SparseGrid grid;
  grid.voxel_ = source.voxel;
  grid.per_voxel_ = 1.0 / source.voxel;
  grid.origin_ = source.origin;
  grid.outside_ = source.outside;
  grid.inside_ = source.inside;
  std::array<std::int32_t, 3> last = source.blocks.front().at;
  grid.first_ = last;
  for (const SparseBlock& block : source.blocks) {
    for (std::size_t a = 0; a < 3; ++a) {
      grid.first_[a] = std::min(grid.first_[a], block.at[a]);
      last[a] = std::max(last[a], block.at[a]);
    }
  }
  double entries = 1.0;
  for (std::size_t a = 0; a < 3; ++a) {
    // A ring of constant bricks around all.
    grid.first_[a] -= 1;
    grid.counts_[a] = static_cast<std::uint32_t>(last[a] - grid.first_[a] + 2);
    entries *= grid.counts_[a];
  }
  if (entries > static_cast<double>(most_table)) {
    return refused(ErrorCode::too_large,
                   fmt::format("spans {} x {} x {} bricks", grid.counts_[0], grid.counts_[1], grid.counts_[2]),
                   "blocks", fmt::format("at most {} in all", most_table));
  }
  for (std::size_t a = 0; a < 3; ++a)
    grid.lower_[static_cast<int>(a)] =
        source.origin[static_cast<int>(a)] + source.voxel * static_cast<double>(block_side * grid.first_[a]);
  grid.table_.assign(static_cast<std::size_t>(entries), inside_entry);
  std::vector<const SparseBlock*> blocks(grid.table_.size(), nullptr);
  for (std::size_t b = 0; b < source.blocks.size(); ++b) {
    const SparseBlock& block = source.blocks[b];
    const std::size_t entry = grid.table_index(static_cast<std::uint32_t>(block.at[0] - grid.first_[0]),
                                               static_cast<std::uint32_t>(block.at[1] - grid.first_[1]),
                                               static_cast<std::uint32_t>(block.at[2] - grid.first_[2]));
    if (blocks[entry] != nullptr)
      return bad_value("is at the place of an earlier one", fmt::format("blocks[{}]", b), "each block once");
    blocks[entry] = &block;
    grid.table_[entry] = static_cast<std::int32_t>(b);
  }
  grid.settle_signs(blocks);
  grid.bricks_.resize(source.blocks.size());
  grid.fill(blocks, std::vector<bool>(grid.table_.size(), true));
  grid.finish();
  return grid;
}

SparseBlock SparseGrid::block_of(std::size_t entry) const {
  const Brick& brick = *bricks_[static_cast<std::size_t>(table_[entry])];
  SparseBlock block;
  block.at = {first_[0] + static_cast<std::int32_t>(entry % counts_[0]),
              first_[1] + static_cast<std::int32_t>(entry / counts_[0] % counts_[1]),
              first_[2] + static_cast<std::int32_t>(entry / counts_[0] / counts_[1])};
  if (brick.owns_material) block.material.resize(SparseBlock::points);
  for_each_in_cube(0, block_side, [&](int i, int j, int k) {
    const std::size_t at = SparseBlock::index(i, j, k);
    block.value[at] = brick.value[apron_index(i, j, k)];
    if (brick.owns_material) block.material[at] = brick.material[material_index(i, j, k)];
  });
  block.face = brick.face;
  return block;
}

SparseSource SparseGrid::source() const {
  SparseSource source;
  source.voxel = voxel_;
  source.origin = origin_;
  source.outside = outside_;
  source.inside = inside_;
  source.blocks.reserve(bricks_.size());
  for (std::size_t entry = 0; entry < table_.size(); ++entry) {
    if (table_[entry] >= 0) source.blocks.push_back(block_of(entry));
  }
  return source;
}

Result<SparseGrid> SparseGrid::edited(std::vector<SparseBlock> changed) const {
  SparseGrid grid = *this;
  std::vector<const SparseBlock*> blocks(table_.size(), nullptr);
  std::vector<bool> wanted(table_.size(), false);
  const auto step_y = static_cast<std::ptrdiff_t>(counts_[0]);
  const std::ptrdiff_t step_z = step_y * static_cast<std::ptrdiff_t>(counts_[1]);
  const auto around = [&](std::size_t entry, const auto& visit) {
    for_each_in_cube(-1, 2, [&](int x, int y, int z) {
      visit(static_cast<std::size_t>(static_cast<std::ptrdiff_t>(entry) + x + y * step_y + z * step_z));
    });
  };
  for (std::size_t b = 0; b < changed.size(); ++b) {
    const SparseBlock& block = changed[b];
    ASPERITY_CHECK(check_block(block, b));
    std::size_t entry = 0;
    bool here = true;
    for (std::size_t a = 3; a-- > 0;) {
      const std::int64_t at = static_cast<std::int64_t>(block.at[a]) - first_[a];
      here = here && at >= 0 && at < static_cast<std::int64_t>(counts_[a]);
      entry = entry * counts_[a] + static_cast<std::size_t>(here ? at : 0);
    }
    if (!here || table_[entry] < 0)
      return bad_value("is not stored in the grid", fmt::format("blocks[{}]", b), "blocks of source()");
    if (blocks[entry] != nullptr)
      return bad_value("is at the place of an earlier one", fmt::format("blocks[{}]", b), "each block once");
    blocks[entry] = &block;
    around(entry, [&](std::size_t next) { wanted[next] = wanted[next] || table_[next] >= 0; });
  }
  // What the aprons read besides: the blocks around the concerned ones, as they are.
  std::vector<std::size_t> needed;
  std::vector<bool> listed(table_.size(), false);
  for (std::size_t entry = 0; entry < table_.size(); ++entry) {
    if (!wanted[entry]) continue;
    around(entry, [&](std::size_t next) {
      if (listed[next] || table_[next] < 0 || blocks[next] != nullptr) return;
      listed[next] = true;
      needed.push_back(next);
    });
  }
  std::vector<SparseBlock> kept;
  kept.reserve(needed.size());
  for (const std::size_t entry : needed) {
    kept.push_back(block_of(entry));
    blocks[entry] = &kept.back();
  }
  grid.fill(blocks, wanted);
  grid.finish();
  return grid;
}

Box SparseGrid::bounds() const noexcept {
  Box box;
  box.lower = lower_;
  for (std::size_t a = 0; a < 3; ++a)
    box.upper[static_cast<int>(a)] = lower_[static_cast<int>(a)] + voxel_ * brick_cells * counts_[a];
  return box;
}

std::size_t SparseGrid::memory_bytes() const noexcept {
  std::size_t bytes = sizeof(*this) + table_.capacity() * sizeof(std::int32_t) + octree_.memory_bytes() +
                      bricks_.capacity() * sizeof(bricks_[0]);
  constexpr std::size_t control_block = 16;
  for (const auto& brick : bricks_) {
    bytes += sizeof(Brick) + control_block + brick->face.capacity() * sizeof(std::uint32_t) +
             brick->material.capacity() * sizeof(PointMaterial);
  }
  return bytes;
}

std::size_t SparseGrid::dense_bytes() const noexcept {
  std::size_t nodes = 1;
  for (const std::uint32_t count : counts_) nodes *= static_cast<std::size_t>(count) * brick_cells + 1;
  return nodes * (sizeof(float) + (has_faces_ ? sizeof(std::uint32_t) : 0));
}

void SparseGrid::cell_samples(const std::uint32_t cell[3], int ring, double* out) const noexcept {
  int local[3];
  std::uint32_t at[3];
  bool border = false;
  for (std::size_t a = 0; a < 3; ++a) {
    at[a] = cell[a] / brick_cells;
    local[a] = static_cast<int>(cell[a] % brick_cells);
    border = border || local[a] < ring || local[a] + 1 + ring >= brick_cells;
  }
  const int count = 2 + 2 * ring;
  const std::int32_t entry = table_[table_index(at[0], at[1], at[2])];
  if (entry >= 0) {
    const float* first = bricks_[static_cast<std::size_t>(entry)]->value +
                         apron_index(local[0] - ring, local[1] - ring, local[2] - ring);
    return ring == 0 ? copy_nodes<2>(first, out) : copy_nodes<4>(first, out);
  }
  if (!border) {
    std::fill(out, out + count * count * count, static_cast<double>(constant(entry)));
    return;
  }
  // Beyond the band, beside it: node by node. Beyond the table lies what its border has.
  const auto node = [&](std::size_t a, int offset) {
    const std::int64_t last = static_cast<std::int64_t>(counts_[a]) * brick_cells - 1;
    return static_cast<std::uint32_t>(std::clamp<std::int64_t>(static_cast<std::int64_t>(cell[a]) + offset, 0, last));
  };
  for (int k = -ring; k < count - ring; ++k) {
    const std::uint32_t z = node(2, k);
    for (int j = -ring; j < count - ring; ++j) {
      const std::uint32_t y = node(1, j);
      for (int i = -ring; i < count - ring; ++i) {
        const std::uint32_t x = node(0, i);
        const std::int32_t there = table_[table_index(x / brick_cells, y / brick_cells, z / brick_cells)];
        *out++ = static_cast<double>(
            there < 0 ? constant(there)
                      : bricks_[static_cast<std::size_t>(there)]
                            ->value[apron_index(static_cast<int>(x % brick_cells), static_cast<int>(y % brick_cells),
                                                static_cast<int>(z % brick_cells))]);
      }
    }
  }
}

bool SparseGrid::find_brick(const double at[3], SparseHint& hint) const noexcept {
  // Also false for what is not a number.
  const bool inside =
      at[0] >= 0.0 && at[1] >= 0.0 && at[2] >= 0.0 && at[0] < extent_.x() && at[1] < extent_.y() && at[2] < extent_.z();
  hint.owner = inside ? identity_ : 0;
  if (!inside) return false;
  std::uint32_t brick[3];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    brick[axis] = static_cast<std::uint32_t>(at[axis]) / brick_cells;
    hint.middle[axis] = (brick[axis] + 0.5) * brick_cells;
  }
  const std::int32_t entry = table_[table_index(brick[0], brick[1], brick[2])];
  hint.brick = entry >= 0 ? bricks_[static_cast<std::size_t>(entry)].get() : nullptr;
  return true;
}

inline const SparseGrid::Brick* SparseGrid::locate(const Vec3& p, SparseHint& hint, Place& place) const noexcept {
  const double at[3] = {(p.x() - lower_.x()) * per_voxel_, (p.y() - lower_.y()) * per_voxel_,
                        (p.z() - lower_.z()) * per_voxel_};
  constexpr double half = 0.5 * brick_cells;
  const bool same = hint.owner == identity_ && std::abs(at[0] - hint.middle[0]) < half &&
                    std::abs(at[1] - hint.middle[1]) < half && std::abs(at[2] - hint.middle[2]) < half;
  if (!same && !find_brick(at, hint)) return nullptr;
  for (int axis = 0; axis < 3; ++axis) {
    const auto cell = static_cast<std::int32_t>(at[axis]);
    place.cell[axis] = static_cast<std::uint32_t>(cell) % brick_cells;
    place.fraction[axis] = at[axis] - cell;
  }
  return static_cast<const Brick*>(hint.brick);
}

void SparseGrid::far_samples(const SparseHint& hint, const Place& place, int ring, double* out) const noexcept {
  std::uint32_t cell[3];
  for (std::size_t a = 0; a < 3; ++a)
    cell[a] = static_cast<std::uint32_t>(hint.middle[a]) - brick_cells / 2 + place.cell[a];
  cell_samples(cell, ring, out);
}

Potential SparseGrid::trilinear(const Vec3& p, SparseHint& hint) const noexcept {
  Place place;
  if (const Brick* brick = locate(p, hint, place)) {
    const float* first = brick->value + first_node(place.cell, 0);
    constexpr int layer = apron_side * apron_side;
    return interpolated(edge_at(first), edge_at(first + apron_side), edge_at(first + layer),
                        edge_at(first + layer + apron_side), place.fraction, per_voxel_);
  }
  if (hint.owner == 0) return {outside_, Vec3::Zero()};
  double c[8];
  far_samples(hint, place, 0, c);
  return interpolated(Pair{c[0], c[1]}, Pair{c[2], c[3]}, Pair{c[4], c[5]}, Pair{c[6], c[7]}, place.fraction,
                      per_voxel_);
}

Potential SparseGrid::node_gradients(const Vec3& p, SparseHint& hint) const noexcept {
  Place place;
  if (const Brick* brick = locate(p, hint, place)) {
    const float* first = brick->value + first_node(place.cell, 1);
    const auto row = [&](int j, int k) { return first + apron_side * (j + apron_side * k); };
    return by_centre_differences([&](int j, int k) { return edge_at(row(j, k) + 1); },
                                 [&](int j, int k) {
                                   return Pair{static_cast<double>(row(j, k)[0]), static_cast<double>(row(j, k)[3])};
                                 },
                                 place.fraction, per_voxel_);
  }
  if (hint.owner == 0) return {outside_, Vec3::Zero()};
  double c[64];
  far_samples(hint, place, 1, c);
  const auto row = [&](int j, int k) { return c + 4 * (j + 4 * k); };
  return by_centre_differences(
      [&](int j, int k) {
        return Pair{row(j, k)[1], row(j, k)[2]};
      },
      [&](int j, int k) {
        return Pair{row(j, k)[0], row(j, k)[3]};
      },
      place.fraction, per_voxel_);
}

Vec3 SparseGrid::clear_gradient(const Vec3& p, SparseHint& hint) const noexcept {
  Place place;
  const Brick* brick = locate(p, hint, place);
  if (hint.owner == 0) return Vec3::Zero();
  double c[64];
  if (brick != nullptr) {
    copy_nodes<4>(brick->value + first_node(place.cell, 1), c);
  } else {
    far_samples(hint, place, 1, c);
  }
  const double scale = 0.5 * per_voxel_;
  Vec3 sum = Vec3::Zero();
  double weights = 0.0;
  for (int n = 0; n < 8; ++n) {
    const int node = 21 + (n & 1) + 4 * (n >> 1 & 1) + 16 * (n >> 2);
    double weight = 1.0;
    for (int a = 0; a < 3; ++a) {
      const double f = place.fraction[a];
      weight *= (n >> a & 1) != 0 ? f : 1.0 - f;
    }
    const Vec3 gradient =
        scale * Vec3(c[node + 1] - c[node - 1], c[node + 4] - c[node - 4], c[node + 16] - c[node - 16]);
    const double squared = gradient.squaredNorm();
    weight *= (squared * squared) * (squared * squared);
    sum += weight * gradient;
    weights += weight;
  }
  return weights > 0.0 ? Vec3(sum / weights) : sum;
}

std::uint32_t SparseGrid::face(const Vec3& p, SparseHint& hint) const noexcept {
  Place place;
  // Half a voxel on, so that the cell's first node is the nearest one.
  const Brick* brick = locate(p + Vec3::Constant(0.5 * voxel_), hint, place);
  if (brick == nullptr || brick->face.empty()) return no_index;
  return brick->face[SparseBlock::index(static_cast<int>(place.cell[0]), static_cast<int>(place.cell[1]),
                                        static_cast<int>(place.cell[2]))];
}

PointMaterial SparseGrid::material(const Vec3& p, const PointMaterial& own, SparseHint& hint) const noexcept {
  Place place;
  const Brick* brick = locate(p, hint, place);
  if (brick == nullptr || brick->material.empty()) return own;
  // The eight points' weights, and what they store.
  const PointMaterial* stored[8];
  double weights[8];
  for (int n = 0; n < 8; ++n) {
    double weight = 1.0;
    int node[3];
    for (int a = 0; a < 3; ++a) {
      const double f = place.fraction[a];
      node[a] = static_cast<int>(place.cell[a]) + (n >> a & 1);
      weight *= (n >> a & 1) != 0 ? f : 1.0 - f;
    }
    weights[n] = weight;
    stored[n] = &brick->material[material_index(node[0], node[1], node[2])];
  }
  const auto mixed = [&](float PointMaterial::*channel) {
    double sum = 0.0;
    for (int n = 0; n < 8; ++n) {
      const float value = stored[n]->*channel;
      sum += weights[n] * static_cast<double>(std::isnan(value) ? own.*channel : value);
    }
    return static_cast<float>(sum);
  };
  PointMaterial out;
  out.stiffness = mixed(&PointMaterial::stiffness);
  out.damping = mixed(&PointMaterial::damping);
  out.static_friction = mixed(&PointMaterial::static_friction);
  out.dynamic_friction = mixed(&PointMaterial::dynamic_friction);
  out.roughness = mixed(&PointMaterial::roughness);
  return out;
}

}  // namespace asperity
