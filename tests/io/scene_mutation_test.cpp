// Reader and published schema say the same of scenes that were changed at random: the schema as valijson understands
// it, which knows nothing of the table, and the readers as they are.

#if defined(__GNUC__) && !defined(__clang__)
// GCC 12 reports a false positive inside valijson at -O3 (GCC bug 105329).
#pragma GCC diagnostic ignored "-Wrestrict"
#endif

#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <valijson/adapters/nlohmann_json_adapter.hpp>
#include <valijson/schema.hpp>
#include <valijson/schema_parser.hpp>
#include <valijson/validator.hpp>

#include "asperity/field/conversion/mesh_conversion.h"
#include "asperity/io/detail/scene_json.h"
#include "tests/io/experiment_fixture.h"
#include "tests/io/scene_hosts.h"

namespace asperity::scene_mutation_test {
namespace {

using nlohmann::json;

/// An object of a scene and its kind.
struct Found {
  json::json_pointer pointer;
  const SceneObject* object;
};

void find_objects(const json& value, const json::json_pointer& pointer, const OptionType& type,
                  std::vector<Found>& found) {
  if (type.kind == OptionKind::array && value.is_array()) {
    for (std::size_t i = 0; i < value.size(); ++i) find_objects(value[i], pointer / i, type.parts.front(), found);
  } else if (type.kind == OptionKind::any) {
    for (const OptionType& part : type.parts) find_objects(value, pointer, part, found);
  } else if (type.kind == OptionKind::object && value.is_object()) {
    const SceneObject& object = scene_object(type.word);
    found.push_back({pointer, &object});
    for (const auto& item : value.items()) {
      const Option* row = object.row(item.key(), SceneJson(value));
      if (row != nullptr) find_objects(item.value(), pointer / item.key(), row->type, found);
    }
  }
}

/// Changes scenes, at random by a seed.
class Mutator {
 public:
  explicit Mutator(std::uint64_t seed) : random_(seed) {}

  json changed(json scene) {
    for (int left = 1 + pick(2); left > 0; --left) change(scene);
    return scene;
  }
  int pick(int count) { return static_cast<int>(random_() % static_cast<std::uint64_t>(count)); }

 private:
  template <class List>
  const auto& one_of(const List& list) {
    return list[static_cast<std::size_t>(pick(static_cast<int>(std::size(list))))];
  }

  void change(json& scene) {
    std::vector<Found> objects;
    find_objects(scene, json::json_pointer(), OptionType::object("scene"), objects);
    if (objects.empty()) return;
    const Found& place = one_of(objects);
    json& object = scene[place.pointer];
    const Option& row = one_of(place.object->rows);
    const bool there = !object.empty();
    std::vector<std::string> keys;
    for (const auto& item : object.items()) keys.push_back(item.key());
    switch (pick(8)) {
      case 0:
        if (there) object.erase(one_of(keys));
        break;
      case 1: object[row.key] = fitting(row.type); break;
      case 2: object[one_of(one_of(scene_table()).rows).key] = anything(); break;
      case 3:
        if (there) object[one_of(keys)] = anything();
        break;
      case 4: object[row.key] = at_an_end(row.type); break;
      case 5:
        if (there) around(object, *place.object, one_of(keys));
        break;
      case 6:
        if (there) object[one_of(keys)] = text();
        break;
      default: object[row.key] = pick(2) == 0 ? fitting(row.type) : anything(); break;
    }
  }

