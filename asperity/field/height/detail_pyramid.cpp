#include "asperity/field/height/detail_pyramid.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

namespace asperity {
namespace {

constexpr std::size_t most_dilated_texels = std::size_t{1} << 25U;

Status check_dilatable(const HeightMap& heights) {
  const std::size_t texels = static_cast<std::size_t>(heights.width()) * static_cast<std::size_t>(heights.height());
  if (texels <= most_dilated_texels) return success();
  return refused(ErrorCode::too_large, fmt::format("{} texels to dilate", texels), {},
                 fmt::format("a map of at most {} texels", most_dilated_texels));
}

Vec2 texel_size(const HeightMap& heights, const Vec2& tile) {
  return {tile.x() / heights.width(), tile.y() / heights.height()};
}

std::vector<double> texels_of(const HeightMap& heights) {
  return tabulated<double>(heights.width(), heights.height(), [&](const Vec2& st) { return heights.height_at(st); });
}

// ---- dilation ---------------------------------------------------------------------------

/// Greatest texels of blocks of 1, 2 x 2, 4 x 4 ... up to the whole map; rows from the top.
class BlockMaxima {
 public:
  struct Level {
    int width = 0;
    int height = 0;
    std::vector<double> values;
    [[nodiscard]] double at(int x, int y) const {
      return values[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
    }
  };
  BlockMaxima(std::vector<double> texels, int width, int height) {
    levels_.push_back({width, height, std::move(texels)});
    while (levels_.back().width > 1 || levels_.back().height > 1) levels_.push_back(halved(levels_.back()));
  }
  [[nodiscard]] const Level& level(int k) const { return levels_[static_cast<std::size_t>(k)]; }
  [[nodiscard]] int top() const { return static_cast<int>(levels_.size()) - 1; }

 private:
  static Level halved(const Level& fine) {
    Level coarse{(fine.width + 1) / 2, (fine.height + 1) / 2, {}};
    for (int y = 0; y < coarse.height; ++y) {
      const int below = std::min(2 * y + 1, fine.height - 1);
      for (int x = 0; x < coarse.width; ++x) {
        const int right = std::min(2 * x + 1, fine.width - 1);
        coarse.values.push_back(std::max(std::max(fine.at(2 * x, 2 * y), fine.at(right, 2 * y)),
                                         std::max(fine.at(2 * x, below), fine.at(right, below))));
      }
    }
    return coarse;
  }
  std::vector<Level> levels_;
};

/// Texels first ... last along an axis.
struct Stretch {
  int first = 0;
  int last = 0;
};

/// Steps between two stretches of an axis of `count` texels, the shorter way round where it repeats. Beyond a clamped
/// border the height is that of the border, which is nearer: nothing there need be looked at.
int steps_between(const Stretch& a, const Stretch& b, int count, bool repeat) {
  const int before = b.first - a.last;
  const int after = a.first - b.last;
  if (before <= 0 && after <= 0) return 0;
  if (!repeat) return std::max(before, after);
  return std::max(0, std::min(before > 0 ? before : before + count, after > 0 ? after : after + count));
}

/// Rolls a ball over a map: for each texel the greatest of H(p) less the ball's rise at p, over all texels p. Balls
/// over a tile of neighbouring texels share the search for the blocks that any of them could touch.
class BallDilation {
 public:
  BallDilation(const BlockMaxima& maxima, const Vec2& texel, Wrap wrap, double radius)
      : maxima_(maxima),
        texels_(maxima.level(0)),
        texel_(texel),
        repeat_(wrap == Wrap::repeat),
        radius_(radius),
        balls_(texels_.values.size()) {}

  [[nodiscard]] std::vector<float> run() {
    for (int top = 0; top < texels_.height; top += tile_side) {
      const Stretch rows{top, std::min(top + tile_side, texels_.height) - 1};
      for (int left = 0; left < texels_.width; left += tile_side)
        roll({left, std::min(left + tile_side, texels_.width) - 1}, rows);
    }
    std::vector<float> heights;
    heights.reserve(balls_.size());
    for (const Ball& ball : balls_) heights.push_back(static_cast<float>(ball.height));
    return heights;
  }

 private:
  static constexpr int tile_side = 8;
  static constexpr int leaf_level = 1;  ///< blocks that are not divided further before balls are told apart

