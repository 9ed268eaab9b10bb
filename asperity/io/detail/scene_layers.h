#pragma once
// What a coat has beside its heights: levels of detail, further layers, maps of the material. Internal to io.

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "asperity/io/detail/scene_reader.h"
#include "asperity/surface/coat.h"

namespace asperity {

/// The coat that layers and maps lie on.
struct LayerHost {
  double mean_edge = 0.0;    ///< m, of the mesh: heights may be shares of it
  bool triplanar = false;    ///< by tile, not by repeat
  Vec2 tile = Vec2::Ones();  ///< m, of the coat's own map
  Wrap wrap = Wrap::repeat;
  std::optional<DetailSettings> detail;
};

/// Reads `detail` of a coat: a kind, or an object. [build]
Result<std::optional<DetailSettings>> read_detail(ObjectReader& coat);
/// A mesostructure with levels of detail. [build]
Result<Mesostructure> with_detail(Mesostructure maps, const DetailSettings& detail, const std::string& place);
/// Reads `layers` of a coat. [build]
Result<std::vector<CoatLayer>> read_layers(ObjectReader& coat, const LayerHost& host, SceneContext& context);
/// Reads `maps` of a coat; nullptr where there are none. [build]
Result<std::shared_ptr<const MaterialMaps>> read_material_maps(ObjectReader& coat, const LayerHost& host,
                                                               SceneContext& context);

/// Whether this is a glTF file whose materials can be felt. [build]
bool has_gltf_materials(const std::filesystem::path& path);
/// The coat that they make; `source` is what `mesh` was built from, `scale` what the model was scaled by. [build]
Result<CoatSource> gltf_coat(const std::filesystem::path& path, const MeshSource& source, const TriangleMesh& mesh,
                             const Material& own, const Stitching& stitching, double scale, SceneContext& context);

}  // namespace asperity
