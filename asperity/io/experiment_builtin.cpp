#include <fmt/format.h>
#include <fmt/ranges.h>

#include "asperity/core/suggest.h"
#include "asperity/io/detail/scene_json.h"
#include "asperity/io/embedded_file.h"
#include "asperity/io/experiment.h"

namespace asperity {
namespace {

std::string stem(std::string_view file) {
  return std::string(file.substr(0, file.rfind('.')));
}

std::vector<BuiltinScene> list_scenes() {
  std::vector<BuiltinScene> scenes;
  for (const EmbeddedFile& file : embedded_scenes()) {
    BuiltinScene scene{stem(file.name), {}};
    const Result<SceneJson> json = parse_scene_json(file.text, scene.name);
    if (json && json->is_object() && json->contains("summary") && (*json)["summary"].is_string()) {
      scene.summary = (*json)["summary"].get<std::string>();
    }
    scenes.push_back(std::move(scene));
  }
  return scenes;
}

}  // namespace

const std::vector<BuiltinScene>& builtin_scenes() {
  static const std::vector<BuiltinScene> scenes = list_scenes();
  return scenes;
}

Result<std::string> builtin_scene_json(std::string_view name) {
  std::vector<std::string> names;
  for (const EmbeddedFile& file : embedded_scenes()) {
    names.push_back(stem(file.name));
    if (edit_distance(names.back(), name) == 0) return std::string(file.text);
  }
  const std::string near = nearest_name(name, names);
  return bad_value(fmt::format("\"{}\" is no built-in scene{}", name,
                               near.empty() ? "" : fmt::format("; did you mean \"{}\"?", near)),
                   "", fmt::format("{}", fmt::join(names, ", ")));
}

}  // namespace asperity
