#pragma once
// What fit-friction finds its least with. Private to the program.

#include "asperity/study/friction_fit.h"

namespace asperity::program {

/// Empty until something sets it before main: the library itself brings none. [main]
Minimiser& own_minimiser();

}  // namespace asperity::program
