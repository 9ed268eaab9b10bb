#pragma once
// Mesostructures that come with the engine: named reliefs of known size, made from formulas, without files.

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "asperity/core/math.h"
#include "asperity/core/result.h"

namespace asperity {

/// One relief of the library.
struct LibraryEntry {
  std::string name;        ///< "linen"
  std::string summary;     ///< what it is, with the sizes it was drawn from
  double tile = 0.0;       ///< m, side of the square that repeats
  double amplitude = 0.0;  ///< m, highest minus lowest
  std::uint64_t seed = 1;  ///< of the one that is shown; other seeds make other pieces of the same stuff
};

/// All of them, by name. [any]
std::span<const LibraryEntry> mesostructure_library();

/// The entry of a name. Errors: bad_value with the name that was probably meant. [build]
Result<LibraryEntry> library_entry(std::string_view name);

/// Heights of a relief of the library.
struct LibraryRelief {
  std::vector<float>
      heights;   ///< m, size * size, row 0 on top (as HeightMap::build takes them), within 0 and the amplitude
  int size = 0;  ///< texels a side
  Vec2 tile = Vec2::Zero();  ///< m, of one repeat: Wrap::repeat shows no seam
  double amplitude = 0.0;    ///< m
};

/// Makes a relief with `size` x `size` texels, 16 to 4096; `seed` 0 stands for the entry's own. The same name, size and
/// seed answer the same heights; texels of other sizes lie on the same relief. Errors:
/// bad_value (name, with the one probably meant; size). [build]
Result<LibraryRelief> library_mesostructure(std::string_view name, int size = 512, std::uint64_t seed = 0);

}  // namespace asperity
