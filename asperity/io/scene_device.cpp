// Device, hand and probe of a scene file.

#include "asperity/io/detail/scene_reader.h"
#include "asperity/io/experiment.h"

namespace asperity {
namespace {

constexpr double full_rate = 1e6;

/// What a text names, and nothing where `json` is an object.
template <class T>
Result<std::optional<T>> read_name(const SceneJson& json, const std::string& place, const char* accepted,
                                   Result<T> (*find)(std::string_view)) {
  if (json.is_object()) return std::optional<T>();
  if (!json.is_string()) return refused(ErrorCode::bad_type, std::string("is ") + json_type(json), place, accepted);
  ASPERITY_TRY(T found, at_place(find(json.get_ref<const std::string&>()), place));
  return std::optional<T>(std::move(found));
}

IdealProbeSettings read_ideal(double stiffness, ObjectReader& parent) {
  ObjectReader reader(parent.raw("ideal"), parent.place_of("ideal"), "ideal probe");
  IdealProbeSettings s;
  s.stiffness_estimate = reader.quantity("stiffness_estimate", Dimension::stiffness, stiffness, Range::positive());
  s.bandwidth = reader.quantity("bandwidth", Dimension::frequency, s.bandwidth, Range::positive());
  s.max_depth = reader.quantity("max_depth", Dimension::length, s.max_depth, Range::positive());
  parent.take("ideal", std::move(reader));
  return s;
}

SimulatedDeviceSettings read_dynamic(ObjectReader& parent) {
  ObjectReader reader(parent.raw("dynamic"), parent.place_of("dynamic"), "dynamic probe");
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
  ASPERITY_TRY(const auto named, read_name(*json, place, "a profile's name or an object", find_profile));
  if (named) return ScenePart<DeviceProfile>{*named, named->name};
  ObjectReader reader(*json, place, "device");
  Result<DeviceProfile> base = find_profile(reader.text("profile", "phantom-desktop"));
  ASPERITY_CHECK(reader.status());
  ASPERITY_TRY(DeviceProfile p, at_place(std::move(base), place + ".profile"));
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
  ASPERITY_CHECK(at_place(validate_profile(p), place));
  return ScenePart<DeviceProfile>{p, std::move(reader.canonical())};
}

Result<ScenePart<HandImpedance>> read_hand(const SceneJson* json, const std::string& place) {
  static const SceneJson by_default = "default";
  if (json == nullptr) json = &by_default;
  ASPERITY_TRY(const auto named, read_name(*json, place, "a hand's name or an object", find_hand));
  if (named) return ScenePart<HandImpedance>{*named, named->name};
  ObjectReader reader(*json, place, "hand");
  Result<HandImpedance> base = find_hand(reader.text("preset", "default"));
  ASPERITY_CHECK(reader.status());
  ASPERITY_TRY(HandImpedance h, at_place(std::move(base), place + ".preset"));
  h.mass = reader.quantity("mass", Dimension::mass, h.mass, Range::positive());
  h.damping = reader.quantity("damping", Dimension::damping, h.damping, Range::not_negative());
  h.stiffness = reader.quantity("stiffness", Dimension::stiffness, h.stiffness, Range::positive());
  h.lateral_limit = reader.quantity("lateral_limit", Dimension::force, h.lateral_limit, Range::positive());
  ASPERITY_CHECK(reader.status());
  ASPERITY_CHECK(at_place(validate_hand(h), place));
  return ScenePart<HandImpedance>{h, std::move(reader.canonical())};
}

Result<ScenePart<ProbeSettings>> read_probe(const SceneJson* json, const std::string& place,
                                            const DeviceProfile& device, double stiffness) {
  ObjectReader reader(json, place, "probe");
  ProbeSettings probe;
  probe.dynamic = reader.choice("kind", ProbeKind::ideal) == ProbeKind::dynamic;
  probe.radius = reader.quantity("radius", Dimension::length, 0.0, Range::not_negative());
  probe.tip = reader.quantity("tip", Dimension::length, 0.0, Range::not_negative());
  probe.rate = reader.quantity("rate", Dimension::frequency, device.rate, Range{0.0, full_rate, true});
  probe.ideal = read_ideal(stiffness, reader);
  probe.simulated = read_dynamic(reader);
  ASPERITY_CHECK(reader.status());
  return ScenePart<ProbeSettings>{probe, std::move(reader.canonical())};
}

}  // namespace asperity
