#pragma once
// A folder with small meshes and maps for scenes to read, and a short run of an experiment.

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>

#include "asperity/geometry/generators.h"
#include "asperity/io/experiment.h"
#include "asperity/io/image_io.h"
#include "asperity/io/mesh_io.h"
#include "asperity/io/trace_file.h"
#include "asperity/render/step.h"
#include "asperity/servo/session.h"

namespace asperity {

class ExperimentTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ =
        std::filesystem::temp_directory_path() / ("asperity-" + std::to_string(::getpid()) + "-" +
                                                  ::testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::create_directories(folder_);
    // OBJ files carry texture coordinates, PLY files of a sphere here do not.
    MeshSource sphere = icosphere(2, 3.0);
    sphere.corner_uvs.clear();
    ASSERT_TRUE(write_ply(folder_ / "sphere.ply", sphere).ok());
    ASSERT_TRUE(write_obj(folder_ / "sheet.obj", plane_grid(2.0, 1.0, 4, 2)).ok());
    ASSERT_TRUE(write_png(folder_ / "map.png", ramp(16, 8)).ok());
    ASSERT_TRUE(write_png(folder_ / "normal.png", flat_normals(16, 8)).ok());
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  /// Grey from black (left) to white (right).
  static Image ramp(int width, int height) {
    Image image{width, height, 1, 16, {}};
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) image.samples.push_back(static_cast<std::uint16_t>(65535 * x / (width - 1)));
    }
    return image;
  }
  static Image flat_normals(int width, int height) {
    Image image{width, height, 3, 8, {}};
    for (int i = 0; i < width * height; ++i) image.samples.insert(image.samples.end(), {128, 128, 255});
    return image;
  }

  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }
  [[nodiscard]] Result<Experiment> parse(const std::string& json) const {
    return parse_experiment(json, folder_, "scene.json");
  }
  /// A scene that is expected to be good.
  [[nodiscard]] Experiment good(const std::string& json) const {
    Result<Experiment> experiment = parse(json);
    if (!experiment) throw std::runtime_error(experiment.error().message());
    return std::move(*experiment);
  }

  [[nodiscard]] static const Coat& coat_of(const Experiment& experiment) {
    return (*std::get_if<std::shared_ptr<const ReliefSurface>>(&experiment.scene.instances()[0].surface))->coat();
  }
  [[nodiscard]] static bool has_note(const Experiment& experiment, const std::string& part) {
    for (const std::string& note : experiment.notes) {
      if (note.find(part) != std::string::npos) return true;
    }
    return false;
  }
  /// Hash of the forces of at most `ticks` ticks with the ideal probe.
  static std::uint64_t short_run(const Experiment& experiment, std::uint64_t ticks) {
    Result<IdealProbe> probe = IdealProbe::build(experiment.path, experiment.ideal);
    Result<SafetyStage> safety = SafetyStage::build(SafetySettings::from_profile(experiment.device));
    EXPECT_TRUE(probe.ok() && safety.ok());
    ProxyState state;
    ProxyCache cache;
    ForceHash hash;
    SessionSettings settings;
    settings.dt = Seconds(1.0 / experiment.rate);
    settings.max_ticks = ticks;
    run_session([&](const ProbeSample& p, Seconds dt) { return step(experiment.scene, state, cache, p, dt); }, *probe,
                *safety, settings, [&](const TraceRecord& record) { hash.add(record); });
    return hash.value();
  }

  std::filesystem::path folder_;
};

}  // namespace asperity
