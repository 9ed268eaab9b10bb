#include "asperity/field/mesostructure_generators.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "asperity/core/math.h"
#include "asperity/core/rng.h"

namespace asperity {
namespace {

using std::numbers::pi;

struct KindName {
  MesostructureKind kind;
  const char* name;
  const char* paper;
};
constexpr std::array<KindName, 6> kind_names{{{MesostructureKind::flat, "flat", "H_0"},
                                              {MesostructureKind::serrated, "serrated", "H_1"},
                                              {MesostructureKind::beams, "beams", "H_2"},
                                              {MesostructureKind::rings, "rings", "H_3"},
                                              {MesostructureKind::warts, "warts", "H_4"},
                                              {MesostructureKind::groove, "groove", "H_6"}}};

/// Heights from a formula of texture coordinates (t up), at the texel centres, row 0 on top.
template <class Formula>
std::vector<float> tabulate(int size, Formula&& formula) {
  std::vector<float> heights;
  heights.reserve(static_cast<std::size_t>(size) * static_cast<std::size_t>(size));
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      heights.push_back(static_cast<float>(formula((x + 0.5) / size, (size - y - 0.5) / size)));
    }
  }
  return heights;
}

/// 1 at 0, falling as a raised cosine to 0 at 1 and beyond; slope 0 at both ends.
double raised_cosine(double q) {
  return std::abs(q) < 1.0 ? 0.5 + 0.5 * std::cos(pi * q) : 0.0;
}

/// Distance of two points on a tile that repeats.
double tiled_distance(double s, double t, double to_s, double to_t) {
  const double ds = s - to_s - std::round(s - to_s);
  const double dt = t - to_t - std::round(t - to_t);
  return std::hypot(ds, dt);
}

/// Whether one of `count` beams covers the texel: each takes the middle third of its pitch.
bool under_beam(int texel, int size, int count) {
  const auto phase = (static_cast<std::int64_t>(2 * texel + 1) * count) % (2 * static_cast<std::int64_t>(size));
  return 3 * phase >= 2 * size && 3 * phase < 4 * static_cast<std::int64_t>(size);
}

struct Wart {
  double s = 0.0;
  double t = 0.0;
  double radius = 0.0;  // tiles
  bool steep = false;
};

constexpr double largest_wart = 0.06;
constexpr double smallest_wart = 0.015;
constexpr int wart_attempts = 600;

std::vector<Wart> scatter_warts(std::uint64_t seed) {
  Rng rng(seed);
  std::vector<Wart> warts;
  for (int attempt = 0; attempt < wart_attempts; ++attempt) {
    Wart wart{rng.uniform(), rng.uniform(), largest_wart, rng.uniform() < 0.5};
    const double size = rng.uniform();
    const double chance = rng.uniform();
    if (!warts.empty()) {
      wart.radius = largest_wart * std::pow(smallest_wart / largest_wart, size);
      if (chance > 0.6 - 0.4 * std::cos(2.0 * pi * wart.s)) continue;
    }
    const bool free = std::none_of(warts.begin(), warts.end(), [&](const Wart& other) {
      return tiled_distance(wart.s, wart.t, other.s, other.t) < wart.radius + other.radius;
    });
    if (free) warts.push_back(wart);
  }
  return warts;
}

double wart_profile(const Wart& wart, double distance) {
  const double q = distance / wart.radius;
  if (q >= 1.0) return 0.0;
  const double rise = wart.radius / largest_wart;
  if (!wart.steep) return rise * raised_cosine(q);
  const double side = 1.0 - q * q * q * q;
  return rise * side * side;
}

