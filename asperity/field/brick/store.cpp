#include "asperity/field/brick/store.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstring>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "asperity/field/brick/detail/pool.h"

namespace asperity {
namespace {

using Clock = std::chrono::steady_clock;

// How often the background thread looks where the probe is.
constexpr auto poll_time = std::chrono::microseconds(500);
// How far ahead it follows the probe's velocity, in how many steps.
constexpr double horizon = 0.015;  // s
constexpr std::size_t path_points = 7;
// Around the path, in bricks of each level: what is fetched at least, however fast the probe moves.
constexpr double least_reach = 0.7;
// A slow probe leaves time for more, up to what the slots hold: reach (bricks) times speed (bricks/s) is at least this.
constexpr double reach_rate = 30.0;  // 1/s
// A brick along the way ahead counts as nearer than one to the side.
constexpr double ahead_weight = 0.05;
// What was settled is looked at again after this, since bricks may have come and gone by fetch.
constexpr auto settled_time = std::chrono::milliseconds(20);
// Bricks read before the probe's place is looked at again.
constexpr std::size_t burst = 8;

/// Where the probe is and how it moves. Written by one thread at a time, which never waits; read by another, which
/// tries again when it met a write.
class Target {
 public:
  void publish(const Vec3& position, const Vec3& velocity) noexcept {
    std::uint64_t even = sequence_.load(std::memory_order_relaxed);
    // A second probe that writes at the same moment is left out.
    if (even % 2 != 0 || !sequence_.compare_exchange_strong(even, even + 1, std::memory_order_acquire)) return;
    for (int a = 0; a < 3; ++a) {
      const auto n = static_cast<std::size_t>(a);
      values_[n].store(position[a], std::memory_order_release);
      values_[n + 3].store(velocity[a], std::memory_order_release);
    }
    sequence_.store(even + 2, std::memory_order_release);
  }
  /// The sequence number read; 0: nothing published yet, or met a write.
  std::uint64_t read(Vec3& position, Vec3& velocity) const noexcept {
    const std::uint64_t before = sequence_.load(std::memory_order_acquire);
    if (before == 0 || before % 2 != 0) return 0;
    for (int a = 0; a < 3; ++a) {
      const auto n = static_cast<std::size_t>(a);
      position[a] = values_[n].load(std::memory_order_acquire);
      velocity[a] = values_[n + 3].load(std::memory_order_acquire);
    }
    return sequence_.load(std::memory_order_relaxed) == before ? before : 0;
  }

 private:
  std::atomic<std::uint64_t> sequence_{0};
  std::array<std::atomic<double>, 6> values_{};
};

/// First and last brick along each axis.
struct BrickBox {
  std::array<std::uint32_t, 3> first{};
  std::array<std::uint32_t, 3> last{};
};

std::uint32_t number_of(const BrickLevel& level, std::uint32_t i, std::uint32_t j, std::uint32_t k) noexcept {
  return level.first + i + level.bricks[0] * (j + level.bricks[1] * k);
}

/// Bricks of the cells that meet a box; a box that ends on a node, up to rounding, meets the cells on both sides.
BrickBox bricks_of(const BrickLevel& level, const Box& box) noexcept {
  constexpr double on_node = 1e-6;
  BrickBox out;
  for (std::size_t a = 0; a < 3; ++a) {
    const auto at = static_cast<Eigen::Index>(a);
    const GridAxis& axis = level.axes[a];
    const GridAxis::Place low = axis.locate(box.lower[at]);
    const GridAxis::Place high = axis.locate(box.upper[at]);
    const std::uint32_t first = low.fraction < on_node && low.cell > 0 ? low.cell - 1 : low.cell;
    const bool next = high.fraction > 1.0 - on_node && high.cell + 1 < axis.cells();
    out.first[a] = first / brick_cells;
    out.last[a] = (next ? high.cell + 1 : high.cell) / brick_cells;
  }
  return out;
}

template <class Visit>
bool all_bricks(const BrickLevel& level, const BrickBox& box, const Visit& visit) {
  for (std::uint32_t k = box.first[2]; k <= box.last[2]; ++k) {
    for (std::uint32_t j = box.first[1]; j <= box.last[1]; ++j) {
      for (std::uint32_t i = box.first[0]; i <= box.last[0]; ++i) {
        if (!visit(number_of(level, i, j, k), std::array<std::uint32_t, 3>{i, j, k})) return false;
      }
    }
  }
  return true;
}

/// Where the probe is and is going, with its turning found from the last few milliseconds.
struct Motion {
  Vec3 position = Vec3::Zero();
  Vec3 velocity = Vec3::Zero();
  Vec3 turning = Vec3::Zero();  ///< rad/s, around its direction

