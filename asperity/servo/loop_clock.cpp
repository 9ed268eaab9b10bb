#include "asperity/servo/loop_clock.h"

#include <fmt/format.h>

namespace asperity {

Status check_loop_rate(double rate) {
  constexpr double lowest = 500.0;
  constexpr double highest = 40e3;
  if (rate >= lowest && rate <= highest) return success();
  return bad_value(fmt::format("is {:g} Hz", rate), "rate", "500 Hz to 40 kHz");
}

}  // namespace asperity