  json anything() {
    static const std::vector<json> values{
        nullptr, true,          3, -1,     0,         0.25,        -0.5,         1e9 + 0.5, "",         "line",
        "2 mm",  json::array(), 7, {1, 2}, {1, 2, 3}, {0.5, "1%"}, {1, 2, 3, 4}, 512,       {{1, 0.5}}, json::object()};
    return one_of(values);
  }
  json text() {
    static const std::vector<json> values{"2 mm", "+2mm", "-1e-3 m",   " 5 % ", "3 N", "4 N/mm", "90deg",   "x",
                                          "1.",   ".5 s", "2.5e-1 Hz", "1e",    "mm",  "2 MB",   "1.5 GiB", "0 %",
                                          "auto", "none", "H_4",       "uv",    "all", "proxy",  "0.2 m/s", "10",
                                          "250%", "2 µm", "- 2 mm",    "inf",   "nan", "0x10",   "1e-40",   "2 N s/m"};
    return one_of(values);
  }
  /// What a type takes, by and large.
  json fitting(const OptionType& type) {
    const double low = std::isfinite(type.range.low) ? type.range.low : -1.0;
    const double high = std::isfinite(type.range.high) ? type.range.high : low + 10.0;
    switch (type.kind) {
      case OptionKind::number: return low + (high - low) * (1 + pick(8)) / 8.0;
      case OptionKind::quantity:
        if (pick(2) == 0) return low + (high - low) * (1 + pick(8)) / 8.0;
        return "0.3 " + unit_names(type.dimension).front();
      case OptionKind::integer: return static_cast<int>(low) + pick(4);
      case OptionKind::seed: return pick(5);
      case OptionKind::boolean: return pick(2) == 0;
      case OptionKind::text: return "map.png";
      case OptionKind::share: return "40 %";
      case OptionKind::bytes: return "64 MB";
      case OptionKind::choice: return one_of(type.all_names());
      case OptionKind::numbers: return {{"type", "gutter"}, {"width", "3 mm"}, {"slope", 0.5}};
      case OptionKind::object: return object_of(scene_object(type.word));
      case OptionKind::any: return fitting(one_of(type.parts));
      case OptionKind::array: break;
    }
    json list = json::array();
    for (std::size_t left = std::max<std::size_t>(type.least, 1); left > 0; --left)
      list.push_back(fitting(type.parts.front()));
    return list;
  }
  /// With what it has to have.
  json object_of(const SceneObject& object) {
    json made = json::object();
    for (const Option& row : object.rows) {
      if (row.required && holds(*row.required, SceneJson(made), object) && object.row(row.key, SceneJson(made)) == &row)
        made[row.key] = fitting(row.type);
    }
    return made;
  }
  /// A number below, at and above the ends of a range, and arrays that are as short or as long as they may be.
  json at_an_end(const OptionType& type) {
    if (type.kind == OptionKind::any) return at_an_end(one_of(type.parts));
    if (type.kind == OptionKind::array) {
      json list = json::array();
      const std::size_t sizes[] = {type.least, type.least > 0 ? type.least - 1 : 0,
                                   std::min<std::size_t>(type.most, 20), std::min<std::size_t>(type.most, 20) + 1};
      for (std::size_t left = one_of(sizes); left > 0; --left)
        list.push_back(left == 1 ? at_an_end(type.parts.front()) : fitting(type.parts.front()));
      return list;
    }
    const double end = pick(2) == 0 ? type.range.low : type.range.high;
    if (!std::isfinite(end)) return fitting(type);
    const double step = (pick(3) - 1) * (type.kind == OptionKind::integer ? 1.0 : 1e-6 * std::max(1.0, std::abs(end)));
    // valijson takes 4.0 for no integer, though draft 7 and the reader do.
    if (type.kind == OptionKind::integer || type.kind == OptionKind::seed) return static_cast<std::int64_t>(end + step);
    return end + step;
  }
  /// Another name, an array emptied, a value nested.
  void around(json& object, const SceneObject& kind, const std::string& key) {
    const Option* row = kind.row(key, SceneJson(object));
    json& value = object[key];
    if (value.is_array() && pick(2) == 0) {
      value = json::array();
    } else if (row != nullptr && pick(2) == 0) {
      value = fitting(row->type);
    } else {
      value = pick(2) == 0 ? json::array({value}) : json{{"value", value}};
    }
  }

  std::mt19937_64 random_;
};

class SceneMutation : public ExperimentTest {
 protected:
  void SetUp() override {
    ExperimentTest::SetUp();
    document_ = json::parse(scene_schema_json());
    valijson::SchemaParser parser;
    parser.populateSchema(valijson::adapters::NlohmannJsonAdapter(document_), schema_);
    for (const BuiltinScene& scene : builtin_scenes()) scenes_.push_back(json::parse(*builtin_scene_json(scene.name)));
    for (const scene_hosts::Host& host : scene_hosts::hosts) scenes_.push_back(json::parse(host.scene));
  }

  bool schema_takes(const json& scene) {
    valijson::Validator validator;
    return validator.validate(schema_, valijson::adapters::NlohmannJsonAdapter(scene), nullptr);
  }
  static Status structure(const json& scene) { return check_structure(SceneJson(scene), "", scene_object("scene")); }

  /// Whether an error is about the number in a text with a unit: no schema can tell its range.
  static bool in_a_text(const json& scene, const std::string& place) {
    std::string path = "/" + place;
    for (const char from : {'.', '['}) std::replace(path.begin(), path.end(), from, '/');
    std::erase(path, ']');
    const json::json_pointer pointer(path);
    return scene.contains(pointer) && scene[pointer].is_string() && number_in_any_unit(SceneJson(scene[pointer]));
  }

