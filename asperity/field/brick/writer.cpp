// Writes bricked volumes: slabs come in at the finest level, and each level keeps only the layers that its next row of
// bricks and the next coarser level need.

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <system_error>

#include "asperity/field/brick/file.h"

namespace asperity {
namespace {

constexpr std::size_t slab_bytes = std::size_t{16} << 20U;

std::string reason(int error) {
  return std::generic_category().message(error);
}

/// A file written aside: renamed when it is whole, removed when it is not.
class AsideFile {
 public:
  explicit AsideFile(const std::filesystem::path& path) : path_(path), aside_(path) {
    static std::atomic<unsigned> serial{0};
    aside_ += fmt::format(".{}-{}.part", ::getpid(), serial.fetch_add(1));
  }
  ~AsideFile() {
    if (descriptor_ < 0) return;
    ::close(descriptor_);
    ::unlink(aside_.c_str());
  }
  AsideFile(const AsideFile&) = delete;
  AsideFile& operator=(const AsideFile&) = delete;

  Status create(std::uint64_t bytes) {
    std::error_code ignored;
    if (std::filesystem::is_directory(path_, ignored)) return unwritable("is a folder");
    descriptor_ = ::open(aside_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor_ < 0) return unwritable(reason(errno));
    // Asks for the room at once, where the file system can tell; where it cannot, writing will.
    if (::fallocate(descriptor_, 0, 0, static_cast<off_t>(bytes)) != 0 && (errno == ENOSPC || errno == EFBIG))
      return unwritable(fmt::format("{} ({} bytes)", reason(errno), bytes));
    if (::ftruncate(descriptor_, static_cast<off_t>(bytes)) != 0) return unwritable(reason(errno));
    return success();
  }

  Status write(std::uint64_t at, const char* from, std::size_t count) {
    while (count > 0) {
      const ssize_t written = ::pwrite(descriptor_, from, count, static_cast<off_t>(at));
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) return unwritable(reason(errno));
      if (written == 0) return unwritable("the disk takes no more");
      from += written;
      at += static_cast<std::uint64_t>(written);
      count -= static_cast<std::size_t>(written);
    }
    return success();
  }

  Status keep() {
    if (::fsync(descriptor_) != 0) return unwritable(reason(errno));
    if (::rename(aside_.c_str(), path_.c_str()) != 0) return unwritable(reason(errno));
    ::close(descriptor_);
    descriptor_ = -1;
    return success();
  }

 private:
  [[nodiscard]] Error unwritable(const std::string& why) const {
    return {ErrorCode::file_unwritable, "cannot be written: " + why, path_.string(), "",
            "a path in an existing folder with room for the file"};
  }

  std::filesystem::path path_;
  std::filesystem::path aside_;
  int descriptor_ = -1;
};

/// Fine nodes and weights that make a coarse node: a smoothing that keeps linear fields, and values at the ends.
struct Smoothing {
  std::uint32_t node[3];
  float below;
  float above;
};

std::vector<Smoothing> smoothings(const GridAxis& fine, std::uint32_t coarse_nodes) {
  std::vector<Smoothing> out(coarse_nodes);
  const std::uint32_t last = fine.size() - 1;
  for (std::uint32_t c = 0; c < coarse_nodes; ++c) {
    const std::uint32_t f = std::min(2 * c, last);
    if (f == 0 || f == last) {
      out[c] = {{f, f, f}, 0.0F, 0.0F};
      continue;
    }
    const double below = fine.width(f - 1);
    const double above = fine.width(f);
    out[c] = {{f - 1, f, f + 1},
              static_cast<float>(0.5 * above / (below + above)),
              static_cast<float>(0.5 * below / (below + above))};
  }
  return out;
}

/// As differences from the middle, so that a constant stays what it is. Where a neighbour is not a number, the middle
/// stands for it; where the middle is none, nothing does.
float smooth(const Smoothing& s, float below, float middle, float above) {
  const float b = std::isnan(below) ? middle : below;
  const float a = std::isnan(above) ? middle : above;
  return middle + (s.below * (b - middle) + s.above * (a - middle));
}

template <class Sample>
Sample rounded(float value) {
  if constexpr (std::is_floating_point_v<Sample>) {
    return value;
  } else {
    return static_cast<Sample>(std::lround(value));
  }
}

/// One level being written.
template <class Sample>
class LevelWriter {
 public:
  LevelWriter(BrickFileHeader& header, std::size_t level, AsideFile& file)
      : header_(header),
        level_(header.levels[level]),
        file_(file),
        layer_(static_cast<std::size_t>(level_.axes[0].size()) * level_.axes[1].size()),
        ring_(layer_ * std::min(brick_nodes, level_.axes[2].size())),
        brick_(brick_aligned(brick_bytes(header.type))) {
    if (level + 1 == header.levels.size()) return;
    next_ = std::make_unique<LevelWriter>(header, level + 1, file);
    for (std::size_t a = 0; a < 3; ++a) smoothing_[a] = smoothings(level_.axes[a], next_->level_.axes[a].size());
    across_.resize(level_.axes[0].size() * std::size_t{3});
    coarse_.resize(next_->layer_);
  }

