#include "asperity/study/friction_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

namespace asperity {
namespace {

/// One dimension of the search, by a number from 0 to 1.
struct Parameter {
  std::string name;
  double lower = 0.0;
  double upper = 1.0;
  bool logarithmic = true;
  double start = 0.0;

  [[nodiscard]] double value(double share) const {
    return logarithmic ? lower * std::pow(upper / lower, share) : lower + (upper - lower) * share;
  }
  [[nodiscard]] double share() const {
    const double s =
        logarithmic ? std::log(start / lower) / std::log(upper / lower) : (start - lower) / (upper - lower);
    return std::clamp(s, 0.0, 1.0);
  }
};

/// Bounds of what a law reads, wide enough for anything that the rig's step can follow.
std::optional<Parameter> parameter_of_law(FrictionKind kind, const std::string& name) {
  if (name == "stiffness") return Parameter{name, 2e3, 2e5, true, 8e4};
  if (name == "damping") return Parameter{name, 1e-2, 30.0, true, 8.0};
  if (name == "viscosity" && kind == FrictionKind::viscous) return Parameter{name, 1.0, 300.0, true, 100.0};
  if (name == "viscosity") return Parameter{name, 1e-2, 10.0, true, 0.03};
  // Slower than a step's change of speed nothing would be caught sticking.
  if (name == "stick_speed" && kind == FrictionKind::coulomb) return Parameter{name, 1e-4, 1e-2, true, 1e-3};
  if (name == "stick_speed") return Parameter{name, 2e-4, 2e-2, true, 5e-3};
  if (name == "stribeck_speed") return Parameter{name, 1e-5, 1e-1, true, 3e-4};
  if (name == "exponent") return Parameter{name, 0.5, 4.0, false, 1.0};
  if (name == "adhesion") return Parameter{name, 0.0, 0.9, false, 0.1};
  return std::nullopt;  // break_away: a constant force instead of the static coefficient
}

bool has_coefficients(FrictionKind kind) {
  return kind != FrictionKind::viscous;
}

bool has_static_coefficient(FrictionKind kind) {
  return kind == FrictionKind::implicit_coulomb || kind == FrictionKind::karnopp || kind == FrictionKind::lugre;
}

/// Mean of what the fitted traces say, before any law.
struct FirstGuess {
  double load = 0.2;
  double still = 0.4;
  double sliding = 0.3;
};

FirstGuess first_guess(const std::vector<const FrictionTrace*>& traces, const FitSettings& settings) {
  FirstGuess guess;
  double still = 0.0;
  double sliding = 0.0;
  std::vector<double> loads;
  for (const FrictionTrace* trace : traces) {
    const StickSlip found = measure_stick_slip(*trace, settings.stick_slip);
    still += found.still / static_cast<double>(traces.size());
    sliding += found.sliding / static_cast<double>(traces.size());
    const double load = load_of_sticking(*trace, settings.stick_slip);
    if (load > 0.0) loads.push_back(load);
  }
  guess.sliding = std::clamp(sliding, 0.02, 2.0);
  guess.still = std::clamp(still, guess.sliding, 2.0 * guess.sliding);
  // Creep makes an estimate too large, nothing makes it too small.
  if (!loads.empty()) guess.load = *std::min_element(loads.begin(), loads.end());
  return guess;
}

std::vector<Parameter> parameters_of(FrictionKind kind, const FirstGuess& guess, const FitSettings& settings) {
  std::vector<Parameter> parameters;
  if (!settings.mass) {
    const double mass = settings.load.value_or(guess.load) / settings.gravity;
    parameters.push_back({"mass", mass / 3.0, mass * 3.0, true, mass});
  }
  if (!settings.load && (settings.mass || !settings.tied))
    parameters.push_back({"load", guess.load / 3.0, guess.load * 3.0, true, guess.load});
  if (has_coefficients(kind)) {
    parameters.push_back({"dynamic_friction", 0.5 * guess.sliding, 1.5 * guess.sliding, false, guess.sliding});
    if (has_static_coefficient(kind))
      parameters.push_back({"static_over_dynamic", 1.0, 2.0, false, guess.still / guess.sliding});
  }
  for (const std::string& name : friction_parameters(kind)) {
    if (std::optional<Parameter> parameter = parameter_of_law(kind, name)) parameters.push_back(*parameter);
  }
  return parameters;
}

/// The law at a point of the search.
LawFit law_at(FrictionKind kind, const std::vector<Parameter>& parameters, std::span<const double> shares,
              const FitSettings& settings) {
  LawFit fit;
  fit.law.kind = kind;
  fit.mass = settings.mass.value_or(0.0);
  double over = 1.0;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const std::string& name = parameters[i].name;
    const double value = parameters[i].value(shares[i]);
    if (name == "mass") fit.mass = value;
    if (name == "load") fit.load = value;
    if (name == "dynamic_friction") fit.coefficients.sliding = value;
    if (name == "static_over_dynamic") over = value;
    if (const auto member = member_of_law(name)) fit.law.*member = value;
  }
  fit.coefficients.still = over * fit.coefficients.sliding;
  if (fit.load <= 0.0) fit.load = settings.load.value_or(fit.mass * settings.gravity);
  return fit;
}

/// A step with which the law's springs and dampers can be integrated.
Seconds step_for(const LawFit& fit, const FrictionTrace& trace, Seconds wished) {
  double dt = wished.count();
  const double stiffness = fit.law.stiffness + trace.stiffness;
  double damping = fit.law.damping + fit.law.viscosity;
  if (fit.law.kind == FrictionKind::coulomb) damping += fit.coefficients.sliding * fit.load / fit.law.stick_speed;
  // An eighth of the way to where the integration of a spring would break down, and half of a damper's.
  while ((dt * dt * stiffness > 0.5 * fit.mass || dt * damping > fit.mass) && dt > 1e-7) dt *= 0.5;
  return Seconds(dt);
}

/// The longer of so many periods and of a time, but no longer than the measured record.
Seconds length_of(double periods, Seconds least, const StickSlip& measured, const FrictionTrace& trace) {
  const Seconds whole(static_cast<double>(trace.friction.size()) * trace.spacing);
  return std::min(whole, std::max(least, Seconds(periods * measured.period)));
}

/// The rig for a trace.
RigSettings rig_for(const LawFit& fit, const FrictionTrace& trace, const StickSlip& measured,
                    const FitSettings& settings, double finer) {
  RigSettings rig;
  rig.mass = fit.mass;
  rig.load = fit.load;
  rig.stiffness = trace.stiffness;
  rig.speed = trace.speed;
  rig.dt = step_for(fit, trace, settings.dt) / finer;
  rig.spacing = Seconds(trace.spacing);
  rig.start = measured.level;
  // A viscous slider takes longer than any stick-slip to forget where it began.
  if (fit.law.kind == FrictionKind::viscous) rig.start = fit.law.viscosity * trace.speed / fit.load;
  rig.warm_up = length_of(settings.warm_up_periods, settings.warm_up, measured, trace);
  rig.duration = length_of(settings.periods, settings.duration, measured, trace);
  if (fit.law.kind == FrictionKind::viscous) rig.warm_up = Seconds(0.0);
  return rig;
}

Result<TraceComparison> compare_with(const LawFit& fit, const FrictionTrace& trace, const StickSlip& measured,
                                     const FitSettings& settings, double finer) {
  const RigSettings rig = rig_for(fit, trace, measured, settings, finer);
  TraceComparison comparison;
  ASPERITY_TRY(comparison.prediction, pull_slider(fit.law, fit.coefficients, rig));
  comparison.prediction.name = trace.name;
  StickSlipSettings same = settings.stick_slip;
  same.threshold = measured.threshold;
  comparison.measured = measured;
  comparison.predicted = measure_stick_slip(comparison.prediction, same);
  comparison.errors = compare_stick_slip(measured, comparison.predicted);
  return comparison;
}

/// See TraceComparison.
Result<bool> slides_as_well(const LawFit& fit, const FrictionTrace& trace, const TraceComparison& found,
                            const FitSettings& settings) {
  if (found.predicted.steady()) return false;
  RigSettings rig = rig_for(fit, trace, found.measured, settings, 1.0);
  rig.start = found.predicted.level;
  rig.start_speed = trace.speed;
  ASPERITY_TRY(const FrictionTrace other, pull_slider(fit.law, fit.coefficients, rig));
  StickSlipSettings same = settings.stick_slip;
  same.threshold = found.measured.threshold;
  return measure_stick_slip(other, same).swing < 0.5 * found.predicted.swing;
}

double root_mean_square(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value * value;
  return values.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(values.size()));
}

