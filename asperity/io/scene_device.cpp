// Device, hand and probe of a scene file.

#include "asperity/io/detail/scene_reader.h"
#include "asperity/io/experiment.h"

namespace asperity {
namespace {

template <class S>
S read_part(ObjectReader& parent, const char* key, const char* object, S settings) {
  ObjectReader reader(parent.raw(key), parent.place_of(key), object);
  reader.read_all(settings);
  parent.take(key, std::move(reader));
  return settings;
}

/// A text that names it, or an object that names it at `key` and changes it.
template <class T>
Result<ScenePart<T>> named_or_changed(const SceneJson& json, const std::string& place, const char* object,
                                      const char* key, Result<T> (*find)(std::string_view),
                                      Status (*validate)(const T&)) {
  const OptionType& names = scene_object(object).rows.front().type;
  if (!json.is_object()) {
    if (!json.is_string())
      return refused(ErrorCode::bad_type, std::string("is ") + json_type(json), place, names.accepted());
    ASPERITY_TRY(T found, at_place(find(json.get_ref<const std::string&>()), place));
    return ScenePart<T>{std::move(found), json};
  }
  ObjectReader reader(json, place, object);
  const auto name = reader.get<std::string>(key);
  ASPERITY_CHECK(reader.status());
  ASPERITY_TRY(T changed, at_place(find(name), place + "." + key));
  reader.read_all(changed);
  ASPERITY_CHECK(at_place(validate(changed), place));
  return ScenePart<T>{std::move(changed), std::move(reader.canonical())};
}

}  // namespace

std::filesystem::path SceneContext::resolve(const std::string& name) const {
  std::error_code ignored;
  const std::filesystem::path joined = folder / std::filesystem::path(name);
  const std::filesystem::path whole = std::filesystem::absolute(joined, ignored);
  return (ignored ? joined : whole).lexically_normal();
}

Result<ScenePart<DeviceProfile>> read_device(const SceneJson& json, const std::string& place) {
  return named_or_changed<DeviceProfile>(json, place, "device", "profile", find_profile, validate_profile);
}

Result<ScenePart<HandImpedance>> read_hand(const SceneJson& json, const std::string& place) {
  return named_or_changed<HandImpedance>(json, place, "hand", "preset", find_hand, validate_hand);
}

Result<ScenePart<ProbeSettings>> read_probe(const SceneJson* json, const std::string& place,
                                            const DeviceProfile& device, double stiffness) {
  ObjectReader reader(json, place, "probe");
  ProbeSettings probe;
  probe.rate = device.rate;
  probe.ideal.stiffness_estimate = stiffness;
  probe.dynamic = reader.get<ProbeKind>("kind") == ProbeKind::dynamic;
  reader.read_all(probe);
  probe.tool_axis = reader.get<Vec3>("tool_axis").normalized();
  probe.ideal = read_part(reader, "ideal", "ideal probe", probe.ideal);
  probe.simulated = read_part(reader, "dynamic", "dynamic probe", probe.simulated);
  ASPERITY_CHECK(reader.status());
  return ScenePart<ProbeSettings>{probe, std::move(reader.canonical())};
}

}  // namespace asperity
