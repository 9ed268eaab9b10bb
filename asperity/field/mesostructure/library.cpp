#include "asperity/field/mesostructure/library.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <mutex>
#include <utility>

#include "asperity/core/suggest.h"
#include "asperity/field/mesostructure/detail/patterns.h"

namespace asperity {
namespace {

using MakePattern = Pattern (*)(std::uint64_t seed);

struct Shelf {
  std::vector<LibraryEntry> entries;
  std::vector<MakePattern> makers;  // of each entry
};

struct Item {
  const char* name;
  double tile;       // m
  double amplitude;  // m
  MakePattern make;
  const char* summary;
};

// By name. Sizes are those of the things themselves where a standard or trade gives them.
constexpr std::array<Item, 29> items{{
    {"ball-milled-steel", 5e-3, 14e-6, milled_pattern, "passes of a ball-nosed cutter of 3 mm, 0.5 mm apart"},
    {"bark", 0.12, 8e-3, bark_pattern, "old tree's bark in plates with deep furrows"},
    {"basket", 0.06, 3e-3, basket_pattern, "wicker of 5 mm, two over two"},
    {"braille", 0.06, 0.5e-3, braille_pattern, "six lines of braille: dots of 1.5 mm, 2.5 mm apart, 0.5 mm high"},
    {"bricks", 0.9, 10e-3, bricks_pattern, "wall of bricks of 215 mm x 65 mm with joints of 10 mm"},
    {"brushed-steel", 10e-3, 6e-6, brushed_pattern, "steel brushed to a satin finish along s"},
    {"cobblestones", 0.8, 25e-3, cobbles_pattern, "setts of 100 mm with rounded tops"},
    {"corduroy", 18e-3, 1.2e-3, corduroy_pattern, "ribbed velvet, eight wales an inch"},
    {"denim", 10e-3, 0.3e-3, denim_pattern, "twill three over one, 20 threads a centimetre"},
    {"diamond-plate", 0.15, 1.8e-3, plate_pattern, "rolled tread plate, lozenges of 30 mm alternately turned"},
    {"file-teeth", 8e-3, 0.3e-3, file_pattern, "double-cut file, 15 teeth a centimetre"},
    {"fish-scales", 56e-3, 0.6e-3, scales_pattern, "overlapping scales of 8 mm with growth rings"},
    {"hammered-copper", 50e-3, 0.5e-3, hammered_pattern, "sheet beaten with a round hammer, blows of 6 mm"},
    {"honeycomb", 37e-3, 1.5e-3, honeycomb_pattern, "wax cells of 5.3 mm with rounded walls"},
    {"knit", 24e-3, 1.5e-3, knit_pattern, "jersey knit, stitches of 4 mm x 3 mm"},
    {"knurled-metal", 7e-3, 0.4e-3, knurl_pattern, "diamond knurl at 30 degrees, pitch 1 mm, tips worn"},
    {"leather", 20e-3, 0.25e-3, leather_pattern, "full-grain cowhide, grains of 1 mm between creases"},
    {"linen", 11.2e-3, 0.35e-3, linen_pattern, "plain weave of uneven threads, 14 a centimetre"},
    {"orange-peel", 22e-3, 0.3e-3, orange_pattern, "rind of an orange, pores of 1 mm"},
    {"pebbles", 0.12, 12e-3, pebbles_pattern, "river gravel of 6 to 30 mm"},
    {"record-groove", 1.6e-3, 30e-6, record_pattern, "a record's grooves, 54 um wide, 100 um apart"},
    {"ribbed-rubber", 12e-3, 1.2e-3, ribs_pattern, "rubber mat with round ribs, 3 mm apart, along t"},
    {"ripple-sand", 0.64, 9e-3, sand_pattern, "sand rippled by wind, 80 mm from crest to crest"},
    {"roughcast", 80e-3, 4e-3, roughcast_pattern, "thrown plaster with grains of 2 to 6 mm"},
    {"sandpaper-p240", 1.3e-3, 45e-6, sandpaper_pattern, "abrasive paper P240, grains of 59 um"},
    {"sandpaper-p80", 4.5e-3, 0.16e-3, sandpaper_pattern, "abrasive paper P80, grains of 0.2 mm"},
    {"stud-plate", 40e-3, 1.7e-3, studs_pattern, "toy bricks' studs of 4.8 mm, 8 mm apart"},
    {"tactile-paving", 0.4, 5e-3, paving_pattern, "blister paving: domes of 25 mm, 67 mm apart, 5 mm high"},
    {"wood", 40e-3, 0.2e-3, wood_pattern, "planed and weathered oak, open pores along t"},
}};

const Shelf& shelf() {
  static const Shelf all = [] {
    Shelf filled;
    std::uint64_t seed = 1;
    for (const Item& item : items) {
      filled.entries.push_back({item.name, item.summary, item.tile, item.amplitude, 100 * seed++});
      filled.makers.push_back(item.make);
    }
    return filled;
  }();
  return all;
}

/// Lowest and highest of a pattern, on a grid of its own: what is drawn does not depend on the size that is asked for.
struct PatternRange {
  double lowest = infinity;
  double highest = -infinity;
  explicit PatternRange(const Pattern& pattern) {
    constexpr int side = 128;
    // Rows and columns are shifted against one another, so that what repeats is met in many places.
    for (int y = 0; y < side; ++y) {
      for (int x = 0; x < side; ++x) {
        const double height = pattern((x + 0.618034 * y) / side, (y + 0.381966 * x) / side);
        lowest = std::min(lowest, height);
        highest = std::max(highest, height);
      }
    }
  }
};

/// The range of an entry's own piece, found once.
const PatternRange& own_range(std::size_t index) {
  static std::array<std::once_flag, items.size()> found;
  static std::vector<PatternRange> ranges(items.size(), PatternRange([](double, double) { return 0.0; }));
  std::call_once(found[index],
                 [&] { ranges[index] = PatternRange(shelf().makers[index](shelf().entries[index].seed)); });
  return ranges[index];
}

Result<std::size_t> index_of(std::string_view name) {
  std::vector<std::string> names;
  for (const LibraryEntry& entry : shelf().entries) {
    if (entry.name == name) return names.size();
    names.push_back(entry.name);
  }
  const std::string meant = nearest_name(name, names);
  return Error{ErrorCode::bad_value,
               fmt::format("no mesostructure of the library is called '{}'{}", name,
                           meant.empty() ? std::string() : fmt::format(", did you mean '{}'?", meant)),
               "", "", fmt::format("{}", fmt::join(names, ", "))};
}

}  // namespace

std::span<const LibraryEntry> mesostructure_library() {
  return shelf().entries;
}

Result<LibraryEntry> library_entry(std::string_view name) {
  ASPERITY_TRY(const std::size_t index, index_of(name));
  return shelf().entries[index];
}

Result<LibraryRelief> library_mesostructure(std::string_view name, int size, std::uint64_t seed) {
  ASPERITY_TRY(const std::size_t index, index_of(name));
  if (size < 16 || size > 4096)
    return Error{ErrorCode::bad_value, fmt::format("{} texels a side", size), "", "size", "16 to 4096 texels"};
  const LibraryEntry& entry = shelf().entries[index];
  const Pattern pattern = shelf().makers[index](seed == 0 ? entry.seed : seed);
  const PatternRange range = seed == 0 || seed == entry.seed ? own_range(index) : PatternRange(pattern);
  const double scale = range.highest > range.lowest ? entry.amplitude / (range.highest - range.lowest) : 0.0;
  LibraryRelief relief{{}, size, Vec2(entry.tile, entry.tile), entry.amplitude};
  relief.heights.reserve(static_cast<std::size_t>(size) * static_cast<std::size_t>(size));
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const double value = pattern((x + 0.5) / size, (size - y - 0.5) / size);
      relief.heights.push_back(static_cast<float>(std::clamp((value - range.lowest) * scale, 0.0, entry.amplitude)));
    }
  }
  return relief;
}

}  // namespace asperity
