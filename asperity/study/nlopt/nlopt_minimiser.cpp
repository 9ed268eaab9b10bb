#include "asperity/study/nlopt/nlopt_minimiser.h"

#include <fmt/format.h>
#include <nlopt.h>

#include <cmath>
#include <limits>
#include <memory>

namespace asperity {
namespace {

struct Search {
  const Cost& cost;
  SearchResult best;
};

/// NLopt's answer is the best point as well, but not where it stops on an error in rounding.
double evaluate(unsigned count, const double* at, double* /*gradient*/, void* data) {
  Search& search = *static_cast<Search*>(data);
  const std::span<const double> point(at, count);
  const double cost = search.cost(point);
  ++search.best.evaluations;
  if (cost < search.best.cost) {
    search.best.cost = cost;
    search.best.at.assign(point.begin(), point.end());
  }
  return std::isfinite(cost) ? cost : std::numeric_limits<double>::max();
}

Status check(const SearchBox& box) {
  const std::size_t count = box.lower.size();
  const auto refused = [](std::string what) {
    return bad_value(std::move(what), "search box", "lower <= start <= upper, equally many");
  };
  if (count == 0 || box.upper.size() != count || box.start.size() != count)
    return refused("has no dimensions, or sides of different sizes");
  for (std::size_t i = 0; i < count; ++i) {
    if (!(box.lower[i] < box.upper[i] && box.lower[i] <= box.start[i] && box.start[i] <= box.upper[i]))
      return refused(fmt::format("dimension {} is no interval with the start in it", i));
  }
  return success();
}

void search_by(nlopt_algorithm algorithm, std::size_t evaluations, const SearchBox& box, Search& search) {
  if (evaluations == 0) return;
  const std::unique_ptr<std::remove_pointer_t<nlopt_opt>, void (*)(nlopt_opt)> method(
      nlopt_create(algorithm, static_cast<unsigned>(box.start.size())), nlopt_destroy);
  if (!method) return;
  nlopt_set_lower_bounds(method.get(), box.lower.data());
  nlopt_set_upper_bounds(method.get(), box.upper.data());
  nlopt_set_min_objective(method.get(), evaluate, &search);
  nlopt_set_maxeval(method.get(), static_cast<int>(evaluations));
  // NLopt's ten points a dimension would leave nothing of a short search.
  if (algorithm == NLOPT_GN_CRS2_LM)
    nlopt_set_population(method.get(), static_cast<unsigned>(5 * (box.start.size() + 1)));
  nlopt_set_xtol_rel(method.get(), 1e-4);
  nlopt_set_ftol_rel(method.get(), 1e-5);
  std::vector<double> at = search.best.at;
  double cost = 0.0;
  nlopt_optimize(method.get(), at.data(), &cost);
}

}  // namespace

Result<SearchResult> minimise_with_nlopt(const Cost& cost, const SearchBox& box, const SearchEffort& effort) {
  ASPERITY_CHECK(check(box));
  Search search{cost, {box.start, std::numeric_limits<double>::max(), 0}};
  nlopt_srand(effort.seed);
  search_by(NLOPT_GN_CRS2_LM, effort.global_evaluations, box, search);
  search_by(NLOPT_LN_SBPLX, effort.local_evaluations, box, search);
  return search.best;
}

}  // namespace asperity
