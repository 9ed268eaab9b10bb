#pragma once
// The command line's options, as commands declare them. CLI11 reads them; it is a large header, and only arguments.cpp
// includes it.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace asperity::program {

/// One option or positional of a command; what is said of it is said by its members, which answer it again. [main]
class Argument {
 public:
  explicit Argument(CLI::Option* option) : option_(option) {}
  /// The heading under which --help lists it.
  Argument group(const std::string& heading);
  Argument required();
  /// How many values it takes.
  Argument expected(int least, int most);
  /// Several values may stand in one word, with this between them.
  Argument delimiter(char between);
  /// --help shows the value that its variable has now.
  Argument shows_default();
  Argument between(double least, double most);
  Argument between(int least, int most);
  Argument one_of(const std::vector<std::string>& names);
  /// Not together with the other.
  Argument excludes(Argument other);

 private:
  CLI::Option* option_;
};

/// The options of the program or of one command. Variables that are given must outlive the parsing. [main]
class Arguments {
 public:
  explicit Arguments(CLI::App& app) : app_(&app) {}
  Arguments command(const std::string& name, const std::string& help);
  /// `name`: "--out", or "FILE" for what stands without a name.
  Argument option(const std::string& name, std::string& value, const std::string& help);
  Argument option(const std::string& name, std::vector<std::string>& values, const std::string& help);
  Argument option(const std::string& name, int& value, const std::string& help);
  Argument option(const std::string& name, std::uint32_t& value, const std::string& help);
  Argument option(const std::string& name, std::size_t& value, const std::string& help);
  Argument option(const std::string& name, double& value, const std::string& help);
  Argument flag(const std::string& name, bool& value, const std::string& help);
  /// A flag that may have a value: "--implicit{256}" is "256" where --implicit stands alone.
  Argument flag(const std::string& name, std::string& value, const std::string& help);
  /// What --help ends with.
  void closing_words(const std::string& text);
  void when_called(std::function<void()> action);

 private:
  CLI::App* app_;
};

/// The whole command line.
class CommandLine {
 public:
  CommandLine(const std::string& name, const std::string& description, const std::string& version);
  ~CommandLine();
  CommandLine(const CommandLine&) = delete;
  CommandLine& operator=(const CommandLine&) = delete;

  Arguments arguments();
  /// Reads it and calls the command's action. An exit code where there is nothing more to do: 0 after --help and
  /// --version; `problem` then says what is wrong, or is empty. [main]
  std::optional<int> parse(int argc, char** argv, std::string& problem);

 private:
  std::unique_ptr<CLI::App> app_;
};

}  // namespace asperity::program