/// Everything about the fit of one law.
class LawFitter {
 public:
  LawFitter(FrictionKind kind, std::span<const FitTrace> traces, const std::vector<StickSlip>& measured,
            const FirstGuess& guess, const FitSettings& settings)
      : kind_(kind),
        traces_(traces),
        measured_(measured),
        settings_(settings),
        parameters_(parameters_of(kind, guess, settings)) {}

  Result<LawFit> run(const Minimiser& minimiser, const std::function<void(double)>& progress) {
    SearchBox box;
    for (const Parameter& parameter : parameters_) {
      box.lower.push_back(0.0);
      box.upper.push_back(1.0);
      box.start.push_back(parameter.share());
    }
    const SearchEffort effort{settings_.global_evaluations * parameters_.size(),
                              settings_.local_evaluations * parameters_.size(), settings_.seed};
    const auto most = static_cast<double>(effort.global_evaluations + effort.local_evaluations);
    double done = 0.0;
    std::vector<double> at = box.start;
    std::size_t evaluations = 0;
    if (!parameters_.empty()) {
      const Cost cost = [&](std::span<const double> shares) {
        if (progress) progress(std::min(1.0, (done += 1.0) / std::max(1.0, most)));
        return cost_of(law_at(kind_, parameters_, shares, settings_));
      };
      ASPERITY_TRY(const SearchResult found, minimiser(cost, box, effort));
      at = found.at;
      evaluations = found.evaluations;
    }
    LawFit fit = law_at(kind_, parameters_, at, settings_);
    fit.evaluations = evaluations;
    for (std::size_t i = 0; i < parameters_.size(); ++i) {
      fit.parameters.push_back(parameters_[i].name);
      if (at[i] < 1e-3 || at[i] > 1.0 - 1e-3) fit.at_bounds.push_back(parameters_[i].name);
    }
    return finished(std::move(fit));
  }

