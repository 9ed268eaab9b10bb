#pragma once
// What a fit asks of an optimiser, so that only one file knows which one it is (asperity/study/nlopt).

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "asperity/core/result.h"

namespace asperity {

/// Where to search: a box, and a point in it to begin with.
struct SearchBox {
  std::vector<double> lower;
  std::vector<double> upper;
  std::vector<double> start;
};

/// How long. The same seed finds the same.
struct SearchEffort {
  std::size_t global_evaluations = 600;  ///< at most, over the whole box; 0: from the start on only
  std::size_t local_evaluations = 300;   ///< at most, from the best point on
  std::uint32_t seed = 1;
};

/// What was found.
struct SearchResult {
  std::vector<double> at;
  double cost = 0.0;
  std::size_t evaluations = 0;
};

/// Answers a finite number for every point of the box.
using Cost = std::function<double(std::span<const double>)>;
/// Looks for the smallest cost. Errors: bad_value for a box that is none.
using Minimiser = std::function<Result<SearchResult>(const Cost&, const SearchBox&, const SearchEffort&)>;

}  // namespace asperity