  /// Takes the next layer of nodes; writes the bricks that have all their layers now.
  Status push(const Sample* samples) {
    const std::uint32_t k = received_++;
    std::copy_n(samples, layer_, layer(k));
    const std::uint32_t last = level_.axes[2].size() - 1;
    while (row_ < level_.bricks[2] && k >= std::min(brick_cells * row_ + brick_cells + 1, last)) {
      for (std::uint32_t j = 0; j < level_.bricks[1]; ++j) {
        for (std::uint32_t i = 0; i < level_.bricks[0]; ++i) ASPERITY_CHECK(write_brick({i, j, row_}));
      }
      ++row_;
    }
    while (next_ && next_->received_ < smoothing_[2].size() && smoothing_[2][next_->received_].node[2] <= k) {
      coarsen(smoothing_[2][next_->received_]);
      ASPERITY_CHECK(next_->push(coarse_.data()));
    }
    return success();
  }

 private:
  Sample* layer(std::uint32_t k) { return ring_.data() + layer_ * (k % brick_nodes); }

  Status write_brick(const std::array<std::uint32_t, 3>& at) {
    const auto place = [&](std::size_t a, std::uint32_t n) {
      const std::uint32_t from = brick_cells * at[a] + n;  // one above the node
      return std::min(from == 0 ? 0 : from - 1, level_.axes[a].size() - 1);
    };
    Sample* to = reinterpret_cast<Sample*>(brick_.data());
    const Sample* const begin = to;
    for (std::uint32_t k = 0; k < brick_nodes; ++k) {
      const Sample* from = layer(place(2, k));
      for (std::uint32_t j = 0; j < brick_nodes; ++j) {
        const Sample* row = from + static_cast<std::size_t>(level_.axes[0].size()) * place(1, j);
        for (std::uint32_t i = 0; i < brick_nodes; ++i) *to++ = row[place(0, i)];
      }
    }
    const std::size_t number =
        level_.first + at[0] + std::size_t{level_.bricks[0]} * (at[1] + std::size_t{level_.bricks[1]} * at[2]);
    BrickRecord& record = header_.bricks[number];
    for (const Sample* s = begin; s != to; ++s) {
      const auto value = static_cast<float>(*s);
      record.range.lower = value < record.range.lower ? value : record.range.lower;
      record.range.upper = value > record.range.upper ? value : record.range.upper;
    }
    record.checksum = brick_checksum(brick_.data(), brick_bytes(header_.type));
    return file_.write(record.offset, brick_.data(), brick_.size());
  }

  /// A coarse layer from the three fine layers around it: along z, then y, then x.
  void coarsen(const Smoothing& z) {
    const std::uint32_t width = level_.axes[0].size();
    const Sample* planes[3] = {layer(z.node[0]), layer(z.node[1]), layer(z.node[2])};
    Sample* to = coarse_.data();
    for (const Smoothing& y : smoothing_[1]) {
      for (std::size_t n = 0; n < 3; ++n) {
        const std::size_t from = static_cast<std::size_t>(width) * y.node[n];
        float* out = across_.data() + n * width;
        for (std::uint32_t i = 0; i < width; ++i)
          out[i] = smooth(z, static_cast<float>(planes[0][from + i]), static_cast<float>(planes[1][from + i]),
                          static_cast<float>(planes[2][from + i]));
      }
      float* rows = across_.data();
      for (std::uint32_t i = 0; i < width; ++i) rows[i] = smooth(y, rows[i], rows[width + i], rows[2 * width + i]);
      for (const Smoothing& x : smoothing_[0])
        *to++ = rounded<Sample>(smooth(x, rows[x.node[0]], rows[x.node[1]], rows[x.node[2]]));
    }
  }

