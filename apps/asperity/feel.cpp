#include "apps/asperity/feel.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace asperity::program {
namespace {

constexpr double noticed_force = 0.03;    // N: smallest change that a fingertip on a stylus notices
constexpr double levels_per_wave = 25.0;  // hrm-2010: encoder steps that one wavelength needs to be felt as a shape
constexpr double ticks_per_wave = 8.0;    // formulation D5 (iii)

/// Force with which the stroke presses on the plain surface (N).
double pressing_force(const Experiment& experiment, double stiffness) {
  const StrokeSettings& stroke = experiment.stroke;
  return stroke.press == PressMode::force ? stroke.normal_force : stiffness * std::max(0.0, stroke.depth);
}

/// Share of the texels that are crests rounder than `radius` allows: curvature along s or t above 1 / radius.
double share_of_sharp_crests(const HeightMap& map, double texel, double radius) {
  const int stride = std::max(1, std::max(map.width(), map.height()) / 512);
  std::size_t sharp = 0;
  std::size_t looked_at = 0;
  for (int y = 1; y + 1 < map.height(); y += stride) {
    for (int x = 1; x + 1 < map.width(); x += stride) {
      const double here = map.texel(x, y);
      const double along = (2.0 * here - map.texel(x - 1, y) - map.texel(x + 1, y)) / (texel * texel);
      const double across = (2.0 * here - map.texel(x, y - 1) - map.texel(x, y + 1)) / (texel * texel);
      ++looked_at;
      if (std::max(along, across) * radius > 1.0) ++sharp;
    }
  }
  return looked_at > 0 ? static_cast<double>(sharp) / static_cast<double>(looked_at) : 0.0;
}

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
  const double step = coat.maps().heights().quantisation_step();
  if (step * stiffness > noticed_force) {
    lines.push_back(fmt::format("the map's own steps of {} can be felt ({:.3g} N): a map of 16 bits would be smooth",
                                format_length(step), step * stiffness));
  }
  if (range > 0.0 && force > experiment.device.max_force) {
    lines.push_back(fmt::format("the full relief asks for more than the {:g} N of {}", experiment.device.max_force,
                                experiment.device.name));
  }
}

void detail_lines(const Coat& coat, const Experiment& experiment, std::vector<std::string>& lines) {
  const double texel = coat.texel_size();
  const double speed = experiment.stroke.speed;
  const double by_encoder = levels_per_wave * experiment.device.position_resolution;
  const double by_rate = ticks_per_wave * speed / experiment.rate;
  const double least = std::max(by_encoder, by_rate);
  const double wave = 2.0 * texel;
  if (wave >= least) {
    lines.push_back(
        fmt::format("every detail of the map is rendered: its shortest wave is {} (texel {}), {} resolves {} and {:g} "
                    "Hz at {:.3g} mm/s {}",
                    format_length(wave), format_length(texel), experiment.device.name, format_length(by_encoder),
                    experiment.rate, speed * 1e3, format_length(by_rate)));
  } else {
    lines.push_back(fmt::format(
        "waves shorter than {} are not felt as shapes: {} ({} steps, 25 a wave) resolves {}, {:g} Hz at {:.3g} mm/s "
        "resolves {}; the map goes down to {}",
        format_length(least), experiment.device.name, format_length(experiment.device.position_resolution),
        format_length(by_encoder), experiment.rate, speed * 1e3, format_length(by_rate), format_length(wave)));
  }
  const double passed = speed / wave;
  lines.push_back(fmt::format(
      "at {:.3g} mm/s up to {:.0f} of the shortest waves pass a second; {:g} Hz carries {:.0f} at 8 ticks each",
      speed * 1e3, passed, experiment.rate, experiment.rate / ticks_per_wave));
}

void crest_line(const Coat& coat, double force, double stiffness, std::vector<std::string>& lines) {
  if (!(force > 0.0) || !(coat.highest() > coat.lowest()) || !(coat.texel_size() > 0.0)) return;
  const double depth = force / stiffness;
  const double share = share_of_sharp_crests(coat.maps().heights(), coat.texel_size(), depth);
  if (share > 0.0) {
    lines.push_back(
        fmt::format("{:.2g} % of the map are crests sharper than the contact is deep ({} at {:.3g} N): there the force "
                    "turns faster than the shape; press less or be stiffer",
                    100.0 * share, format_length(depth), force));
  } else {
    lines.push_back(
        fmt::format("no crest is sharper than the contact is deep ({} at {:.3g} N): shapes are rendered faithfully",
                    format_length(depth), force));
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
  if (constrains(instance.law)) return;
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
  const double force = pressing_force(experiment, stiffness);
  if (force > device.max_force) {
    lines.push_back(fmt::format("the stroke presses with {:.3g} N, more than the {:g} N of {}: the force is cut", force,
                                device.max_force, device.name));
  }
  if (const auto* relief = std::get_if<std::shared_ptr<const ReliefSurface>>(&instance.surface)) {
    const Coat& coat = (*relief)->coat();
    amplitude_line(coat, experiment, stiffness, lines);
    detail_lines(coat, experiment, lines);
    crest_line(coat, force, stiffness, lines);
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
