#include "apps/asperity/relief_advice.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "apps/asperity/feel.h"

namespace asperity::program {
namespace {

/// "fidelity, hand": what does not pass.
std::string failing(const Renderability& answer) {
  std::vector<std::string> names;
  for (const RenderFinding& found : answer.findings) {
    if (!found.passes) names.emplace_back(criterion_name(found.criterion));
  }
  return fmt::format("{}", fmt::join(names, ", "));
}

std::string base_line(const BaseMeshAdvice& base) {
  std::string text = fmt::format(
      "base mesh: the relief of {} is {:.3g} % of the mean edge of {}; on {:.3g} % of the faces it exceeds {:g} % of "
      "their own edges (at most {:.3g} %)",
      format_length(base.range), 100.0 * base.range / base.mean_edge, format_length(base.mean_edge),
      100.0 * base.share_of_faces, 100.0 * largest_relief_over_edge, 100.0 * base.largest_ratio);
  if (!base.exceeded) return text + ": it carries it";
  if (base.subdivisions > 0) {
    text += fmt::format(
        ". A finer base mesh that follows the relief itself would carry it: mean edge {}, {} subdivision{} of each "
        "triangle into four, {} triangles, and {} left to the coat",
        format_length(base.edge_needed), base.subdivisions, base.subdivisions > 1 ? "s" : "", base.triangles,
        format_length(base.residual));
  } else {
    text += ". No finer base mesh would carry it: it has walls";
  }
  return text + fmt::format("; on this mesh, lower it to {}", format_length(base.height_allowed));
}

double pressing_force(const Experiment& experiment, double stiffness) {
  constexpr double usual = 1.0;  // N
  const double force = stroke_force(experiment, stiffness);
  return force > 0.0 ? force : usual;
}

Json suggestion_json(const RenderSuggestion& suggestion) {
  Json changes = Json::array();
  for (const KnobChange& change : suggestion.changes)
    changes.push_back({{"what", to_string(change.knob)}, {"from", change.from}, {"to", change.to}});
  return {{"text", suggestion.text}, {"changes", changes}};
}

Json base_json(const BaseMeshAdvice& base) {
  return {{"mean_edge_m", base.mean_edge},
          {"relief_m", base.range},
          {"share_of_faces_beyond", base.share_of_faces},
          {"largest_ratio", base.largest_ratio},
          {"exceeded", base.exceeded},
          {"height_allowed_m", base.height_allowed},
          {"subdivisions", base.subdivisions},
          {"edge_needed_m", base.edge_needed},
          {"triangles", base.triangles},
          {"left_to_the_coat_m", base.residual}};
}

}  // namespace

TouchConditions touch_conditions(const Experiment& experiment, double stiffness) {
  TouchConditions t;
  t.device = experiment.device;
  t.hand = experiment.hand;
  t.force = pressing_force(experiment, stiffness);
  t.speed = experiment.stroke.speed;
  t.stiffness = stiffness;
  t.rate = experiment.rate;
  t.tip_radius = experiment.scene.probe_radius();
  // In the scene's lengths: what is shown larger is stiffer, and the hand slower and finer there.
  const double zoom = experiment.scene.settings().view.zoom;
  t.stiffness *= zoom;
  t.hand.stiffness *= zoom;
  t.device.max_stiffness *= zoom;
  t.device.position_resolution /= zoom;
  t.speed /= zoom;
  return t;
}

ReliefAdvice advise_on(std::string surface, const ReliefShape& shape, TouchConditions conditions) {
  ReliefAdvice advice;
  advice.surface = std::move(surface);
  advice.conditions = std::move(conditions);
  advice.shape = shape;
  advice.answer = judge_relief(shape, advice.conditions);
  advice.devices = judge_on_devices(shape, advice.conditions);
  return advice;
}

std::vector<ReliefAdvice> advise_on(const Experiment& experiment) {
  std::vector<ReliefAdvice> all;
  for (const Instance& instance : experiment.scene.instances()) {
    const TouchConditions conditions = touch_conditions(experiment, instance.material.stiffness);
    if (const auto* relief = std::get_if<std::shared_ptr<const ReliefSurface>>(&instance.surface)) {
      const Coat& coat = (*relief)->coat();
      const TriangleMesh& mesh = (*relief)->base().mesh();
      if (!(coat.highest() > coat.lowest())) continue;
      all.push_back(advise_on(instance.name, measure_shape(mesh, coat), conditions));
      all.back().base = advise_base_mesh(mesh, coat);
    } else if (const ParametricSurface* parametric = parametric_of(instance.surface)) {
      if (parametric->settings().features.empty()) continue;
      if (const auto shape = measure_shape(parametric->settings().features); shape)
        all.push_back(advise_on(instance.name + ", its features", *shape, conditions));
    }
  }
  return all;
}

std::vector<std::string> advice_lines(const ReliefAdvice& advice) {
  std::vector<std::string> lines;
  for (const RenderFinding& found : advice.answer.findings) {
    // The device's own limits are told of every surface, with a relief or without.
    if (found.criterion == Criterion::stiffness || found.criterion == Criterion::force) continue;
    lines.push_back(fmt::format("{}{}: {}", found.passes ? "" : "NOT ", criterion_name(found.criterion), found.text));
  }
  if (advice.answer.renderable) {
    lines.push_back(fmt::format("all of it can be felt on {}", advice.conditions.device.name));
  } else if (advice.answer.suggestions.empty()) {
    lines.push_back(fmt::format("not renderable on {} ({}), and up to three changes at once do not help",
                                advice.conditions.device.name, failing(advice.answer)));
  } else {
    std::vector<std::string> texts;
    for (const RenderSuggestion& suggestion : advice.answer.suggestions) texts.push_back(suggestion.text);
    lines.push_back(fmt::format("not renderable on {} ({}). It would be, nearest change first: {}",
                                advice.conditions.device.name, failing(advice.answer), fmt::join(texts, "; or ")));
  }
  if (advice.base) lines.push_back(base_line(*advice.base));
  return lines;
}

std::string device_table(const ReliefAdvice& advice) {
  std::size_t widest = 12;
  for (const DeviceAnswer& device : advice.devices) widest = std::max(widest, failing(device.answer).size() + 2);
  std::string table = fmt::format("{:<17}{:>12}{:>6}  {:<{}}{}\n", "device", "stiffness", "felt", "what fails", widest,
                                  "nearest change");
  for (const DeviceAnswer& device : advice.devices) {
    const Renderability& answer = device.answer;
    const std::string change = answer.suggestions.empty() ? std::string() : answer.suggestions.front().text;
    table += fmt::format("{:<17}{:>12}{:>6}  {:<{}}{}\n", device.device.name,
                         fmt::format("{:.3g} N/mm", device.stiffness * 1e-3), answer.renderable ? "yes" : "no",
                         failing(answer), widest, change);
  }
  // No line ends in blanks.
  std::string clean;
  for (const char c : table) {
    if (c == '\n') clean.erase(clean.find_last_not_of(' ') + 1);
    clean += c;
  }
  return clean;
}

Json advice_json(const ReliefAdvice& advice) {
  const ReliefShape& shape = advice.shape;
  const TouchConditions& t = advice.conditions;
  Json json{{"surface", advice.surface},
            {"device", t.device.name},
            {"hand", t.hand.name},
            {"force_n", t.force},
            {"speed_m_s", t.speed},
            {"stiffness_n_m", t.stiffness},
            {"rate_hz", t.rate},
            {"relief",
             {{"lowest_m", shape.lowest},
              {"highest_m", shape.highest},
              {"wave_m", shape.wave},
              {"finest_wave_m", shape.finest_wave},
              {"crest_radius_smallest_m", finite_or_null(shape.crests.smallest())},
              {"crest_radius_sharpest_percent_m", finite_or_null(shape.crests.sharpest_percent())},
              {"crest_radius_median_m", finite_or_null(shape.crests.median())},
              {"map_step_m", shape.step}}},
            {"renderable", advice.answer.renderable}};
  for (const RenderFinding& found : advice.answer.findings) {
    json["criteria"].push_back({{"name", criterion_name(found.criterion)},
                                {"value", finite_or_null(found.value)},
                                {"limit", finite_or_null(found.limit)},
                                {"passes", found.passes},
                                {"text", found.text}});
  }
  json["suggestions"] = Json::array();
  for (const RenderSuggestion& suggestion : advice.answer.suggestions)
    json["suggestions"].push_back(suggestion_json(suggestion));
  for (const DeviceAnswer& device : advice.devices) {
    Json row{{"device", device.device.name},
             {"stiffness_n_m", device.stiffness},
             {"renderable", device.answer.renderable},
             {"fails", failing(device.answer)}};
    if (!device.answer.suggestions.empty()) row["change"] = suggestion_json(device.answer.suggestions.front());
    json["devices"].push_back(std::move(row));
  }
  if (advice.base) json["base_mesh"] = base_json(*advice.base);
  return json;
}

}  // namespace asperity::program