  BrickFileHeader& header_;
  const BrickLevel& level_;
  AsideFile& file_;
  std::size_t layer_;
  std::vector<Sample> ring_;
  std::vector<char> brick_;
  std::unique_ptr<LevelWriter> next_;
  std::array<std::vector<Smoothing>, 3> smoothing_;
  std::vector<float> across_;
  std::vector<Sample> coarse_;
  std::uint32_t received_ = 0;
  std::uint32_t row_ = 0;
};

template <class Sample>
Status write_samples(BrickFileHeader& header, AsideFile& file, const SlabSource& source, const Progress& progress,
                     SampleSurvey& survey) {
  const GridAxes& axes = header.levels.front().axes;
  const std::uint32_t layers = axes[2].size();
  const std::size_t layer = static_cast<std::size_t>(axes[0].size()) * axes[1].size();
  const auto step =
      static_cast<std::uint32_t>(std::clamp<std::size_t>(slab_bytes / (layer * sizeof(Sample)), 1, layers));
  LevelWriter<Sample> finest(header, 0, file);
  SampleArray slab = std::vector<Sample>();
  for (std::uint32_t first = 0; first < layers; first += step) {
    const std::uint32_t last = std::min(first + step, layers);
    if (progress) progress("writing bricks", static_cast<double>(first) / layers);
    auto& samples = std::get<std::vector<Sample>>(slab);
    samples.resize(layer * (last - first));
    ASPERITY_CHECK(source(first, last, slab));
    const auto* filled = std::get_if<std::vector<Sample>>(&slab);
    if (filled == nullptr || filled->size() != layer * (last - first)) {
      return refused(ErrorCode::mismatch, "a slab of another type or size came in",
                     fmt::format("layers {} to {}", first, last), "one sample for each node");
    }
    ASPERITY_CHECK(survey.take(slab, axes, first));
    for (std::uint32_t k = 0; k < last - first; ++k) ASPERITY_CHECK(finest.push(filled->data() + layer * k));
  }
  return success();
}

}  // namespace

std::size_t brick_writer_memory(const GridAxes& axes, SampleType type) noexcept {
  const std::size_t layer = static_cast<std::size_t>(axes[0].size()) * axes[1].size() * sample_bytes(type);
  // A ring of layers at every level, each level a quarter of the one before, and a slab coming in.
  return layer * brick_nodes * 4 / 3 + std::max(slab_bytes, layer) + layer;
}

Result<BrickFileSummary> write_brick_file(const std::filesystem::path& path, const GridAxes& axes, SampleType type,
                                          const std::string& name, const SlabSource& source, const Progress& progress) {
  if (std::any_of(axes.begin(), axes.end(), [](const GridAxis& axis) { return axis.size() < 2; }))
    return Error{ErrorCode::bad_value, "has an axis without cells", path.string(), name, "two nodes"};
  BrickFileHeader header;
  header.type = type;
  header.name = name;
  Result<std::vector<BrickLevel>> levels = brick_levels(axes);
  if (!levels) return std::move(levels).error().in_file(path.string());
  header.levels = std::move(*levels);
  header.bricks.resize(std::size_t{header.levels.back().first} + header.levels.back().count());
  const std::uint64_t bricks_at = brick_aligned(encode_brick_header(header).size());
  const std::uint64_t stride = brick_aligned(brick_bytes(type));
  for (std::size_t n = 0; n < header.bricks.size(); ++n) header.bricks[n].offset = bricks_at + stride * n;
  header.file_bytes = bricks_at + stride * header.bricks.size();

  AsideFile file(path);
  ASPERITY_CHECK(file.create(header.file_bytes));
  SampleSurvey survey;
  ASPERITY_CHECK(with_samples_of(
      type, [&]<class Sample>() { return write_samples<Sample>(header, file, source, progress, survey); }));
  if (survey.lowest > survey.highest) {
    return bad_value("holds no sample that is a number", name, "samples that are numbers");
  }
  header.lowest = survey.lowest;
  header.highest = survey.highest;
  const std::string first_bytes = encode_brick_header(header);
  ASPERITY_CHECK(file.write(0, first_bytes.data(), first_bytes.size()));
  ASPERITY_CHECK(file.keep());
  return BrickFileSummary{header.levels.size(), header.bricks.size(), header.file_bytes,
                          survey.lowest,        survey.highest,       survey.unknown};
}

Result<BrickFileSummary> write_brick_file(const std::filesystem::path& path, const ScalarGrid& grid,
                                          const Progress& progress) {
  const std::size_t layer = static_cast<std::size_t>(grid.axis(0).size()) * grid.axis(1).size();
  const auto source = [&](std::uint32_t first, std::uint32_t last, SampleArray& out) {
    std::visit(
        [&](const auto& samples) {
          auto& to = std::get<std::decay_t<decltype(samples)>>(out);
          std::copy_n(samples.begin() + static_cast<std::ptrdiff_t>(layer * first), layer * (last - first), to.begin());
        },
        grid.samples());
    return success();
  };
  return write_brick_file(path, grid.axes(), grid.type(), grid.name(), source, progress);
}

}  // namespace asperity
