// That the program fits with NLopt, settled before main.

#ifdef ASPERITY_HAS_NLOPT

#include "apps/asperity/minimiser.h"
#include "asperity/study/nlopt/nlopt_minimiser.h"

namespace asperity::program {
namespace {

[[maybe_unused]] const bool registered = [] {
  own_minimiser() = minimise_with_nlopt;
  return true;
}();

}  // namespace
}  // namespace asperity::program

#endif