  /// Takes over what was published. Turning is averaged, since velocities are noisy.
  void update(const Vec3& now_at, const Vec3& now_velocity) {
    constexpr double interval = 2e-3;  // s
    constexpr double slow = 1e-3;      // m/s
    const Clock::time_point now = Clock::now();
    position = now_at;
    velocity = now_velocity;
    const double passed = std::chrono::duration<double>(now - since_).count();
    if (passed < interval) return;
    const double product = before_.norm() * velocity.norm();
    const bool known = product > slow * slow && passed < 10.0 * interval && before_.dot(velocity) > 0.0;
    turning = 0.5 * (turning + (known ? Vec3(before_.cross(velocity) / (product * passed)) : Vec3::Zero()));
    before_ = velocity;
    since_ = now;
  }

 private:
  Vec3 before_ = Vec3::Zero();
  Clock::time_point since_;
};

/// The probe's way ahead at every level, measured in bricks of that level (so that stretched axes need no care).
class Way {
 public:
  Way(const BrickFileHeader& header, const Motion& motion) : header_(&header) {
    constexpr double seconds = horizon / (path_points - 1);
    const double angle = motion.turning.norm() * seconds;
    Mat3 turn = Mat3::Identity();
    if (angle > 1e-9) turn = Eigen::AngleAxisd(angle, motion.turning.normalized()).toRotationMatrix();
    points_.resize(header.levels.size());
    Vec3 p = motion.position;
    Vec3 velocity = motion.velocity;
    for (std::size_t n = 0; n < path_points; ++n) {
      for (std::size_t l = 0; l < header.levels.size(); ++l) {
        for (std::size_t a = 0; a < 3; ++a) {
          const GridAxis::Place place = header.levels[l].axes[a].locate(p[static_cast<Eigen::Index>(a)]);
          points_[l][n][static_cast<Eigen::Index>(a)] = (place.cell + place.fraction) / brick_cells;
        }
      }
      p += velocity * seconds;
      velocity = turn * velocity;
    }
  }

  /// Least distance of a brick from the way, in bricks of its level, places further ahead a little farther.
  [[nodiscard]] double distance(std::size_t level, const std::array<std::uint32_t, 3>& at) const {
    const Vec3 lower(at[0], at[1], at[2]);
    double least = infinity;
    for (const Vec3& q : points_[level]) {
      const Vec3 off = (lower - q).cwiseMax(q - lower - Vec3::Ones()).cwiseMax(0.0);
      least = std::min(least, off.norm() + ahead_weight * (q - points_[level].front()).norm());
    }
    return least;
  }
  [[nodiscard]] double distance(std::uint32_t brick) const {
    std::size_t l = header_->levels.size() - 1;
    while (header_->levels[l].first > brick) --l;
    const BrickLevel& level = header_->levels[l];
    const std::uint32_t n = brick - level.first;
    return distance(
        l, {n % level.bricks[0], n / level.bricks[0] % level.bricks[1], n / level.bricks[0] / level.bricks[1]});
  }
  /// Bricks within `reach` of the way, and some more.
  [[nodiscard]] BrickBox around(std::size_t level, double reach) const {
    BrickBox out;
    Box way;
    for (const Vec3& q : points_[level]) way.include(q);
    way = way.grown(reach);
    for (std::size_t a = 0; a < 3; ++a) {
      const auto at = static_cast<Eigen::Index>(a);
      const double last = header_->levels[level].bricks[a] - 1;
      out.first[a] = static_cast<std::uint32_t>(std::clamp(std::floor(way.lower[at]), 0.0, last));
      out.last[a] = static_cast<std::uint32_t>(std::clamp(std::floor(way.upper[at]), 0.0, last));
    }
    return out;
  }
  /// Length of the way, in bricks of the finest level.
  [[nodiscard]] double length() const {
    double sum = 0.0;
    for (std::size_t n = 1; n < path_points; ++n) sum += (points_.front()[n] - points_.front()[n - 1]).norm();
    return sum;
  }
  /// Whether so little has changed that the other's bricks are the same.
  [[nodiscard]] bool like(const Way& other) const {
    constexpr double little = 1.0 / 32.0;
    return (points_.front().front() - other.points_.front().front()).norm() < little &&
           (points_.front().back() - other.points_.front().back()).norm() < 4.0 * little;
  }

