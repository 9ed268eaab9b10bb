#include <unistd.h>

#include <chrono>
#include <cmath>
#include <iostream>
#include <memory>

#include <fmt/format.h>

#include "apps/asperity/command.h"

namespace asperity::program {
namespace {

/// Writes one line that is overwritten on a terminal, and one line a stage elsewhere.
class ProgressLine {
 public:
  explicit ProgressLine(bool terminal) : terminal_(terminal) {}
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;
  ~ProgressLine() {
    if (terminal_ && drawn_) std::cerr << "\r\x1b[K" << std::flush;
  }

  void show(std::string_view what, double fraction) {
    using Clock = std::chrono::steady_clock;
    const Clock::time_point now = Clock::now();
    const bool new_stage = what != stage_;
    stage_ = what;
    if (!terminal_) {
      if (new_stage) std::cerr << stage_ << " ...\n";
      return;
    }
    constexpr std::chrono::milliseconds patience(400);
    constexpr std::chrono::milliseconds interval(100);
    if (now - begin_ < patience || (now - last_ < interval && !new_stage)) return;
    last_ = now;
    drawn_ = true;
    std::cerr << fmt::format("\r\x1b[K{} {:3.0f} %", stage_, 100.0 * fraction) << std::flush;
  }

 private:
  bool terminal_;
  bool drawn_ = false;
  std::string stage_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  std::chrono::steady_clock::time_point last_{};
};

}  // namespace

Progress Console::progress() const {
  const bool terminal = ::isatty(STDERR_FILENO) == 1;
  if (!terminal && !show_progress) return {};
  auto line = std::make_shared<ProgressLine>(terminal);
  return [line](std::string_view what, double fraction) { line->show(what, fraction); };
}

void Console::note(const std::string& text) const {
  std::cerr << "note: " << text << '\n';
}

void Console::print(const Json& document) const {
  std::cout << document.dump(2, ' ', false, Json::error_handler_t::replace) << '\n';
}

Json finite_or_null(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}

std::string program_name() {
  return "asperity " ASPERITY_VERSION;
}

void add_console_options(Arguments& command, Console& console, bool with_json) {
  if (with_json) command.flag("--json", console.json, "Answer on standard output as JSON, for programs");
  command.flag("--progress", console.show_progress, "Show progress on standard error even when it is no terminal");
}

}  // namespace asperity::program
