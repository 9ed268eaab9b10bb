#include "asperity/render/laws/normal_map_use.h"

namespace asperity {

Status check_normal_map(NormalMapUse use, Formulation formulation) {
  if (formulation == Formulation::consistent || use == NormalMapUse::automatic) return success();
  return refused(ErrorCode::mismatch, "is for the consistent form: as printed, normals are used as the paper says",
                 "normal_map", "the law without \"-literal\"");
}

}  // namespace asperity