 private:
  const BrickFileHeader* header_;
  std::vector<std::array<Vec3, path_points>> points_;
};

struct Candidate {
  double distance = 0.0;
  std::uint32_t brick = 0;
};

bool nearer(const Candidate& a, const Candidate& b) {
  return a.distance < b.distance;
}

template <class Sample>
void gather(const std::byte* brick, const std::array<std::uint32_t, 3>& local, double out[64]) noexcept {
  const std::byte* from =
      brick + sizeof(Sample) * (local[0] + std::size_t{brick_nodes} * (local[1] + std::size_t{brick_nodes} * local[2]));
  for (int k = 0; k < 4; ++k) {
    for (int j = 0; j < 4; ++j) {
      Sample row[4];
      std::memcpy(row, from + sizeof(Sample) * brick_nodes * static_cast<std::size_t>(j), sizeof row);
      for (int i = 0; i < 4; ++i) *out++ = static_cast<double>(row[i]);
    }
    from += sizeof(Sample) * brick_nodes * brick_nodes;
  }
}

}  // namespace

struct BrickStore::State {
  std::unique_ptr<BrickPool> pool;
  std::vector<MinMaxOctree> octrees;
  Target target;
  std::mutex filling;              ///< held by whoever fills slots: the background thread or fetch
  Status first_error = success();  ///< under `filling`
  std::vector<bool> damaged;       ///< bricks that could not be read: not tried again in the background
  std::atomic<bool> stop{false};
  std::thread streamer;

  [[nodiscard]] const BrickFileHeader& header() const noexcept { return pool->header(); }

  void stream() {
    Vec3 position = Vec3::Zero();
    Vec3 velocity = Vec3::Zero();
    Motion motion;
    std::optional<Way> done;
    Clock::time_point done_at;
    while (!stop.load(std::memory_order_relaxed)) {
      if (target.read(position, velocity) != 0) {
        motion.update(position, velocity);
        const Way way(header(), motion);
        const bool settled = done && way.like(*done) && Clock::now() - done_at < settled_time;
        if (!settled) {
          if (stream_once(way)) continue;
          done = way;
          done_at = Clock::now();
        }
      }
      std::this_thread::sleep_for(poll_time);
    }
  }

  Status fetch(const BrickLevel& level, const BrickBox& box, const Way& way) {
    const auto full = [&] {
      return Error{ErrorCode::too_large, "needs more bricks than the resident memory takes", pool->file(), "resident",
                   "more memory, or a coarser level"};
    };
    std::uint64_t wanted = 1;
    for (std::size_t a = 0; a < 3; ++a) wanted *= box.last[a] - box.first[a] + 1;
    if (level.first < pool->first_pinned() && wanted > pool->slots()) return full();
    Status outcome = success();
    all_bricks(level, box, [&](std::uint32_t brick, const auto&) {
      // A doomed one must be gone before it can come back.
      const bool gone = pool->ready(brick) || patiently([&] { return !pool->here(brick); });
      if (pool->ready(brick)) return true;
      outcome = gone && wait_for_slot(way, level, box) ? load(brick) : Status(full());
      return outcome.ok();
    });
    return outcome;
  }

 private:
  Status load(std::uint32_t brick) {
    Status loaded = pool->load(brick);
    damaged[brick] = !loaded;
    if (!loaded && first_error) first_error = loaded;
    return loaded;
  }

