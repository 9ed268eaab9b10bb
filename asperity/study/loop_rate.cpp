#include "asperity/study/loop_rate.h"

#include <algorithm>
#include <chrono>
#include <optional>

#include "asperity/render/step.h"
#include "asperity/study/metrics.h"

namespace asperity {

namespace {

/// Every `stride`-th sample, both ends of each axis kept. Nothing where fewer than four would be left along an axis.
std::optional<ScalarGrid> thinned(const ScalarGrid& grid, std::uint32_t stride) {
  std::array<std::vector<std::uint32_t>, 3> kept;
  GridAxes axes;
  for (std::size_t a = 0; a < 3; ++a) {
    const GridAxis& axis = grid.axis(a);
    std::vector<double> nodes;
    for (std::uint32_t i = 0; i < axis.size(); i += stride) kept[a].push_back(i);
    if (kept[a].back() + 1 != axis.size()) kept[a].push_back(axis.size() - 1);
    if (kept[a].size() < 4) return std::nullopt;
    for (const std::uint32_t i : kept[a]) nodes.push_back(axis.node(i));
    Result<GridAxis> built = GridAxis::build(std::move(nodes));
    if (!built) return std::nullopt;
    axes[a] = std::move(built).value();
  }
  SampleArray samples = std::visit(
      [&](const auto& all) {
        std::decay_t<decltype(all)> some;
        some.reserve(kept[0].size() * kept[1].size() * kept[2].size());
        for (const std::uint32_t k : kept[2]) {
          for (const std::uint32_t j : kept[1]) {
            for (const std::uint32_t i : kept[0]) some.push_back(all[grid.index(i, j, k)]);
          }
        }
        return SampleArray(std::move(some));
      },
      grid.samples());
  Result<ScalarGrid> built = ScalarGrid::build(std::move(axes), std::move(samples), grid.name());
  if (!built) return std::nullopt;
  return std::move(built).value();
}

/// The instances on thinner data; false when one of them cannot be.
bool thin(std::vector<Instance>& instances, std::uint32_t stride, LoopRateRow& row) {
  for (Instance& instance : instances) {
    const IsoSurface* iso = iso_of(instance.surface);
    if (iso == nullptr) continue;
    const ScalarGrid* grid = iso->field().grid();
    if (grid == nullptr) return false;
    std::shared_ptr<const ScalarField> field = iso->shared_field();
    if (stride > 1) {
      std::optional<ScalarGrid> fewer = thinned(*grid, stride);
      if (!fewer) return false;
      field = std::make_shared<const ScalarField>(std::move(*fewer), iso->field().reconstruction());
      Result<IsoSurface> surface = IsoSurface::build(field, iso->threshold(), iso->inside(), iso->threshold_speed());
      if (!surface) return false;
      instance.surface = std::make_shared<const IsoSurface>(std::move(surface).value());
    }
    row.samples += field->grid()->size();
    row.bytes += static_cast<double>(field->memory_bytes());
  }
  return row.samples > 0;
}

double median_tick(const Scene& scene, const StrokePath& path, double rate, std::uint64_t ticks) {
  using Clock = std::chrono::steady_clock;
  ProxyState state;
  ProxyCache cache(scene);
  std::vector<double> times;
  times.reserve(ticks);
  const auto wanted = static_cast<std::uint64_t>(path.duration().count() * rate);
  for (std::uint64_t tick = 0; tick < wanted && times.size() < ticks; ++tick) {
    const Seconds time(static_cast<double>(tick) / rate);
    const StrokePose pose = path.pose(time);
    ProbeSample probe;
    probe.pose.position = pose.target;
    probe.twist.linear = pose.velocity;
    probe.time = time;
    const Clock::time_point begin = Clock::now();
    step(scene, state, cache, probe, Seconds(1.0 / rate));
    const double took = Seconds(Clock::now() - begin).count();
    if (time >= path.contact_begin()) times.push_back(took);
  }
  return percentile(times, 0.5);
}

}  // namespace

Result<std::vector<LoopRateRow>> loop_rates(const Scene& scene, const StrokePath& path, std::span<const Law> laws,
                                            double rate, std::uint64_t ticks) {
  constexpr int rounds = 5;
  std::vector<LoopRateRow> rows;
  std::vector<std::vector<Scene>> felt;
  for (const std::uint32_t stride : {8U, 4U, 2U, 1U}) {
    LoopRateRow row;
    std::vector<Instance> instances(scene.instances().begin(), scene.instances().end());
    if (!thin(instances, stride, row)) continue;
    std::vector<Scene>& scenes = felt.emplace_back();
    for (const Law& law : laws) {
      for (Instance& instance : instances) instance.law = law;
      ASPERITY_TRY(Scene made, Scene::build(instances, scene.settings()));
      double bytes = 0.0;
      for (const Instance& instance : made.instances()) bytes += static_cast<double>(law_bytes(instance));
      row.law_bytes.push_back(bytes);
      scenes.push_back(std::move(made));
    }
    row.p50.assign(laws.size(), infinity);
    rows.push_back(std::move(row));
  }
  for (int round = 0; round < rounds; ++round) {
    for (std::size_t size = 0; size < rows.size(); ++size) {
      for (std::size_t law = 0; law < laws.size(); ++law) {
        double& least = rows[size].p50[law];
        least = std::min(least, median_tick(felt[size][law], path, rate, ticks));
      }
    }
  }
  return rows;
}

}  // namespace asperity
