#include "apps/asperity/program.h"

int main(int argc, char** argv) {
  return asperity::run_program(argc, argv);
}
