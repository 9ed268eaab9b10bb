// What fine features are in numbers: roughness, the friction it proposes, and how rough their waves feel.

#include "apps/asperity/feature_facts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace asperity::program {
namespace {

/// Felt roughness of a feature where the mapping makes its wavelength `stretch` times as long.
double felt(const SurfaceFeature& feature, double stretch) {
  const FeatureSpec& spec = feature.spec();
  if (spec.kind == FeatureKind::grating || spec.kind == FeatureKind::circular_grating)
    return felt_roughness(spec.amplitude, stretch * spec.wavelength.x(), felt_tip_radius);
  constexpr double samples_a_wave = 64.0;
  const bool noise = spec.kind == FeatureKind::noise;
  const double repeat = noise ? spec.period.x() : spec.wavelength.x();
  const auto count = static_cast<std::size_t>(std::clamp(samples_a_wave * repeat / feature.wavelength(), 64.0, 1024.0));
  const double spacing = repeat / static_cast<double>(count);
  const double direction = noise ? 0.0 : spec.direction;
  const Vec2 way(std::cos(direction), std::sin(direction));
  std::vector<double> heights(count);
  for (std::size_t i = 0; i < count; ++i) heights[i] = feature.sample(static_cast<double>(i) * spacing * way).height;
  return felt_roughness(heights, stretch * spacing, felt_tip_radius);
}

FeltWaves felt_waves(const SurfaceFeature& feature, const WaveRange& waves) {
  constexpr int steps = 48;
  FeltWaves answer{waves, 0.0, 0.0, -1.0, 0.0};
  const int last = waves.longest < 1.01 * waves.shortest ? 0 : steps;
  for (int i = 0; i <= last; ++i) {
    const double wave = waves.shortest * std::pow(waves.longest / waves.shortest, static_cast<double>(i) / steps);
    const double rough = felt(feature, wave / feature.wavelength());
    if (i == 0) answer.shortest = rough;
    answer.longest = rough;
    if (rough > answer.roughest) {
      answer.roughest = rough;
      answer.roughest_wave = wave;
    }
  }
  return answer;
}

/// What the two directions of a feature are called.
std::pair<const char*, const char*> directions_of(FeatureKind kind) {
  switch (kind) {
    case FeatureKind::grating:
    case FeatureKind::triangular:
    case FeatureKind::serrated: return {"across its lay", "along it"};
    default: return {"along its first axis", "along its second"};
  }
}

std::string felt_line(const FeatureFact& fact) {
  const FeltWaves& felt = *fact.felt;
  const WaveRange& waves = felt.waves;
  const std::string tip = fmt::format("rms slope of the path of a {} tip", format_length(felt_tip_radius));
  const std::string name = fmt::format("{}: {}", fact.surface, feature_name(fact.feature.spec().kind));
  if (waves.longest < 1.01 * waves.shortest) {
    return fmt::format("{} under the stroke has waves of {}, whose felt roughness is {:.3g} ({})", name,
                       format_length(waves.shortest), felt.shortest, tip);
  }
  constexpr double alike = 1.01;
  std::string words;
  if (felt.longest > alike * felt.shortest) {
    words = fmt::format(
        "its finest waves feel smoothest, although the force along the surface is largest there, {:.2g} times that on "
        "the longest: the tip does not reach into them",
        waves.longest / waves.shortest);
  } else if (felt.shortest > alike * felt.longest) {
    words = "its longest waves feel smoothest: they are the flattest";
  } else {
    words = "its finest waves feel as its longest do";
  }
  return fmt::format(
      "{} under the stroke has a felt roughness of {:.3g} at its finest waves of {} and {:.3g} at its longest of {}; "
      "roughest are those of {}, {:.3g} ({}): {}",
      name, felt.shortest, format_length(waves.shortest), felt.longest, format_length(waves.longest),
      format_length(felt.roughest_wave), felt.roughest, tip, words);
}

}  // namespace

std::string roughness_text(const Roughness& roughness) {
  // What rounding leaves of a straight profile is no roughness.
  constexpr double rounding = 1e-15;
  const auto length = [](double metres) { return format_length(metres < rounding ? 0.0 : metres); };
  const double slope = roughness.mean_slope < 1e-12 ? 0.0 : roughness.mean_slope;
  return fmt::format("R_a {}, R_q {}, mean slope {:.3g}", length(roughness.average), length(roughness.rms), slope);
}

std::string proposal_reason(double smooth) {
  return fmt::format(
      "friction: to {:g} of the smooth material (--friction) comes the mean slope of each direction, because carrying "
      "a load up a slope m takes m times the load and none of it comes back where the slider drops off; at most 2",
      smooth);
}

std::vector<FeatureFact> feature_facts(const Experiment& experiment, double smooth) {
  std::vector<FeatureFact> facts;
  for (const Instance& instance : experiment.scene.instances()) {
    if (instance.fine == nullptr) continue;
    const auto add = [&](const SurfaceFeature& feature, FeatureScale scale) {
      const double direction = feature.spec().direction;
      FeatureFact fact{instance.name, feature, scale, {}, {}, 0.0, 0.0, {}};
      fact.across = feature.roughness_along(direction);
      fact.along = feature.roughness_along(direction + 0.5 * std::numbers::pi);
      const FrictionProposal proposal = propose_friction({fact.across, fact.along}, smooth);
      fact.friction_across = proposal.rough_along_s ? proposal.across : proposal.along;
      fact.friction_along = proposal.rough_along_s ? proposal.along : proposal.across;
      if (scale == FeatureScale::texture) {
        const WaveRange waves = waves_along(instance, feature, experiment.path);
        if (waves.changes) fact.felt = felt_waves(feature, waves);
      }
      facts.push_back(std::move(fact));
    };
    for (const SurfaceFeature& feature : instance.fine->settings().texture) add(feature, FeatureScale::texture);
    for (const SurfaceFeature& feature : instance.fine->settings().micro) add(feature, FeatureScale::friction);
  }
  return facts;
}

std::vector<std::string> feature_lines(const std::vector<FeatureFact>& facts, double smooth) {
  std::vector<std::string> lines;
  for (const FeatureFact& fact : facts) {
    const auto [across, along] = directions_of(fact.feature.spec().kind);
    const char* friction = fact.felt_as == FeatureScale::friction ? "friction proposed"
                                                                  : "friction proposed, were it felt as nothing else";
    lines.push_back(fmt::format("{}: {} of {}, felt as {}: {} {}; {} {}; {}: {:.3g} and {:.3g}", fact.surface,
                                feature_name(fact.feature.spec().kind), format_length(fact.feature.wavelength()),
                                scale_name(fact.felt_as), across, roughness_text(fact.across), along,
                                roughness_text(fact.along), friction, fact.friction_across, fact.friction_along));
    if (fact.felt) lines.push_back(felt_line(fact));
  }
  if (!facts.empty()) lines.push_back(proposal_reason(smooth));
  return lines;
}

}  // namespace asperity::program
