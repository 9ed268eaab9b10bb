#pragma once
// Fine features of a scene's surface: friction laws, textures, and features that become geometry. Internal to io.

#include <memory>
#include <string>
#include <vector>

#include "asperity/device/stroke.h"
#include "asperity/field/mesostructure/mesostructure.h"
#include "asperity/io/detail/scene_reader.h"

namespace asperity {

/// What a material says beside its numbers.
struct FinePart {
  bool lay_given = false;
  FrictionLay lay;
  FrictionMap friction_map;
};
/// Reads `friction`, `lay` and `friction_map` of a material. [build]
Result<FinePart> read_friction(ObjectReader& material, SceneContext& context, Material& into);
/// Says where a material's friction can never resist, and where its law does not read a coefficient that it has.
/// [build]
void note_friction(const Instance& instance, const FinePart& part, SceneContext& context);

/// What features are laid on.
struct TextureHost {
  std::string name;
  Box bounds;                                     ///< m, object frame
  const TriangleMesh* mesh = nullptr;             ///< whose texture coordinates the mapping "uv" takes, or nullptr
  const ParametricSurface* parametric = nullptr;  ///< whose parameters it takes, or nullptr
  /// What it is, where features cannot become part of its geometry ("a volume"); empty: they can.
  std::string rigid;
};

/// A surface's features by what they are felt as.
struct TexturePart {
  bool given = false;                    ///< the surface has the key `texture`
  FineSettings fine;                     ///< friction and texture
  std::vector<SurfaceFeature> geometry;  ///< to become part of the surface
};
/// Reads `texture` of a surface; without one answers the mapping that maps of friction go by. [build]
Result<TexturePart> read_texture(ObjectReader& surface, const TextureHost& host, const Law& law, SceneContext& context);
/// Gives an instance what is felt of it beside its geometry, where there is anything. [build]
Status attach_fine(const ObjectReader& surface, TexturePart texture, const FinePart& material,
                   const SceneContext& context, Instance& instance);

/// Features as a mesostructure, and the mesh that wears it by its texture coordinates.
struct BakedFeatures {
  TriangleMesh mesh;
  std::shared_ptr<const Mesostructure> maps;
};
/// Errors: too_large, mismatch. [build]
Result<BakedFeatures> bake_features(const TriangleMesh& mesh, const std::vector<SurfaceFeature>& features,
                                    const FeatureMapping& mapping, const std::string& place);

/// Reads `parametric` of a surface, its `up`, `sides` and texture. [build]
Status read_parametric(ObjectReader& surface, const Law& law, SceneContext& context, Instance& instance,
                       TexturePart& texture);

/// What can be felt of an instance's textures along a stroke: levels and samples a wavelength, and whether they fade.
/// `speed`: along the surface (m/s); `rate`: force updates a second. [build]
void note_rendering(const Instance& instance, const StrokePath& path, double speed, double rate, SceneContext& context);

}  // namespace asperity
