// Rows of the table of scene keys: what is touched, and where it is.

#include <numbers>

#include "asperity/field/conversion/mesh_conversion.h"
#include "asperity/field/volume/derived_fields.h"
#include "asperity/field/volume/generators.h"
#include "asperity/geometry/generators.h"
#include "asperity/io/detail/scene_reader.h"
#include "asperity/io/detail/scene_rows.h"
#include "asperity/io/volume_io.h"
#include "asperity/render/law_registry.h"
#include "asperity/surface/implicit/texture.h"

namespace asperity::scene_rows {
namespace {

const Test own_shape = Test::without("custom");
const char* const beside_own = "beside a surface of the program's own";
const char* const beside_formula = "beside a parametric surface";

/// Of a row that surfaces of triangles alone have.
const auto of_triangles = [](Option& row) {
  row.only_if(own_shape, beside_own)
      .only_if(Test::without("parametric"), beside_formula)
      .only_if(Test::without("volume"), "beside a volume")
      .only_if(Test::without("implicit"), "by an implicit surface");
};

void surface(SceneObject& row) {
  const Test formula = Test::without("parametric");
  const auto one_kind = Test::none(
      {Test::given("custom"), Test::given("parametric"), Test::given("volume"), Test::given("implicit.file")});
  row("name", Type::text(), "What it is called in messages and reports.",
      or_else("the file's or the generator's name"));
  row("mesh",
      Type::any({Type::file(), Type::object("mesh generator")})
          .saying("a mesh file (OBJ, PLY, STL, glTF) or an object with a generator"),
      "A mesh file (OBJ, PLY, STL, glTF; the path is relative to the scene), or an object with a generator.",
      only_if(own_shape, beside_own), only_if(formula, beside_formula),
      only_if(Test::any({Test::without("volume"), Test::given("implicit")}), "beside a volume"), there_if(one_kind),
      by_contents("a file that cannot be read, and what is no mesh"));
  row("parametric", Type::object("parametric"), "In place of a mesh: a surface given by a formula.",
      only_if(own_shape, beside_own));
  row("custom", Type::numbers(),
      "In place of a mesh: a surface that the program has registered (docs/methods/custom.md), with its numbers (SI, "
      "or texts with a unit). Its own axis is z; \"up\" turns it to the world's.",
      by_contents("a name that nobody has registered, and numbers that it does not read"));
  row("volume",
      Type::any({Type::file(), Type::object("volume")})
          .saying("a volume file or an object with \"file\" or \"generator\""),
      "In place of a mesh: a volume file (VTK, OpenFOAM, NRRD, raw samples by their sidecar, a bricked file; the path "
      "is relative to the scene), or an object. An isosurface of it is touched.",
      only_if(own_shape, beside_own), only_if(formula, beside_formula),
      only_if(Test::without("implicit"), "beside \"implicit\""),
      by_contents("a file that cannot be read, and what is no volume of numbers"));
  row("iso", Type::object("iso"), "With a volume: which isosurface.",
      only_if(Test::given("volume"), "without a volume"),
      or_else("at a threshold that splits the samples best in two, high values inside"));
  row("implicit", Type::object("implicit"),
      "The mesh (and its coat) made into a signed potential that is felt in its place (hybrid-surface-2004), or a "
      "level set of a .vdb file.",
      only_if(own_shape, beside_own), only_if(formula, beside_formula),
      by_contents("a mesh or a grid that makes no potential"));
  placing(row, {{own_shape, beside_own}, {formula, beside_formula}});
  row("up", Type::one_of({"x", "y", "z", "-x", "-y", "-z"}),
      "The axis of the mesh or formula that points up in the world (+y). Not for volumes.",
      only_if(Test::without("volume"), "beside a volume"),
      only_if(Test::any({Test::given("mesh"), Test::without("implicit")}), "without a mesh"),
      or_else(
          "y for files and closed generators, z for open sheets (M_a, M_b, M_c, M_e, M_f, M_G, plane) and formulas"),
      by_contents("turning a mesh beside a .vdb file"));
  row("sides", Type::named_or_auto<Sides>(),
      "front: only from where normals point. both: from either side. auto: front where the mesh or formula is closed "
      "and oriented, else both; both for a volume.",
      with_default("auto"));
  row("search", Type::named<SearchStructure>(), "Search structure. Both answer the same.",
      with_default(SearchStructure::bvh), of_triangles);
  row("coat", Type::object("coat"), "Relief over the mesh.", only_if(own_shape, beside_own),
      only_if(formula, beside_formula), only_if(Test::without("volume"), "beside a volume"),
      only_if(Test::any({Test::given("mesh"), Test::without("implicit")}), "without a mesh"),
      or_else("none, or what the materials of a glTF file say"));
  row("texture", Type::object("texture"),
      "Fine features: felt as friction, as a lateral force, or as geometry, by their size.", or_else("none"));
  row("law", Type::any({Type::one_of({}, law_names), Type::object("law")}).saying("a law's name or an object"),
      "How it is felt: a law's name, or an object.", with_default("proxy"),
      by_contents("a law that cannot be felt on this surface"));
  row("material", Type::object("material"), "What it is made of.");
  const char* worn = "a mesh that wears no coat and no features that are geometry";
  row("on_overlap", Type::named<OnOverlap>(),
      "A relief that folds over itself: \"cure\" turns the shell's directions where that helps, lowers the relief "
      "around the vertices at fault and says so; \"refuse\" is an error that names them.",
      &ReliefSettings::on_overlap, by_contents(worn), of_triangles);
  row("shell_directions", Type::named<ShellDirections>(),
      "Directions along which heights are measured: least squares to the faces around each vertex, or smoothed over "
      "the mesh, which leaves room for higher reliefs over folds.",
      &ReliefSettings::directions, by_contents(worn), of_triangles);
  row("motion", Type::object("motion"), "How the surface moves on from its pose.", or_else("it stands still"),
      by_contents("the motion of a volume or an implicit surface"));
}

void pose(SceneObject& row) {
  const Test turned = Test::without("orientation");
  row("position", Type::vector(Dimension::length), "Of the surface's origin in the world.",
      with_default(Vec3(0.0, 0.0, 0.0)));
  row("orientation", Type::array(Type::number(), 4, 4, "numbers").saying("a quaternion [w, x, y, z]"),
      "Quaternion w, x, y, z; normalised. In place of axis and angle.",
      with_default(std::vector<double>{1.0, 0.0, 0.0, 0.0}), by_contents("four numbers without length"));
  row("axis", Type::direction(), "Axis of rotation; any length but 0.", only_if(turned, "beside orientation"),
      with_default(Vec3(0.0, 1.0, 0.0)), by_contents("three zeros, which are no direction"));
  row("angle", angle(), "Angle of rotation around axis, right-handed.", only_if(turned, "beside orientation"),
      with_default(0.0));
}

void motion(SceneObject& row) {
  constexpr double fastest = 100.0;     // m/s
  constexpr double fastest_turn = 1e3;  // rad/s
  row("velocity", Type::vector(Dimension::speed, {-fastest, fastest}), "Of the origin of the surface (world).",
      with_default(Vec3(0.0, 0.0, 0.0)));
  row("angular_velocity", Type::vector(Dimension::angle, {-fastest_turn, fastest_turn}), "About it, a second (world).",
      with_default(Vec3(0.0, 0.0, 0.0)));
  row("since", seconds(not_negative), "Until then it stands at its pose.", &Motion::since);
  // A scene file is one snapshot for the whole run: without a horizon the motion goes on.
  row("horizon", seconds(not_negative), "How long it moves from then on.", &Motion::horizon, with_default(3600.0));
}

void parametric(SceneObject& row) {
  using S = ParametricSettings;
  const auto size = [&](const char* key, const Type& type, const char* help, double S::*member, const auto&... more) {
    row(key, type, help, member,
        only_if(Test::is("shape", taking<ParametricShape>(parametric_parameters, key)), "by the shape \"{}\""),
        more...);
  };
  row("shape", Type::named<ParametricShape>(),
      "plane: (u, v, 0), centred. cylinder: u the angle, v the height. sphere: u longitude, v latitude. torus: u "
      "around the axis, v around the tube. vase: a turned vase with a belly and a neck (heterogeneous-features-2008, "
      "Fig. 11), u the angle, v the height. ramp: (v cos u, v sin u, v^3 + 3 u) of the paper's section 3.1.3.",
      &S::shape, always_there);
  size("width", length(positive), "plane: along u.", &S::width, by_contents("sizes that are too large or too small"));
  size("depth", length(positive), "plane: along v.", &S::depth, by_contents("sizes that are too large or too small"));
  size("radius", length(positive), "cylinder, sphere, torus; vase: of the widest place.", &S::radius,
       by_contents("a torus with a tube that is wider, and sizes that are too large or too small"));
  size("tube", length(positive), "torus: radius of the tube, below radius.", &S::tube, by_contents("more than radius"));
  size("height", length(positive), "cylinder, vase.", &S::height, by_contents("sizes that are too large or too small"));
  size("neck", ratio({0.05, 0.95}), "vase: radius of the neck over that of the widest place.", &S::neck);
  size("scale", length(positive), "ramp: length of one unit of the formula.", &S::scale,
       by_contents("sizes that are too large or too small"));
}

void mesh_generator(SceneObject& row) {
  constexpr double degree = std::numbers::pi / 180.0;
  const Range sizes{1e-9, 1e9};
  const std::vector<std::string> balls{"icosphere", "M_d"};
  const std::vector<std::string> trials{"M_a", "M_b", "M_c", "M_G"};
  const auto of = [&](const char* key, const Type& type, const char* help, std::vector<std::string> generators,
                      const auto&... more) {
    row(key, type, help, only_if(Test::is("generator", generators), "by this generator"), more...);
  };
  row("generator",
      Type::one_of({"icosphere", "M_a", "M_b", "M_c", "M_d", "M_e", "M_f", "M_G", "plane", "box", "random"}),
      "The papers' trial meshes (M_d is the icosphere, M_G is M_b whose geometry follows a mesostructure), a plane cut "
      "into triangles, a box, or a random closed blob.",
      always_there);
  of("columns", Type::integer(1, 1000), "Pairs of triangles in a strip.", trials, with_default(8));
  of("columns", Type::integer(1, 2048), "plane: cells along x.", {"plane"},
     only_if(Test::without("triangles"), "beside triangles"), with_default(1));
  of("rows", Type::integer(1, 1000), "Strips.", trials, with_default(8));
  of("rows", Type::integer(1, 2048), "plane: cells along y.", {"plane"},
     only_if(Test::without("triangles"), "beside triangles"), with_default(1));
  of("largest_fold", angle({1e-3, std::numbers::pi / 4.0}), "Largest fold between faces beyond flat.", {"M_b", "M_G"},
     with_default(std::numbers::pi / 30.0));
  of("bend", Type::named<TrialBend>(),
     "dome: along every edge, laid on a sphere, which folds of 45 degrees close around. arch: along the rows, flat "
     "within a strip.",
     {"M_b", "M_G"}, with_default(TrialBend::dome));
  of("fold_angles",
     Type::array(angle({10.0 * degree, 180.0 * degree}), 1, 1000, "angles")
         .saying("1 to 1000 angles, 10 to 180 degrees each (rad, or \"60 deg\")"),
     "Angles between the two faces at its ridges, in turn. Valleys have the mean of their two ridges.", {"M_c"},
     with_default(std::vector<double>{60.0 * degree, 90.0 * degree, 120.0 * degree}));
  of("subdivisions", Type::integer(0, 9), "20 * 4^subdivisions triangles.", balls, with_default(4));
  of("subdivisions", Type::integer(0, 8), "20 * 4^subdivisions triangles.", {"random"}, with_default(4));
  of("subdivisions", Type::integer(0, 10), "Every triangle of M_b becomes 4^subdivisions.", {"M_G"}, with_default(4),
     by_contents("more than 4194304 triangles in all"));
  of("radius", length(sizes), "Of the ball.", {"icosphere", "M_d", "random"}, with_default(0.04));
  of("mean_edge", length(sizes), "Mean edge length; of a ball in place of radius; M_G: of its M_b.",
     {"M_a", "M_b", "M_c", "M_e", "M_f", "M_G", "icosphere", "M_d"}, only_if(Test::without("radius"), "beside radius"),
     with_default(0.01));
  of("rings", Type::integer(1, 512), "Rings around the bottom of the cup.", {"M_e"}, with_default(8));
  of("opening", angle({0.1, 3.0}), "From the bottom to the rim seen from the centre.", {"M_e"},
     with_default(std::numbers::pi / 2.0));
  of("grading", Type::number({0.1, 0.9}), "Area of each triangle over that of the one before.", {"M_f"},
     with_default(0.5));
  of("triangles", Type::integer(1, 40), "M_f: how many.", {"M_f"}, with_default(10),
     by_contents("so many that the last has less than 2^-40 of the first's area"));
  of("triangles", Type::integer(2, 4'194'304), "plane: exactly so many, in place of columns and rows.", {"plane"},
     or_else("two for each of columns and rows"));
  of("width", length(sizes), "plane: along x.", {"plane"}, with_default(0.1));
  of("depth", length(sizes), "plane: along y of its own frame.", {"plane"}, with_default(0.1));
  of("size", Type::vector(Dimension::length, sizes), "Along x, y, z.", {"box"}, with_default(Vec3(0.08, 0.08, 0.08)));
  of("seed", Type::seed(), "The same seed gives the same mesh.", {"random"}, with_default(std::uint64_t{1}));
  of("roughness", Type::number({0.0, 0.9}), "How far vertices leave the sphere, as a share of the radius.", {"random"},
     with_default(0.2));
  of("mesostructure", Type::object("mesostructure"), "What its geometry follows.", {"M_G"},
     there_if(Test::is("generator", {"M_G"})));
}

void volume(SceneObject& row) {
  using S = VolumeGenerator;
  const Test made = Test::given("generator");
  const Test read = Test::without("generator");
  const auto of = [&](const char* key, const Type& type, const char* help, auto S::*member, const auto&... more) {
    row(key, type, help, member, only_if(made, "without a generator"),
        only_if(Test::is("generator", taking<VolumeKind>([](VolumeKind k) { return parameters_of(k); }, key)),
                "by the generator \"{}\""),
        or_else("the generator's"), more...);
  };
  row("derive", Type::named<DerivedField>(),
      "A scalar computed from the array, with differences of second order; all but gradient_magnitude need vectors.",
      by_contents("an array that it cannot be computed from"));
  row("component", Type::any({Type::integer(0, 1000), Type::named<VectorPart>()}),
      "Of an array of vectors: a number from 0, or one of the texts.",
      only_if(Test::without("derive"), "beside \"derive\""), or_else("the array has to be one of numbers"),
      by_contents("a component that the array does not have, and bricked files"));
  row("reconstruction", Type::named<CellReconstruction>(),
      "What lies between the samples: trilinear as large-data-2008, or smooth, whose gradient is continuous.",
      with_default(CellReconstruction::smooth));
  row("file", Type::file(), "A volume file, or the folder of an OpenFOAM case; the path is relative to the scene.",
      only_if(read, "beside a generator"), there_if(read), by_contents("a file that cannot be read as a volume"));
  row("array", Type::text(), "Which of the file's arrays.", only_if(read, "beside a generator"),
      or_else("the first of numbers (of vectors, where they are needed) that is not constant"),
      by_contents("an array that the file does not have, and bricked files"));
  row("association", Type::named<Association>(), "Whether the array sits on nodes or in cells.",
      only_if(read, "beside a generator"), or_else("whichever there is, nodes first"),
      by_contents("bricked files, which have one"));
  row("resample", Type::array(Type::integer(0, 4096), 3, 3, "numbers").saying("three whole numbers, 0 to 4096"),
      "Nodes along x, y, z onto which cells that are no rectilinear grid are resampled; 0: chosen.",
      only_if(read, "beside a generator"), by_contents("bricked files, which are resampled already"));
  row("residency", Type::bytes({1048576.0, 1099511627776.0}),
      "Of a bricked file (.aspvol): how much of it is in memory.", only_if(read, "beside a generator"),
      or_else("512 MiB"), by_contents("a volume in memory"));
  row("generator", Type::named<VolumeKind>(),
      "A volume made from a formula, in place of a file. Centred on the origin. cavity is a velocity field.");
  row("size", Type::array(Type::integer(2, 4096), 3, 3, "numbers").saying("three whole numbers, 2 to 4096"),
      "Nodes along x, y, z.", only_if(made, "without a generator"),
      or_else("259, 127, 128 for cavity (large-data-2008), 128 each for others"),
      by_contents("more nodes than fit into memory"));
  row("extent", Type::vector(Dimension::length, positive), "The box.", &S::extent, only_if(made, "without a generator"),
      or_else("0.2, 0.1, 0.1 m for cavity, 0.1 m each for others"),
      by_contents("a box that its numbers do not fit into"));
  row("stretch", Type::number({1.0, 100.0}), "How much wider the widest cell is than the narrowest.", &S::stretch,
      only_if(made, "without a generator"), or_else("6 for cavity, 1 for others"));
  of("radius", length(positive), "sphere: of the ball.", &S::radius, or_else("0.35 of the shortest side"));
  of("wavelength", length(positive), "shells, waves, gyroid, cavity: the distance of what repeats.", &S::wavelength);
  of("thickness", length(positive),
     "shells: half thickness of the innermost sheet; cavity: half thickness of the shear layer; waves: half width of "
     "the steep strip along x.",
     &S::thickness, by_contents("sheets that touch one another"));
  of("amplitude", length(not_negative), "waves: of the sheet.", &S::amplitude,
     only_if(Test::is("generator", {"waves"}), "by the generator \"{}\""), by_contents("more than the box holds"));
  of("amplitude", Type::number(not_negative), "ramp: in the field's unit.", &S::amplitude);
  of("gradient", Type::number(), "ramp: the field's slope in its unit by metre, not 0.", &S::gradient,
     by_contents("0"));
  of("steepness", Type::number({1.0, 1e6}),
     "waves: how many times steeper the field is in a strip along x, the sheet's place being the same.", &S::steepness);
  of("count", Type::integer(1, 64), "shells: how many sheets.", &S::count, by_contents("more sheets than fit"));
  of("speed", speed(positive), "cavity: of the outer stream.", &S::speed);
  of("strength", Type::number({0.0, 0.9}), "cavity: how far the layer has rolled up.", &S::strength);
  of("time", seconds({-1e6, 1e6}), "cavity: since the layer began to roll up.", &S::time);
  row("time", Type::any({Type::text(), Type::number()}).saying("the name of a time step"),
      "Of a file: the step of an OpenFOAM case by its name.", only_if(read, "beside a generator"), or_else("the last"),
      by_contents("a step that the case does not have, and bricked files"));
  row("type", Type::named<SampleType>(), "How samples are stored; int16 and uint8 are scaled to fill the type.",
      &S::type, only_if(made, "without a generator"), by_contents("another than float32 for cavity"));
}

/// A number of the field, or a share of its range.
Type field_value() {
  return Type::any({Type::number(), Type::share_alone({0.0, 1.0})})
      .saying("a number in the field's unit, or a share of its range (\"50 %\")");
}

void iso(SceneObject& row) {
  row("threshold", field_value(), "In the field's unit, or a share of its range (\"50 %\").",
      or_else("what splits the samples best in two (Otsu 1979); the middle of the range for a bricked file"),
      by_contents("a threshold that the field nowhere has"));
  row("inside", Type::named<Inside>(), "Which side of the threshold is the inside: low as in large-data-2008, or high.",
      with_default(Inside::high));
  row("threshold_speed", speed(positive),
      "How fast the surface may move along its normal when its threshold is changed while it is touched.",
      with_default(0.02));
  row("schedule", Type::array(Type::object("threshold step"), 1, 1000, "steps"),
      "Thresholds by the probe's clock: from \"threshold\" at time 0 to that of each step at its time, evenly in "
      "between.",
      or_else("the threshold stays"), by_contents("times that do not rise"));
}

void threshold_step(SceneObject& row) {
  row("time", seconds(positive), "Since the start.", always_there);
  row("threshold", field_value(), "In the field's unit, or a share of its range (\"50 %\").", always_there,
      by_contents("a threshold that the field nowhere has"));
}

void implicit(SceneObject& row) {
  using S = ConversionSettings;
  const auto of_mesh = [&](const char* key, const Type& type, const char* help, const auto&... more) {
    row(key, type, help, only_if(Test::without("file"), "with a .vdb file, which has its own"), more...);
  };
  row("file", Type::file(),
      "A .vdb file in place of the conversion: a level set, its closest faces and materials where it has them.",
      by_contents("a file that cannot be read, and that of another mesh"));
  row("grid", Type::text(), "Of the file: name of the level set.", only_if(Test::given("file"), "without a .vdb file"),
      or_else("the only one, or the first"), by_contents("a grid that the file does not have"));
  row("texture", Type::object("implicit texture"),
      "Noise that modulates the potential. A coat does the same with an image.", by_contents("a coat beside it"));
  row("offset", length(not_negative),
      "What is felt is where the potential has this value: some volume for thin objects.", with_default(0.0),
      by_contents("more than is stored"));
  row("reconstruction", Type::named<CellReconstruction>(),
      "Between stored points: trilinear as hybrid-surface-2004, or smooth (tricubic, continuous gradient).",
      with_default(CellReconstruction::smooth));
  row("materials", Type::array(Type::object("material brush"), 1, 10000, "entries"),
      "Local materials, laid on stored points by balls, in turn.",
      by_contents("materials that cannot be, and a roughness without a texture"));
  const char* fine = "so fine that it needs more memory than it may, or so coarse that nothing is left";
  of_mesh("voxel", length(positive), "Distance of stored points.", by_contents(fine));
  of_mesh("resolution", Type::integer(8, 4096), "Voxels along the mesh's longest side.",
          only_if(Test::without("voxel"), "beside voxel"), with_default(256), by_contents(fine));
  of_mesh("budget", Type::bytes({1048576.0, 1099511627776.0}), "The finest voxel whose grid takes at most this.",
          only_if(Test::without("voxel"), "beside voxel"), only_if(Test::without("resolution"), "beside resolution"),
          by_contents(fine));
  of_mesh("band_outside", length(positive), "How far out the potential is stored, at least three voxels.",
          or_else("what law, offset, probe and texture reach for"), by_contents("less than three voxels"));
  of_mesh("band_inside", Type::any({Type::one_of({"all"}), length(positive)}),
          "How far in it is stored, at least three voxels, or \"all\".",
          or_else("one and a half times as deep as the device's largest force presses"),
          by_contents("less than three voxels"));
  of_mesh("inside", Type::named<InsideRule>(),
          "What tells inside from outside. flood: outside is what can be reached from far away. winding: the "
          "generalised winding number, which bridges holes. shell: no inside, the potential is the distance less half "
          "of shell_thickness. automatic: flood for closed, oriented meshes, winding where faces still tell their two "
          "sides apart, else shell.",
          &S::rule, by_contents("a rule that this mesh has no inside by"));
  of_mesh("shell_thickness", length(positive), "Of the shell around open sheets.",
          only_if(Test::is("inside", {"shell", "automatic"}), "by this rule of what is inside"), or_else("two voxels"),
          by_contents("less than two voxels"));
  row("redistance", Type::named<Redistancing>(),
      "What is done so that a textured potential stays a distance: nothing as the paper, division by its slope, or the "
      "distance to its zero set.",
      with_default(Redistancing::redistanced), by_contents("neither texture nor coat"));
}

void implicit_texture(SceneObject& row) {
  row("type", Type::one_of({"gaussian", "gradient"}),
      "gaussian: independent deviates, whose grain is the voxel (hybrid-surface-2004, Fig. 7). gradient: gradient "
      "noise (Perlin 2002).",
      with_default("gradient"));
  row("amplitude", length(positive), "gaussian: standard deviation, cut at three of them; gradient: largest height.",
      with_default(0.0002), by_contents("more than the band that is stored"));
  row("seed", Type::seed(), "Of the noise.", with_default(std::uint64_t{1}));
  row("wavelength", length(positive), "gradient: distance of the noise's lattice.",
      only_if(Test::is("type", {"gradient"}), "by Gaussian noise, whose grain is the voxel"), with_default(0.003));
}

void material_brush(SceneObject& row) {
  const Test nothing = Test::none({Test::given("damping"), Test::given("static_friction"),
                                   Test::given("dynamic_friction"), Test::given("roughness")});
  row("centre", Type::vector(Dimension::length), "In the surface's own frame.", always_there);
  row("radius", length(positive), "Of the ball.", with_default(0.005));
  row("falloff", length(not_negative), "Over this, at most the radius, the material fades to what was there.",
      with_default(0.0), by_contents("more than the radius"));
  row("stiffness", stiffness(positive), "Of the contact. One property at least has to be given.", there_if(nothing));
  row("damping", damping(not_negative), "Along the normal; it never pulls the probe inward.");
  row("static_friction", Type::number(not_negative), "Coulomb's coefficient while the proxy sticks.",
      by_contents("less than the dynamic one"));
  row("dynamic_friction", Type::number(not_negative),
      "Coulomb's coefficient while it slides, 0 to static_friction; f_c of the law virtual-contact-point.",
      by_contents("more than the static one"));
  row("roughness", Type::number(not_negative), "What the texture's heights are multiplied with.",
      by_contents("no texture that it could multiply"));
}

void effect(SceneObject& row) {
  const Test scalars = Test::is("type", {"gravity-scalars", "viscosity-scalars"});
  const char* by = "by the effect \"{}\"";
  row("type", Type::named<FieldEffectKind>(),
      "viscosity: -T v. gradient: T g. iwata: T along a direction. pao: -T v along the gradient. gravity-scalars: "
      "T(|value - wanted|) towards the wanted value. viscosity-scalars: -T(|value - wanted|) v. T is the transfer "
      "function of the field's value, g its gradient, v the probe's velocity.",
      &FieldEffect::kind, always_there);
  row("transfer",
      Type::array(Type::array(Type::number(), 2, 2, "numbers").saying("a pair of numbers"), 1, 1000000, "points")
          .saying("an array of points [value, answer]"),
      "The transfer function: points [value, answer], linear between them, constant beyond. Values in the field's "
      "unit, increasing; answers in N s/m (viscosity, pao, viscosity-scalars), N (iwata, gravity-scalars) or N m by "
      "the field's unit (gradient).",
      always_there, by_contents("values that do not increase, answers that no hand could bear"));
  row("direction", Type::direction(), "iwata: of the force, in the world, not 0.", &FieldEffect::direction,
      only_if(Test::is("type", {"iwata"}), by), by_contents("three zeros, which are no direction"));
  row("value", Type::number(), "gravity-scalars, viscosity-scalars: the value that is looked for, in the field's unit.",
      &FieldEffect::value, only_if(scalars, by));
  row("formulation", Type::named<Formulation>(), "pao: as the paper prints it, or with its errata resolved.",
      &FieldEffect::formulation, only_if(Test::is("type", {"pao"}), by));
  row("largest_force", force(positive), "What any force is cut to.", &FieldEffect::largest_force);
  row("volume",
      Type::any({Type::file(), Type::object("volume")})
          .saying("a volume file or an object with \"file\" or \"generator\""),
      "As for a surface.", always_there, by_contents("a file that cannot be read, and what is no volume of numbers"));
  row("name", Type::text(), "What it is called in messages and reports.", or_else("its type and its volume"));
  placing(row, {});
}

void sidecar(SceneObject& row) {
  constexpr double most_nodes = 1U << 20U;  // along an axis: 1e6 nodes of 8 bytes, before any sample is looked at
  const auto three = [](const Type& type, const char* accepted) {
    return Type::array(type, 3, 3, "numbers").saying(accepted);
  };
  const Test even = Test::without("axes");
  row("asperity_volume", Type::integer(1, 1000000), "Format version: 1.", always_there);
  row("file", Type::file(), "The raw samples, x fastest; the path is relative to the sidecar.", always_there);
  row("size", three(Type::integer(1, most_nodes), "three whole numbers of samples, 1 or more, along x, y, z"),
      "Samples along x, y, z.", always_there);
  row("type", Type::named<SampleType>(), "Of the samples.", always_there);
  row("byte_order", Type::one_of({"little", "big"}), "Of the samples.", always_there);
  row("components", Type::integer(1, 3), "1 or 3.", with_default(1));
  row("association", Type::one_of({"node", "cell"}), "Whether samples sit on nodes or in cells.", with_default("node"));
  row("array", Type::text(), "What it is called.", or_else("the file's name"));
  row("unit", Type::text(), "Of the samples.", or_else("none"));
  row("axes", Type::object("sidecar's axes"), "Where nodes lie.", or_else("evenly"));
  row("spacing", three(Type::number(positive), "three numbers above 0"), "Between nodes along x, y, z.",
      with_default(Vec3(1.0, 1.0, 1.0)), only_if(even, "beside \"axes\""));
  row("origin", three(Type::number(), "three numbers"), "Of the first node.", with_default(Vec3(0.0, 0.0, 0.0)),
      only_if(even, "beside \"axes\""));
}

void sidecar_axes(SceneObject& row) {
  for (const char* axis : {"x", "y", "z"}) {
    row(axis, Type::array(Type::number(), 1, (1U << 20U) + 1, "coordinates").saying("an array of coordinates"),
        "Coordinates of the nodes, rising.", always_there);
  }
}

}  // namespace

void placing(SceneObject& row, std::vector<std::pair<Test, std::string>> unfit) {
  const char* generated = "for a generated mesh or volume, which is in metres";
  Option& units = row(
      "units", Type::one_of({"m", "cm", "mm", "um", "in"}), "Unit of the mesh or volume file; neither kind states one.",
      only_if(Test::none({Test::an_object("mesh")}), generated), only_if(Test::without("volume.generator"), generated),
      with_default("m"), by_contents("bricked files, which are in metres"));
  for (const auto& [test, why] : unfit) units.only_if(test, why);
  Option& fit =
      row("fit",
          Type::any({Type::one_of({"workspace", "none"}), length(positive)})
              .saying("\"workspace\", \"none\", or a length above 0 (" + accepted_units(Dimension::length) + ")"),
          "workspace: scaled so that its largest side is the device's workspace radius, and centred on the origin. "
          "none: as it is. A length: scaled to that largest side, and centred.",
          or_else("workspace for a file whose units are not stated, else none"),
          by_contents("bricked files, which are in metres"));
  for (const auto& [test, why] : unfit) fit.only_if(test, why);
  row("pose", Type::object("pose"), "Where it is in the world, after fit and up.", or_else("at the origin"));
}

Rows shape_rows() {
  return {
      {{"surface",
        "One touchable thing: a mesh and what it wears, its implicit twin, a volume, or a formula; how it is felt, "
        "what it is made of, where it is."},
       surface},
      {{"mesh generator", "A mesh made from a formula (hrm-2010, Table 1, and plain shapes)."}, mesh_generator},
      {{"parametric",
        "A surface given by a formula over two parameters u and v, without triangles. Its own axis is z; \"up\" turns "
        "it to the world's."},
       parametric},
      {{"volume", "Samples on a rectilinear grid, from a file or a generator."}, volume},
      {{"iso", "An isosurface of a volume."}, iso},
      {{"threshold step", "A threshold at a time."}, threshold_step},
      {{"implicit",
        "A signed potential on a sparse grid, positive outside. One of voxel, resolution and budget says how fine it "
        "is."},
       implicit},
      {{"implicit texture", "Noise over the stored points."}, implicit_texture},
      {{"material brush", "A ball that gives stored points a material. What it does not name stays as it was."},
       material_brush},
      {{"pose", "A rigid placement."}, pose},
      {{"motion", "A motion at constant velocity. Of meshes, reliefs and formulas."}, motion},
      {{"effect",
        "A volume that is felt wherever the probe is in it, without a surface (large-data-2008, eq. 2 to 4)."},
       effect},
      {{"volume's sidecar", "A JSON file beside raw samples that says how to read them (not part of a scene)."},
       sidecar},
      {{"sidecar's axes", "Nodes of a volume that are not evenly spaced."}, sidecar_axes},
  };
}

}  // namespace asperity::scene_rows
