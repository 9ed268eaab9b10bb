#include "apps/asperity/feel.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "asperity/study/renderability.h"

namespace asperity::program {
namespace {

void amplitude_line(const Coat& coat, const Experiment& experiment, double stiffness, std::vector<std::string>& lines) {
  const double range = coat.highest() - coat.lowest();
  const double force = range * stiffness;
  const double least = noticed_force / stiffness;
  if (range == 0.0) {
    lines.push_back("the coat has no relief: it feels like the bare mesh");
  } else if (force < noticed_force) {
    lines.push_back(
        fmt::format("the relief of {} changes the force by {:.3g} N at {:g} N/mm, less than the {:g} N that are "
                    "noticed: magnify it {:.0f} times or more",
                    format_length(range), force, stiffness * 1e-3, noticed_force, std::ceil(least / range)));
  } else {
    lines.push_back(fmt::format(
        "the relief of {} changes the force by {:.3g} N at {:g} N/mm; heights of {} are just noticed ({:g} N)",
        format_length(range), force, stiffness * 1e-3, format_length(least), noticed_force));
  }
  if (range > 0.0 && force > experiment.device.max_force) {
    lines.push_back(fmt::format("the full relief asks for more than the {:g} N of {}", experiment.device.max_force,
                                experiment.device.name));
  }
}

/// What of features laid on a formula can be felt.
void parametric_lines(const ParametricSurface& surface, double force, double stiffness,
                      std::vector<std::string>& lines) {
  if (surface.settings().features.empty()) {
    lines.push_back("no features in its geometry: the shape alone constrains");
    return;
  }
  const double range = surface.limits().highest - surface.limits().lowest;
  lines.push_back(
      fmt::format("features of up to {} in its geometry change the force by up to {:.3g} N at {:g} N/mm; "
                  "{:g} N are just noticed",
                  format_length(range), range * stiffness, stiffness * 1e-3, noticed_force));
  const double bend = std::max(0.0, -surface.limits().lowest) + force / stiffness;
  lines.push_back(
      fmt::format("the contact is {} deep at {:.3g} N, {} with the features' own depth; the surface is "
                  "followed in strides of {}",
                  format_length(force / stiffness), force, format_length(bend), format_length(surface.stride())));
}

/// What the voxels and the stored band let through.
void potential_lines(const ImplicitSurface& surface, const Instance& instance, double force,
                     std::vector<std::string>& lines) {
  const double voxel = surface.grid().voxel();
  lines.push_back(
      fmt::format("edges are rounded within about {}; texture is felt to its full height from waves of {} on "
                  "(6 voxels)",
                  format_length(1.5 * voxel), format_length(6.0 * voxel)));
  if (instance.law.constrains()) return;
  const double depth = force / instance.material.stiffness;
  if (depth > surface.trusted_depth()) {
    lines.push_back(
        fmt::format("the stroke presses {} deep, and the potential is stored {} inside: from there on the "
                    "force no longer rises (implicit.band_inside)",
                    format_length(depth), format_length(-surface.grid().inside())));
  }
  lines.push_back(
      fmt::format("parts thinner than {} let this law's probe through at {:.3g} N (an offset, or the law "
                  "\"proxy\", holds it)",
                  format_length(2.0 * depth), force));
}

}  // namespace

double stroke_force(const Experiment& experiment, double stiffness) {
  const StrokeSettings& stroke = experiment.stroke;
  return stroke.press == PressMode::force ? stroke.normal_force : stiffness * std::max(0.0, stroke.depth);
}

std::vector<std::string> feel_of(const Experiment& experiment, const Instance& instance) {
  std::vector<std::string> lines;
  const double stiffness = instance.material.stiffness;
  const DeviceProfile& device = experiment.device;
  if (stiffness > device.max_stiffness) {
    lines.push_back(fmt::format("{:g} N/m is stiffer than the {:g} N/m recommended for {}: it may buzz", stiffness,
                                device.max_stiffness, device.name));
  } else {
    lines.push_back(fmt::format("{:g} N/m is within the {:g} N/m of {}", stiffness, device.max_stiffness, device.name));
  }
  const double force = stroke_force(experiment, stiffness);
  if (force > device.max_force) {
    lines.push_back(fmt::format("the stroke presses with {:.3g} N, more than the {:g} N of {}: the force is cut", force,
                                device.max_force, device.name));
  }
  if (const auto* relief = std::get_if<std::shared_ptr<const ReliefSurface>>(&instance.surface)) {
    const Coat& coat = (*relief)->coat();
    amplitude_line(coat, experiment, stiffness, lines);
  } else if (const ImplicitSurface* implicit = implicit_of(instance.surface)) {
    potential_lines(*implicit, instance, force, lines);
  } else if (const IsoSurface* iso = iso_of(instance.surface)) {
    lines.push_back(fmt::format("the isosurface has no detail below its cells of {}",
                                format_length(iso->field().narrowest_cell())));
  } else if (parametric_of(instance.surface) != nullptr) {
    parametric_lines(*parametric_of(instance.surface), force, stiffness, lines);
  } else {
    lines.push_back("no coat: the shape alone is felt");
  }
  return lines;
}

}  // namespace asperity::program
