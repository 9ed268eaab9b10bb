#include "asperity/io/trace_export.h"

#include <fmt/format.h>

#include <array>
#include <filesystem>
#include <iterator>
#include <nlohmann/json.hpp>
#include <utility>

#include "asperity/io/atomic_file.h"

namespace asperity {
namespace {

/// Appends cells to a line of CSV; a row of the table and its header are made by the same calls.
class CellWriter {
 public:
  explicit CellWriter(std::string& line) : line_(line) {}
  void operator()(const char*, const char*, double value) { cell("{}", value); }
  void operator()(const char*, const char*, std::uint64_t value) { cell("{}", value); }
  void operator()(const char*, const char*, std::uint32_t value) {
    if (value == no_index) {
      cell("");
    } else {
      cell("{}", value);
    }
  }

 private:
  template <class... Value>
  void cell(fmt::format_string<const Value&...> format, const Value&... value) {
    if (!first_) line_ += ',';
    first_ = false;
    fmt::format_to(std::back_inserter(line_), format, value...);
  }
  std::string& line_;
  bool first_ = true;
};

class ColumnCollector {
 public:
  explicit ColumnCollector(std::vector<TraceColumn>& columns) : columns_(columns) {}
  template <class Value>
  void operator()(const char* name, const char* unit, const Value&) {
    columns_.push_back({name, unit});
  }

 private:
  std::vector<TraceColumn>& columns_;
};

template <class Visit>
void visit_vector(Visit& visit, const std::array<const char*, 3>& names, const char* unit, const Vec3& v) {
  for (std::size_t i = 0; i < 3; ++i) visit(names[i], unit, v[static_cast<Eigen::Index>(i)]);
}

/// The one place that lists the columns: name, unit, value.
template <class Visit>
void visit_columns(Visit&& visit, const TraceRecord& r) {
  const Quat& q = r.probe.pose.orientation;
  const ContactSummary& contact = r.rendered.contact;
  visit("tick", "", r.tick);
  visit("time", "s", r.probe.time.count());
  visit("dt", "s", r.dt.count());
  visit_vector(visit, {"position_x", "position_y", "position_z"}, "m", r.probe.pose.position);
  visit("orientation_w", "", q.w());
  visit("orientation_x", "", q.x());
  visit("orientation_y", "", q.y());
  visit("orientation_z", "", q.z());
  visit_vector(visit, {"velocity_x", "velocity_y", "velocity_z"}, "m/s", r.probe.twist.linear);
  visit_vector(visit, {"angular_velocity_x", "angular_velocity_y", "angular_velocity_z"}, "rad/s",
               r.probe.twist.angular);
  visit("buttons", "", r.probe.buttons);
  visit_vector(visit, {"force_x", "force_y", "force_z"}, "N", r.rendered.wrench.force);
  visit_vector(visit, {"torque_x", "torque_y", "torque_z"}, "N m", r.rendered.wrench.torque);
  visit_vector(visit, {"proxy_x", "proxy_y", "proxy_z"}, "m", r.rendered.proxy);
  visit("contacts", "", contact.count);
  visit("instance", "", contact.instance);
  visit("element", "", contact.element);
  visit_vector(visit, {"contact_x", "contact_y", "contact_z"}, "m", contact.point);
  visit_vector(visit, {"normal_x", "normal_y", "normal_z"}, "", contact.normal);
  visit("penetration", "m", contact.penetration);
  visit("relief_height", "m", contact.height);
  visit("flags", "", r.rendered.flags.bits());
  visit("level", "", static_cast<std::uint32_t>(r.rendered.level));
  visit_vector(visit, {"commanded_x", "commanded_y", "commanded_z"}, "N", r.commanded);
  visit_vector(visit, {"hand_x", "hand_y", "hand_z"}, "m", r.hand);
  visit("update_time", "s", r.update_seconds);
}

}  // namespace

std::vector<TraceColumn> trace_columns() {
  std::vector<TraceColumn> columns;
  visit_columns(ColumnCollector(columns), TraceRecord{});
  return columns;
}

std::string trace_csv(const Trace& trace) {
  std::string text;
  text.reserve(600 * (trace.records.size() + 1));
  for (const TraceColumn& column : trace_columns()) {
    if (!text.empty()) text += ',';
    text += column.unit.empty() ? column.name : fmt::format("{} [{}]", column.name, column.unit);
  }
  text += '\n';
  for (const TraceRecord& record : trace.records) {
    visit_columns(CellWriter(text), record);
    text += '\n';
  }
  return text;
}

std::string trace_sidecar_json(const Trace& trace) {
  using Json = nlohmann::ordered_json;
  Json columns = Json::array();
  for (const TraceColumn& column : trace_columns())
    columns.push_back(Json{{"name", column.name}, {"unit", column.unit}});
  Json flags;
  for (const auto& [flag, name] : Names<TickFlag>::table)
    flags[std::to_string(static_cast<std::uint32_t>(flag))] = name;
  Json json;
  json["format"] = "asperity trace table";
  json["version"] = 1;
  json["records"] = trace.records.size();
  json["complete"] = trace.complete;
  json["damage"] = trace.damage;
  json["force_hash"] = format_hash(force_hash(trace.records));
  json["columns"] = std::move(columns);
  json["flags"] = flags;
  json["metadata"] = Json::parse(to_json(trace.metadata), nullptr, false);
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string sidecar_path(std::string_view csv_path) {
  std::filesystem::path path(csv_path);
  path.replace_extension(".json");
  return path.string();
}

Status export_trace(const Trace& trace, const std::string& path) {
  const std::string sidecar = sidecar_path(path);
  if (sidecar == path) {
    return bad_value("is the name of the sidecar as well", "", "a name that ends in .csv").in_file(path);
  }
  // The table last: when it is there, its description is.
  ASPERITY_CHECK(write_file_atomically(sidecar, trace_sidecar_json(trace)));
  return write_file_atomically(path, trace_csv(trace));
}

}  // namespace asperity
