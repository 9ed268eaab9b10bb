// asperity scenes: the built-in scenes. asperity schema: the schema of scene files.

#include <fmt/format.h>

#include <algorithm>
#include <iostream>
#include <memory>

#include "apps/asperity/command.h"
#include "asperity/io/experiment.h"

namespace asperity::program {
namespace {

Result<int> list_scenes(const Console& console) {
  if (console.json) {
    Json list = Json::array();
    for (const BuiltinScene& scene : builtin_scenes())
      list.push_back(Json{{"name", scene.name}, {"summary", scene.summary}});
    console.print(list);
    return exit_success;
  }
  std::size_t width = 0;
  for (const BuiltinScene& scene : builtin_scenes()) width = std::max(width, scene.name.size());
  for (const BuiltinScene& scene : builtin_scenes())
    std::cout << fmt::format("{:<{}}  {}\n", scene.name, width, scene.summary);
  return exit_success;
}

Result<int> print_scene(const std::string& name) {
  ASPERITY_TRY(const std::string text, builtin_scene_json(name));
  std::cout << text;
  return exit_success;
}

}  // namespace

void add_scenes(Arguments& program, Console& console, Action& action) {
  Arguments command = program.command("scenes", "List the built-in scenes, or print one");
  auto name = std::make_shared<std::string>();
  command.option("NAME", *name, "Print this scene's JSON");
  add_console_options(command, console);
  command.closing_words(
      "A printed scene is a good start for one of your own.\n"
      "Examples:\n"
      "  asperity scenes\n"
      "  asperity scenes M_a-H_3 > mine.json");
  command.when_called([name, &console, &action] {
    action = [name, &console] { return name->empty() ? list_scenes(console) : print_scene(*name); };
  });
}

void add_schema(Arguments& program, Console& console, Action& action) {
  Arguments command = program.command("schema", "Print the JSON Schema of scene files, or what one key is");
  auto key = std::make_shared<std::string>();
  auto page = std::make_shared<bool>(false);
  command.option("KEY", *key, "Say what this key is: stroke.speed, coat.height, or a kind of object");
  command.flag("--page", *page, "Print the reference page of all keys (docs/scene.md)");
  add_console_options(command, console, false);
  command.closing_words(
      "Every key with its unit, range and default. Editors complete and check scenes with it (\"$schema\": "
      "\"scene.schema.json\" beside the scene).\n"
      "Examples:\n"
      "  asperity schema > scene.schema.json\n"
      "  asperity schema stroke.speed");
  command.when_called([key, page, &action] {
    action = [key, page]() -> Result<int> {
      std::string text = *page ? scene_page() : scene_schema_json();
      if (!key->empty()) {
        ASPERITY_TRY(text, scene_key_help(*key));
      }
      std::cout << text;
      return exit_success;
    };
  });
}

}  // namespace asperity::program