void stamp_wart(std::vector<float>& heights, int size, double amplitude, const Wart& wart) {
  const auto first = [&](double centre) { return static_cast<int>(std::floor((centre - wart.radius) * size)) - 1; };
  const int span = static_cast<int>(std::ceil(2.0 * wart.radius * size)) + 3;
  for (int j = 0; j < std::min(span, size); ++j) {
    const int row = ((first(wart.t) + j) % size + size) % size;
    for (int i = 0; i < std::min(span, size); ++i) {
      const int column = ((first(wart.s) + i) % size + size) % size;
      const double distance = tiled_distance((column + 0.5) / size, (row + 0.5) / size, wart.s, wart.t);
      const auto index =
          static_cast<std::size_t>(size - 1 - row) * static_cast<std::size_t>(size) + static_cast<std::size_t>(column);
      heights[index] = std::max(heights[index], static_cast<float>(amplitude * wart_profile(wart, distance)));
    }
  }
}

constexpr double letter_radius = 0.16;      // tiles, of both bows of the S
constexpr double groove_half_width = 0.04;  // tiles
constexpr double groove_flat_part = 0.5;    // of the half width

/// Distance to an arc around `centre` that runs counterclockwise from angle `from` over `sweep` (rad).
double arc_distance(const Vec2& point, const Vec2& centre, double from, double sweep) {
  const Vec2 arm = point - centre;
  const double turn = std::atan2(arm.y(), arm.x()) - from;
  const double angle = turn - 2.0 * pi * std::floor(turn / (2.0 * pi));
  if (angle <= sweep) return std::abs(arm.norm() - letter_radius);
  const Vec2 start(std::cos(from), std::sin(from));
  const Vec2 end(std::cos(from + sweep), std::sin(from + sweep));
  return std::min((arm - letter_radius * start).norm(), (arm - letter_radius * end).norm());
}

double letter_distance(double s, double t) {
  const double sweep = 250.0 / 180.0 * pi;
  const double upper = arc_distance({s, t}, {0.5, 0.5 + letter_radius}, 1.5 * pi - sweep, sweep);
  const double lower = arc_distance({s, t}, {0.5, 0.5 - letter_radius}, 0.5 * pi - sweep, sweep);
  return std::min(upper, lower);
}

Status refuse(std::string what, const char* place, std::string accepted) {
  return Error{ErrorCode::bad_value, std::move(what), "", place, std::move(accepted)};
}

Status check(const MesostructureSpec& spec) {
  if (spec.size < 2 || spec.size > 8192) {
    return refuse(fmt::format("{} texels a side", spec.size), "size", "2 to 8192 texels");
  }
  const bool flat = spec.kind == MesostructureKind::flat;
  if (!std::isfinite(spec.amplitude) || (spec.amplitude < 0.0 && !flat)) {
    return refuse(fmt::format("the amplitude is {} m", spec.amplitude), "amplitude",
                  flat ? "a finite height" : "a finite length of 0 or more");
  }
  int most = spec.count;
  if (spec.kind == MesostructureKind::serrated) most = spec.size / 2;
  if (spec.kind == MesostructureKind::beams) most = std::max(spec.size / 4, 1);
  if (most != spec.count && (spec.count < 1 || spec.count > most)) {
    return refuse(fmt::format("{} repeats on {} texels", spec.count, spec.size), "count", fmt::format("1 to {}", most));
  }
  return success();
}

}  // namespace

const char* paper_name(MesostructureKind kind) {
  for (const KindName& entry : kind_names) {
    if (entry.kind == kind) return entry.paper;
  }
  return "unknown";
}

Result<MesostructureKind> parse_mesostructure_kind(std::string_view name) {
  std::string accepted;
  for (const KindName& entry : kind_names) {
    const std::string short_name{'h', entry.paper[2]};
    if (name == entry.name || name == entry.paper || name == short_name) return entry.kind;
    accepted += fmt::format("{}{} ({})", accepted.empty() ? "" : ", ", entry.name, entry.paper);
  }
  return Error{ErrorCode::bad_value, fmt::format("no mesostructure is called '{}'", name), "", "", std::move(accepted)};
}

