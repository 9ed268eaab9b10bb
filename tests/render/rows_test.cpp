#include "tests/render/fixtures.h"
