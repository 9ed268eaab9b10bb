// Device, hand and probe of a scene file.

#include "asperity/io/detail/scene_reader.h"
#include "asperity/io/experiment.h"

namespace asperity {
namespace {

constexpr double full_rate = 1e6;

/// The text form of a part that may be a text or an object; empty when it is an object.
Result<std::string> name_of(const SceneJson& json, const std::string& place, const char* accepted) {
  if (json.is_string()) return json.get<std::string>();
  if (json.is_object()) return std::string();
  return refused(ErrorCode::bad_type, std::string("is ") + json_type(json), place, accepted);
}

IdealProbeSettings read_ideal(const SceneJson* json, const std::string& place, double stiffness, ObjectReader& parent) {
  static const SceneJson empty = SceneJson::object();
  ObjectReader reader(json == nullptr ? empty : *json, place, "ideal probe");
  IdealProbeSettings s;
  s.stiffness_estimate = reader.quantity("stiffness_estimate", Dimension::stiffness, stiffness, Range::positive());
  s.bandwidth = reader.quantity("bandwidth", Dimension::frequency, s.bandwidth, Range::positive());
  s.max_depth = reader.quantity("max_depth", Dimension::length, s.max_depth, Range::positive());
  parent.take("ideal", std::move(reader));
  return s;
}

SimulatedDeviceSettings read_dynamic(const SceneJson* json, const std::string& place, ObjectReader& parent) {
  static const SceneJson empty = SceneJson::object();
  ObjectReader reader(json == nullptr ? empty : *json, place, "dynamic probe");
  SimulatedDeviceSettings s;
  s.force_bandwidth = reader.quantity("force_bandwidth", Dimension::frequency, s.force_bandwidth, Range::positive());
  s.reach = reader.quantity("reach", Dimension::length, s.reach, Range::positive());
  s.tremor = reader.quantity("tremor", Dimension::length, s.tremor, Range::not_negative());
  s.seed = reader.seed("seed", s.seed);
  // Shorter steps than a microsecond would make a second of touch take minutes.
  s.max_substep = reader.quantity("max_substep", Dimension::time, s.max_substep, Range{1e-6, 1.0});
  parent.take("dynamic", std::move(reader));
  return s;
}

}  // namespace

std::filesystem::path SceneContext::resolve(const std::string& name) const {
  std::error_code ignored;
  const std::filesystem::path joined = folder / std::filesystem::path(name);
  const std::filesystem::path whole = std::filesystem::absolute(joined, ignored);
  return (ignored ? joined : whole).lexically_normal();
}

Result<ScenePart<DeviceProfile>> read_device(const SceneJson* json, const std::string& place) {
  static const SceneJson by_default = "phantom-desktop";
  if (json == nullptr) json = &by_default;
  ASPERITY_TRY(const std::string name, name_of(*json, place, "a profile's name or an object"));
  if (!name.empty() || json->is_string()) {
    Result<DeviceProfile> profile = find_profile(name);
    if (!profile) return std::move(profile).error().at(place);
    return ScenePart<DeviceProfile>{*profile, profile->name};
  }
  ObjectReader reader(*json, place, "device");
  Result<DeviceProfile> base = find_profile(reader.text("profile", "phantom-desktop"));
  if (!base && !reader.failed()) return std::move(base).error().at(place + ".profile");
  DeviceProfile p = base ? *base : DeviceProfile{};
  p.max_force = reader.quantity("max_force", Dimension::force, p.max_force, Range::positive());
  p.max_stiffness = reader.quantity("max_stiffness", Dimension::stiffness, p.max_stiffness, Range::positive());
  p.max_damping = reader.quantity("max_damping", Dimension::damping, p.max_damping, Range::not_negative());
  p.workspace_radius = reader.quantity("workspace_radius", Dimension::length, p.workspace_radius, Range::positive());
  p.position_resolution =
      reader.quantity("position_resolution", Dimension::length, p.position_resolution, Range::not_negative());
  p.mass = reader.quantity("mass", Dimension::mass, p.mass, Range::not_negative());
  p.damping = reader.quantity("damping", Dimension::damping, p.damping, Range::not_negative());
  p.friction = reader.quantity("friction", Dimension::force, p.friction, Range::not_negative());
  p.slew_limit = reader.number("slew_limit", p.slew_limit, Range::positive());
  p.rate = reader.quantity("rate", Dimension::frequency, p.rate, Range{0.0, full_rate, true});
  p.admittance = reader.boolean("admittance", p.admittance);
  ASPERITY_CHECK(reader.status());
  if (auto valid = validate_profile(p); !valid) return std::move(valid).error().at(place);
  return ScenePart<DeviceProfile>{p, std::move(reader.canonical())};
}

Result<ScenePart<HandImpedance>> read_hand(const SceneJson* json, const std::string& place) {
  static const SceneJson by_default = "default";
  if (json == nullptr) json = &by_default;
  ASPERITY_TRY(const std::string name, name_of(*json, place, "a hand's name or an object"));
  if (!name.empty() || json->is_string()) {
    Result<HandImpedance> hand = find_hand(name);
    if (!hand) return std::move(hand).error().at(place);
    return ScenePart<HandImpedance>{*hand, hand->name};
  }
  ObjectReader reader(*json, place, "hand");
  Result<HandImpedance> base = find_hand(reader.text("preset", "default"));
  if (!base && !reader.failed()) return std::move(base).error().at(place + ".preset");
  HandImpedance h = base ? *base : HandImpedance{};
  h.mass = reader.quantity("mass", Dimension::mass, h.mass, Range::positive());
  h.damping = reader.quantity("damping", Dimension::damping, h.damping, Range::not_negative());
  h.stiffness = reader.quantity("stiffness", Dimension::stiffness, h.stiffness, Range::positive());
  h.lateral_limit = reader.quantity("lateral_limit", Dimension::force, h.lateral_limit, Range::positive());
  ASPERITY_CHECK(reader.status());
  if (auto valid = validate_hand(h); !valid) return std::move(valid).error().at(place);
  return ScenePart<HandImpedance>{h, std::move(reader.canonical())};
}

Result<ScenePart<ProbeSettings>> read_probe(const SceneJson* json, const std::string& place,
                                            const DeviceProfile& device, double stiffness) {
  static const SceneJson empty = SceneJson::object();
  ObjectReader reader(json == nullptr ? empty : *json, place, "probe");
  ProbeSettings probe;
  probe.dynamic = reader.choice("kind", ProbeKind::ideal) == ProbeKind::dynamic;
  probe.radius = reader.quantity("radius", Dimension::length, 0.0, Range::not_negative());
  probe.tip = reader.quantity("tip", Dimension::length, 0.0, Range::not_negative());
  probe.rate = reader.quantity("rate", Dimension::frequency, device.rate, Range{0.0, full_rate, true});
  probe.ideal = read_ideal(reader.raw("ideal"), place + ".ideal", stiffness, reader);
  probe.simulated = read_dynamic(reader.raw("dynamic"), place + ".dynamic", reader);
  ASPERITY_CHECK(reader.status());
  return ScenePart<ProbeSettings>{probe, std::move(reader.canonical())};
}

}  // namespace asperity