  /// The ball over a texel: how high it stands so far, and on which texel.
  struct Ball {
    double height = 0.0;
    int x = 0;
    int y = 0;
  };
  struct Block {
    int level;
    int x;
    int y;
  };
  struct Leaf {
    double height;
    Stretch columns;
    Stretch rows;
  };

  Ball& ball(int x, int y) {
    return balls_[static_cast<std::size_t>(y) * static_cast<std::size_t>(texels_.width) + static_cast<std::size_t>(x)];
  }

  void roll(const Stretch& columns, const Stretch& rows) {
    double lowest = infinity;
    for (int y = rows.first; y <= rows.last; ++y) {
      for (int x = columns.first; x <= columns.last; ++x) {
        settle(x, y);
        lowest = std::min(lowest, ball(x, y).height);
      }
    }
    search(columns, rows, lowest);
    for (int y = rows.first; y <= rows.last; ++y) {
      for (int x = columns.first; x <= columns.last; ++x) {
        Ball& best = ball(x, y);
        for (const Leaf& leaf : leaves_) {
          if (!reaches(leaf.height, squared({x, x}, {y, y}, leaf.columns, leaf.rows), best.height)) continue;
          for (int row = leaf.rows.first; row <= leaf.rows.last; ++row) {
            for (int column = leaf.columns.first; column <= leaf.columns.last; ++column) touch(best, x, y, column, row);
          }
        }
      }
    }
  }