Result<std::vector<float>> generate_heights(const MesostructureSpec& spec) {
  ASPERITY_CHECK(check(spec));
  switch (spec.kind) {
    case MesostructureKind::flat: return flat_heights(spec.size, spec.amplitude);
    case MesostructureKind::serrated: return serrated_heights(spec.size, spec.count, spec.amplitude);
    case MesostructureKind::beams: return beam_heights(spec.size, spec.count, spec.amplitude);
    case MesostructureKind::rings: return ring_heights(spec.size, spec.amplitude);
    case MesostructureKind::warts: return wart_heights(spec.size, spec.amplitude, spec.seed);
    case MesostructureKind::groove: return groove_heights(spec.size, spec.amplitude);
  }
  return Error{ErrorCode::bad_value, "an unknown mesostructure", "", "kind", "one of the named kinds"};
}

Result<HeightMap> generate_height_map(const MesostructureSpec& spec, Wrap wrap, Reconstruction reconstruction) {
  if (spec.kind == MesostructureKind::flat) {
    // As an offset the height stays a double: a coat of constant height equals the shifted surface exactly.
    ASPERITY_CHECK(check(spec));
    const auto texels = static_cast<std::size_t>(spec.size) * static_cast<std::size_t>(spec.size);
    const Image black{spec.size, spec.size, 1, 8, std::vector<std::uint16_t>(texels, 0)};
    return HeightMap::build(black, Channel::luminance, {0.0, spec.amplitude, false, wrap, reconstruction});
  }
  ASPERITY_TRY(std::vector<float> heights, generate_heights(spec));
  return HeightMap::build(std::move(heights), spec.size, spec.size, wrap, reconstruction);
}

std::vector<float> flat_heights(int size, double height) {
  return std::vector<float>(static_cast<std::size_t>(size) * static_cast<std::size_t>(size),
                            static_cast<float>(height));
}

std::vector<float> serrated_heights(int size, int ridges, double amplitude) {
  std::vector<float> row(static_cast<std::size_t>(size));
  for (int x = 0; x < size; ++x) {
    const auto phase = static_cast<std::int64_t>(x) * ridges % size;
    row[static_cast<std::size_t>(x)] = static_cast<float>(amplitude * static_cast<double>(size - phase) / size);
  }
  std::vector<float> heights;
  heights.reserve(row.size() * row.size());
  for (int y = 0; y < size; ++y) heights.insert(heights.end(), row.begin(), row.end());
  return heights;
}

std::vector<float> beam_heights(int size, int beams, double amplitude) {
  const auto side = static_cast<std::size_t>(size);
  std::vector<bool> covered(side);
  for (int i = 0; i < size; ++i) covered[static_cast<std::size_t>(i)] = under_beam(i, size, beams);
  std::vector<float> heights(side * side);
  for (std::size_t y = 0; y < side; ++y) {
    for (std::size_t x = 0; x < side; ++x) {
      if (covered[x] || covered[side - 1 - y]) heights[y * side + x] = static_cast<float>(amplitude);
    }
  }
  return heights;
}

std::vector<float> ring_heights(int size, double amplitude) {
  return tabulate(size, [amplitude](double s, double t) {
    const double from_first = tiled_distance(s, t, 0.28, 0.72);
    const double from_second = tiled_distance(s, t, 0.72, 0.28);
    double rise = raised_cosine((from_first - 0.17) / 0.06) + raised_cosine((from_second - 0.17) / 0.06);
    rise += raised_cosine(from_first / 0.08) - raised_cosine(from_second / 0.08);
    rise += raised_cosine(tiled_distance(s, t, 0.28, 0.28) / 0.12);
    rise -= raised_cosine(tiled_distance(s, t, 0.72, 0.72) / 0.12);
    return 0.5 * amplitude * (1.0 + rise);
  });
}

std::vector<float> wart_heights(int size, double amplitude, std::uint64_t seed) {
  std::vector<float> heights = flat_heights(size);
  for (const Wart& wart : scatter_warts(seed)) stamp_wart(heights, size, amplitude, wart);
  return heights;
}

std::vector<float> groove_heights(int size, double amplitude) {
  return tabulate(size, [amplitude](double s, double t) {
    const double q = letter_distance(s, t) / groove_half_width;
    return -amplitude * raised_cosine(std::max(q - groove_flat_part, 0.0) / (1.0 - groove_flat_part));
  });
}

}  // namespace asperity
