#pragma once
// What the commands of the program share. Each command has one file: add_NAME declares its options and says what to do.

#include <functional>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <span>
#include <string>

#include "apps/asperity/arguments.h"
#include "asperity/core/progress.h"
#include "asperity/core/result.h"

namespace asperity::program {

using Json = nlohmann::ordered_json;

/// The number; null where it is not finite (a radius without end, an angle of nothing).
Json finite_or_null(double value);

/// Exit codes: the same for every command.
inline constexpr int exit_success = 0;
inline constexpr int exit_check_failed = 1;  ///< it ran, and what it checked does not hold
inline constexpr int exit_bad_input = 2;     ///< input or usage

/// What every command has.
struct Console {
  bool json = false;           ///< machine-readable answer on standard output
  bool show_progress = false;  ///< on standard error even when that is no terminal
  std::string command_line;    ///< as it was called

  /// Progress on standard error, once something has taken longer than a moment; empty when nobody looks. [main]
  [[nodiscard]] Progress progress() const;
  /// "note: ..." on standard error. [main]
  void note(const std::string& text) const;
  /// One JSON document on standard output. [main]
  void print(const Json& document) const;
};

/// What a command does once its options are read: its exit code, or why it could not.
using Action = std::function<Result<int>()>;

/// "asperity 0.1.0"
std::string program_name();

void add_touch(Arguments& program, Console& console, Action& action);
void add_compare(Arguments& program, Console& console, Action& action);
void add_replay(Arguments& program, Console& console, Action& action);
void add_inspect(Arguments& program, Console& console, Action& action);
void add_convert(Arguments& program, Console& console, Action& action);
void add_fit_friction(Arguments& program, Console& console, Action& action);
void add_score(Arguments& program, Console& console, Action& action);
void add_library(Arguments& program, Console& console, Action& action);
void add_scenes(Arguments& program, Console& console, Action& action);
void add_bench(Arguments& program, Console& console, Action& action);
void add_schema(Arguments& program, Console& console, Action& action);
void add_run(Arguments& program, Console& console, Action& action);
void add_doctor(Arguments& program, Console& console, Action& action);

/// Declares a command: its options, and what it does with them.
using AddCommand = void (*)(Arguments& program, Console& console, Action& action);

/// Runs the command line with these commands, and answers the exit code; see run_program. [main]
int run_commands(int argc, char** argv, std::span<const AddCommand> commands, std::initializer_list<Status> prepared);

/// Adds --json and --progress, which every command takes.
void add_console_options(Arguments& command, Console& console, bool with_json = true);

}  // namespace asperity::program