 private:
  double cost_of(const LawFit& fit) const {
    std::vector<double> misfits;
    for (std::size_t i = 0; i < traces_.size(); ++i) {
      if (!traces_[i].fitted) continue;
      const Result<TraceComparison> comparison = compare_with(fit, traces_[i].trace, measured_[i], settings_, 1.0);
      misfits.push_back(comparison ? comparison->errors.misfit() : 10.0);
    }
    return root_mean_square(misfits);
  }

  Result<LawFit> finished(LawFit fit) const {
    std::vector<double> fitted;
    std::vector<double> predicted;
    for (std::size_t i = 0; i < traces_.size(); ++i) {
      ASPERITY_TRY(TraceComparison comparison, compare_with(fit, traces_[i].trace, measured_[i], settings_, 1.0));
      ASPERITY_TRY(const TraceComparison finer, compare_with(fit, traces_[i].trace, measured_[i], settings_, 2.0));
      ASPERITY_TRY(comparison.also_slides, slides_as_well(fit, traces_[i].trace, comparison, settings_));
      const double misfit = comparison.errors.misfit();
      fit.step_error = std::max(fit.step_error, std::abs(finer.errors.misfit() - misfit));
      (traces_[i].fitted ? fitted : predicted).push_back(misfit);
      fit.traces.push_back(std::move(comparison));
    }
    fit.fitted_misfit = root_mean_square(fitted);
    fit.predicted_misfit = root_mean_square(predicted);
    return fit;
  }

  FrictionKind kind_;
  std::span<const FitTrace> traces_;
  const std::vector<StickSlip>& measured_;
  const FitSettings& settings_;
  std::vector<Parameter> parameters_;
};

Status check(std::span<const FitTrace> traces, const FitSettings& settings) {
  if (traces.empty()) return bad_value("there are no traces to fit", "traces", "one or more");
  if (std::none_of(traces.begin(), traces.end(), [](const FitTrace& t) { return t.fitted; }))
    return bad_value("no trace is to be fitted", "traces", "one or more to fit on");
  if (settings.laws.empty()) return bad_value("there are no laws", "laws", "one or more");
  for (const auto& [name, value] : {std::pair("mass", settings.mass), std::pair("load", settings.load)}) {
    if (value && !(std::isfinite(*value) && *value > 0.0)) return bad_value("is not above 0", name, "a number above 0");
  }
  return success();
}

}  // namespace

