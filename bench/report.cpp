#include "bench/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

namespace asperity::bench {

namespace {

using Json = nlohmann::ordered_json;

/// What `numerator` costs compared with `denominator`, warm medians of one group.
void add_ratio(std::vector<Ratio>& ratios, const Group& group, const char* numerator, const char* denominator,
               double bar, double margin) {
  const RowResult* over = group.row(numerator);
  const RowResult* under = group.row(denominator);
  if (over == nullptr || under == nullptr || under->warm.p50 <= 0.0) return;
  ratios.push_back({fmt::format("{} / {}, {}", numerator, denominator, group.size()), over->warm.p50 / under->warm.p50,
                    bar, margin});
}

/// What a row costs on the base, or in the volume, where it costs most, compared with the one where it costs least.
void add_flatness(std::vector<Ratio>& ratios, const std::vector<Group>& groups, const char* kind, const char* of,
                  double bar) {
  const auto first = std::find_if(groups.begin(), groups.end(), [&](const Group& group) { return group.kind == kind; });
  if (first == groups.end()) return;
  for (const RowResult& row : first->rows) {
    double least = row.warm.p50;
    double most = row.warm.p50;
    std::size_t sizes = 0;
    for (const Group& group : groups) {
      const RowResult* same = group.kind == kind ? group.row(row.name) : nullptr;
      if (same == nullptr) continue;
      ++sizes;
      least = std::min(least, same->warm.p50);
      most = std::max(most, same->warm.p50);
    }
    if (least > 0.0 && sizes > 2)
      ratios.push_back({fmt::format("{}: dearest / cheapest {}", row.name, of), most / least, bar, 15.0});
  }
}

Json json_of(const Latency& latency) {
  return {{"updates", latency.updates},
          {"p50_ns", latency.p50},
          {"p99_ns", latency.p99},
          {"p999_ns", latency.p999},
          {"max_ns", latency.max}};
}

Json json_of(const Group& group) {
  Json rows = Json::array();
  for (const RowResult& row : group.rows) {
    rows.push_back({{"name", row.name},
                    {"warm", json_of(row.warm)},
                    {"cold", json_of(row.cold)},
                    {"answered_share", row.answered_share}});
  }
  return {{"kind", group.kind},
          {"triangles", group.triangles},
          {"resolution", group.resolution},
          {"mesh_build_s", group.mesh_build_seconds},
          {"search_build_s", group.search_build_seconds},
          {"embree_build_s", group.embree_build_seconds},
          {"bytes_per_triangle", group.bytes_per_triangle},
          {"coat_bytes", group.coat_bytes},
          {"largest_disagreement_m", group.largest_disagreement},
          {"rows", rows}};
}

Json json_of(const RaySpeed& speed) {
  return {{"rays_per_s", speed.rays_a_second}, {"hit_share", speed.hit_share}, {"worst_ns", speed.worst}};
}

Json json_of(const RayRow& row) {
  Json relief = json_of(row.relief);
  relief["bytes"] = row.relief_bytes;
  relief["build_s"] = row.relief_build_seconds;
  Json embree = json_of(row.embree);
  embree["triangles"] = row.triangles;
  embree["texels_an_edge"] = row.texels_an_edge;
  embree["capped"] = row.capped;
  embree["triangle_bytes"] = row.triangle_bytes;
  embree["bytes"] = row.embree_bytes;
  embree["cut_s"] = row.cut_seconds;
  embree["build_s"] = row.embree_build_seconds;
  return {{"body", row.body},
          {"faces", row.faces},
          {"texel_m", row.texel},
          {"rays", row.rays},
          {"both_share", row.both_share},
          {"relief", relief},
          {"embree", embree},
          {"difference_p50_m", row.difference_p50},
          {"difference_p99_m", row.difference_p99},
          {"flatness_p50_m", row.flatness_p50},
          {"flatness_p99_m", row.flatness_p99}};
}

std::string text_of(const Group& group) {
  std::string text = fmt::format("\n{} of {}: ", group.kind, group.size());
  if (group.resolution == 0) text += fmt::format("{:.1f} bytes a triangle", group.bytes_per_triangle);
  if (group.resolution > 0) {
    text +=
        fmt::format("{:.1f} MB; made in {:.3f} s, octree in {:.3f} s\n", static_cast<double>(group.coat_bytes) * 1e-6,
                    group.mesh_build_seconds, group.search_build_seconds);
  } else if (group.kind == "potential") {
    text = fmt::format("\n{} of {}: {:.1f} MB; mesh and search structure in {:.3f} s, potential in {:.3f} s",
                       group.kind, group.size(), static_cast<double>(group.coat_bytes) * 1e-6, group.mesh_build_seconds,
                       group.search_build_seconds);
    if (group.largest_disagreement > 0.0)
      text += fmt::format("; values differ from OpenVDB's by at most {:.1e} m", group.largest_disagreement);
    text += '\n';
  } else if (group.kind == "formula") {
    text = fmt::format("\n{} of {}:\n", group.kind, group.size());
  } else if (group.kind == "refit") {
    text += '\n';
  } else if (group.coat_bytes > 0) {
    text += fmt::format(", coat {:.1f} MB\n", static_cast<double>(group.coat_bytes) * 1e-6);
  } else {
    text += fmt::format(
        "; built in {:.3f} s (mesh) + {:.3f} s (search structure), Embree {:.3f} s; distances differ by at most {:.1e} "
        "m\n",
        group.mesh_build_seconds, group.search_build_seconds, group.embree_build_seconds, group.largest_disagreement);
  }
  // Whole meshes take milliseconds.
  const double unit = group.kind == "refit" ? 1e3 : 1.0;
  text += fmt::format("{:<37}{:>8}{:>8}{:>9}{:>10} |{:>8}{:>8}{:>9}{:>10}\n", unit > 1.0 ? "us" : "ns", "p50", "p99",
                      "p99.9", "max", "cold p50", "p99", "p99.9", "max");
  for (const RowResult& row : group.rows) {
    text += fmt::format("{:<37}{:>8.0f}{:>8.0f}{:>9.0f}{:>10.0f} |{:>8.0f}{:>8.0f}{:>9.0f}{:>10.0f}\n", row.name,
                        row.warm.p50 / unit, row.warm.p99 / unit, row.warm.p999 / unit, row.warm.max / unit,
                        row.cold.p50 / unit, row.cold.p99 / unit, row.cold.p999 / unit, row.cold.max / unit);
  }
  return text;
}

}  // namespace

std::string Group::size() const {
  if (resolution > 0) return fmt::format("{0}^3 samples", resolution);
  return triangles > 0 ? fmt::format("{} triangles", triangles) : "one sphere";
}

std::vector<Ratio> Report::ratios() const {
  std::vector<Ratio> ratios;
  for (const Group& group : groups) {
    add_ratio(ratios, group, god_object_point, embree_infinite, 1.0, 3.0);
    add_ratio(ratios, group, god_object_point, embree_bounded, 0.0, 6.0);
    add_ratio(ratios, group, god_object_radius, god_object_point, 1.5, 6.0);
    add_ratio(ratios, group, closest_coherent, embree_bounded, 0.0, 4.0);
    add_ratio(ratios, group, proxy_edge, proxy_inside, 2.0, 20.0);
    add_ratio(ratios, group, mesh_refit, mesh_rebuild, 1.0, 2.0);
    add_ratio(ratios, group, relief_refit, relief_rebuild, 1.0, 2.0);
  }
  add_flatness(ratios, groups, "relief", "base", 1.5);
  add_flatness(ratios, groups, "volume", "volume", 1.5);
  add_flatness(ratios, groups, "potential", "mesh", 1.25);
  return ratios;
}

std::vector<std::string> Report::failures() const {
  std::vector<std::string> failures = ray_failures(rays);
  for (const Group& group : groups) {
    for (const RowResult& row : group.rows) {
      if (row.warm.updates == 0 || row.cold.updates == 0)
        failures.push_back(fmt::format("{} on {} did not run", row.name, group.size()));
      if (row.answered_share < 0.99) {
        failures.push_back(fmt::format("{} on {} answered only {:.1f} % of its updates", row.name, group.size(),
                                       100.0 * row.answered_share));
      }
    }
    // Embree holds vertices in single precision and its culling ball with them; the distances are in double.
    if (!(group.largest_disagreement <= 1e-9)) {
      failures.push_back(fmt::format("on {} triangles our distance and Embree's differ by {:.3e} m", group.triangles,
                                     group.largest_disagreement));
    }
  }
  for (const Ratio& ratio : ratios()) {
    if (!(ratio.value <= ratio.margin))
      failures.push_back(fmt::format("{} is {:.2f}, above {:.2f}", ratio.what, ratio.value, ratio.margin));
  }
  return failures;
}

std::string Report::text() const {
  std::string text = fmt::format("{}\n{}, {}\n", command, machine, date);
  if (!groups.empty()) {
    text += "Probe 1 mm under a sphere of radius 50 mm, 50 mm/s, 1 kHz. Cold: 64 MB swept before every update.\n";
  }
  text += fmt::format("One reading of the clock costs {:.0f} ns, which is taken off.\n", clock_cost);
  for (const Group& group : groups) text += text_of(group);
  text += rays_text(rays);
  for (const Group& group : groups) {
    if (group.on_top.empty()) continue;
    text += "\nA tick on top of the bare contact, medians of differences taken in turn\n";
    for (const Extra& extra : group.on_top) {
      text += fmt::format("{:<72}{:>6.0f} ns   owed: at most {:g} ns{}\n", extra.what, extra.nanoseconds, extra.owed,
                          extra.nanoseconds <= extra.owed ? "" : ", missed");
    }
  }
  if (!groups.empty()) text += "\nRatios of warm medians\n";
  for (const Ratio& ratio : ratios()) {
    text += fmt::format("{:<78}{:>6.2f}", ratio.what, ratio.value);
    if (ratio.bar > 0.0)
      text += fmt::format("   owed: at most {:g}{}", ratio.bar, ratio.value <= ratio.bar ? "" : ", missed");
    text += '\n';
  }
  return text;
}

std::string Report::json() const {
  Json groups_json = Json::array();
  for (const Group& group : groups) groups_json.push_back(json_of(group));
  Json ratios_json = Json::array();
  for (const Ratio& ratio : ratios()) {
    Json entry = {{"what", ratio.what}, {"value", ratio.value}};
    if (ratio.bar > 0.0) entry["bar"] = ratio.bar;
    ratios_json.push_back(entry);
  }
  Json extras_json = Json::array();
  for (const Group& group : groups) {
    for (const Extra& extra : group.on_top) {
      extras_json.push_back({{"what", extra.what}, {"ns", extra.nanoseconds}, {"owed_ns", extra.owed}});
    }
  }
  Json rays_json = Json::array();
  for (const RayRow& row : rays) rays_json.push_back(json_of(row));
  const Json report = {{"command", command},          {"machine", machine},    {"date", date},
                       {"clock_cost_ns", clock_cost}, {"groups", groups_json}, {"on_top", extras_json},
                       {"ratios", ratios_json},       {"rays", rays_json}};
  return report.dump(2);
}

std::string machine_name() {
  std::ifstream file("/proc/cpuinfo");
  const std::string key = "model name";
  std::string name = "unknown processor";
  for (std::string line; std::getline(file, line);) {
    const std::size_t colon = line.find(": ");
    if (line.compare(0, key.size(), key) != 0 || colon == std::string::npos) continue;
    name = line.substr(colon + 2);
    break;
  }
  return fmt::format("{}, {} cores", name, std::thread::hardware_concurrency());
}

}  // namespace asperity::bench
