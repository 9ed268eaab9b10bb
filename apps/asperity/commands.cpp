// The asperity program, with whatever commands it is given: exit codes, one message for each error.

#include <fmt/format.h>

#include <cstdio>
#include <exception>
#include <filesystem>
#include <iostream>

#include "apps/asperity/command.h"

namespace asperity::program {
namespace {

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

int run(int argc, char** argv, std::span<const AddCommand> commands) {
  Console console;
  Action action;
  console.command_line = whole_command_line(argc, argv);
  CommandLine line(called_as(argc, argv),
                   "Asperity renders fine surface detail to the hand: it slides a probe over a surface and answers the "
                   "force at every tick.",
                   program_name());
  Arguments program = line.arguments();
  program.closing_words(examples);
  for (const AddCommand add : commands) add(program, console, action);
  std::string problem;
  if (const std::optional<int> code = line.parse(argc, argv, problem)) {
    return problem.empty() ? *code : fail(problem + "; asperity --help shows what is accepted");
  }
  const Result<int> code = action();
  if (!code) return fail(code.error().message());
  std::cout.flush();
  return std::cout ? *code : fail("standard output cannot be written");
}

}  // namespace

int run_commands(int argc, char** argv, std::span<const AddCommand> commands, std::initializer_list<Status> prepared) {
  try {
    for (const Status& status : prepared) {
      if (!status) return fail(status.error().message());
    }
    return run(argc, argv, commands);
  } catch (const std::exception& problem) {
    return fail(problem.what());
  }
}

}  // namespace asperity::program
