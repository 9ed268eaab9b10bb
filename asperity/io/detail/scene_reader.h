#pragma once
// The parts of a scene file, one function each. Internal to io: experiment.cpp puts them together.

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "asperity/core/progress.h"
#include "asperity/device/hand.h"
#include "asperity/device/ideal_probe.h"
#include "asperity/device/profile.h"
#include "asperity/device/simulated_device.h"
#include "asperity/device/stroke.h"
#include "asperity/io/detail/file_reading.h"
#include "asperity/io/detail/scene_json.h"
#include "asperity/render/scene.h"

namespace asperity {

/// A volume of a scene, placed and scaled to metres.
struct VolumePart {
  std::shared_ptr<const ScalarField> field;
  std::string name;  ///< what the surface is called unless the scene says otherwise
};

/// A volume, and the words that it was asked for with.
struct SharedVolume {
  std::string key;
  VolumePart part;
  SceneJson canonical;  ///< `volume`, `units` and `fit`
};

/// What the parts of a scene need to know of one another.
struct SceneContext {
  std::filesystem::path folder;  ///< what relative paths start from
  DeviceProfile device;
  Progress progress;
  std::vector<std::string> notes;
  std::vector<SharedVolume> volumes;  ///< read so far: entries that say the same share one
  double probe_radius = 0.0;          ///< m; where the scene does not say, what it is where every law takes a ball

