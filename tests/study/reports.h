#pragma once
// Reports of real runs on small scenes, for the tests of their pages.

#include "asperity/render/law_registry.h"
#include "asperity/study/report.h"
#include "tests/render/volumes.h"
#include "tests/study/synthetic.h"

namespace asperity::synthetic {

inline ReportOrigin origin(const std::string& title) {
  return {title,     "asperity run sheet --seed 1", "a machine", "21 November 2026", "asperity 0.1.0", {"a warning"},
          {"a note"}};
}

inline RunReport run_report(const std::string& title, bool with_picture = false) {
  const StrokePath path = line_path();
  const Scene scene =
      relief_scene({MesostructureKind::rings, 128, 1e-3, 8, 1}, HeightFieldLaw{}, Reconstruction::quadratic_bspline);
  const auto records = rendered_along(path, scene);
  RunReport report;
  report.origin = origin(title);
  report.law = "height-field";
  report.setup = {{"Device", "omega.7"}, {"Stroke", "line"}};
  report.series = derive_series(records, scene, path);
  report.metrics = measure_run(records, report.series, path);
  if (with_picture) {
    PictureSettings settings;
    settings.width = 240;
    settings.height = 160;
    report.picture = render_picture(scene, path, records, settings).value();
  }
  return report;
}

/// The laws that can be felt on a relief.
inline std::vector<std::string> relief_laws() {
  std::vector<std::string> names;
  for (const std::string& name : law_names()) {
    if (law_by_name(name)->facts().needs < LawNeeds::field) names.push_back(name);
  }
  return names;
}

inline CompareReport compare_report(const std::string& title) {
  const StrokePath path = line_path();
  CompareReport report;
  report.origin = origin(title);
  for (const std::string& name : relief_laws()) {
    const Scene scene = relief_scene({MesostructureKind::rings, 128, 1e-3, 8, 1}, law_by_name(name).value(),
                                     Reconstruction::quadratic_bspline);
    const auto records = rendered_along(path, scene);
    CompareEntry entry;
    entry.law = name;
    entry.series = derive_series(records, scene, path);
    entry.metrics = measure_run(records, entry.series, path);
    report.entries.push_back(std::move(entry));
  }
  return report;
}

/// The sheet's plane z = 0 as an isosurface, low values under it.
inline Scene volume_scene(const Law& law) {
  return scene_of(
      volumes::surface_of(volumes::sampled(volumes::cube(0.03, 13), [](const Vec3& p) { return 100.0 * p.z(); }), 0.0),
      law);
}

/// Laws of volumes on one isosurface.
inline CompareReport volume_report(const std::string& title) {
  const StrokePath path = line_path();
  CompareReport report;
  report.origin = origin(title);
  std::vector<Scene> scenes;
  for (const char* name : {"avila", "cross-uncross", "proxy"}) {
    const Scene& scene = scenes.emplace_back(volume_scene(law_by_name(name).value()));
    const auto records = rendered_along(path, scene);
    CompareEntry entry;
    entry.law = name;
    entry.series = derive_series(records, scene, path);
    entry.metrics = measure_run(records, entry.series, path);
    report.entries.push_back(std::move(entry));
  }
  DetectionSettings settings;
  settings.passages = 50;
  report.detection = detection_table(scenes, path, settings).value();
  return report;
}

}  // namespace asperity::synthetic
