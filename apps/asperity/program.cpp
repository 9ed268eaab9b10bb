// The asperity program: commands, exit codes, one message for each error.

#include "apps/asperity/program.h"

#include <fmt/format.h>

#include <cstdio>
#include <exception>
#include <filesystem>
#include <iostream>

#include "apps/asperity/command.h"

namespace asperity {
namespace {

using namespace program;

constexpr const char* examples =
    "Examples:\n"
    "  asperity touch                                   touch the built-in scene, write a report\n"
    "  asperity touch bunny.obj                         touch a mesh as it is\n"
    "  asperity touch bunny.obj --relief rock.png --height 2mm\n"
    "  asperity compare M_a-H_3 --laws proxy,mesostructure\n"
    "  asperity inspect rock.png --device touch         what it is, and what can be felt of it\n"
    "  asperity replay out/icosphere-relief/trace.asptrace\n"
    "  asperity COMMAND --help                          teaches one command\n"
    "\n"
    "Exit codes: 0 success, 1 it ran but what it checked does not hold, 2 bad input or usage.";

/// What it was called as: a program that is asperity with something of its own has its own name.
std::string called_as(int argc, char** argv) {
  const std::string name = argc > 0 ? std::filesystem::path(argv[0]).filename().string() : std::string();
  return name.empty() ? "asperity" : name;
}

std::string whole_command_line(int argc, char** argv) {
  std::string line = called_as(argc, argv);
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    const bool plain = !argument.empty() && argument.find_first_of(" \"'\\$&|;<>()*?`\n\t") == std::string::npos;
    line += plain ? " " + argument : " '" + argument + "'";
  }
  return line;
}

int fail(const std::string& message) {
  std::cout.flush();
  std::cerr << "asperity: " << message << '\n';
  return exit_bad_input;
}

int run(int argc, char** argv) {
  CLI::App app{
      "Asperity renders fine surface detail to the hand: it slides a probe over a surface and answers the force at "
      "every tick."};
  Console console;
  Action action;
  console.command_line = whole_command_line(argc, argv);
  app.name(called_as(argc, argv));
  app.footer(examples);
  app.set_version_flag("--version", program_name());
  app.require_subcommand(1);
  add_touch(app, console, action);
  add_compare(app, console, action);
  add_replay(app, console, action);
  add_inspect(app, console, action);
  add_convert(app, console, action);
  add_fit_friction(app, console, action);
  add_score(app, console, action);
  add_library(app, console, action);
  add_scenes(app, console, action);
  add_bench(app, console, action);
  add_schema(app, console, action);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& problem) {
    if (problem.get_exit_code() == 0) return app.exit(problem);
    return fail(fmt::format("{}; asperity --help shows what is accepted", problem.what()));
  }
  const Result<int> code = action();
  if (!code) return fail(code.error().message());
  std::cout.flush();
  return std::cout ? *code : fail("standard output cannot be written");
}

}  // namespace

int run_program(int argc, char** argv, std::initializer_list<Status> prepared) {
  try {
    for (const Status& status : prepared) {
      if (!status) return fail(status.error().message());
    }
    return run(argc, argv);
  } catch (const std::exception& problem) {
    return fail(problem.what());
  }
}

}  // namespace asperity
