// Which libraries the program reads volumes with, settled before main: every command may meet a volume.

#ifdef ASPERITY_HAS_VTK

#include "asperity/io/vtk/vtk_volume.h"

namespace asperity::program {
namespace {

[[maybe_unused]] const bool registered = [] {
  register_vtk_volumes();
  return true;
}();

}  // namespace
}  // namespace asperity::program

#endif
