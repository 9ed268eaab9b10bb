#pragma once
// The asperity program as a library: a program that adds surfaces and laws of its own is asperity with those.

#include <initializer_list>

#include "asperity/core/result.h"

namespace asperity {

/// Runs the command line as the program `asperity` does, with all that has been registered before, and answers its exit
/// code: 0 success, 1 what it checked does not hold, 2 bad input. `prepared`: what the registrations answered; the
/// first error ends the program with its message. To be called once, by main. [main]
int run_program(int argc, char** argv, std::initializer_list<Status> prepared = {});

}  // namespace asperity
