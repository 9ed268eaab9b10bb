// Rows of the table of scene keys: the scene itself, who touches it, and how it is looked at.

#include <numbers>

#include "asperity/io/detail/scene_reader.h"
#include "asperity/io/detail/scene_rows.h"
#include "asperity/io/experiment.h"

namespace asperity::scene_rows {
namespace {

void scene(SceneObject& row) {
  const char* one = "one that a scene is about: surfaces, or effects";
  row("$schema", Type::text(), "Where editors find this schema.");
  row("asperity", Type::integer(1, 1), "Format version.", with_default(1));
  row("name", Type::text(), "What the scene is called.", or_else("the file's name"));
  row("summary", Type::text(), "One line on the scene for lists.");
  row("probe", Type::object("probe"), "What touches.", or_else("an ideal point"));
  row("surfaces", Type::array(Type::object("surface"), 0, 1024, "entries"), "What is touched, beside effects.",
      only_if(Test::filled("effects"), one));
  row("surfaces", Type::array(Type::object("surface"), 1, 1024, "entries"), "What is touched.", always_there);
  row("effects", Type::array(Type::object("effect"), 0, 64, "entries"), "Volumes that are felt without a surface.");
  row("device", Type::any({Type::one_of(device_profile_names()), Type::object("device")}),
      "A built-in profile by name, or an object with changes. Its limits are those of the safety stage.",
      with_default("phantom-desktop"));
  row("hand", Type::any({Type::one_of(hand_preset_names()), Type::object("hand")}),
      "A built-in hand by name, or an object with changes; felt with a dynamic probe.", with_default("default"));
  row("stroke", Type::object("stroke"), "The path of the hand.",
      or_else("a line over 60 % of the top in about four seconds"));
  row("view", Type::object("view"), "How the scene is seen, and how the workspace of the device lies in it.",
      or_else("as it is, and nobody looks"));
  row("change", Type::object("change"), "How changes of surfaces are felt.");
  row("budget", Type::integer(0, 1000000),
      "What a force update may look at, in evaluations of a surface, about 0.1 us each; 0: no limit. What does not fit "
      "is gone on with in the next updates.",
      or_else("600 for a point, 150,000 for a ball"), by_contents("less than 100 but 0"));
}

void probe(SceneObject& row) {
  const Range rates{0.0, 1e6, true};
  row("kind", Type::named<ProbeKind>(),
      "ideal: exactly on its stroke, or regulated to a normal force. dynamic: a simulated hand that holds the device.",
      with_default(ProbeKind::ideal));
  row("radius", length(not_negative),
      "Radius of the tip; 0 is a point. Laws of height fields and mesostructures, and forms as printed, touch with a "
      "point.",
      &ProbeSettings::radius, or_else("0.5 mm where every law takes a ball, else 0"));
  row("tip", length(not_negative),
      "Radius of the tip whose path a point follows on coats with levels of detail by dilation; 0: a point. Laws touch "
      "with a point all the same.",
      &ProbeSettings::tip);
  row("tool_length", length(not_negative),
      "From the tip to where the hand holds the tool: torque is answered about there; 0: none is.",
      &ProbeSettings::tool_length);
  row("tool_axis", Type::direction(), "The way from the tip to there, in the probe's own frame.",
      with_default(Vec3(0.0, 1.0, 0.0)), by_contents("three zeros, which are no direction"));
  row("rate", frequency(rates), "Force updates a second.", &ProbeSettings::rate, or_else("the device's rate"));
  row("ideal", Type::object("ideal probe"), "Settings read when kind is ideal.");
  row("dynamic", Type::object("dynamic probe"), "Settings read when kind is dynamic.");
}

void ideal_probe(SceneObject& row) {
  using S = IdealProbeSettings;
  row("stiffness_estimate", stiffness(positive),
      "Expected stiffness of the contact; the true one may be up to twice this.", &S::stiffness_estimate,
      or_else("the stiffness of the first surface"));
  row("bandwidth", frequency(positive), "Of the regulator.", &S::bandwidth);
  row("max_depth", length(positive), "The regulated depth stays within this, below and above the surface.",
      &S::max_depth);
}

void dynamic_probe(SceneObject& row) {
  using S = SimulatedDeviceSettings;
  row("force_bandwidth", frequency(positive), "How fast the pressing force builds up and fades; people: 2 to 5 Hz.",
      &S::force_bandwidth);
  row("reach", length(positive), "Depth below the surface where the arm's own spring stops a pressing hand.",
      &S::reach);
  row("tremor", length(not_negative), "RMS of the hand's tremor, 8 to 12 Hz, each axis; 0: none.", &S::tremor);
  row("seed", Type::seed(), "Of the tremor.", &S::seed);
  // Shorter steps than a microsecond would make a second of touch take minutes.
  row("max_substep", seconds({1e-6, 1.0}), "Longest integration step.", &S::max_substep);
}

void device(SceneObject& row) {
  using S = DeviceProfile;
  const auto own = [&](const char* key, const Type& type, const char* help, auto S::*member) {
    row(key, type, help, member, or_else("the profile's"));
  };
  row("profile", Type::one_of(device_profile_names()), "The built-in profile to start from.",
      with_default("phantom-desktop"));
  own("max_force", force(positive), "Largest force that may be commanded.", &S::max_force);
  own("max_stiffness", stiffness(positive), "Stiffest contact recommended.", &S::max_stiffness);
  own("max_damping", damping(not_negative), "Largest rendered damping.", &S::max_damping);
  own("workspace_radius", length(positive), "Of the sphere the tip can reach.", &S::workspace_radius);
  own("position_resolution", length(not_negative), "Smallest step of the reported position; 0: continuous.",
      &S::position_resolution);
  own("mass", mass(not_negative), "Apparent mass at the tip.", &S::mass);
  own("damping", damping(not_negative), "The mechanism's own viscous damping.", &S::damping);
  own("friction", force(not_negative), "The mechanism's own Coulomb friction.", &S::friction);
  own("slew_limit", Type::number(positive), "Largest change of the commanded force in N/s.", &S::slew_limit);
  own("max_power", Type::number(positive), "Most that the force may do to the hand in W.", &S::max_power);
  own("max_velocity", speed(positive), "Of the tip: what moves faster is no hand.", &S::max_velocity);
  own("rate", frequency({0.0, 1e6, true}), "Force updates a second.", &S::rate);
  own("admittance", Type::boolean(), "Measures force and moves a virtual mass.", &S::admittance);
}

void hand(SceneObject& row) {
  using S = HandImpedance;
  row("preset", Type::one_of(hand_preset_names()), "The built-in hand to start from.", with_default("default"));
  row("mass", mass(positive), "Of the hand that moves with the device.", &S::mass, or_else("the preset's"));
  row("damping", damping(not_negative), "Against the motion the hand intends.", &S::damping, or_else("the preset's"));
  row("stiffness", stiffness(positive), "Towards the position the hand intends.", &S::stiffness,
      or_else("the preset's"));
  row("lateral_limit", force(positive), "Largest tangential force spent on following the path.", &S::lateral_limit,
      or_else("the preset's"));
}

void stroke(SceneObject& row) {
  using S = StrokeSettings;
  const std::string by = "by a {} stroke";
  const Type place = Type::array(Type::length_or_share(), 3, 3, "coordinates")
                         .saying("[x, y, z], each a length (m, or with a unit) or a share of the bounds (\"50%\")");
  const std::string shares = " A share is of the bounds: 0% their lower, 100% their upper end; y is up.";
  const Test flat = Test::is("type", {"line", "raster"});
  const Test round = Test::is("type", {"circle", "spiral"});
  const Test drawn = Test::is("type", {"line", "raster", "circle", "spiral", "polyline"});
  row("type", Type::named<StrokeType>(), "Shape of the path.", with_default(StrokeType::line));
  row("axis", Type::direction(), "circle, spiral, raster: normal of the plane it is drawn in.",
      with_default(Vec3(0.0, 1.0, 0.0)), only_if(Test::is("type", {"raster", "circle", "spiral"}), by),
      by_contents("three zeros, which are no direction"));
  row("rows", Type::integer(1, 100000), "raster when pitch is 0.", with_default(5),
      only_if(Test::is("type", {"raster"}), by));
  row("pitch", Type::length_or_share(not_negative),
      "raster: between rows; spiral: between windings; 0: from rows or turns. A share is of the object's largest side.",
      with_default(0.0), only_if(Test::is("type", {"raster", "spiral"}), by));
  row("start", place, "line: first end; raster: first corner." + shares, only_if(flat, by),
      or_else("20 % into the top, or into another side where that meets too little"),
      by_contents("a stroke without length"));
  row("end", place, "line: other end; raster: opposite corner." + shares, only_if(flat, by),
      or_else("80 % into the same side"));
  row("centre", place, "circle, spiral." + shares, only_if(round, by), or_else("the middle of the top"));
  row("radius", Type::length_or_share(positive),
      "circle; spiral: the outermost winding. A share is of the object's largest side.", only_if(round, by),
      or_else("30 % of the smaller horizontal side"));
  row("turns", Type::number({0.0, 1e4, true}), "circle; spiral when pitch is 0.", only_if(round, by),
      or_else("1 for a circle, 4 for a spiral"));
  row("points", Type::array(place, 2, 1000000, "points").saying("two points or more, each [x, y, z]"),
      "polyline: its corners." + shares, only_if(Test::is("type", {"polyline"}), by),
      there_if(Test::is("type", {"polyline"})), by_contents("points that are all the same"));
  row("path", Type::file().saying("a CSV file with time, x, y, z, or a trace"),
      "recorded: a CSV file whose header names time, x, y, z (with units in brackets, SI without), or a trace. It "
      "brings its own speed and depth.",
      only_if(Test::is("type", {"recorded"}), by), there_if(Test::is("type", {"recorded"})),
      by_contents("a file that cannot be read as a path"));
  row("speed", speed(positive), "Along the surface.", &S::speed, only_if(drawn, by),
      or_else("60 % of the top in four seconds"));
  Option& pressed = row("normal_force", force(positive), "The hand presses with this force, in place of depth.",
                        only_if(drawn, by), or_else("none"));
  pressed.settings = typeid(S);
  pressed.get = [](const void* of) {
    const S& settings = *static_cast<const S*>(of);
    return settings.press == PressMode::force ? OptionValue(settings.normal_force) : OptionValue();
  };
  pressed.set = [](void* of, const OptionValue& value) {
    static_cast<S*>(of)->press = PressMode::force;
    static_cast<S*>(of)->normal_force = from_option<double>(value);
  };
  row("depth", length(), "How far below the base surface the tip's lowest point is led; negative stays above.",
      &S::depth, only_if(drawn, by), only_if(Test::without("normal_force"), "beside normal_force"),
      or_else("1 mm, at most 2 % of the object's diagonal"));
  row("approach_height", length(not_negative), "Where the stroke starts and ends over the surface.",
      &S::approach_height, only_if(drawn, by), or_else("5 % of the object's diagonal"));
  row("approach_speed", speed(positive), "Towards and away from the surface.", &S::approach_speed, only_if(drawn, by),
      or_else("approach_height in half a second"));
  row("repeats", Type::integer(1, 100000), "Traversals; an open stroke repeats only back and forth.", &S::repeats,
      only_if(drawn, by), by_contents("more than one on an open stroke without back_and_forth"));
  row("back_and_forth", Type::boolean(), "Every traversal goes there and back.", &S::back_and_forth,
      only_if(drawn, by));
  row("sample_spacing", length(positive), "Between stored samples of the path.", &S::sample_spacing,
      or_else("1/2000 of its length"), by_contents("so short that there would be too many"));
  row("normal_smoothing", length(not_negative), "The path's normal is averaged over this length.", &S::normal_smoothing,
      or_else("1/200 of its length"));
}

void view(SceneObject& row) {
  row("zoom", Type::number({1e-3, 1e6}), "Size of what is shown over its own.", &View::zoom);
  row("focus", Type::vector(Dimension::length), "What stays where it is when zoomed.", &View::focus,
      or_else("the middle of the surfaces"));
  row("home", Type::vector(Dimension::length), "Where in the workspace the focus is felt.", &View::home,
      or_else("the focus"));
  row("camera", Type::object("camera"), "Who looks.", or_else("nobody, and nothing is too small to be seen"));
  row("axis", Type::direction(), "Of the turn from the workspace to the scene.", with_default(Vec3(0.0, 1.0, 0.0)),
      by_contents("three zeros, which are no direction"));
  row("angle", angle(), "Of that turn.", with_default(0.0));
}

void camera(SceneObject& row) {
  row("target", Type::vector(Dimension::length), "The middle of the picture.", &Viewpoint::target, or_else("the focus"),
      by_contents("where the eye is"));
  row("eye", Type::vector(Dimension::length), "Where it is seen from.", &Viewpoint::eye,
      or_else("above and in front of the target, one and a half diagonals away"), by_contents("where the target is"));
  row("field_of_view", angle({0.0, std::numbers::pi, true}), "Over the height of the picture, below 180 degrees.",
      &Viewpoint::field_of_view, by_contents("180 degrees"));
  row("pixels", Type::integer(0, 100000), "Rows of the picture; 0: nothing is too small to be seen.",
      &Viewpoint::pixels, with_default(1080));
}

void change(SceneObject& row) {
  using S = SceneSettings;
  row("handover", seconds(not_negative), "Over how long a change of the scene is spread.", &S::handover);
  row("power", Type::number(not_negative),
      "W that changes may give to the hand beyond what it has spent; 0 keeps them passive.", &S::change_power);
  row("capacity", Type::number(not_negative),
      "J that the hand may get back later, through something else than it has put it in by.", &S::energy_capacity);
  row("level_rate", Type::number(positive), "Levels of detail a second.", &S::level_rate);
}

}  // namespace

Rows hand_rows() {
  return {
      {{"scene",
        "An experiment: what is touched, with which device and hand, along which stroke. Quantities are SI numbers or "
        "texts with a unit. World frame: right-handed, y up, the device's workspace centred on the origin. "
        "{\"surfaces\": [{\"mesh\": \"bunny.obj\"}]} is a scene."},
       scene},
      {{"probe", "What touches: the tip and how it is moved."}, probe},
      {{"ideal probe", "How an ideal probe regulates a normal force."}, ideal_probe},
      {{"dynamic probe", "The simulated hand beyond its impedance."}, dynamic_probe},
      {{"device", "A built-in device profile with changes. Values at the tip."}, device},
      {{"hand", "A built-in hand with changes: second-order impedance, equal in all directions."}, hand},
      {{"stroke", "The path of the hand, laid on the nearest base mesh."}, stroke},
      {{"view",
        "The view of the scene. The probe at p in the workspace is in the scene at focus + R (p - home) / zoom; forces "
        "and stiffness are the hand's. Strokes are drawn in the workspace."},
       view},
      {{"camera",
        "Where the scene is seen from at zoom 1; zooming brings the camera nearer to the focus. Coats with levels of "
        "detail are felt as finely as they are seen."},
       camera},
      {{"change", "How changes are felt: moving surfaces, other levels of detail, and what the caller changes."},
       change},
  };
}

}  // namespace asperity::scene_rows