  /// A good contact to begin with: from where the neighbours' balls touch, on to better neighbours.
  void settle(int x, int y) {
    Ball& best = ball(x, y);
    best = {texels_.at(x, y), x, y};
    if (x > 0) touch(best, x, y, ball(x - 1, y).x, ball(x - 1, y).y);
    if (y > 0) touch(best, x, y, ball(x, y - 1).x, ball(x, y - 1).y);
    bool better = true;
    while (better) {
      better = false;
      const Ball from = best;
      for (const auto& [dx, dy] : {std::array{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
        const int to_x = moved(from.x, dx, texels_.width);
        const int to_y = moved(from.y, dy, texels_.height);
        better = touch(best, x, y, to_x, to_y) || better;
      }
    }
  }

  [[nodiscard]] int moved(int place, int step, int count) const {
    const int to = place + step;
    if (to >= 0 && to < count) return to;
    return repeat_ ? (to + count) % count : place;
  }

  /// Lifts the ball over (x, y) on to a texel, if it stands higher there.
  bool touch(Ball& best, int x, int y, int to_x, int to_y) const {
    const double height = texels_.at(to_x, to_y);
    const double apart = squared({x, x}, {y, y}, {to_x, to_x}, {to_y, to_y});
    if (!reaches(height, apart, best.height)) return false;
    const double rise = apart / (radius_ + std::sqrt(std::max(0.0, radius_ * radius_ - apart)));
    if (!(height - rise > best.height)) return false;
    best = {height - rise, to_x, to_y};
    return true;
  }

  /// Square of the least distance between two rectangles of texels (m^2).
  [[nodiscard]] double squared(const Stretch& columns, const Stretch& rows, const Stretch& to_columns,
                               const Stretch& to_rows) const {
    const double dx = texel_.x() * steps_between(columns, to_columns, texels_.width, repeat_);
    const double dy = texel_.y() * steps_between(rows, to_rows, texels_.height, repeat_);
    return dx * dx + dy * dy;
  }

  /// Whether a ball that touches this height, so far away, stands higher than `best`.
  [[nodiscard]] bool reaches(double height, double apart, double best) const {
    const double over = height - best;
    if (over <= 0.0 || apart > radius_ * radius_) return false;
    return over > radius_ || apart < over * (2.0 * radius_ - over);
  }

  /// Every leaf on which a ball over these texels could stand higher than `lowest`.
  void search(const Stretch& columns, const Stretch& rows, double lowest) {
    leaves_.clear();
    open_.clear();
    open_.push_back({maxima_.top(), 0, 0});
    while (!open_.empty()) {
      const Block block = open_.back();
      open_.pop_back();
      const Stretch to_columns = stretch(block.x, block.level, texels_.width);
      const Stretch to_rows = stretch(block.y, block.level, texels_.height);
      const double height = maxima_.level(block.level).at(block.x, block.y);
      if (!reaches(height, squared(columns, rows, to_columns, to_rows), lowest)) continue;
      if (block.level <= leaf_level) {
        leaves_.push_back({height, to_columns, to_rows});
        continue;
      }
      const BlockMaxima::Level& finer = maxima_.level(block.level - 1);
      for (int y = 2 * block.y; y < std::min(2 * block.y + 2, finer.height); ++y) {
        for (int x = 2 * block.x; x < std::min(2 * block.x + 2, finer.width); ++x)
          open_.push_back({block.level - 1, x, y});
      }
    }
  }

  [[nodiscard]] static Stretch stretch(int block, int level, int count) {
    return {block << level, std::min((block + 1) << level, count) - 1};
  }

  const BlockMaxima& maxima_;
  const BlockMaxima::Level& texels_;
  Vec2 texel_;
  bool repeat_;
  double radius_;
  std::vector<Ball> balls_;
  std::vector<Block> open_;
  std::vector<Leaf> leaves_;
};

Result<HeightMap> rolled(const BlockMaxima& maxima, const HeightMap& heights, const Vec2& tile, double radius) {
  BallDilation dilation(maxima, texel_size(heights, tile), heights.wrap(), radius);
  return HeightMap::build(dilation.run(), heights.width(), heights.height(), heights.wrap(), heights.reconstruction());
}

// ---- low pass ---------------------------------------------------------------------------

/// Means over windows `width` texels wide along one axis, three times over: a ring, or mirrored about its borders.
class LineFilter {
 public:
  LineFilter(int count, Wrap wrap, double width)
      : count_(static_cast<std::size_t>(count)),
        ring_(wrap == Wrap::repeat ? count_ : 2 * count_),
        width_(width),
        line_(ring_),
        sums_(ring_ + 1) {}

  void run(double* values, std::size_t stride) {
    for (std::size_t i = 0; i < ring_; ++i) line_[i] = values[(i < count_ ? i : ring_ - 1 - i) * stride];
    for (int pass = 0; pass < 3; ++pass) average();
    for (std::size_t i = 0; i < count_; ++i) values[i * stride] = line_[i];
  }

 private:
  void average() {
    // About the first value, so that a constant line stays what it is.
    const double origin = line_[0];
    for (std::size_t i = 0; i < ring_; ++i) sums_[i + 1] = sums_[i] + (line_[i] - origin);
    const Edge upper = edge(0.5 + 0.5 * width_);
    const Edge lower = edge(0.5 - 0.5 * width_);
    const double whole = sums_[ring_];
    std::size_t above = upper.index;
    std::size_t below = lower.index;
    double turns = upper.turns - lower.turns;
    for (std::size_t i = 0; i < ring_; ++i) {
      const double up = sums_[above] + upper.fraction * (sums_[above + 1] - sums_[above]);
      const double low = sums_[below] + lower.fraction * (sums_[below + 1] - sums_[below]);
      line_[i] = origin + (turns * whole + up - low) / width_;
      if (++above == ring_) {
        above = 0;
        turns += 1.0;
      }
      if (++below == ring_) {
        below = 0;
        turns -= 1.0;
      }
    }
  }
  /// Where a place lies on the ring: after so many turns, so far into one of its values.
  struct Edge {
    double turns;
    std::size_t index;
    double fraction;
  };
  [[nodiscard]] Edge edge(double place) const {
    const auto ring = static_cast<double>(ring_);
    const double turns = std::floor(place / ring);
    const double rest = std::clamp(place - turns * ring, 0.0, ring);
    const std::size_t index = std::min(static_cast<std::size_t>(rest), ring_ - 1);
    return {turns, index, rest - static_cast<double>(index)};
  }

  std::size_t count_;
  std::size_t ring_;
  double width_;
  std::vector<double> line_;
  std::vector<double> sums_;
};

/// Texels along an axis of `side` (m) that hold wavelengths down to `scale`, with four for each.
int texels_for(int texels, double side, double scale, Reconstruction reconstruction) {
  if (!is_spline(reconstruction)) return texels;
  const double needed = std::ceil(4.0 * side / scale);
  return needed < texels ? std::max(1, static_cast<int>(needed)) : texels;
}

Result<HeightMap> low_passed(const HeightMap& heights, const Vec2& tile, double scale) {
  const int width = heights.width();
  const int height = heights.height();
  const Vec2 texel = texel_size(heights, tile);
  std::vector<double> values = texels_of(heights);
  const auto columns = static_cast<std::size_t>(width);
  LineFilter along_rows(width, heights.wrap(), scale / texel.x());
  for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) along_rows.run(&values[y * columns], 1);
  LineFilter along_columns(height, heights.wrap(), scale / texel.y());
  for (std::size_t x = 0; x < columns; ++x) along_columns.run(&values[x], columns);
  Result<HeightMap> full = HeightMap::build(std::vector<float>(values.begin(), values.end()), width, height,
                                            heights.wrap(), heights.reconstruction());
  const int fewer_columns = texels_for(width, tile.x(), scale, heights.reconstruction());
  const int fewer_rows = texels_for(height, tile.y(), scale, heights.reconstruction());
  if (!full || (fewer_columns == width && fewer_rows == height)) return full;
  return HeightMap::build(tabulated(fewer_columns, fewer_rows, [&](const Vec2& st) { return full->height_at(st); }),
                          fewer_columns, fewer_rows, heights.wrap(), heights.reconstruction());
}

// ---- settings ---------------------------------------------------------------------------

/// Levels until a ball's radius reaches half of the tile, or a wavelength all of it.
int octaves(double finest, const Vec2& tile, DetailKind kind) {
  const double longest = tile.maxCoeff();
  const double doublings = kind == DetailKind::dilation ? std::floor(std::log2(0.5 * longest / finest) + 1e-9)
                                                        : std::ceil(std::log2(longest / finest) - 1e-9);
  return static_cast<int>(std::clamp(1.0 + doublings, 1.0, static_cast<double>(DetailPyramid::most_levels)));
}

Result<DetailSettings> completed(DetailSettings settings, const HeightMap& heights, const Vec2& tile) {
  ASPERITY_CHECK(check_tile(tile));
  if (!(std::isfinite(settings.finest) && settings.finest >= 0.0))
    return bad_value(fmt::format("is {} m", settings.finest), "finest", "a finite length, or 0 for the map's own");
  if (settings.levels < 0 || settings.levels > DetailPyramid::most_levels) {
    return bad_value(fmt::format("there are to be {}", settings.levels), "levels",
                     fmt::format("1 to {}, or 0 for as many as the map has octaves", DetailPyramid::most_levels));
  }
  if (settings.finest == 0.0)
    settings.finest = (settings.kind == DetailKind::dilation ? 1.0 : 2.0) * texel_size(heights, tile).minCoeff();
  if (settings.levels == 0) settings.levels = octaves(settings.finest, tile, settings.kind);
  return settings;
}

/// Texels of all levels together.
double texels_in_all(const DetailSettings& settings, const HeightMap& heights, const Vec2& tile) {
  const double each = static_cast<double>(heights.width()) * heights.height();
  if (settings.kind == DetailKind::dilation) return settings.levels * each;
  double sum = 1.0;
  for (int level = 1; level < settings.levels; ++level) {
    const double scale = std::ldexp(settings.finest, level - 1);
    sum += static_cast<double>(texels_for(heights.width(), tile.x(), scale, heights.reconstruction())) *
           texels_for(heights.height(), tile.y(), scale, heights.reconstruction());
  }
  return sum;
}

Status check_size(const DetailSettings& settings, const HeightMap& heights, const Vec2& tile) {
  if (settings.kind == DetailKind::dilation) ASPERITY_CHECK(check_dilatable(heights));
  // A float a texel, and two thirds of that for its bounds.
  const double bytes = texels_in_all(settings, heights, tile) * sizeof(float) * 5.0 / 3.0;
  if (bytes <= static_cast<double>(settings.most_bytes)) return success();
  return refused(ErrorCode::too_large, fmt::format("{} levels of detail take {:.0f} MB", settings.levels, bytes * 1e-6),
                 "levels",
                 fmt::format("at most {:.0f} MB: fewer levels, or a smaller map",
                             static_cast<double>(settings.most_bytes) * 1e-6));
}

}  // namespace

Result<HeightMap> dilated(const HeightMap& heights, const Vec2& tile, double radius) {
  ASPERITY_CHECK(check_tile(tile));
  if (!(std::isfinite(radius) && radius >= 0.0))
    return bad_value(fmt::format("is {} m", radius), "radius", "a finite length of 0 or more");
  ASPERITY_CHECK(check_dilatable(heights));
  return rolled(BlockMaxima(texels_of(heights), heights.width(), heights.height()), heights, tile, radius);
}

Result<DetailPyramid> DetailPyramid::build(const HeightMap& heights, const Vec2& tile, const DetailSettings& given) {
  ASPERITY_TRY(const DetailSettings settings, completed(given, heights, tile));
  ASPERITY_CHECK(check_size(settings, heights, tile));
  DetailPyramid pyramid;
  pyramid.kind_ = settings.kind;
  pyramid.finest_ = settings.finest;
  std::optional<BlockMaxima> maxima;
  if (settings.kind == DetailKind::dilation) maxima.emplace(texels_of(heights), heights.width(), heights.height());
  // The last level of a low-pass pyramid is flat.
  for (int level = 1; level < settings.levels + (maxima ? 1 : 0); ++level) {
    const double scale = std::ldexp(settings.finest, level - 1);
    ASPERITY_TRY(HeightMap map, maxima ? rolled(*maxima, heights, tile, scale) : low_passed(heights, tile, scale));
    ASPERITY_CHECK(pyramid.add(heights, std::move(map), scale));
  }
  if (maxima) return pyramid;
  const std::vector<double> texels = texels_of(heights);
  const double first = texels.front();
  const double sum = std::accumulate(texels.begin(), texels.end(), 0.0,
                                     [&](double so_far, double value) { return so_far + (value - first); });
  const double mean = first + sum / static_cast<double>(texels.size());
  ASPERITY_TRY(HeightMap flat,
               HeightMap::build({static_cast<float>(mean)}, 1, 1, heights.wrap(), heights.reconstruction()));
  ASPERITY_CHECK(pyramid.add(heights, std::move(flat), infinity));
  return pyramid;
}

Result<DetailPyramid> DetailPyramid::build(const HeightMap& heights, std::vector<HeightMap> levels,
                                           const DetailPyramid& like) {
  bool fits = levels.size() == static_cast<std::size_t>(like.levels());
  for (const HeightMap& level : levels)
    fits = fits && level.width() == heights.width() && level.height() == heights.height();
  if (!fits) {
    return refused(ErrorCode::mismatch,
                   fmt::format("are {}, the pyramid like which they are has {}", levels.size(), like.levels()),
                   "levels", "as many, of the size of the map");
  }
  DetailPyramid pyramid;
  pyramid.kind_ = like.kind_;
  pyramid.finest_ = like.finest_;
  for (std::size_t i = 0; i < levels.size(); ++i)
    ASPERITY_CHECK(pyramid.add(heights, std::move(levels[i]), like.scales_[i]));
  return pyramid;
}

Status DetailPyramid::add(const HeightMap& heights, HeightMap level, double scale) {
  std::vector<float> difference = tabulated(
      heights.width(), heights.height(), [&](const Vec2& st) { return level.height_at(st) - heights.height_at(st); });
  ASPERITY_TRY(const HeightMap between, HeightMap::build(std::move(difference), heights.width(), heights.height(),
                                                         heights.wrap(), heights.reconstruction()));
  const double before = removed_.empty() ? 0.0 : removed_.back();
  // Between the texels a coarser spline runs a little beside the one through the differences at them.
  const bool same_texels = level.width() == heights.width() && level.height() == heights.height();
  const double margin = same_texels ? 1.0 : 1.01;
  removed_.push_back(std::max({before, -margin * between.lowest(), margin * between.highest()}));
  // A sliver of the scale for each level keeps the inverse continuous.
  const double climbed = climb_.empty() ? 0.0 : climb_.back();
  climb_.push_back(std::max(removed_.back(), climbed + 1e-6 * finest_));
  scales_.push_back(scale);
  maps_.push_back(std::make_shared<const HeightMap>(std::move(level)));
  return success();
}

double DetailPyramid::level_of_scale(double scale) const noexcept {
  if (!(scale > 0.0)) return 0.0;
  if (scale <= finest_) return scale / finest_;
  return std::min(1.0 + std::log2(scale / finest_), static_cast<double>(levels()));
}

double DetailPyramid::level_of_removed(double height) const noexcept {
  if (!(height > 0.0)) return 0.0;
  double from = 0.0;
  for (std::size_t i = 0; i < climb_.size(); ++i) {
    const double to = climb_[i];
    if (height < to) return static_cast<double>(i) + (height - from) / (to - from);
    from = to;
  }
  return static_cast<double>(levels());
}

std::size_t DetailPyramid::memory_bytes() const noexcept {
  std::size_t bytes = sizeof(*this) + (scales_.capacity() + removed_.capacity() + climb_.capacity()) * sizeof(double);
  for (const auto& map : maps_) bytes += map->memory_bytes() + sizeof(map);
  return bytes;
}

}  // namespace asperity
