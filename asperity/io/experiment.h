#pragma once
// An experiment: the scene, the device and hand that touch it, and the stroke they follow. What scene files hold.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "asperity/core/progress.h"
#include "asperity/core/result.h"
#include "asperity/device/hand.h"
#include "asperity/device/ideal_probe.h"
#include "asperity/device/profile.h"
#include "asperity/device/simulated_device.h"
#include "asperity/device/stroke.h"
#include "asperity/render/scene.h"

namespace asperity {

/// Who moves the probe.
enum class ProbeKind {
  ideal,    ///< exactly on its stroke
  dynamic,  ///< a simulated hand holding a simulated device
};
/// As in scene files.
template <>
struct Names<ProbeKind> {
  static constexpr auto table =
      std::to_array<Named<ProbeKind>>({{ProbeKind::ideal, "ideal"}, {ProbeKind::dynamic, "dynamic"}});
};

/// Everything a run needs, read, built and checked. World frame, SI.
struct Experiment {
  std::string name;
  Scene scene;
  ProbeKind probe = ProbeKind::ideal;
  DeviceProfile device;  ///< limits of the safety stage; mechanics when the probe is dynamic
  HandImpedance hand;
  IdealProbeSettings ideal;
  SimulatedDeviceSettings simulated;
  double rate = 1000.0;  ///< Hz
  StrokeSettings stroke;
  StrokePath path;
  /// What was decided for the user and should be said: units assumed, fit applied, sides chosen, maps that disagree.
  std::vector<std::string> notes;
  /// The scene file with every default filled in and every path absolute: what a trace stores, so that it replays
  /// alone.
  std::string canonical_json;
};

/// Reads a scene file (JSON, docs/scene.md). Paths in it are relative to it. Errors name file, key and what
/// would be accepted; unknown keys are errors that suggest the nearest known one. [build]
Result<Experiment> read_experiment(const std::filesystem::path& file, const Progress& progress = {});
/// The same from text; `folder` is what relative paths start from, `name` stands for the file in messages. [build]
Result<Experiment> parse_experiment(std::string_view json, const std::filesystem::path& folder, const std::string& name,
                                    const Progress& progress = {});

/// Names of the built-in scenes, with one line on each, in the order they are listed to people. [any]
struct BuiltinScene {
  std::string name;
  std::string summary;
};
const std::vector<BuiltinScene>& builtin_scenes();
/// The JSON text of a built-in scene. Errors: bad_value with the nearest name. [any]
Result<std::string> builtin_scene_json(std::string_view name);

/// The JSON Schema (draft 7) of scene files, made from the table that they are read by. [any]
std::string scene_schema_json();
/// The reference page of scene files in Markdown, from the same table: docs/scene.md. [any]
std::string scene_page();
/// What a key of scene files is: "stroke.speed", "surfaces.coat.height", or a kind of object ("coat", "coat.height").
/// Errors: bad_value with the nearest path. [any]
Result<std::string> scene_key_help(std::string_view path);

/// A copy of `experiment` in which every surface is felt by `law`. Errors: unsupported_pair. [build]
Result<Experiment> with_law(const Experiment& experiment, const Law& law);

}  // namespace asperity
