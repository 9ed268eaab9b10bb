#include "asperity/field/mesostructure/generators.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <utility>

#include "asperity/field/mesostructure/detail/formulas.h"

namespace asperity {
namespace {

/// Whether a number lies in its closed range; `what` says which ("the width is").
Status within(double value, double low, double high, const char* place, const char* what) {
  if (value >= low && value <= high) return success();
  return bad_value(fmt::format("{} {:.4g}", what, value), place, fmt::format("{:.4g} to {:.4g}", low, high));
}

Status check_count(const MesostructureSpec& spec, int most) {
  if (spec.count >= 1 && spec.count <= most) return success();
  return bad_value(fmt::format("{} repeats on {} texels", spec.count, spec.size), "count",
                   fmt::format("1 to {}", most));
}

Status check_number(const MesostructureSpec& spec, int most) {
  return within(spec.number.value_or(1), 1, most, "number", "there are to be");
}

Status check_radii(const ShareRange& radius) {
  ASPERITY_CHECK(within(radius.low, 0.001, 0.25, "radius", "the smallest radius is"));
  return within(radius.high, radius.low, 0.25, "radius", "the largest radius is");
}

Status check_serrated(const MesostructureSpec& spec) {
  ASPERITY_CHECK(check_count(spec, spec.size / 2));
  return within(spec.wall, 0.0, 0.5, "wall", "the steep side takes a share of");
}

Status check_beams(const MesostructureSpec& spec) {
  ASPERITY_CHECK(check_count(spec, std::max(spec.size / 4, 1)));
  // A third of four texels is more than one: the beams' own width never fails here at four texels and above.
  const double texel = static_cast<double>(spec.count) / spec.size;
  return within(*spec.width, texel, 1.0 - texel, "width", "the beams' share of their pitch is");
}

Status check_coins(const MesostructureSpec& spec) {
  ASPERITY_CHECK(check_number(spec, 200));
  ASPERITY_CHECK(check_radii(*spec.radius));
  ASPERITY_CHECK(within(spec.field, 0.0, 1.0, "field", "the field's share of the amplitude is"));
  const bool struck = spec.field < 1.0;
  if (struck) {
    ASPERITY_CHECK(within(*spec.rim, 0.02, 0.5, "rim", "the rim's share of the radius is"));
  } else if (spec.rim) {
    return bad_value("flat coins have no rim", "rim", "a rim around a lower \"field\", 0 to below 1");
  }
  ASPERITY_CHECK(within(spec.overlap, 0.0, 0.9, "overlap", "the coins' overlap is"));
  const double narrowest = struck ? *spec.rim * spec.radius->low : spec.radius->low;
  return within(*spec.flank, 0.0, 0.5 * narrowest, "flank", "the flank's width is");
}

Status check_groove(const MesostructureSpec& spec) {
  ASPERITY_CHECK(within(*spec.width, 0.005, 0.2, "width", "the stroke's width is"));
  ASPERITY_CHECK(within(*spec.flank, 0.0, 0.5 * *spec.width, "flank", "the wall's width is"));
  // Two bows of this radius and half a stroke reach from the middle to just inside the border.
  const double most = 0.24 - 0.25 * *spec.width;
  ASPERITY_CHECK(within(spec.radius->low, 0.05, most, "radius", "the bows' radius is"));
  return within(spec.radius->high, spec.radius->low, spec.radius->low, "radius", "the bows' other radius is");
}

Status check_fractal(const MesostructureSpec& spec) {
  ASPERITY_CHECK(within(spec.hurst, 0.05, 1.0, "hurst", "the Hurst exponent is"));
  const int most = std::max(1, static_cast<int>(std::bit_width(static_cast<unsigned>(spec.size))) - 2);
  return within(*spec.octaves, 1, most, "octaves", "the number of octaves is");
}

Status check_rings(const MesostructureSpec& spec) {
  return check_number(spec, 64);
}

Status check_warts(const MesostructureSpec& spec) {
  ASPERITY_CHECK(check_number(spec, 2000));
  return check_radii(*spec.radius);
}

struct Kind {
  MesostructureKind kind;
  const char* paper;
  Status (*check)(const MesostructureSpec& spec);
  MadeHeights (*heights)(const MesostructureSpec& spec);
  std::array<std::string_view, 7> parameters;  // as many as are not empty
};
constexpr std::array<Kind, 8> kinds{{
    {MesostructureKind::flat, "H_0", nullptr, flat_heights, {}},
    {MesostructureKind::serrated, "H_1", check_serrated, serrated_heights, {"count", "wall"}},
    {MesostructureKind::beams, "H_2", check_beams, beam_heights, {"count", "width"}},
    {MesostructureKind::rings, "H_3", check_rings, ring_heights, {"number", "seed"}},
    {MesostructureKind::warts, "H_4", check_warts, wart_heights, {"number", "radius", "seed"}},
    {MesostructureKind::coins,
     "H_5",
     check_coins,
     coin_heights,
     {"number", "radius", "rim", "field", "flank", "overlap", "seed"}},
    {MesostructureKind::groove, "H_6", check_groove, groove_heights, {"width", "flank", "radius"}},
    {MesostructureKind::fractal, "H_7", check_fractal, fractal_heights, {"hurst", "octaves", "seed"}},
}};

const Kind* entry_of(MesostructureKind kind) {
  const auto found = std::find_if(kinds.begin(), kinds.end(), [&](const Kind& entry) { return entry.kind == kind; });
  return found != kinds.end() ? &*found : nullptr;
}

/// `spec` is completed.
Status check(const MesostructureSpec& spec) {
  if (spec.size < 2 || spec.size > 8192)
    return bad_value(fmt::format("{} texels a side", spec.size), "size", "2 to 8192 texels");
  const bool flat = spec.kind == MesostructureKind::flat;
  if (!std::isfinite(spec.amplitude) || (spec.amplitude < 0.0 && !flat)) {
    return bad_value(fmt::format("the amplitude is {} m", spec.amplitude), "amplitude",
                     flat ? "a finite height" : "a finite length of 0 or more");
  }
  if (flat) return success();
  const Kind* entry = entry_of(spec.kind);
  return entry != nullptr ? entry->check(spec)
                          : bad_value("an unknown mesostructure", "kind", "one of the named kinds");
}

}  // namespace

const char* paper_name(MesostructureKind kind) {
  const Kind* entry = entry_of(kind);
  return entry != nullptr ? entry->paper : "unknown";
}

Result<MesostructureKind> parse_mesostructure_kind(std::string_view name) {
  std::string accepted;
  for (const Kind& entry : kinds) {
    const std::string short_name{'h', entry.paper[2]};
    if (name == to_string(entry.kind) || name == entry.paper || name == short_name) return entry.kind;
    accepted += fmt::format("{}{} ({})", accepted.empty() ? "" : ", ", to_string(entry.kind), entry.paper);
  }
  return bad_value(fmt::format("no mesostructure is called '{}'", name), {}, std::move(accepted));
}

std::span<const std::string_view> parameters_of(MesostructureKind kind) {
  const Kind* entry = entry_of(kind);
  if (entry == nullptr) return {};
  return {entry->parameters.begin(), std::find(entry->parameters.begin(), entry->parameters.end(), std::string_view())};
}

MesostructureSpec completed(MesostructureSpec spec) {
  const auto own = [](auto& member, auto value) {
    if (!member) member = value;
  };
  switch (spec.kind) {
    case MesostructureKind::flat:
    case MesostructureKind::serrated:
    case MesostructureKind::rings: break;
    case MesostructureKind::beams: own(spec.width, 1.0 / 3.0); break;
    case MesostructureKind::warts: own(spec.radius, ShareRange{0.015, 0.06}); break;
    case MesostructureKind::coins:
      own(spec.number, 5);
      own(spec.radius, ShareRange{0.09, 0.15});
      own(spec.flank, 0.0);
      if (spec.field < 1.0) own(spec.rim, 0.12);
      break;
    case MesostructureKind::groove:
      own(spec.width, 0.08);
      own(spec.flank, 0.25 * *spec.width);
      own(spec.radius, ShareRange{0.16, 0.16});
      break;
    case MesostructureKind::fractal:
      // The coarsest octave has two cells a side, and 2^octaves cells of four texels make a side.
      own(spec.octaves, std::max(1, static_cast<int>(std::bit_width(static_cast<unsigned>(spec.size))) - 3));
      break;
  }
  return spec;
}

Result<std::vector<float>> generate_heights(const MesostructureSpec& given) {
  const MesostructureSpec spec = completed(given);
  ASPERITY_CHECK(check(spec));
  return entry_of(spec.kind)->heights(spec);
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

}  // namespace asperity
