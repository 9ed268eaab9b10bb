#include "apps/asperity/arguments.h"

#include <CLI/CLI.hpp>
#include <cmath>
#include <utility>

#include "apps/asperity/command.h"

namespace asperity::program {

Argument Argument::group(const std::string& heading) {
  return Argument(option_->group(heading));
}

Argument Argument::required() {
  return Argument(option_->required());
}

Argument Argument::expected(int least, int most) {
  return Argument(option_->expected(least, most));
}

Argument Argument::delimiter(char between) {
  return Argument(option_->delimiter(between));
}

Argument Argument::shows_default() {
  return Argument(option_->capture_default_str());
}

Argument Argument::between(double least, double most) {
  // Nan is below and above nothing, so a check of the ends alone would let it in.
  return Argument(option_->check(CLI::Range(least, most))->check([](const std::string& text) {
    double value = 0.0;
    return CLI::detail::lexical_cast(text, value) && std::isnan(value) ? text + " is not a number" : std::string();
  }));
}

Argument Argument::between(int least, int most) {
  return Argument(option_->check(CLI::Range(least, most)));
}

Argument Argument::one_of(const std::vector<std::string>& names) {
  return Argument(option_->check(CLI::IsMember(names)));
}

Argument Argument::excludes(Argument other) {
  return Argument(option_->excludes(other.option_));
}

Arguments Arguments::command(const std::string& name, const std::string& help) {
  return Arguments(*app_->add_subcommand(name, help));
}

Argument Arguments::option(const std::string& name, std::string& value, const std::string& help) {
  return Argument(app_->add_option(name, value, help));
}

Argument Arguments::option(const std::string& name, std::vector<std::string>& values, const std::string& help) {
  return Argument(app_->add_option(name, values, help));
}

Argument Arguments::option(const std::string& name, int& value, const std::string& help) {
  return Argument(app_->add_option(name, value, help));
}

Argument Arguments::option(const std::string& name, std::uint32_t& value, const std::string& help) {
  return Argument(app_->add_option(name, value, help));
}

Argument Arguments::option(const std::string& name, std::size_t& value, const std::string& help) {
  return Argument(app_->add_option(name, value, help));
}

Argument Arguments::option(const std::string& name, double& value, const std::string& help) {
  return Argument(app_->add_option(name, value, help));
}

Argument Arguments::flag(const std::string& name, bool& value, const std::string& help) {
  return Argument(app_->add_flag(name, value, help));
}

Argument Arguments::flag(const std::string& name, std::string& value, const std::string& help) {
  return Argument(app_->add_flag(name, value, help));
}

void Arguments::closing_words(const std::string& text) {
  app_->footer(text);
}

void Arguments::when_called(std::function<void()> action) {
  app_->callback(std::move(action));
}

CommandLine::CommandLine(const std::string& name, const std::string& description, const std::string& version)
    : app_(std::make_unique<CLI::App>(description)) {
  app_->name(name);
  app_->set_version_flag("--version", version);
  app_->require_subcommand(1);
}

CommandLine::~CommandLine() = default;

Arguments CommandLine::arguments() {
  return Arguments(*app_);
}

std::optional<int> CommandLine::parse(int argc, char** argv, std::string& problem) {
  try {
    app_->parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app_->exit(error);
    problem = error.what();
    return exit_bad_input;
  }
  return std::nullopt;
}

}  // namespace asperity::program
