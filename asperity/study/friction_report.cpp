#include "asperity/study/friction_report.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "asperity/io/atomic_file.h"
#include "asperity/study/detail/page.h"
#include "asperity/study/detail/page_data.h"

namespace asperity {
namespace {

using nlohmann::json;

constexpr std::size_t friction_script = 4;        // of report_assets()
constexpr std::size_t most_friction_rows = 1500;  // of a plot

const std::vector<std::string>& shown_parameters() {
  static const std::vector<std::string> names{"mass",           "load",     "static_friction", "dynamic_friction",
                                              "stiffness",      "damping",  "viscosity",       "stick_speed",
                                              "stribeck_speed", "exponent", "adhesion"};
  return names;
}

/// Where a filtered trace first rises through its mean after a fall below it: measured and predicted begin alike.
std::size_t first_rise(const std::vector<double>& y, double level, double threshold) {
  bool below = false;
  for (std::size_t i = 0; i < y.size(); ++i) {
    below = below || y[i] < level - 0.25 * threshold;
    if (below && y[i] >= level) return i;
  }
  return 0;
}

/// Rows [time, measured, predicted] from the first rise of each.
json rows_of(const FrictionTrace& measured, const TraceComparison& comparison, const StickSlipSettings& settings) {
  const std::vector<double> y = filtered(measured, settings);
  const std::vector<double>& p = comparison.prediction.friction;
  const std::size_t y0 = first_rise(y, comparison.measured.level, comparison.measured.threshold);
  const std::size_t p0 = first_rise(p, comparison.predicted.level, comparison.measured.threshold);
  const double length = static_cast<double>(p.size() - p0) * comparison.prediction.spacing;
  const auto samples = std::min(y.size() - y0, static_cast<std::size_t>(length / measured.spacing));
  const std::size_t stride = std::max<std::size_t>(1, samples / most_friction_rows);
  json rows = json::array();
  for (std::size_t i = 0; i < samples; i += stride) {
    const double time = static_cast<double>(i) * measured.spacing;
    const auto at = p0 + static_cast<std::size_t>(time / comparison.prediction.spacing + 0.5);
    rows.push_back({significant(time), significant(y[y0 + i]), significant(p[std::min(at, p.size() - 1)])});
  }
  return rows;
}

std::string with_spread(double value, double spread, bool steady) {
  return steady ? std::string("steady") : fmt::format("{:.4g} ± {:.2g}", value, spread);
}

std::string or_steady(double value, bool steady) {
  return steady ? std::string("steady") : fmt::format("{:.4g}", value);
}

json comparison_row(const FitTrace& trace, const LawFit& fit, const TraceComparison& c) {
  const StickSlip& m = c.measured;
  const StickSlip& p = c.predicted;
  return {trace.trace.name,
          friction_name(fit.law.kind),
          trace.fitted ? "fitted" : "predicted",
          or_steady(p.period, p.steady()),
          with_spread(m.period, m.period_spread, m.steady()),
          error_words(m.period, p.period),
          or_steady(p.amplitude, p.steady()),
          with_spread(m.amplitude, m.amplitude_spread, m.steady()),
          error_words(m.amplitude, p.amplitude),
          fmt::format("{:.3f}", p.ratio()),
          fmt::format("{:.3f}", m.ratio()),
          error_words(m.ratio(), p.ratio()),
          fmt::format("{:.3f}", p.level),
          fmt::format("{:.3f}", m.level),
          error_words(m.level, p.level)};
}

json law_data(const FrictionReport& report, const LawFit& fit) {
  json traces = json::array();
  for (std::size_t i = 0; i < fit.traces.size(); ++i) {
    traces.push_back({{"misfit", significant(fit.traces[i].errors.misfit())},
                      {"rows", rows_of(report.traces[i].trace, fit.traces[i], report.stick_slip)}});
  }
  json parameters = json::array();
  for (const std::string& name : shown_parameters()) {
    const double value = friction_parameter(fit, name);
    const std::string searched = name == "static_friction" ? "static_over_dynamic" : name;
    const bool at_bound = std::count(fit.at_bounds.begin(), fit.at_bounds.end(), searched) > 0;
    parameters.push_back(std::isfinite(value) ? fmt::format("{:.4g}{}", value, at_bound ? " *" : "") : "–");
  }
  return {{"name", friction_name(fit.law.kind)},
          {"fitted_misfit", significant(fit.fitted_misfit)},
          {"predicted_misfit", significant(fit.predicted_misfit)},
          {"verdict", verdict(fit, report.traces)},
          {"parameters", parameters},
          {"traces", traces}};
}

std::string summary_of(const FrictionReport& report) {
  const auto best = std::min_element(report.laws.begin(), report.laws.end(), [](const LawFit& a, const LawFit& b) {
    return a.predicted_misfit < b.predicted_misfit;
  });
  const auto fitted =
      std::count_if(report.traces.begin(), report.traces.end(), [](const FitTrace& t) { return t.fitted; });
  std::string text = fmt::format("{} laws were fitted on {} of {} traces of a slider pulled by a spring",
                                 report.laws.size(), fitted, report.traces.size());
  if (best == report.laws.end() || static_cast<std::size_t>(fitted) == report.traces.size()) return text + ".";
  return text + fmt::format(", and the others predicted. {} predicts best: {}.", friction_name(best->law.kind),
                            verdict(*best, report.traces));
}

json page_data_of(const FrictionReport& report) {
  json traces = json::array();
  json comparison = json::array();
  for (std::size_t i = 0; i < report.traces.size(); ++i) {
    traces.push_back({{"name", report.traces[i].trace.name}, {"fitted", report.traces[i].fitted}});
    for (const LawFit& fit : report.laws) comparison.push_back(comparison_row(report.traces[i], fit, fit.traces[i]));
  }
  json laws = json::array();
  for (const LawFit& fit : report.laws) laws.push_back(law_data(report, fit));
  return {{"title", report.origin.title},
          {"command", report.origin.command},
          {"date", report.origin.date},
          {"program", report.origin.program},
          {"summary", summary_of(report)},
          {"notes", report.origin.notes},
          {"misfit_hint",
           fmt::format("Root of the mean square of five errors: the logarithms of predicted over measured mean level, "
                       "period, amplitude and static/dynamic ratio, and the relative difference of the median cycles. "
                       "0.1 is about 10 %. Steady sliding where stick-slip was measured counts {:g} for period and "
                       "shape, more for amplitude.",
                       error_of_missing)},
          {"traces", traces},
          {"comparison", comparison},
          {"parameter_names", shown_parameters()},
          {"laws", laws}};
}

}  // namespace

double friction_parameter(const LawFit& fit, const std::string& name) {
  const auto& read = friction_parameters(fit.law.kind);
  if (name == "mass") return fit.mass;
  if (name == "load") return fit.load;
  if (name == "dynamic_friction" && fit.coefficients.sliding > 0.0) return fit.coefficients.sliding;
  if (name == "static_friction" && fit.coefficients.still > 0.0) return fit.coefficients.still;
  const auto member = member_of_law(name);
  const bool has = member != nullptr && std::count(read.begin(), read.end(), name) > 0;
  return has ? fit.law.*member : std::numeric_limits<double>::quiet_NaN();
}

std::string error_words(double measured, double predicted) {
  if (!(measured > 0.0 && predicted > 0.0)) return measured > 0.0 || predicted > 0.0 ? "none" : "0 %";
  return fmt::format("{:+.0f} %", 100.0 * (predicted / measured - 1.0));
}

std::string verdict(const LawFit& fit, const std::vector<FitTrace>& traces) {
  std::vector<std::string> steady;
  std::vector<std::string> also_slides;
  for (std::size_t i = 0; i < fit.traces.size(); ++i) {
    if (fit.traces[i].also_slides) also_slides.push_back(traces[i].trace.name);
    if (fit.traces[i].predicted.steady() && !fit.traces[i].measured.steady()) steady.push_back(traces[i].trace.name);
  }
  if (!steady.empty() && steady.size() == fit.traces.size())
    return "slides steadily everywhere: it knows no stick-slip";
  std::string text = fmt::format("misfit {:.2f} on the fitted traces", fit.fitted_misfit);
  if (fit.predicted_misfit > 0.0) text += fmt::format(", {:.2f} on the others", fit.predicted_misfit);
  if (!steady.empty()) text += fmt::format("; slides steadily instead of stick-slip on {}", fmt::join(steady, ", "));
  // Where static and dynamic friction are one, nothing feeds a swing.
  if (fit.coefficients.still <= fit.coefficients.sliding && steady.size() < traces.size()) {
    text += "; elsewhere it only swings on from its start";
  } else if (!also_slides.empty()) {
    text += fmt::format("; begun in motion it slides steadily on {}", fmt::join(also_slides, ", "));
  }
  if (fit.step_error > 0.1)
    text += fmt::format("; half the time step changes a misfit by {:.2f}: not a settled motion", fit.step_error);
  return text;
}

Result<std::string> friction_report_html(const FrictionReport& report) {
  for (const LawFit& fit : report.laws) {
    if (fit.traces.size() != report.traces.size()) {
      return bad_value(fmt::format("has {} comparisons", fit.traces.size()), "laws",
                       fmt::format("{}, one for each trace", report.traces.size()));
    }
  }
  return page_html(report.origin.title + " - Asperity", page_data_of(report), friction_script, "");
}

Status write_friction_report(const std::filesystem::path& path, const FrictionReport& report) {
  ASPERITY_TRY(const std::string html, friction_report_html(report));
  return write_file_atomically(path, html);
}

}  // namespace asperity
