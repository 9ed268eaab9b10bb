#include "asperity/render/laws/dense_mesh.h"

#include "asperity/core/option.h"
#include "asperity/render/laws/generated_geometry.h"

namespace asperity {

void DenseMeshLaw::options(std::vector<Option>& rows) {
  rows.push_back(option("subdivisions", &DenseMeshLaw::subdivisions,
                        OptionType::integer(1, GeneratedGeometryLaw::most_subdivisions),
                        "cuts along each edge of a base triangle; at most 4,194,304 triangles in all.")
                     .or_else("triangles of a texel, or coarser ones if those are too many")
                     .by_contents("more triangles than it may make"));
}

}  // namespace asperity