  /// Whether a scene is quickly made: no large grids, no finely cut meshes.
  static bool is_cheap(const json& scene) {
    std::vector<Found> objects;
    find_objects(scene, json::json_pointer(), OptionType::object("scene"), objects);
    for (const auto& [pointer, object] : objects) {
      const json& one = scene[pointer];
      if (object->name == "volume" && one.contains("generator")) {
        if (!one.contains("size")) return false;
        for (const json& nodes : one["size"])
          if (nodes > 32) return false;
      }
      if (object->name == "implicit" && one.value("resolution", json()) != 16) return false;
      if (object->name == "mesh generator" && one.value("subdivisions", 0) > 4) return false;
      for (const char* key : {"columns", "rows", "triangles", "texels", "rings", "repeats", "turns"})
        if (one.contains(key) && one[key].is_number() && one[key] > 64) return false;
      for (const char* key :
           {"sample_spacing", "pitch", "residency", "budget", "closing", "offset", "band_outside", "band_inside"})
        if (one.contains(key)) return false;
      // How far a law reaches is how far a potential is stored.
      if (object->name == "law" && one.contains("band")) return false;
      if (object->name == "implicit texture" && one.contains("amplitude")) return false;
      if (object->name == "material" && one.contains("stiffness")) return false;
      if (object->name == "height generator" && one.value("size", 512) > 512) return false;
      if (object->name == "library relief" && one.value("size", 512) > 64) return false;
    }
    return true;
  }

  json document_;
  valijson::Schema schema_;
  std::vector<json> scenes_;
};

TEST_F(SceneMutation, SchemaAndReaderSayTheSame) {
  Mutator mutate(20261123);
  std::map<std::string, int> count;
  for (int round = 0; round < 150; ++round) {
    for (const json& scene : scenes_) {
      const json changed = mutate.changed(scene);
      const Status read = structure(changed);
      const bool taken = schema_takes(changed);
      ++count["compared"];
      ++count[read ? "accepted" : "refused"];
      if (read.ok() == taken) continue;
      if (taken && in_a_text(changed, read.error().place)) {
        ++count["excepted"];
        continue;
      }
      if (++count["disagreed"] <= 5)
        ADD_FAILURE() << (taken ? "the schema takes " : "the schema refuses ") << changed << "\n"
                      << (read ? "" : read.error().message());
    }
  }
  for (const auto& [what, how_many] : count) {
    std::cout << what << " " << how_many << "\n";
    RecordProperty(what, how_many);
  }
  EXPECT_EQ(count["disagreed"], 0);
  EXPECT_GT(count["compared"], 20000);
  EXPECT_GT(count["accepted"], count["compared"] / 5);
  EXPECT_GT(count["refused"], count["compared"] / 5);
  // Ranges of texts with units.
  EXPECT_LT(count["excepted"], count["compared"] / 50);
}

/// What the readers refuse beyond the structure is marked so in the table.
TEST_F(SceneMutation, WholeReadsRefuseNothingElseButContents) {
  if (!has_mesh_voxelizer()) GTEST_SKIP() << "without OpenVDB nothing implicit is read";
  Mutator mutate(7);
  std::map<std::string, int> count;
  for (int round = 0; round < 12; ++round) {
    for (const scene_hosts::Host& host : scene_hosts::hosts) {
      const json changed = mutate.changed(json::parse(host.scene));
      const Status good = structure(changed);
      if (good && !is_cheap(changed)) continue;
      const Result<Experiment> whole = parse(changed.dump());
      ++count["compared"];
      if (!good) {
        ++count["refused"];
        ASSERT_FALSE(whole.ok()) << changed;
        if (whole.error().code == ErrorCode::file_unsupported) continue;  // a newer format, which is said before all
        EXPECT_EQ(whole.error().place, good.error().place) << changed;
        EXPECT_EQ(whole.error().what, good.error().what) << changed;
      } else if (whole) {
        ++count["accepted"];
      } else {
        ++count["by contents"];
        const bool of_a_file = whole.error().file != "scene.json";
        EXPECT_TRUE(of_a_file || refused_by_contents(whole.error().place))
            << whole.error().message() << "\nis not marked in the table\n"
            << changed;
      }
    }
  }
  for (const auto& [what, how_many] : count) std::cout << what << " " << how_many << "\n";
  EXPECT_GT(count["accepted"], count["compared"] / 8);
  EXPECT_GT(count["refused"], count["compared"] / 6);
  EXPECT_LT(count["by contents"], count["compared"] / 2);
}

/// Read, written and read again, a scene is the same to the last byte, and so are its path and first forces.
TEST_F(SceneMutation, BuiltinScenesSurviveTheRoundTrip) {
  for (const BuiltinScene& scene : builtin_scenes()) {
    if (scene.name.starts_with("implicit") && !has_mesh_voxelizer()) continue;
    const Experiment first = good(*builtin_scene_json(scene.name));
    const Experiment second = good(first.canonical_json);
    EXPECT_EQ(second.canonical_json, first.canonical_json) << scene.name;
    ASSERT_EQ(second.path.points().size(), first.path.points().size()) << scene.name;
    EXPECT_EQ(second.path.points().back(), first.path.points().back()) << scene.name;
    EXPECT_EQ(short_run(second, 300), short_run(first, 300)) << scene.name;
  }
}

}  // namespace
}  // namespace asperity::scene_mutation_test
