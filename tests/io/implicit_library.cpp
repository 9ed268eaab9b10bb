// That these tests make potentials of meshes where the library for it is there, as the program does.

#ifdef ASPERITY_HAS_OPENVDB

#include "asperity/io/vdb/vdb.h"

namespace asperity {
namespace {

[[maybe_unused]] const bool registered = [] {
  register_vdb();
  return true;
}();

}  // namespace
}  // namespace asperity

#endif