  /// Bricks that the way needs and that are not here, nearest first: coarser ones reach farther, since their distances
  /// are measured in wider bricks.
  void list_missing(const Way& way, std::vector<Candidate>& missing) const {
    missing.clear();
    const std::size_t levels = header().levels.size();
    const double room = static_cast<double>(pool->slots()) / 2.0 / static_cast<double>(levels);
    const double most = std::max(0.5 * (std::cbrt(room) - 1.0), least_reach);
    const double speed = std::max(way.length() / horizon, 1e-9);
    const double reach = std::clamp(reach_rate / speed, least_reach, most);
    for (std::size_t l = 0; l < levels; ++l) {
      const BrickLevel& level = header().levels[l];
      if (level.first >= pool->first_pinned()) break;
      all_bricks(level, way.around(l, reach), [&](std::uint32_t brick, const std::array<std::uint32_t, 3>& at) {
        if (pool->ready(brick) || damaged[brick]) return true;
        const double distance = way.distance(l, at);
        if (distance < reach) missing.push_back({distance, brick});
        return true;
      });
    }
    std::sort(missing.begin(), missing.end(), nearer);
  }

  /// Dooms what is farthest from the way, a batch at a time, but nothing that is as near as what is missing. False
  /// where there is nothing to gain.
  bool make_room(const Way& way, double nearest_missing) {
    constexpr double clearly = 0.1;
    pool->list_evictable(evictable_);
    leaving_.clear();
    for (const std::uint32_t brick : evictable_) {
      const double distance = way.distance(brick);
      if (distance > nearest_missing + clearly) leaving_.push_back({distance, brick});
    }
    const std::size_t batch = std::min(std::max<std::size_t>(pool->slots() / 16, 4), leaving_.size());
    std::partial_sort(leaving_.begin(), leaving_.begin() + static_cast<std::ptrdiff_t>(batch), leaving_.end(),
                      [](const Candidate& a, const Candidate& b) { return nearer(b, a); });
    for (std::size_t n = 0; n < batch; ++n) pool->doom(leaving_[n].brick);
    return batch > 0;
  }

  /// Reads a few of the bricks that the way needs. False when nothing is left to do for now.
  bool stream_once(const Way& way) {
    const std::scoped_lock lock(filling);
    pool->reclaim();
    list_missing(way, missing_);
    if (missing_.empty()) return false;
    if (pool->free_slots() < burst && pool->retiring() == 0) make_room(way, missing_.front().distance);
    // Usually no reader is inside, and both steps are taken at once.
    pool->reclaim();
    pool->reclaim();
    // The disk is told of all of them at once: it answers several requests sooner than one after the other.
    for (std::size_t n = 0; n < std::min(2 * burst, missing_.size()); ++n) pool->announce(missing_[n].brick);
    std::size_t read = 0;
    for (const Candidate& candidate : missing_) {
      if (read == burst || pool->free_slots() == 0 || stop.load(std::memory_order_relaxed)) break;
      if (pool->here(candidate.brick)) continue;  // on its way out: comes back once it is gone
      // A brick that cannot be read is remembered and left out from here on.
      if (load(candidate.brick)) ++read;
    }
    return read > 0;
  }

  /// Takes doomed bricks on until `done`. Readers leave within a tick: who stays for seconds never will.
  template <class Done>
  bool patiently(const Done& done) {
    constexpr auto patience = std::chrono::seconds(2);
    const Clock::time_point begin = Clock::now();
    while (!done() && Clock::now() - begin < patience) {
      pool->reclaim();
      if (!done()) std::this_thread::sleep_for(std::chrono::microseconds(20));
    }
    return done();
  }

  /// Takes away what is farthest from the way and outside of `keep`, and waits until its slot is free.
  bool wait_for_slot(const Way& way, const BrickLevel& level, const BrickBox& keep) {
    pool->reclaim();
    if (pool->free_slots() > 0) return true;
    if (pool->retiring() == 0) {
      pool->list_evictable(evictable_);
      Candidate farthest{-1.0, no_index};
      for (const std::uint32_t brick : evictable_) {
        const bool kept = !all_bricks(level, keep, [&](std::uint32_t other, const auto&) { return other != brick; });
        const double distance = kept ? -1.0 : way.distance(brick);
        if (distance > farthest.distance) farthest = {distance, brick};
      }
      if (farthest.brick == no_index) return false;
      pool->doom(farthest.brick);
    }
    return patiently([&] { return pool->free_slots() > 0; });
  }

