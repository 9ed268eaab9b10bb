#include "asperity/io/live_trace.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <nlohmann/json.hpp>

#include "asperity/render/state_image.h"

namespace asperity {
namespace {

constexpr std::uint32_t loop_image_version = 1;
constexpr std::size_t loop_image_bytes = 4 + 4 + 4 * 8;
constexpr const char* no_limit = "infinity";

/// Calls each(name, member) for every setting.
template <class Settings, class Each>
void each_safety_setting(Settings& settings, const Each& each) {
  auto& [max_force, slew_limit, max_power, max_velocity, workspace, workspace_radius, border, engage, enabling_button,
         longest_tick, latches] = settings;
  each("max_force", max_force);
  each("slew_limit", slew_limit);
  each("max_power", max_power);
  each("max_velocity", max_velocity);
  each("workspace", workspace);
  each("workspace_radius", workspace_radius);
  each("border", border);
  each("engage", engage);
  each("enabling_button", enabling_button);
  each("longest_tick", longest_tick);
  each("latches", latches);
}

using SafetyJson = nlohmann::json;

SafetyJson number_json(double value) {
  return std::isinf(value) && value > 0.0 ? SafetyJson(no_limit) : SafetyJson(value);
}
SafetyJson setting_json(double value) {
  return number_json(value);
}
SafetyJson setting_json(Seconds value) {
  return number_json(value.count());
}
SafetyJson setting_json(int value) {
  return value;
}
SafetyJson setting_json(bool value) {
  return value;
}
SafetyJson setting_json(const Vec3& value) {
  return SafetyJson{value.x(), value.y(), value.z()};
}

bool read_setting(const SafetyJson& json, double& value) {
  if (json.is_number()) value = json.get<double>();
  const bool unlimited = json.is_string() && json.get<std::string>() == no_limit;
  if (unlimited) value = infinity;
  return json.is_number() || unlimited;
}
bool read_setting(const SafetyJson& json, Seconds& value) {
  double count = 0.0;
  const bool good = read_setting(json, count);
  value = Seconds(count);
  return good;
}
bool read_setting(const SafetyJson& json, int& value) {
  constexpr std::int64_t most = 1000;
  if (!json.is_number_integer() || json.get<std::int64_t>() < -most || json.get<std::int64_t>() > most) return false;
  value = json.get<int>();
  return true;
}
bool read_setting(const SafetyJson& json, bool& value) {
  if (json.is_boolean()) value = json.get<bool>();
  return json.is_boolean();
}
bool read_setting(const SafetyJson& json, Vec3& value) {
  if (!json.is_array() || json.size() != 3) return false;
  bool good = true;
  for (int i = 0; i < 3; ++i) good = good && read_setting(json[static_cast<std::size_t>(i)], value[i]);
  return good;
}

void put_number(std::vector<std::byte>& bytes, std::uint64_t value, int count) {
  for (int i = 0; i < count; ++i) bytes.push_back(static_cast<std::byte>((value >> (8 * i)) & 0xFFU));
}

std::uint64_t number_of(std::span<const std::byte> bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) value |= std::to_integer<std::uint64_t>(bytes[i]) << (8 * i);
  return value;
}

/// The number that an event "lost" tells; 0: none.
std::uint64_t told_lost(const TraceEvent& event) {
  constexpr std::size_t most_digits = 18;
  const bool digits = !event.text.empty() && event.text.size() <= most_digits &&
                      event.text.find_first_not_of("0123456789") == std::string::npos;
  return digits ? std::stoull(event.text) : 0;
}

}  // namespace

std::vector<std::byte> save_loop_state(const ProxyState& state, const SafetyMemory& safety, const Scene& scene) {
  const auto& [last_force, engaged, fault, raised, armed, withheld] = safety;
  std::vector<std::byte> bytes;
  put_number(bytes, loop_image_version, 4);
  put_number(bytes, static_cast<std::uint64_t>(fault), 1);
  put_number(bytes, raised ? 1 : 0, 1);
  put_number(bytes, armed ? 1 : 0, 1);
  put_number(bytes, withheld ? 1 : 0, 1);
  for (const double number : {last_force.x(), last_force.y(), last_force.z(), engaged.count()})
    put_number(bytes, std::bit_cast<std::uint64_t>(number), 8);
  const std::vector<std::byte> image = save_state(state, scene);
  bytes.insert(bytes.end(), image.begin(), image.end());
  return bytes;
}