double FrictionLaw::*member_of_law(const std::string& name) {
  static const std::map<std::string, double FrictionLaw::*> members{{"stiffness", &FrictionLaw::stiffness},
                                                                    {"damping", &FrictionLaw::damping},
                                                                    {"viscosity", &FrictionLaw::viscosity},
                                                                    {"stick_speed", &FrictionLaw::stick_speed},
                                                                    {"stribeck_speed", &FrictionLaw::stribeck_speed},
                                                                    {"exponent", &FrictionLaw::exponent},
                                                                    {"adhesion", &FrictionLaw::adhesion}};
  const auto found = members.find(name);
  return found == members.end() ? nullptr : found->second;
}

double FitErrors::misfit() const {
  return root_mean_square({level, period, amplitude, ratio, shape});
}

void choose_fitted(std::vector<FitTrace>& traces) {
  std::vector<std::size_t> order(traces.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto place = [&](std::size_t i) { return traces[i].trace.speed * std::sqrt(traces[i].trace.stiffness); };
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return place(a) < place(b); });
  for (std::size_t i = 0; i < order.size(); ++i)
    traces[order[i]].fitted = order.size() < 3 || (i % 2 == 0 && i + 1 < order.size());
}

FitErrors compare_stick_slip(const StickSlip& measured, const StickSlip& predicted) {
  const auto logarithm = [](double over, double under) {
    return over > 0.0 && under > 0.0 ? std::clamp(std::log(over / under), -6.0, 6.0) : 6.0;
  };
  FitErrors errors;
  errors.level = logarithm(predicted.level, measured.level);
  errors.ratio = logarithm(predicted.ratio(), measured.ratio());
  if (measured.steady() && predicted.steady()) return errors;
  if (measured.steady() || predicted.steady()) {
    // What swings a little is nearer than what does not at all: an optimiser needs to know where to go.
    const double lesser = std::min(measured.swing, predicted.swing);
    const double larger = std::max(measured.swing, predicted.swing);
    const double more = larger > 0.0 ? 1.0 - std::clamp(lesser / larger, 0.0, 1.0) : 1.0;
    errors.amplitude = (measured.steady() ? 1.0 : -1.0) * (error_of_missing + more);
    errors.period = errors.shape = error_of_missing;
    return errors;
  }
  errors.period = logarithm(predicted.period, measured.period);
  errors.amplitude = logarithm(predicted.amplitude, measured.amplitude);
  std::vector<double> differences;
  for (std::size_t i = 0; i < std::min(measured.cycle.size(), predicted.cycle.size()); ++i)
    differences.push_back(predicted.cycle[i] - measured.cycle[i]);
  const double size = root_mean_square(measured.cycle);
  errors.shape = size > 0.0 ? std::min(3.0, root_mean_square(differences) / size) : error_of_missing;
  return errors;
}

Result<TraceComparison> predict_trace(const LawFit& fit, const FrictionTrace& trace, const FitSettings& settings) {
  ASPERITY_TRY(TraceComparison comparison,
               compare_with(fit, trace, measure_stick_slip(trace, settings.stick_slip), settings, 1.0));
  ASPERITY_TRY(comparison.also_slides, slides_as_well(fit, trace, comparison, settings));
  return comparison;
}

Result<std::vector<LawFit>> fit_friction(std::span<const FitTrace> traces, const FitSettings& settings,
                                         const Minimiser& minimiser, const Progress& progress) {
  ASPERITY_CHECK(check(traces, settings));
  std::vector<StickSlip> measured;
  std::vector<const FrictionTrace*> fitted;
  for (const FitTrace& trace : traces) {
    measured.push_back(measure_stick_slip(trace.trace, settings.stick_slip));
    if (trace.fitted) fitted.push_back(&trace.trace);
  }
  const FirstGuess guess = first_guess(fitted, settings);
  std::vector<LawFit> fits;
  for (std::size_t i = 0; i < settings.laws.size(); ++i) {
    const std::string what =
        fmt::format("fitting {} ({} of {})", friction_name(settings.laws[i]), i + 1, settings.laws.size());
    const std::function<void(double)> of_law = [&](double fraction) {
      if (progress) progress(what, fraction);
    };
    ASPERITY_TRY(LawFit fit, LawFitter(settings.laws[i], traces, measured, guess, settings).run(minimiser, of_law));
    fits.push_back(std::move(fit));
  }
  return fits;
}

}  // namespace asperity
