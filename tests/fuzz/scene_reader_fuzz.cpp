// What no text may do to the scene reader: crash, throw, answer a scene that cannot be touched, or an error that says
// nothing. Scenes use generators alone, so that the fuzzer cannot ask for files; large ones are left out for time.

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "asperity/io/experiment.h"
#include "asperity/render/step.h"
#include "tests/fuzz/fuzz_driver.h"

namespace {

void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "broken: %s\n", what);
  std::abort();
}

/// Sizes that would take seconds: legal, but no use here.
bool takes_long(const nlohmann::json& json) {
  if (json.is_number()) return json.get<double>() > 100.0;
  if (json.is_object() && json.contains("subdivisions") && json["subdivisions"].is_number() &&
      json["subdivisions"].get<double>() > 3.0)
    return true;
  if (!json.is_structured()) return false;
  for (const auto& item : json) {
    if (takes_long(item)) return true;
  }
  return json.size() > 64;
}

void touch(const asperity::Experiment& experiment) {
  asperity::ProxyState state;
  for (int tick = 0; tick < 20; ++tick) {
    asperity::ProbeSample probe;
    const double time = experiment.path.duration().count() * tick / 20.0;
    probe.pose.position = experiment.path.pose(asperity::Seconds(time)).target;
    const asperity::ForceSample force = asperity::step(experiment.scene, state, probe, asperity::Seconds(1e-3));
    require(force.wrench.force.allFinite() || !probe.pose.position.allFinite(), "forces are finite");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  const nlohmann::json json = nlohmann::json::parse(text, nullptr, false);
  if (!json.is_discarded() && takes_long(json)) return 0;
  static const std::filesystem::path nowhere = "/nonexistent";
  const auto experiment = asperity::parse_experiment(text, nowhere, "fuzz.json");
  if (!experiment) {
    require(!experiment.error().what.empty() && !experiment.error().file.empty(), "an error names its cause and file");
    return 0;
  }
  touch(*experiment);
  const auto again = asperity::parse_experiment(experiment->canonical_json, nowhere, "canonical.json");
  require(again.ok(), "the canonical copy can be read");
  require(again->canonical_json == experiment->canonical_json, "the canonical copy is its own canonical copy");
  return 0;
}

#ifndef ASPERITY_FUZZ_WITHOUT_MAIN

namespace {

std::vector<std::string> corpus() {
  return {
      R"({"surfaces":[{"mesh":{"generator":"box"}}]})",
      R"({"asperity":1,"name":"a","summary":"b","surfaces":[{"name":"s","mesh":{"generator":"icosphere","subdivisions":1,"radius":"40 mm"},
        "fit":"workspace","up":"-z","pose":{"position":["1mm",0,0],"axis":[0,1,0],"angle":"10 deg"},"sides":"front","search":"octree",
        "material":{"stiffness":"0.5 N/mm","damping":0.5}}],"device":{"profile":"falcon","max_force":"6 N"},"hand":{"preset":"firm","mass":"300 g"},
        "probe":{"kind":"dynamic","radius":"1mm","rate":"0.2kHz","ideal":{"bandwidth":10},"dynamic":{"tremor":"20um","seed":9}},
        "stroke":{"type":"spiral","centre":["50%","100%","50%"],"radius":"20%","turns":2,"normal_force":"1 N","speed":"15mm/s"}})",
      R"({"surfaces":[{"mesh":{"generator":"M_a","columns":2,"rows":2},"coat":{"height_map":{"generator":"H_1","size":16,"count":4},
        "height":"10%","offset":"-1mm","mapping":"per_face","repeat":[1,2],"filter":"bilinear","wrap":"clamp","magnify":1.5},
        "law":{"type":"mesostructure","formulation":"literal","rho":0.1,"blend":[0,0.5,1]}}],"stroke":{"type":"raster","rows":2,"pitch":0}})",
      R"({"surfaces":[{"mesh":{"generator":"random","seed":3,"subdivisions":1,"roughness":0.3},"coat":{"height_map":{"generator":"H_4","size":16,"seed":2},
        "height":"1mm","tile":["10mm",0.02],"mapping":"triplanar"},"law":{"type":"height-field","edge_taper":0.1}}],
        "stroke":{"type":"polyline","points":[["0%","100%","0%"],["100%","100%","0%"]],"back_and_forth":true,"repeats":2}})",
      R"({"surfaces":[{"mesh":{"generator":"M_e","rings":2,"opening":"80 deg","mean_edge":"10mm"},"law":"force-shading"},
        {"mesh":{"generator":"plane","width":0.1,"depth":"10cm","triangles":8},"pose":{"orientation":[1,0.1,0,0]}}],"stroke":{"type":"circle"}})",
      R"({"surfaces":[{"parametric":{"shape":"vase","radius":"30 mm","height":"90 mm","neck":0.4},"up":"z",
        "texture":{"features":{"type":"grating","amplitude":"0.2 mm","count":42},"mapping":{"surface":"cylinder","radius":"30 mm"},
        "as":"texture","formulation":"literal"},"material":{"static_friction":0.5,"friction":{"law":"karnopp","break_away":"0.4 N",
        "stick_speed":"5 mm/s"},"lay":{"still_ratio":1,"sliding_ratio":"0 %","direction":"90 deg"}}}]})",
      R"({"surfaces":[{"mesh":{"generator":"plane","width":0.06,"depth":0.04,"triangles":8},"texture":{"features":[
        {"type":"grating","amplitude":"0.2 um","wavelength":"3 um"},{"type":"serrated","amplitude":"40 um","wavelength":"1 mm","wall":0.1},
        {"type":"grid","amplitude":"0.2 mm","wavelength":["6 mm","8 mm"]},{"type":"map","height_map":{"generator":"H_1","size":16,"count":4},
        "height":"0.1 mm","wavelength":"20 mm","as":"texture"}],"mapping":{"axis":[0,1,0]}},"material":{"friction":"dahl",
        "friction_map":{"image":{"generator":"H_2","size":16},"low":0.5,"tile":"10 mm"}}}]})",
      R"({"surfaces":[{"parametric":{"shape":"torus","radius":0.03,"tube":0.01},"texture":{"features":[{"type":"noise",
        "roughness":"10 um","correlation_length":"2 mm","period":0,"as":"friction"}],"mapping":{"surface":"plane"}}}]})",
  };
}

}  // namespace

int main(int argc, char** argv) {
  return asperity::fuzz::run(argc, argv, "scene", corpus());
}

#endif
