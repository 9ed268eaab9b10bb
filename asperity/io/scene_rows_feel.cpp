// Rows of the table of scene keys: laws, materials and fine features.

#include <fmt/format.h>

#include "asperity/io/detail/scene_fine.h"
#include "asperity/io/detail/scene_reader.h"
#include "asperity/io/detail/scene_rows.h"
#include "asperity/render/law_registry.h"

namespace asperity::scene_rows {
namespace {

void law(SceneObject& row) {
  const char* by = "by the law \"{}\"";
  std::vector<std::string> two_forms;
  std::string what;
  for (const LawKind* kind : law_kinds()) {
    const LawFacts& facts = *kind->facts;
    what += fmt::format("{}{}: {} ({}{})", what.empty() ? "" : "; ", facts.name, facts.title, facts.source,
                        !Law(*kind).takes_ball()   ? "; a point alone"
                        : !Law(*kind).constrains() ? "; a ball where the surface lies its radius farther out"
                                                   : "");
    if (kind->form == nullptr) continue;
    for (const char* form : {"", "-literal"}) two_forms.push_back(std::string(facts.name) + form);
  }
  row("type", Type::one_of({}, law_names), what + ". Forms as printed are of points.", with_default("proxy"));
  row("formulation", Type::named<Formulation>(), "As the paper prints it, or with its errata resolved.",
      only_if(Test::is("type", two_forms), by), or_else("consistent, or what the law's name says"));
  for (const LawKind* kind : law_kinds()) {
    const std::string name(kind->facts->name);
    std::vector<std::string> names{name};
    if (kind->form != nullptr) names.push_back(name + "-literal");
    // The literal form is told by "formulation", or by the name.
    const Test literal = Test::any({Test::all({Test::given("formulation"), Test::is("formulation", {"literal"})}),
                                    Test::all({Test::without("formulation"), Test::is("type", {name + "-literal"})})});
    for (Option& option : law_options(*kind)) {
      option.help = fmt::format("{}{}: {}", name, option.printed.empty() ? "" : ", literal", option.help);
      option.only_if(Test::is("type", names), by);
      if (!option.printed.empty())
        option.only_if(literal, fmt::format("by the consistent law \"{}\", {}", name, option.printed));
      row.rows.push_back(std::move(option));
    }
  }
}

void material(SceneObject& row) {
  using S = Material;
  row("stiffness", stiffness(positive), "Of the contact.", &S::stiffness,
      or_else("1000 N/m, or the device's largest if that is less"));
  row("damping", damping(not_negative), "Along the normal; it never pulls the probe inward.", &S::damping);
  row("viscosity", damping(not_negative), "Against any motion while in touch.", &S::viscosity,
      by_contents("a surface that cannot have it"));
  row("magnetism", stiffness(not_negative),
      "How steeply the surface draws the probe from outside. Coated meshes, a point, laws proxy, height-field and "
      "mesostructure.",
      &S::magnetism, by_contents("a surface that cannot have it"));
  row("magnetic_band", length(positive), "How far it does.", &S::magnetic_band);
  row("stickiness", force(not_negative),
      "Pull up to which the surface holds the probe. Coated meshes, a point, law proxy.", &S::stickiness,
      by_contents("a surface that cannot have it"));
  row("static_friction", Type::number(not_negative),
      "Coulomb's coefficient while the contact sticks. Felt with the proxy law, and under every law where \"friction\" "
      "is named.",
      &S::static_friction, by_contents("less than the dynamic one"));
  row("dynamic_friction", Type::number(not_negative), "Coulomb's coefficient while it slides, 0 to static_friction.",
      or_else("0.8 times static_friction"), by_contents("more than the static one"));
  row("friction", Type::any({Type::named<FrictionKind>(), Type::object("friction")}),
      "How friction is felt: a law's name, or an object.", or_else("implicit-coulomb, under the proxy law alone"),
      by_contents("a surface that cannot have it"));
  row("lay", Type::object("lay"), "Friction that depends on the direction.", or_else("the same in every direction"),
      by_contents("a surface that cannot have it"));
  row("friction_map", Type::object("friction map"),
      "Factors of both coefficients over the surface, laid on by the texture's mapping.", or_else("1 everywhere"),
      by_contents("a surface that cannot have it"));
}

void friction(SceneObject& row) {
  using S = FrictionLaw;
  const auto number = [&](const char* key, const Type& type, const char* help, double S::*member) {
    row(key, type, help, member,
        only_if(Test::is("law", taking<FrictionKind>(friction_parameters, key)), "by the friction law \"{}\""));
  };
  row("law", Type::named<FrictionKind>(),
      "implicit-coulomb: Coulomb's law by an implicit Euler step (Kikuuwe et al. 2006). viscous: by velocity. coulomb: "
      "sliding friction alone. karnopp: stick by a spring, slip by Coulomb (heterogeneous-features-2008, eq. 13 and "
      "14). dahl: by displacement. hayward-armstrong: likewise, without drift. lugre: bristles with Stribeck's curve.",
      &S::kind, always_there);
  row("formulation", Type::named<Formulation>(), "karnopp, coulomb, lugre: as printed, or passive.", &S::formulation,
      only_if(Test::is("law", {"karnopp", "coulomb", "lugre"}), "by the friction law \"{}\""));
  number("stiffness", stiffness(not_negative), "Of the tangential spring; 0: the contact's own.", &S::stiffness);
  number("damping", damping(not_negative), "Beside that spring.", &S::damping);
  number("viscosity", damping(not_negative), "Of sliding.", &S::viscosity);
  number("break_away", force(not_negative),
         "Force at which sticking ends, whatever pushes; 0: static_friction times the push.", &S::break_away);
  number("stick_speed", speed(positive),
         "karnopp: below which it sticks. coulomb: below which the force falls with speed.", &S::stick_speed);
  number("stribeck_speed", speed(positive), "Over which friction falls from static to dynamic.", &S::stribeck_speed);
  number("exponent", ratio({0.5, 4.0}), "Shape of the approach to sliding.", &S::exponent);
  number("adhesion", ratio({0.0, 0.9}), "Share of the largest stretch below which nothing creeps.", &S::adhesion);
}

void lay(SceneObject& row) {
  using S = FrictionLay;
  row("still_ratio", ratio({0.0, 1.0}), "Static coefficient along the lay over that across it.", &S::still_ratio);
  row("sliding_ratio", ratio({0.0, 1.0}), "The same of the dynamic coefficient.", &S::sliding_ratio,
      or_else("still_ratio"));
  row("stiffness_ratio", ratio({0.01, 1.0}), "The same of the stiffness of the friction law's spring (k_s of eq. 13).",
      &S::stiffness_ratio);
  row("formulation", Type::named<Formulation>(),
      "literal: coefficients and stiffness by the angle between velocity and gradient (eq. 15). consistent: an "
      "ellipse, "
      "force of maximum dissipation, and a spring of two stiffnesses.",
      &S::formulation);
  row("direction", angle(), "Across the lay, from u towards v.", &S::direction, or_else("that of the features"));
}

void friction_map(SceneObject& row) {
  row("image", heights_source(), "An image (the path is relative to the scene), or an object with a height generator.",
      always_there, by_contents("a file that cannot be read, and what is no map"));
  row("channel", Type::file(), "Channel that holds the factor; of an OpenEXR file any channel by its own name.",
      only_if(Test::none({Test::an_object("image")}), "for a generated height map"), with_default(Channel::automatic),
      by_contents("a channel that the image does not have"));
  row("low", Type::number({0.0, 1e3}), "Factor of black.", with_default(0.0));
  row("high", Type::number({0.0, 1e3}), "Factor of white.", with_default(1.0));
  row("tile", Type::pair(length(positive)), "Size of one repeat.", always_there);
}

void texture(SceneObject& row) {
  const Test own = Test::is("source", {"features"});
  row("mapping", Type::object("feature mapping"), "How the plane of the features is laid on the surface.");
  row("source", Type::named<TextureSource>(),
      "features: those given here. coat: the heights of the mesh's coat, felt as lateral force on the bare mesh, under "
      "a law that does not follow the relief.",
      &FineSettings::source, by_contents("a surface without a coat, and a law that follows the relief"));
  row("formulation", Type::named<Formulation>(),
      "Of the texture force. literal: minus the gradient times the constraint's force (eq. 12), which feeds energy; "
      "consistent: the slope of one potential.",
      &FineSettings::formulation);
  row("as", Type::named_or_auto<FeatureScale>(),
      "For features that do not say themselves. auto: by wavelength (Tab. 1), below 0.1 mm or five steps of the device "
      "friction, from 5 mm on geometry, between them texture.",
      only_if(own, "where the coat is the source"), with_default("auto"));
  row("features",
      Type::any(
          {Type::object("feature"), Type::array(Type::object("feature"), 1, FineFeatures::most_features, "features")})
          .saying("a feature, or an array of them"),
      "One feature, or several whose heights add. Only a lay or a friction map of the material does without.",
      only_if(own, "where the coat is the source"),
      by_contents("none without a lay or a friction map, and features that this surface cannot have"));
}

void feature(SceneObject& row) {
  using S = FeatureSpec;
  const char* by = "by the feature \"{}\"";
  const auto takers = [](const char* member) {
    return Test::is("type", taking<FeatureKind>(feature_parameters, member));
  };
  const auto of = [&](const char* key, const char* member, const Type& type, const char* help, const auto&... more) {
    row(key, type, help, only_if(takers(member), by), more...);
  };
  const Type one = length(positive);
  row("type", Type::named<FeatureKind>(),
      "grating, circular-grating, grid: cosines (eq. 3 to 5). triangular, serrated: straight ridges. noise: a random "
      "surface of a given roughness. map: an image, or a formula of a coat's.",
      &S::kind, always_there, by_contents("what cannot be geometry, and what this mapping cannot wrap around"));
  of("direction", "direction", angle(), "Of the waves, from u towards v: 0 for ridges along v.", &S::direction,
     by_contents("one that does not come back where the mapping goes around"));
  const std::size_t source = row.rows.size();
  heights(row, false, [&](Option& each) { each.only_if(takers("heights"), by); });
  row.rows[source].required = takers("heights");
  of("filter", "heights", Type::named<Reconstruction>(), "map: how heights run between texels.",
     with_default(Reconstruction::quadratic_bspline));
  of("amplitude", "amplitude", one,
     "Heights lie between minus and plus this: half of what is measured from valley to crest.", &S::amplitude,
     or_else("none"), there_if(takers("amplitude")), by_contents("more than the surface can bear"));
  const auto waves = [&](const Type& type, const char* help, const std::vector<std::string>& kinds) {
    std::vector<std::string> unmeasured = kinds;
    std::erase(unmeasured, "map");
    row("wavelength", type, help, only_if(Test::is("type", kinds), by), only_if(Test::without("count"), "beside count"),
        there_if(Test::all({Test::is("type", unmeasured), Test::without("count")})),
        by_contents("one that does not come back where the mapping goes around, and none but for a measured map"));
  };
  std::vector<std::string> single = taking<FeatureKind>(feature_parameters, "wavelength");
  std::erase_if(single, [](const std::string& kind) { return kind == "grid" || kind == "map"; });
  waves(one, "Of one wave.", single);
  waves(Type::pair(one), "Of one repeat. One length keeps a map's pixels square.", {"grid", "map"});
  of("count", "wavelength", Type::integer(1, 1'000'000),
     "In place of wavelength, where the mapping goes around: so many waves along the way.",
     by_contents("a mapping that does not go around"));
  of("phase", "phase", angle(), "Where the wave begins; 0 for a crest at u = 0.", &S::phase);
  of("centre", "centre", Type::pair(length()), "Of the circles, [u, v].", &S::centre);
  of("wall", "wall", ratio({0.01, 0.5}), "Share of the wavelength that rises.", &S::wall);
  of("roughness", "roughness", one, "Root mean square of the heights, R_q. R_a is 0.8 of it.",
     only_if(Test::without("average_roughness"), "beside average_roughness"),
     there_if(Test::all({takers("roughness"), Test::without("average_roughness")})),
     by_contents("more than the surface can bear"));
  of("average_roughness", "roughness", one,
     "Mean of the absolute heights, R_a, in place of roughness. R_q is 1.25 of it.",
     by_contents("more than the surface can bear"));
  of("correlation_length", "correlation_length", one, "Over which the autocorrelation falls to 1/e.",
     &S::correlation_length, or_else("none"), there_if(takers("correlation_length")),
     by_contents("so long that the pattern does not come back"));
  of("seed", "seed", Type::seed(), "Another number, another pattern.", &S::seed);
  of("period", "period", Type::pair(length(not_negative)),
     "After which the pattern repeats along u and v; 0: after 64 cells of it.",
     or_else("the way around, where the mapping goes around, else 0"),
     by_contents("one that does not come back where the mapping goes around"));
  row("as", Type::named_or_auto<FeatureScale>(), "What it is felt as.", or_else("the texture's \"as\""));
}

void feature_mapping(SceneObject& row) {
  const char* by = "by the mapping \"{}\"";
  const auto of = [&](const char* key, const Type& type, const char* help, std::vector<std::string> kinds,
                      const auto&... more) { row(key, type, help, only_if(Test::is("surface", kinds), by), more...); };
  const std::vector<std::string> framed{"plane", "cylinder", "sphere", "box"};
  row("surface", Type::named<IntermediateSurface>(),
      "plane: u along reference, v along axis x reference. cylinder, sphere: u around the axis, measured at the "
      "radius, v along it. box: six planes. uv: the mesh's texture coordinates, or a parametric surface's parameters.",
      or_else("uv for a parametric surface, else plane"),
      by_contents("uv where there are no texture coordinates, and what features as geometry cannot lie by"));
  const std::string unnamed = "beside no \"surface\", where the default is another mapping";
  of("origin", Type::vector(Dimension::length), "In the surface's own frame.", framed,
     or_else("the middle of its bounds"), by_contents(unnamed));
  of("axis", Type::direction(), "Normal of the plane, axis of the cylinder or sphere, in the surface's own frame.",
     framed, or_else("z for a parametric surface; else y, for a plane across the shortest side"),
     by_contents("three zeros, which are no direction"));
  of("reference", Type::direction(), "Direction of u, where the angle begins. What runs along the axis is taken off.",
     framed, or_else("x, or y where the axis is x"), by_contents("a direction along the axis"));
  of("radius", length(positive), "Where u is measured in metres.", {"cylinder", "sphere"},
     or_else("half of the surface's size across the axis"), by_contents(unnamed));
  of("range", Type::array(angle(), 2, 2, "angles").saying("two angles [from, to]"),
     "Angles around the axis that features are wrapped over (eq. 6), u counting from the first. They go on beyond both "
     "up to a seam opposite their middle, where they need not close: they are felt as a step there.",
     {"cylinder", "sphere"}, or_else("all around: features have to close"),
     by_contents("a second angle that is not above the first, or more than a turn"));
  of("half_extent", Type::vector(Dimension::length), "Along reference, axis x reference and axis.", {"box"},
     or_else("half of the surface's size"), by_contents("what is no box; " + unnamed));
  of("tile", Type::pair(length(positive)), "Length of one unit of u and v.", {"uv"},
     or_else("what it measures on the surface; for a parametric one where it is widest"), by_contents(unnamed));
}

}  // namespace

Rows feel_rows() {
  return {
      {{"law", "A contact law with its options."}, law},
      {{"material", "What a surface is made of."}, material},
      {{"friction", "A friction law and its parameters. Coefficients are the material's."}, friction},
      {{"lay",
        "Friction along and across the lay. Across is where heights change: along the gradient of the surface's "
        "features, or the direction given here."},
       lay},
      {{"friction map", "An image of factors."}, friction_map},
      {{"texture",
        "Fine features of the surface (heterogeneous-features-2008): what they are, how they are laid on, what they "
        "are felt as."},
       texture},
      {{"feature", "One feature: a height over the plane of u and v."}, feature},
      {{"feature mapping",
        "The two-stage shrink-wrap mapping: rays along the normal of an intermediate surface lead from it to the "
        "object (heterogeneous-features-2008, section 3.2)."},
       feature_mapping},
  };
}

}  // namespace asperity::scene_rows
