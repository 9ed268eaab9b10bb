#include "asperity/field/mesostructure/library.h"

#include <fmt/format.h>

#include <algorithm>
#include <mutex>
#include <utility>

#include "asperity/core/suggest.h"
#include "asperity/field/height/map.h"
#include "asperity/field/mesostructure/detail/patterns.h"

namespace asperity {
namespace {

struct Shelf {
  std::vector<PatternItem> items;  // by name
  std::vector<LibraryEntry> entries;
};

const Shelf& shelf() {
  static const Shelf all = [] {
    Shelf filled;
    for (const auto& items : {grown_patterns(), made_patterns()})
      filled.items.insert(filled.items.end(), items.begin(), items.end());
    std::sort(filled.items.begin(), filled.items.end(),
              [](const PatternItem& a, const PatternItem& b) { return std::string_view(a.name) < b.name; });
    std::uint64_t seed = 1;
    for (const PatternItem& item : filled.items)
      filled.entries.push_back({item.name, item.summary, item.tile, item.amplitude, 100 * seed++});
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
  const std::size_t count = shelf().items.size();
  static std::vector<std::once_flag> found(count);
  static std::vector<PatternRange> ranges(count, PatternRange([](double, double) { return 0.0; }));
  std::call_once(found[index],
                 [&] { ranges[index] = PatternRange(shelf().items[index].make(shelf().entries[index].seed)); });
  return ranges[index];
}

Result<std::size_t> index_of(std::string_view name) {
  std::vector<std::string> names;
  for (const LibraryEntry& entry : shelf().entries) {
    if (entry.name == name) return names.size();
    names.push_back(entry.name);
  }
  const std::string meant = nearest_name(name, names);
  return bad_value(fmt::format("no mesostructure of the library is called '{}'{}", name,
                               meant.empty() ? std::string() : fmt::format(", did you mean '{}'?", meant)),
                   {}, listed(names));
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
  if (size < 16 || size > 4096) return bad_value(fmt::format("{} texels a side", size), "size", "16 to 4096 texels");
  const LibraryEntry& entry = shelf().entries[index];
  const Pattern pattern = shelf().items[index].make(seed == 0 ? entry.seed : seed);
  const PatternRange range = seed == 0 || seed == entry.seed ? own_range(index) : PatternRange(pattern);
  const double scale = range.highest > range.lowest ? entry.amplitude / (range.highest - range.lowest) : 0.0;
  std::vector<float> heights = tabulated(size, size, [&](const Vec2& st) {
    return std::clamp((pattern(st.x(), st.y()) - range.lowest) * scale, 0.0, entry.amplitude);
  });
  return LibraryRelief{std::move(heights), size, Vec2(entry.tile, entry.tile), entry.amplitude};
}

}  // namespace asperity
