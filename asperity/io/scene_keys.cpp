#include <iterator>
#include <sstream>

#include "asperity/io/detail/scene_json.h"

namespace asperity {
namespace {

std::vector<std::string> words(const char* text) {
  std::istringstream stream(text);
  return {std::istream_iterator<std::string>(stream), {}};
}

}  // namespace

const std::vector<SceneObjectKeys>& scene_object_keys() {
  static const std::vector<SceneObjectKeys> objects{
      {"scene", words("asperity name summary probe surfaces effects device hand stroke $schema view change")},
      {"probe", words("kind radius rate ideal dynamic tip")},
      {"ideal probe", words("stiffness_estimate bandwidth max_depth")},
      {"dynamic probe", words("force_bandwidth reach tremor seed max_substep")},
      {"device", words("profile max_force max_stiffness max_damping workspace_radius position_resolution mass damping"
                       " friction slew_limit rate admittance")},
      {"hand", words("preset mass damping stiffness lateral_limit")},
      {"surface",
       words("name mesh parametric custom volume iso implicit units fit up pose sides search coat texture law"
             " material on_overlap shell_directions motion")},
      {"parametric", words("shape width depth radius tube height neck scale")},
      {"texture", words("features mapping as formulation source")},
      {"feature",
       words("type as amplitude wavelength count direction phase centre wall roughness correlation_length seed"
             " period height_map channel height height_range offset white_is filter average_roughness")},
      {"feature mapping", words("surface origin axis reference radius half_extent tile")},
      {"mesh generator",
       words("generator subdivisions radius mean_edge columns rows largest_fold rings opening triangles width"
             " depth size seed roughness fold_angles grading mesostructure")},
      {"pose", words("position orientation axis angle")},
      {"coat", words("height_map channel height height_range offset white_is magnify tile repeat mapping wrap filter"
                     " normal_map green normals stitching detail layers maps closing from")},
      {"detail", words("kind finest levels")},
      {"layer", words("height_map channel height height_range offset white_is filter repeat tile solid amplitude"
                      " wavelength direction centre phase frequency drift octaves persistence seed")},
      {"material maps", words("stiffness damping viscosity friction magnetism stickiness lay")},
      {"material map", words("image channel low high")},
      {"lay map", words("image")},
      {"closing", words("radius texels")},
      {"library relief", words("library size seed")},
      {"motion", words("velocity angular_velocity since horizon")},
      {"view", words("zoom focus home camera axis angle")},
      {"camera", words("eye target field_of_view pixels")},
      {"change", words("handover power level_rate")},
      {"stitching", words("folds rho blend fillet_radius")},
      {"height generator",
       words("generator size count seed number wall width flank radius rim field overlap hurst octaves")},
      {"volume", words("file array component association time resample derive reconstruction residency generator size"
                       " extent stretch radius wavelength thickness amplitude gradient count speed strength type")},
      {"iso", words("threshold inside threshold_speed")},
      {"implicit",
       words("file grid voxel resolution budget band_outside band_inside inside shell_thickness reconstruction"
             " offset texture redistance materials")},
      {"implicit texture", words("type amplitude wavelength seed")},
      {"material brush", words("centre radius falloff stiffness damping static_friction dynamic_friction roughness")},
      {"effect", words("name volume units fit pose type transfer direction value largest_force formulation")},
      {"law", words("type formulation rho blend edge_taper subdivisions influence_radius band largest_force retarding"
                    " reach magnitude depth_gain offset test_neighbours")},
      {"blend map", words("image channel")},
      {"material",
       words("stiffness damping static_friction dynamic_friction friction lay friction_map viscosity magnetism"
             " magnetic_band stickiness")},
      {"friction", words("law formulation stiffness damping viscosity break_away stick_speed stribeck_speed exponent"
                         " adhesion")},
      {"lay", words("still_ratio sliding_ratio formulation direction")},
      {"friction map", words("image channel low high tile")},
      {"stroke", words("type start end centre axis radius turns pitch rows points path speed depth normal_force"
                       " approach_height approach_speed repeats back_and_forth sample_spacing normal_smoothing")},
  };
  return objects;
}

}  // namespace asperity
