// The program with the command touch alone: what ./run builds and runs first on a fresh machine.

#include <array>

#include "apps/asperity/command.h"

int main(int argc, char** argv) {
  using namespace asperity::program;
  static constexpr std::array<AddCommand, 1> commands{add_touch};
  return run_commands(argc, argv, commands, {});
}
