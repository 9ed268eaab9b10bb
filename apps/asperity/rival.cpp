#include "apps/asperity/rival.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "asperity/core/suggest.h"
#include "asperity/render/law_registry.h"
#include "asperity/study/follow.h"

namespace asperity::program {
namespace {

/// Surface kinds that a law's name may start with.
constexpr const char* kinds[] = {"mesh", "relief", "implicit"};
constexpr const char* literal_suffix = "-literal";

/// Whether a friction law was printed with defects.
bool has_literal(const std::string& friction) {
  return friction == "karnopp" || friction == "coulomb" || friction == "lugre";
}

/// "no-friction" and the friction laws: one a name.
bool says_friction(const std::string& word) {
  const std::string stem = word.substr(0, word.rfind(literal_suffix));
  const std::vector<std::string>& names = friction_names();
  return word == "no-friction" || std::find(names.begin(), names.end(), stem) != names.end();
}

Error unknown(const std::string& word, const std::vector<std::string>& accepted) {
  std::string list;
  for (const std::string& known : accepted) list += (list.empty() ? "" : ", ") + known;
  const std::string near = nearest_name(word, accepted);
  return Error{ErrorCode::bad_value,
               fmt::format("\"+{}\" means nothing{}", word, near.empty() ? "" : "; did you mean \"+" + near + "\"?"),
               {},
               "--laws",
               "after a law and \"+\": " + list};
}

/// The part of the word before "-literal", and whether that was there.
std::pair<std::string, Formulation> split(const std::string& word) {
  const std::string suffix = literal_suffix;
  if (!word.ends_with(suffix)) return {word, Formulation::consistent};
  return {word.substr(0, word.size() - suffix.size()), Formulation::literal};
}

Error nothing_there(const std::string& word, const std::string& what, const std::string& name) {
  return Error{ErrorCode::bad_value, fmt::format("\"+{}\": nothing in this scene has {}", word, what), name, "--laws",
               "a scene with " + what};
}

/// The instance's fine features as the settings say. False where it has none.
template <class Change>
Result<bool> change_fine(Instance& instance, Change&& change) {
  if (instance.fine == nullptr) return false;
  FineSettings settings = instance.fine->settings();
  if (!change(settings)) return false;
  ASPERITY_TRY(FineFeatures fine, FineFeatures::build(std::move(settings)));
  instance.fine = std::make_shared<const FineFeatures>(std::move(fine));
  return true;
}

Result<bool> change(Instance& instance, const std::string& word) {
  const auto [stem, formulation] = split(word);
  if (stem == "no-friction") {
    instance.material.static_friction = instance.material.dynamic_friction = 0.0;
    instance.material.friction = {};
    ASPERITY_CHECK(change_fine(instance, [](FineSettings& fine) {
      fine.micro.clear();
      fine.lay = {};
      fine.friction_map = {};
      return true;
    }));
    return true;
  }
  if (stem == "unblended") {
    if (instance.closed_from == nullptr) return false;
    instance.surface = instance.closed_from->before;
    instance.closed_from.reset();
    return true;
  }
  if (stem == "neighbours") {
    const auto* law = instance.law.as<MesostructureLaw>();
    if (law == nullptr || law->formulation != Formulation::literal) return false;
    MesostructureLaw neighbours = *law;
    neighbours.test_neighbours = true;
    instance.law = neighbours;
    return true;
  }
  const Formulation as = formulation;
  if (stem == "texture") {
    return change_fine(instance, [as](FineSettings& fine) {
      fine.formulation = as;
      return fine.source == TextureSource::coat || !fine.texture.empty();
    });
  }
  if (stem == "no-texture") {
    return change_fine(instance, [](FineSettings& fine) {
      const bool any = fine.source == TextureSource::coat || !fine.texture.empty();
      fine.source = TextureSource::features;
      fine.texture.clear();
      return any;
    });
  }
  if (stem == "lay") {
    return change_fine(instance, [as](FineSettings& fine) {
      fine.lay.formulation = as;
      return fine.lay.still_ratio < 1.0 || fine.lay.sliding_ratio < 1.0 || fine.lay.stiffness_ratio < 1.0 ||
             !fine.micro.empty();
    });
  }
  ASPERITY_TRY(const FrictionKind kind, friction_by_name(stem));
  FrictionLaw& law = instance.material.friction;
  if (law.kind != kind) {
    // What the scene says of its own law means nothing to another one, but for what both read.
    FrictionLaw other;
    other.kind = kind;
    const std::vector<std::string>& reads = friction_parameters(kind);
    const auto keep = [&](const char* name, double FrictionLaw::*member) {
      if (std::find(reads.begin(), reads.end(), name) != reads.end()) other.*member = law.*member;
    };
    keep("stiffness", &FrictionLaw::stiffness);
    keep("damping", &FrictionLaw::damping);
    keep("viscosity", &FrictionLaw::viscosity);
    keep("break_away", &FrictionLaw::break_away);
    keep("stick_speed", &FrictionLaw::stick_speed);
    keep("stribeck_speed", &FrictionLaw::stribeck_speed);
    law = other;
  }
  law.formulation = formulation;
  if (formulation == Formulation::literal) {
    // What the printed forms do not have.
    if (kind == FrictionKind::karnopp) law.damping = 0.0;
    if (kind == FrictionKind::coulomb) law.stick_speed = FrictionLaw{}.stick_speed;
  }
  instance.material.friction_named = true;
  return true;
}

const char* needed_by(const std::string& word) {
  const std::string stem = split(word).first;
  if (stem == "unblended") return "a coat with \"closing\"";
  if (stem == "neighbours") return "the law mesostructure-literal";
  return stem == "lay" ? "friction that depends on the direction" : "a texture";
}

}  // namespace

const std::vector<std::string>& fine_words() {
  static const std::vector<std::string> words = [] {
    std::vector<std::string> all{"no-friction", "texture",     "texture-literal", "no-texture",
                                 "lay",         "lay-literal", "unblended",       "neighbours"};
    for (const std::string& name : friction_names()) {
      all.push_back(name);
      if (has_literal(name)) all.push_back(name + literal_suffix);
    }
    return all;
  }();
  return words;
}

Result<Rival> parse_rival(const std::string& name) {
  Rival rival;
  rival.name = name;
  std::string rest = name;
  for (const char* kind : kinds) {
    const std::string prefix = std::string(kind) + "/";
    if (!name.starts_with(prefix)) continue;
    rival.kind = kind;
    rest = name.substr(prefix.size());
  }
  std::size_t plus = rest.find('+');
  rival.law = rest.substr(0, plus);
  while (plus != std::string::npos) {
    const std::size_t next = rest.find('+', plus + 1);
    const std::string word = rest.substr(plus + 1, next == std::string::npos ? next : next - plus - 1);
    const std::vector<std::string>& words = fine_words();
    if (std::find(words.begin(), words.end(), word) == words.end()) return unknown(word, words);
    for (const std::string& other : rival.fine) {
      if (other != word && !(says_friction(word) && says_friction(other)) && split(other).first != split(word).first)
        continue;
      return Error{ErrorCode::bad_value,
                   fmt::format("\"{}\" says both +{} and +{}", name, other, word),
                   {},
                   "--laws",
                   "one of them"};
    }
    rival.fine.push_back(word);
    plus = next;
  }
  return rival;
}

Result<Experiment> felt_by(const Experiment& experiment, const Rival& rival) {
  Experiment felt = experiment;
  if (!rival.law.empty()) {
    Result<Law> law = law_by_name(rival.law);
    if (!law) return std::move(law).error().at("--laws");
    const auto instances = experiment.scene.instances();
    const bool own = std::all_of(instances.begin(), instances.end(),
                                 [&](const Instance& i) { return law_name(i.law) == rival.law; });
    if (!own) {
      ASPERITY_TRY(felt, with_law(experiment, *law));
    }
  }
  if (rival.fine.empty()) return felt;
  std::vector<Instance> instances(felt.scene.instances().begin(), felt.scene.instances().end());
  for (const std::string& word : rival.fine) {
    bool any = false;
    for (Instance& instance : instances) {
      ASPERITY_TRY(const bool changed, change(instance, word));
      any = any || changed;
    }
    if (!any) return nothing_there(word, needed_by(word), experiment.name);
  }
  std::vector<FieldEffect> effects(felt.scene.effects().begin(), felt.scene.effects().end());
  ASPERITY_TRY(felt.scene, Scene::build(std::move(instances), felt.scene.settings(), std::move(effects)));
  return felt;
}

/// By what laws say of themselves; where the instance's own is not among those, that and the proxy.
std::vector<std::string> laws_compared_on(const Instance& instance) {
  constexpr unsigned surfaces[] = {on_mesh, on_relief, on_iso, on_implicit, 0, 0};
  std::vector<std::string> names;
  const auto add = [&](const LawKind& kind, bool literal_form) {
    names.emplace_back(kind.facts->name);
    if (literal_form && kind.form != nullptr) names.push_back(law_name(Law(kind).in_form(Formulation::literal)));
  };
  const LawKind& own = instance.law.kind();
  const unsigned here = surfaces[instance.surface.index()];
  if ((own.facts->compared & here) == 0 && own.facts->proxy != LawProxy::surface) {
    add(own, true);
    names.emplace_back("proxy");
    return names;
  }
  for (const LawKind* kind : law_kinds()) {
    if ((kind->facts->compared & here) != 0) add(*kind, (kind->facts->compared & literal_too) != 0);
  }
  if (names.empty()) names.emplace_back("proxy");
  return names;
}

std::vector<std::string> default_rivals(const Scene& scene) {
  if (const Instance* followed = followed_instance(scene)) return laws_compared_on(*followed);
  for (const Instance& instance : scene.instances()) {
    const std::string law = law_name(instance.law);
    if (instance.closed_from != nullptr)
      return {"mesostructure-literal+unblended", "mesostructure-literal+neighbours+unblended", law + "+unblended", law};
    if (instance.fine != nullptr && instance.fine->has_texture())
      return {law + "+texture", law + "+texture-literal", law + "+no-texture"};
    if (instance.fine != nullptr && instance.fine->shapes_friction()) return {law + "+lay", law + "+lay-literal"};
    if (instance.material.friction_named) {
      return {law + "+implicit-coulomb",  law + "+karnopp", law + "+karnopp-literal", law + "+dahl",
              law + "+hayward-armstrong", law + "+lugre",   law + "+coulomb"};
    }
    const std::vector<std::string> laws = laws_compared_on(instance);
    const ImplicitSurface* implicit = implicit_of(instance.surface);
    if (implicit == nullptr || implicit->mesh() == nullptr || implicit->textured()) return laws;
    std::vector<std::string> all{"mesh/proxy", "mesh/force-shading-literal"};
    all.insert(all.end(), laws.begin(), laws.end());
    return all;
  }
  return {"proxy"};
}

std::vector<std::string> suitable_rivals(const Experiment& experiment) {
  std::vector<std::string> suitable;
  for (const std::string& name : default_rivals(experiment.scene)) {
    const Result<Rival> rival = parse_rival(name);
    // What a law stands on is made later; what the scene itself refuses is known now.
    if (!rival || (rival->kind.empty() && !felt_by(experiment, *rival))) continue;
    suitable.push_back(name);
  }
  if (suitable.empty() && !experiment.scene.instances().empty())
    suitable.push_back(law_name(experiment.scene.instances().front().law));
  return suitable;
}

}  // namespace asperity::program