Result<LoopState> restore_loop_state(std::span<const std::byte> image, const Scene& scene) {
  const auto refuse = [](ErrorCode code, std::string what, std::size_t at) {
    return refused(code, std::move(what), fmt::format("byte {}", at), "a key frame of a live trace");
  };
  if (image.size() < loop_image_bytes)
    return refuse(ErrorCode::file_truncated, fmt::format("has {} bytes and is no key frame", image.size()), 0);
  if (number_of(image.first(4)) != loop_image_version)
    return refuse(ErrorCode::file_unsupported, fmt::format("has version {} of key frames", number_of(image.first(4))),
                  0);
  const auto fault = static_cast<Fault>(number_of(image.subspan(4, 1)));
  const std::uint64_t raised = number_of(image.subspan(5, 1));
  const std::uint64_t armed = number_of(image.subspan(6, 1));
  const std::uint64_t withheld = number_of(image.subspan(7, 1));
  if (place_of_name(fault) == Names<Fault>::table.size() || raised > 1 || armed > 1 || withheld > 1)
    return refuse(ErrorCode::file_malformed, "has a safety stage that there is not", 4);
  const auto number = [&](std::size_t i) { return std::bit_cast<double>(number_of(image.subspan(8 + 8 * i, 8))); };
  LoopState loop;
  loop.safety = {
      Vec3(number(0), number(1), number(2)), Seconds(number(3)), fault, raised == 1, armed == 1, withheld == 1};
  if (!loop.safety.last_force.allFinite() || !(loop.safety.engaged.count() >= 0.0))
    return refuse(ErrorCode::file_malformed, "has a last force that is none", 8);
  ASPERITY_TRY(loop.proxy, restore_state(image.subspan(loop_image_bytes), scene));
  return loop;
}

std::string to_json(const SafetySettings& settings) {
  SafetyJson json = SafetyJson::object();
  each_safety_setting(settings, [&](const char* name, const auto& value) { json[name] = setting_json(value); });
  return json.dump();
}

Result<SafetySettings> parse_safety_settings(std::string_view text) {
  const SafetyJson json = SafetyJson::parse(text.begin(), text.end(), nullptr, false);
  if (!json.is_object()) return refused(ErrorCode::file_malformed, "is no JSON object", "safety");
  SafetySettings settings;
  std::size_t known = 0;
  std::string wrong;
  each_safety_setting(settings, [&](const char* name, auto& value) {
    const auto it = json.find(name);
    if (it == json.end()) return;
    ++known;
    if (!read_setting(*it, value)) wrong = name;
  });
  if (!wrong.empty())
    return refused(ErrorCode::bad_type, "is " + json[wrong].dump(), "safety." + wrong, "as to_json writes it");
  if (known < json.size()) {
    return refused(ErrorCode::bad_key, fmt::format("has {} settings that nobody reads", json.size() - known), "safety",
                   SafetyJson::parse(to_json(SafetySettings{})).dump());
  }
  if (Result<SafetyStage> stage = SafetyStage::build(settings); !stage) return std::move(stage).error().at("safety");
  return settings;
}

Result<SafetySettings> safety_of(const TraceMetadata& metadata, const DeviceProfile& device) {
  const auto it = metadata.extra.find(trace_safety_key);
  if (it == metadata.extra.end()) return SafetySettings::from_profile(device);
  return parse_safety_settings(it->second);
}

Result<std::vector<TraceGap>> trace_gaps(const Trace& trace) {
  std::vector<TraceGap> gaps;
  std::size_t event = 0;
  for (std::size_t i = 0; i < trace.records.size(); ++i) {
    const std::uint64_t tick = trace.records[i].tick;
    std::uint64_t told = 0;
    for (; event < trace.events.size() && trace.events[event].tick <= tick; ++event)
      if (trace.events[event].kind == "lost") told += told_lost(trace.events[event]);
    if (i == 0) continue;
    const std::uint64_t expected = trace.records[i - 1].tick + 1;
    if (tick == expected) continue;
    if (tick < expected || told == 0) {
      return refused(ErrorCode::file_malformed,
                     fmt::format("goes on from tick {} with tick {}, and tells of no loss", expected - 1, tick),
                     fmt::format("tick {}", tick), "ticks one after the other");
    }
    gaps.push_back({tick, tick - expected});
  }
  return gaps;
}

}  // namespace asperity
