#include "asperity/io/scene_json.h"

namespace asperity {

const std::vector<SceneObjectKeys>& scene_object_keys() {
  static const std::vector<SceneObjectKeys> objects{
      {"scene", {"asperity", "name", "summary", "probe", "surfaces", "device", "hand", "stroke", "$schema"}},
      {"probe", {"kind", "radius", "rate", "ideal", "dynamic"}},
      {"ideal probe", {"stiffness_estimate", "bandwidth", "max_depth"}},
      {"dynamic probe", {"force_bandwidth", "reach", "tremor", "seed", "max_substep"}},
      {"device",
       {"profile", "max_force", "max_stiffness", "max_damping", "workspace_radius", "position_resolution", "mass",
        "damping", "friction", "slew_limit", "rate", "admittance"}},
      {"hand", {"preset", "mass", "damping", "stiffness", "lateral_limit"}},
      {"surface",
       {"name", "mesh", "units", "fit", "up", "pose", "sides", "search", "coat", "law", "material", "on_overlap",
        "shell_directions"}},
      {"mesh generator",
       {"generator", "subdivisions", "radius", "mean_edge", "columns", "rows", "largest_fold", "rings", "opening",
        "triangles", "width", "depth", "size", "seed", "roughness", "fold_angles", "grading", "mesostructure"}},
      {"pose", {"position", "orientation", "axis", "angle"}},
      {"coat",
       {"height_map", "channel", "height", "height_range", "offset", "white_is", "magnify", "tile", "repeat", "mapping",
        "wrap", "filter", "normal_map", "green", "normals", "stitching"}},
      {"stitching", {"folds", "rho", "blend"}},
      {"height generator",
       {"generator", "size", "count", "seed", "number", "wall", "width", "flank", "radius", "rim", "field", "overlap",
        "hurst", "octaves"}},
      {"law", {"type", "formulation", "rho", "blend", "edge_taper", "subdivisions", "influence_radius"}},
      {"blend map", {"image", "channel"}},
      {"material", {"stiffness", "damping", "static_friction", "dynamic_friction"}},
      {"stroke",
       {"type",
        "start",
        "end",
        "centre",
        "axis",
        "radius",
        "turns",
        "pitch",
        "rows",
        "points",
        "path",
        "speed",
        "depth",
        "normal_force",
        "approach_height",
        "approach_speed",
        "repeats",
        "back_and_forth",
        "sample_spacing",
        "normal_smoothing"}},
  };
  return objects;
}

}  // namespace asperity
