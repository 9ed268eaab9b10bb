#include "asperity/render/laws/generated_geometry.h"

#include "asperity/core/option.h"

namespace asperity {

void GeneratedGeometryLaw::options(std::vector<Option>& rows) {
  using L = GeneratedGeometryLaw;
  rows.push_back(option("subdivisions", &L::subdivisions, OptionType::integer(1, most_subdivisions),
                        "cuts along each edge of a base triangle."));
  rows.push_back(option("influence_radius", &L::influence_radius,
                        OptionType::quantity(Dimension::length, Range::positive()),
                        "distance around the proxy within which triangles are made.")
                     .or_else("one and a half of their edges"));
}

}  // namespace asperity
