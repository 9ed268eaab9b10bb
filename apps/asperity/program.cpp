#include "apps/asperity/program.h"

#include <array>

#include "apps/asperity/command.h"

namespace asperity {

int run_program(int argc, char** argv, std::initializer_list<Status> prepared) {
  using namespace program;
  static constexpr std::array<AddCommand, 13> commands{
      add_touch, add_run,     add_compare, add_replay, add_inspect, add_convert, add_fit_friction,
      add_score, add_library, add_scenes,  add_bench,  add_schema,  add_doctor};
  return run_commands(argc, argv, commands, prepared);
}

}  // namespace asperity
