#pragma once

#include "asperity/study/minimiser.h"

namespace asperity {

/// A Minimiser that needs no derivatives: controlled random search with local mutation over the box, then Sbplex
/// (subspaces of Nelder and Mead's simplex) from the best point on. Bit-equal for the same seed.
/// Errors: bad_value (sizes that differ, lower above upper, nothing to search, a start outside). [main]
Result<SearchResult> minimise_with_nlopt(const Cost& cost, const SearchBox& box, const SearchEffort& effort);

}  // namespace asperity
