#pragma once
// What a command is pointed at: a scene file, a built-in scene, or a mesh or volume alone; and the options that change
// it.

#include <optional>
#include <string>

#include "apps/asperity/command.h"
#include "asperity/io/experiment.h"

namespace asperity::program {

/// The scene and what the command line changes in it. Texts are as in scene files ("2mm"); empty: not given.
struct SceneArgument {
  std::string scene = "icosphere-relief";
  std::string relief, height, tile, normal_map, channel, white_is, mapping, magnify;
  std::string units, fit, up;
  std::string implicit;  ///< "256" voxels along the longest side, or a voxel: "0.4mm"
  std::string law, stiffness, damping;
  std::string felt_as;  ///< "mesh", "relief", "implicit": every surface that has a mesh, whatever the scene says
  std::string depth, force, speed;
  std::string device, hand, rate, probe, probe_radius;
  std::string unstated_radius;  ///< the probe's, where neither the scene nor probe_radius says it; empty: the default
};

/// Adds SCENE and the options that change it.
void add_scene_options(Arguments& command, SceneArgument& argument);

/// Reads the scene by writing scene JSON with the changes and giving it to the one reader that there is.
/// `loops`: let an open stroke go there and back, so that energy over closed loops can be told. [main]
Result<Experiment> load_scene(const SceneArgument& argument, const Progress& progress, bool loops = false);

/// The text of a scene file, of a built-in scene, or of a scene made from a mesh or a volume, with the folder its paths
/// start from. [main]
struct SceneText {
  std::string text;
  std::string folder;
  std::string name;  ///< the file's, for messages
};
Result<SceneText> find_scene(const std::string& scene);

/// "icosphere-relief" for the folder of a scene's output; nothing that a file system would object to. [any]
std::string folder_name(const std::string& scene_name);

}  // namespace asperity::program
