// Fits of friction laws: what they made themselves is found again, and errors are what they say.

#include "asperity/study/friction_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "asperity/study/friction_report.h"
#ifdef ASPERITY_HAS_NLOPT
#include "asperity/study/nlopt/nlopt_minimiser.h"
#endif

namespace asperity::friction_fit_test {
namespace {

FrictionTrace made_by(FrictionKind kind, double stiffness, double speed) {
  FrictionLaw law;
  law.kind = kind;
  law.stiffness = 5e4;
  law.damping = kind == FrictionKind::implicit_coulomb ? 5.0 : 0.0;
  law.viscosity = kind == FrictionKind::karnopp ? 0.05 : 0.0;
  FrictionCoefficients coefficients;
  coefficients.still = 0.40;
  coefficients.sliding = 0.34;
  RigSettings rig;
  rig.mass = 0.025;
  rig.load = 0.025 * 9.81;
  rig.stiffness = stiffness;
  rig.speed = speed;
  rig.start = 0.34;
  rig.warm_up = Seconds(1.0);
  rig.duration = Seconds(3.0);
  FrictionTrace trace = pull_slider(law, coefficients, rig).value();
  trace.name = "made";
  return trace;
}

/// Looks nowhere but at the start: a fit that needs no optimiser.
Result<SearchResult> stays(const Cost& cost, const SearchBox& box, const SearchEffort&) {
  return SearchResult{box.start, cost(box.start), 1};
}

TEST(FrictionFit, ATraceIsNoErrorAwayFromItself) {
  const StickSlip found = measure_stick_slip(made_by(FrictionKind::implicit_coulomb, 168.0, 1e-3), {});
  ASSERT_FALSE(found.steady());
  EXPECT_EQ(compare_stick_slip(found, found).misfit(), 0.0);
  StickSlip other = found;
  other.period *= 1.1;
  EXPECT_NEAR(compare_stick_slip(found, other).period, std::log(1.1), 1e-12);
  EXPECT_NEAR(compare_stick_slip(found, other).misfit(), std::log(1.1) / std::sqrt(5.0), 1e-12);
  other.period = 0.0;
  EXPECT_GE(compare_stick_slip(found, other).period, error_of_missing);
  EXPECT_LE(compare_stick_slip(found, other).amplitude, -error_of_missing);
  EXPECT_GE(compare_stick_slip(other, found).amplitude, error_of_missing);
}

TEST(FrictionFit, ChoosesEveryOtherTraceFromTheSlowEnd) {
  std::vector<FitTrace> traces(5);
  const double speeds[] = {4300e-6, 42e-6, 1100e-6, 42e-6, 1100e-6};
  const double stiffness[] = {1002.0, 2254.0, 1002.0, 168.0, 168.0};
  for (std::size_t i = 0; i < 5; ++i) {
    traces[i].trace.speed = speeds[i];
    traces[i].trace.stiffness = stiffness[i];
  }
  choose_fitted(traces);
  std::vector<bool> fitted;
  for (const FitTrace& trace : traces) fitted.push_back(trace.fitted);
  EXPECT_EQ(fitted, (std::vector<bool>{false, false, false, true, true}));
  traces.resize(2);
  choose_fitted(traces);
  EXPECT_TRUE(traces[0].fitted && traces[1].fitted);
}

TEST(FrictionFit, RefusesWhatCannotBeFitted) {
  std::vector<FitTrace> traces{{made_by(FrictionKind::karnopp, 168.0, 1e-3), false}};
  FitSettings settings;
  settings.laws = {FrictionKind::karnopp};
  EXPECT_FALSE(fit_friction({}, settings, stays, {}).ok());
  EXPECT_FALSE(fit_friction(traces, settings, stays, {}).ok());
  traces[0].fitted = true;
  EXPECT_TRUE(fit_friction(traces, settings, stays, {}).ok());
  settings.mass = -1.0;
  EXPECT_FALSE(fit_friction(traces, settings, stays, {}).ok());
  settings = {};
  EXPECT_FALSE(fit_friction(traces, settings, stays, {}).ok());
}

TEST(FrictionFit, FollowsTheRigAndTheTie) {
  const std::vector<FitTrace> traces{{made_by(FrictionKind::karnopp, 168.0, 1e-3), true}};
  FitSettings settings;
  settings.laws = {FrictionKind::lugre, FrictionKind::viscous};
  const auto tied = fit_friction(traces, settings, stays, {});
  ASSERT_TRUE(tied.ok());
  EXPECT_NEAR((*tied)[0].load, 9.81 * (*tied)[0].mass, 1e-12);
  settings.mass = 0.02;
  settings.load = 0.5;
  const auto given = fit_friction(traces, settings, stays, {});
  ASSERT_TRUE(given.ok());
  EXPECT_EQ((*given)[0].mass, 0.02);
  EXPECT_EQ((*given)[0].load, 0.5);
  EXPECT_TRUE((*given)[1].traces[0].predicted.steady());
  EXPECT_NE(verdict((*given)[1], traces).find("no stick-slip"), std::string::npos);
}

TEST(FrictionFit, TellsWhereSteadySlidingIsPossibleAsWell) {
  // A constant dynamic friction leaves a steady slide as it is, and a swing too.
  LawFit fit;
  fit.law.kind = FrictionKind::implicit_coulomb;
  fit.law.stiffness = 5e4;
  fit.coefficients.still = fit.coefficients.sliding = 0.3;
  fit.mass = 0.02;
  fit.load = 0.2;
  const FrictionTrace fast = made_by(FrictionKind::implicit_coulomb, 1002.0, 4.3e-3);
  const Result<TraceComparison> swinging = predict_trace(fit, fast, {});
  ASSERT_TRUE(swinging.ok());
  ASSERT_FALSE(swinging->predicted.steady());
  EXPECT_TRUE(swinging->also_slides);
  fit.coefficients.still = 0.36;
  const FrictionTrace slow = made_by(FrictionKind::implicit_coulomb, 168.0, 1e-3);
  const Result<TraceComparison> sticking = predict_trace(fit, slow, {});
  ASSERT_TRUE(sticking.ok());
  EXPECT_FALSE(sticking->predicted.steady());
  EXPECT_TRUE(sticking->also_slides);
  // Stribeck's curve leaves none: the slide itself is unstable.
  fit.law.kind = FrictionKind::lugre;
  fit.law.damping = 15.0;
  fit.law.stribeck_speed = 4e-3;
  const Result<TraceComparison> unstable = predict_trace(fit, slow, {});
  ASSERT_TRUE(unstable.ok());
  EXPECT_FALSE(unstable->predicted.steady());
  EXPECT_FALSE(unstable->also_slides);
}

TEST(FrictionReport, HoldsEverythingAndEscapesIt) {
  FrictionReport report;
  report.origin.title = "<b>laws</b>";
  report.origin.command = "asperity fit-friction </script>";
  report.traces = {{made_by(FrictionKind::karnopp, 168.0, 1e-3), true}};
  FitSettings settings;
  settings.laws = {FrictionKind::karnopp};
  report.laws = fit_friction(report.traces, settings, stays, {}).value();
  const Result<std::string> page = friction_report_html(report);
  ASSERT_TRUE(page.ok());
  EXPECT_EQ(page->find("<b>laws"), std::string::npos);
  EXPECT_EQ(page->find("fit-friction </script>"), std::string::npos);
  EXPECT_EQ(page->find("http://"), std::string::npos);
  const std::size_t begin = page->find("id=\"data\">") + 10;
  const auto data = nlohmann::json::parse(page->substr(begin, page->find("</script>", begin) - begin));
  EXPECT_EQ(data["laws"][0]["name"], "karnopp");
  EXPECT_GT(data["laws"][0]["traces"][0]["rows"].size(), 100U);
  report.laws[0].traces.clear();
  EXPECT_FALSE(friction_report_html(report).ok());
}

#ifdef ASPERITY_HAS_NLOPT

TEST(Nlopt, FindsTheLowestOfManyMinima) {
  const Cost bumpy = [](std::span<const double> x) {
    double sum = 0.0;
    for (const double v : x) sum += (v - 0.7) * (v - 0.7) + 0.05 * (1.0 - std::cos(40.0 * (v - 0.7)));
    return sum;
  };
  const SearchBox box{{0.0, 0.0}, {1.0, 1.0}, {0.1, 0.9}};
  const auto first = minimise_with_nlopt(bumpy, box, {1000, 300, 7});
  const auto second = minimise_with_nlopt(bumpy, box, {1000, 300, 7});
  ASSERT_TRUE(first.ok() && second.ok());
  EXPECT_NEAR(first->at[0], 0.7, 1e-3);
  EXPECT_NEAR(first->at[1], 0.7, 1e-3);
  EXPECT_LE(first->evaluations, 1310U);
  EXPECT_EQ(first->at, second->at);
  EXPECT_FALSE(minimise_with_nlopt(bumpy, {{0.0}, {0.0}, {0.0}}, {}).ok());
  EXPECT_FALSE(minimise_with_nlopt(bumpy, {{}, {}, {}}, {}).ok());
  EXPECT_FALSE(minimise_with_nlopt(bumpy, {{0.0}, {1.0}, {2.0}}, {}).ok());
}

TEST(FrictionFit, FindsWhatTheTracesWereMadeWith) {
  const FrictionKind kind = FrictionKind::implicit_coulomb;
  const std::vector<FitTrace> traces{{made_by(kind, 168.0, 5e-4), true}, {made_by(kind, 1002.0, 5e-4), false}};
  FitSettings settings;
  settings.laws = {kind};
  settings.warm_up = Seconds(0.5);
  settings.global_evaluations = 30;
  settings.local_evaluations = 40;
  const auto fits = fit_friction(traces, settings, minimise_with_nlopt, {});
  ASSERT_TRUE(fits.ok()) << fits.error().message();
  const LawFit& fit = fits->front();
  EXPECT_LT(fit.fitted_misfit, 0.03);
  EXPECT_LT(fit.predicted_misfit, 0.1);
  EXPECT_NEAR(fit.coefficients.sliding, 0.34, 0.01);
  EXPECT_NEAR(fit.coefficients.still, 0.40, 0.015);
  EXPECT_NEAR(fit.mass, 0.025, 0.005);
  const auto again = fit_friction(traces, settings, minimise_with_nlopt, {});
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(again->front().law, fit.law);
  EXPECT_EQ(again->front().traces[0].prediction.friction, fit.traces[0].prediction.friction);
}

#endif

}  // namespace
}  // namespace asperity::friction_fit_test
