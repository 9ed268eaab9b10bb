// That the program makes potentials of meshes and reads .vdb files, settled before main: every command may meet one.

#ifdef ASPERITY_HAS_OPENVDB

#include "asperity/io/vdb/vdb.h"

namespace asperity::program {
namespace {

[[maybe_unused]] const bool registered = [] {
  register_vdb();
  return true;
}();

}  // namespace
}  // namespace asperity::program

#endif