  std::vector<Candidate> missing_;
  std::vector<std::uint32_t> evictable_;
  std::vector<Candidate> leaving_;
};

BrickStore::BrickStore() : state_(std::make_unique<State>()) {}

BrickStore::~BrickStore() {
  state_->stop.store(true, std::memory_order_relaxed);
  if (state_->streamer.joinable()) state_->streamer.join();
}

Result<std::unique_ptr<BrickStore>> BrickStore::open(const std::filesystem::path& file, const BrickSettings& settings) {
  std::unique_ptr<BrickStore> store(new BrickStore());
  State& state = *store->state_;
  ASPERITY_TRY(state.pool, BrickPool::open(file, settings.resident_bytes));
  const BrickFileHeader& header = state.header();
  store->header_ = &header;
  state.damaged.resize(header.bricks.size());
  for (const BrickLevel& level : header.levels) {
    std::vector<ValueRange> ranges(level.count());
    for (std::size_t n = 0; n < ranges.size(); ++n) ranges[n] = header.bricks[level.first + n].range;
    state.octrees.push_back(MinMaxOctree::build(level.bricks, brick_cells, std::move(ranges)));
  }
  if (settings.stream) state.streamer = std::thread([&state] { state.stream(); });
  return store;
}

const MinMaxOctree& BrickStore::octree(int level) const noexcept {
  return state_->octrees[static_cast<std::size_t>(level)];
}

std::size_t BrickStore::resident_bytes() const noexcept {
  std::size_t bytes = state_->pool->memory_bytes();
  for (const MinMaxOctree& octree : state_->octrees) bytes += octree.memory_bytes();
  for (const BrickLevel& level : state_->header().levels) {
    for (const GridAxis& axis : level.axes) bytes += axis.memory_bytes();
  }
  return bytes;
}

BrickTraffic BrickStore::traffic() const noexcept {
  const BrickPool& pool = *state_->pool;
  return {pool.bricks_read(), pool.bricks_read() * brick_bytes(type()), pool.bricks_here(), pool.slots(),
          pool.slowest_read()};
}

Status BrickStore::status() const {
  const std::scoped_lock lock(state_->filling);
  return state_->first_error;
}

void BrickStore::enter() const noexcept {
  state_->pool->enter();
}
void BrickStore::leave() const noexcept {
  state_->pool->leave();
}

int BrickStore::ready_level(const Box& box, int finest) const noexcept {
  const int coarsest = levels() - 1;
  for (int l = std::max(finest, 0); l < coarsest; ++l) {
    const BrickLevel& level = state_->header().levels[static_cast<std::size_t>(l)];
    const auto ready = [&](std::uint32_t brick, const auto&) { return state_->pool->ready(brick); };
    if (all_bricks(level, bricks_of(level, box), ready)) return l;
  }
  return coarsest;
}

bool BrickStore::samples(int level_number, const CellIndex& cell, double out[64]) const noexcept {
  const BrickLevel& level = state_->header().levels[static_cast<std::size_t>(level_number)];
  std::array<std::uint32_t, 3> at{};
  std::array<std::uint32_t, 3> local{};
  for (std::size_t a = 0; a < 3; ++a) {
    if (cell.at[a] >= level.axes[a].cells()) return false;
    at[a] = cell.at[a] / brick_cells;
    local[a] = cell.at[a] % brick_cells;
  }
  const std::byte* brick = state_->pool->find(number_of(level, at[0], at[1], at[2]));
  if (brick == nullptr) return false;
  with_samples_of(type(), [&]<class Sample>() { gather<Sample>(brick, local, out); });
  return true;
}

void BrickStore::look_ahead(const Vec3& position, const Vec3& velocity) const noexcept {
  if (position.allFinite() && velocity.allFinite()) state_->target.publish(position, velocity);
}

Status BrickStore::fetch(const Box& box, int level_number) const {
  const BrickLevel& level =
      state_->header().levels[static_cast<std::size_t>(std::clamp(level_number, 0, levels() - 1))];
  if (box.empty()) return success();
  Motion still;
  still.position = box.centre();
  const Way way(state_->header(), still);
  const std::scoped_lock lock(state_->filling);
  return state_->fetch(level, bricks_of(level, box), way);
}

}  // namespace asperity