  void note(std::string text) { notes.push_back(std::move(text)); }
  /// `name` as an absolute path, relative ones from `folder`.
  [[nodiscard]] std::filesystem::path resolve(const std::string& name) const;
};

/// What was read, and how it stands in the canonical copy.
template <class T>
struct ScenePart {
  T value;
  SceneJson canonical;
};

/// Text (a built-in profile) or object (a profile with changes). [build]
Result<ScenePart<DeviceProfile>> read_device(const SceneJson& json, const std::string& place);
/// Text (a preset) or object. [build]
Result<ScenePart<HandImpedance>> read_hand(const SceneJson& json, const std::string& place);

/// Of a probe whose radius a scene does not say, where all of it can be felt by a ball (m).
inline constexpr double default_probe_radius = 0.5e-3;

/// The scene's `probe` object.
struct ProbeSettings {
  bool dynamic = false;
  double radius = 0.0;             ///< m
  double tip = 0.0;                ///< m: of the ball whose path a point follows on coats with levels of detail
  double tool_length = 0.0;        ///< m: from the tip to where the hand holds it; 0: no torque
  Vec3 tool_axis = Vec3::UnitY();  ///< the way there in the probe's own frame, unit
  double rate = 1000.0;            ///< Hz
  IdealProbeSettings ideal;
  SimulatedDeviceSettings simulated;
};
/// `stiffness`: of what is touched (N/m), the default estimate of the ideal probe's regulator. [build]
Result<ScenePart<ProbeSettings>> read_probe(const SceneJson* json, const std::string& place,
                                            const DeviceProfile& device, double stiffness);

/// Text (a law's name) or object. [build]
Result<ScenePart<Law>> read_law(const SceneJson& json, const std::string& place, const SceneContext& context);
/// A law as scene files write it; reads back as the same law. A blend map is written as its values. [build]
SceneJson law_json(const Law& law);

/// A coat's `stitching` object. Writes its canonical copy into `coat`. [build]
Result<Stitching> read_stitching(const SceneJson& json, const std::string& place, const SceneContext& context,
                                 ObjectReader& coat);

/// A mesh before it is built: placed, scaled, its axis turned up. [build]
struct MeshPart {
  MeshSource source;  ///< m
  std::string name;   ///< what the surface is called unless the scene says otherwise
  bool from_file = false;
  // Where the source's own positions went: turned up, scale (p - centre).
  double scale = 1.0;
  Vec3 centre = Vec3::Zero();
  bool turned = false;
};
/// Reads `mesh`, `units`, `fit` and `up` of a surface. Sets an error in `surface` or answers one. [build]
Result<MeshPart> read_mesh_part(ObjectReader& surface, SceneContext& context);

/// A point whose axis `up` (x, y, z, -x, -y, -z) is turned to +y. [build]
Vec3 turned_up(const Vec3& p, std::size_t up);
/// Reads `up`; `fallback` is its position among x, y, z, -x, -y, -z. [build]
std::size_t read_up(ObjectReader& surface, std::size_t fallback);

/// Welds, cleans and validates it, with its notes; its errors name the file. [build]
Result<TriangleMesh> build_mesh(MeshPart part, const ObjectReader& surface, SceneContext& context);

/// The `units` of a file, in metres; refused for what is generated. [build]
double read_units(ObjectReader& object, bool from_file);
/// The largest extent that `fit` asks for (m); 0: as it is. `by_default`: to the workspace. [build]
double read_fit(ObjectReader& object, bool by_default, const SceneContext& context);
/// Says that `what` was scaled to `extent` (m) though nobody asked for it. [build]
void note_fit(const std::string& what, double scale, const Vec3& extent, SceneContext& context);
/// Reads `pose` of a surface or an effect and writes its canonical copy. [build]
Result<Pose> read_pose(ObjectReader& object);

/// Reads `volume`, `units` and `fit` of a surface or an effect. [build]
Result<VolumePart> read_volume_part(ObjectReader& object, SceneContext& context);
/// Reads `iso` of a surface with this volume. [build]
Result<std::shared_ptr<const IsoSurface>> read_iso(ObjectReader& surface, const VolumePart& volume,
                                                   SceneContext& context);
/// Reads the scene's `effects`, none where there are none; their canonical copies go into `canonical`. [build]
Result<std::vector<FieldEffect>> read_effects(ObjectReader& root, SceneContext& context, SceneJson& canonical);

/// A size in bytes, or as text ("64 MB"). [build]
std::size_t read_bytes(ObjectReader& reader, std::string_view key, std::size_t fallback);

/// How an implicit surface will be felt: what its bands have to reach for.
struct ImplicitFeel {
  Law law = ProxyLaw{};
  Material material;
  double probe_radius = 0.0;  ///< m
};
/// Reads `implicit` of a surface, its mesh and coat where it has them. [build]
Status read_implicit(ObjectReader& surface, const ImplicitFeel& feel, SceneContext& context, Instance& instance);

/// Mean length (m) of one unit of the mesh's texture coordinates; its mean edge where it has none. [any]
double texture_unit(const TriangleMesh& mesh);
/// What a coat is made of before it lies on its mesh.
struct CoatSource {
  CoatParts parts;
  CoatSettings settings;
};
/// What the coat of `mesh` is made of. `object`: "coat", or "mesostructure", of which heights alone are read. [build]
Result<ScenePart<CoatSource>> read_coat(const SceneJson& json, const std::string& place, const TriangleMesh& mesh,
                                        SceneContext& context, std::string_view object = "coat");

/// One entry of `surfaces`. [build]
Result<ScenePart<Instance>> read_surface(const SceneJson& json, const std::string& place, SceneContext& context);

/// Reads `axis` and `angle`, no turn where there is neither. [build]
Quat read_turn(ObjectReader& reader);
/// Reads `motion` of a surface. [build]
Result<Motion> read_motion(ObjectReader& surface);
/// Reads the scene's `view`; `bounds` of the base meshes (m, world), for defaults. [build]
Result<View> read_view(ObjectReader& root, const Box& bounds);
/// Reads the scene's `change`. [build]
Status read_change(ObjectReader& root, SceneSettings& settings);

/// `bounds`: of the base meshes (m, world), for defaults and percentages. [build]
Result<ScenePart<StrokeSettings>> read_stroke(const SceneJson* json, const std::string& place, const Box& bounds,
                                              const SceneContext& context);
/// A stroke whose place the scene does not say: as the default has it where that is in contact for a quarter of its
/// way, else over whichever side of the bounds it touches most of; with a note. `stroke` becomes what is laid. Errors:
/// those of build_stroke, of the default. [build]
Result<StrokePath> lay_default_stroke(const Scene& scene, const ProbeSettings& probe, const Box& bounds,
                                      const SurfaceProjector& project, ScenePart<StrokeSettings>& stroke,
                                      SceneContext& context);

}  // namespace asperity
