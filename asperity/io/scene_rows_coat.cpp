// Rows of the table of scene keys: heights, and the coats that wear them.

#include "asperity/field/mesostructure/generators.h"
#include "asperity/field/mesostructure/library.h"
#include "asperity/io/detail/scene_reader.h"
#include "asperity/io/detail/scene_rows.h"
#include "asperity/surface/blend_option.h"
#include "asperity/surface/relief/closing.h"

namespace asperity::scene_rows {
namespace {

const char* const generated_heights_why = "for a generated height map";

void filter(SceneObject& row) {
  row("filter", Type::named<Reconstruction>(),
      "Between texels: steps, bilinear, or through every texel a C1 quadratic or C2 cubic (bicubic) B-spline.",
      with_default(Reconstruction::quadratic_bspline));
}

void coat(SceneObject& row) {
  const Test own = Test::without("from");
  const char* beside = "beside \"from\": \"gltf\"";
  row("from", Type::one_of({"gltf"}),
      "gltf: heights, normals and haptic maps of the materials in the mesh's own glTF file, in place of height_map.",
      or_else("gltf for glTF files whose materials have any"), by_contents("a mesh that is no glTF file"));
  heights(row, true, [&](Option& one) { one.only_if(own, beside); });
  row.rows[1].required = own;
  row("magnify", Type::number(positive),
      "Multiplies height, height_range, offset and tile, so that a surface measured in micrometres can be felt.",
      with_default(1.0));
  row("mapping", Type::named_or_auto<Mapping>(),
      "uv: the mesh's texture coordinates. per_face: the whole map on every triangle. triplanar: projected along the "
      "three axes and mixed. auto: uv where the mesh has texture coordinates, else triplanar.",
      with_default("auto"), by_contents("uv on a mesh without texture coordinates"));
  row("wrap", Type::named<Wrap>(), "Outside the map: again, or its border continued.", with_default(Wrap::repeat));
  filter(row);
  row("tile", Type::pair(length(positive)),
      "Triplanar mapping only: size of one repeat. One length keeps pixels square.",
      only_if(Test::is("mapping", {"auto", "triplanar"}),
              "by this mapping, whose size the mesh decides (\"repeat\" changes it)"),
      or_else("the sidecar's, else a quarter of the object"),
      by_contents("a mesh that is mapped by its texture coordinates"));
  row("repeat", Type::pair(Type::number(positive)),
      "uv and per_face mapping only: how often the map fits into one unit of texture coordinate.",
      only_if(Test::is("mapping", {"auto", "uv", "per_face"}),
              "by the triplanar mapping (\"tile\" is the size of one repeat)"),
      or_else("1; for a relief of the library what lays it at its own size"),
      by_contents("a mesh that is mapped along the axes"));
  row("normals", Type::one_of({"heights", "map"}),
      "heights: normals of the heights where they are touched. map: a normal map is made of the heights and read like "
      "one from a file, as the papers' force shading does.",
      only_if(Test::without("normal_map"), "beside normal_map"), with_default("heights"));
  row("normal_map", Type::file(), "An image with normals in the tangent frame.", or_else("normals of the heights"),
      by_contents("a file that cannot be read, and what is no normal map"));
  row("green", Type::named<GreenConvention>(),
      "Where the normal map's green points: up the image (OpenGL) or down (DirectX).",
      only_if(Test::given("normal_map"), "without normal_map"), with_default(GreenConvention::up));
  row("stitching", Type::object("stitching"), "How heights are joined where neighbouring faces disagree.");
  row("detail", Type::any({Type::named<DetailKind>(), Type::object("detail")}),
      "Levels of detail, between which the probe chooses by its tip, its speed and the view. A kind, or an object.",
      or_else("none"), by_contents("a map that is too large or too small for it"));
  row("layers", Type::array(Type::object("layer"), 0, Coat::most_layers, "layers"),
      "Further mesostructures, summed to the first.", by_contents("layers that the coat cannot have together"));
  row("groups", Type::array(Type::object("face group"), 1, 254, "groups"),
      "Groups of faces that wear another map in place of the coat's own, laid and joined as it is; where faces stand "
      "in "
      "several groups, the last counts.");
  row("maps", Type::object("material maps"), "Properties of the surface that vary over it, laid as the heights are.",
      by_contents("maps that are none"));
  row("closing", Type::object("closing"),
      "Closes the relief with a ball, once, when the scene is read: folds, grooves and holes that it does not fit into "
      "are filled as far as it stays out (hrm-2010, 4.2).",
      by_contents("a coat with a layer that changes with time, or with maps of the material"));
  for (Option& one : row.rows) {
    const bool stays = one.key == "from" || one.key == "stitching" || one.key == "closing";
    if (!stays && (one.only.empty() || one.only.back().why != beside)) one.only_if(own, beside);
  }
}

/// The keys of a coat, of which heights alone are read.
void mesostructure(SceneObject& row) {
  coat(row);
  for (const char* key : {"from", "closing", "normals", "normal_map", "green", "stitching"}) {
    for (Option& one : row.rows) {
      if (one.key != key) continue;
      one.only.clear();
      one.only_if(Test::any({}), "by M_G, whose geometry follows the heights");
      one.contents.clear();
    }
  }
}

void face_group(SceneObject& row) {
  row("faces",
      Type::array(Type::array(Type::integer(0, 4294967294.0), 2, 2, "numbers").saying("two faces [first, last]"), 1,
                  1000000, "ranges")
          .saying("an array of ranges of faces, each [first, last]"),
      "Faces by their number in the mesh, from 0, each range [first, last]. Triangles without area are left out, and "
      "not counted.",
      always_there, by_contents("faces that the mesh does not have, and ranges that end before they begin"));
  heights(row, true, [](Option&) {});
  row.rows[1].required = Test();
  filter(row);
}

/// Every spelling of the formulas that take a parameter; of all for none.
std::vector<std::string> formulas(std::string_view parameter) {
  std::vector<std::string> spelled;
  for (const Named<MesostructureKind>& entry : Names<MesostructureKind>::table) {
    const auto taken = parameters_of(entry.value);
    if (!parameter.empty() && std::find(taken.begin(), taken.end(), parameter) == taken.end()) continue;
    const std::string paper = paper_name(entry.value);
    spelled.insert(spelled.end(), {paper, entry.name, std::string{'h', paper[2]}});
  }
  return spelled;
}

void height_generator(SceneObject& row) {
  const Range radii{0.001, 0.25};
  const auto of = [&](const char* key, const Type& type, const char* help, const auto&... more) {
    row(key, type, help, only_if(Test::is("generator", formulas(key)), "by this generator"), more...,
        by_contents("what the formula cannot do with its other numbers"));
  };
  const auto share = [](double most) { return ratio({0.0, most}); };
  row("generator", Type::one_of(formulas("")).saying(parse_mesostructure_kind("").error().accepted),
      "H_0 (flat), H_1 (serrated), H_2 (beams), H_3 (rings), H_4 (warts), H_5 (coins), H_6 (groove) or H_7 (fractal).",
      always_there);
  row("size", Type::integer(2, 8192), "Texels a side.", with_default(512),
      by_contents("a map that is too small for its features"));
  of("count", Type::integer(1, 4096),
     "H_1: ridges, at most half of size; H_2: beams each way, at most a quarter of size.", with_default(8));
  of("number", Type::integer(1, 2000),
     "H_3: so many rings around holes, rings around peaks, peaks and holes in turn, to 64. H_4: warts. H_5: coins, to "
     "200. An error when they find no place.",
     or_else("H_3: the fixed arrangement of four; H_4: as many as 600 trials place; H_5: 5"));
  of("seed", Type::seed(), "The same seed gives the same map.",
     only_if(Test::any({Test::none({Test::is("generator", formulas("number"))}),
                        Test::is("generator", formulas("radius")), Test::given("number")}),
             "by the fixed arrangement (\"number\" scatters features)"),
     with_default(std::uint64_t{1}));
  of("wall", share(0.5), "H_1: share of a ridge that its steep left side takes, 0 (vertical: one texel).",
     with_default(0.0));
  of("width", share(1.0),
     "H_2: width of a beam, share of the pitch, at least a texel. H_6 (0.005 to 0.2): of the stroke, share of the "
     "tile.",
     or_else("H_2: 1/3; H_6: 0.08"));
  of("flank", share(0.25),
     "Width of each edge, share of the tile. H_5: to half of the narrowest rim or flat coin; H_6: to half of width.",
     or_else("H_5: 0, a vertical edge of one texel; H_6: a quarter of width"));
  of("radius", ratio(radii), "Of both bows of the S, share of the tile, 0.05 to 0.24 less a quarter of width.",
     only_if(Test::is("generator", {"H_6", "groove", "h6"}), "by this generator"), with_default(0.16));
  of("radius",
     Type::any({ratio(radii), Type::array(Type::number(radii), 2, 2, "numbers")
                                  .saying("a share of the tile from 0.001 to 0.25, or two [smallest, largest]")}),
     "Smallest and largest radius, or one for all, shares of the tile.",
     or_else("H_4: [0.015, 0.06]; H_5: [0.09, 0.15]"));
  of("rim", share(0.5), "H_5: width of the rim around a \"field\" below 1, share of the radius, 0.02 or more.",
     or_else("0.12; flat coins have none"));
  of("field", share(1.0),
     "H_5: height of the field inside a rim, with a cross on it, share of the rim's height; 1: a flat cylinder.",
     with_default(1.0));
  of("overlap", share(0.9), "H_5: how far two coins may overlap, share of the sum of their radii.", with_default(0.2));
  of("hurst", Type::number({0.05, 1.0}), "H_7: Hurst exponent, from rugged to smooth.", with_default(0.8));
  of("octaves", Type::integer(1, 12),
     "H_7: octaves of noise, the coarsest two cells a side, to the log2 of half of size.",
     or_else("one fewer, cells of four texels"));
}

void library_relief(SceneObject& row) {
  std::vector<std::string> names;
  for (const LibraryEntry& entry : mesostructure_library()) names.push_back(entry.name);
  row("library", Type::one_of(std::move(names)), "Its name.", always_there);
  row("size", Type::integer(16, 4096), "Texels a side.", with_default(512));
  row("seed", Type::seed(), "Another piece of the same stuff; 0: the one that is shown.",
      with_default(std::uint64_t{0}));
}

void stitching(SceneObject& row) {
  using S = Stitching;
  row("folds", Type::named<FoldMode>(),
      "keep: heights are blended and the mesh's own folds stay; round: penetrations are blended, and folds become "
      "round within the band; fillet: a ball rests in concave folds, convex ones stay.",
      &S::folds);
  row("rho", Type::number({0.0, 1.0 / 3.0, true}),
      "Half width of the band as a share of the smaller of the two triangles' heights over the edge. Narrowed by "
      "itself around sharp corners.",
      &S::rho);
  row("fillet_radius", length(positive), "Of the ball.", &S::fillet_radius,
      only_if(Test::is("folds", {"fillet"}), "without \"folds\": \"fillet\""));
  row.rows.push_back(blend_option(&S::blend, &S::blend_map));
}

void blend_map(SceneObject& row) {
  row("image", Type::file(), "PNG or JPEG, at least two pixels wide.", always_there,
      by_contents("a file that cannot be read as an image"));
  row("channel", Type::named<Channel>(), "Channel that holds the weight.", with_default(Channel::automatic),
      by_contents("a channel that the image does not have"));
}

void detail_levels(SceneObject& row) {
  using S = DetailSettings;
  row("kind", Type::named<DetailKind>(),
      "dilation: what balls of growing radius follow; low_pass: without waves shorter than a growing length.", &S::kind,
      with_default(DetailKind::low_pass));
  row("finest", length(not_negative),
      "Radius or wavelength of the first level, 0: one texel, two texels; each further one has twice that.", &S::finest,
      by_contents("a level that the map is too small for"));
  row("levels", Type::integer(0, DetailPyramid::most_levels),
      "How many beside the finest; 0: as many as the map has octaves.", &S::levels, by_contents("more than there are"));
}

void layer(SceneObject& row) {
  using S = SolidSpec;
  const Test map = Test::without("solid");
  const std::string by_map = "by a map (\"solid\" names one of " + name_list<SolidKind>() + ")";
  const auto solid = [&](const char* key, const Type& type, const char* help, auto S::*member,
                         std::vector<std::string> kinds, const auto&... more) {
    row(key, type, help, member, only_if(Test::given("solid"), by_map),
        only_if(Test::is("solid", kinds), "by this solid"), more...);
  };
  const std::vector<std::string>& every = all_names<SolidKind>();
  row("solid", Type::named<SolidKind>(),
      "In place of a map: a function of the place in space and of time, in the mesh's frame.", &S::kind,
      or_else("a map"));
  heights(row, true, [&](Option& one) { one.only_if(map, "by a solid"); });
  row.rows[1].required = map;
  filter(row);
  row.rows.back().only_if(map, "by a solid");
  row("repeat", Type::number(positive), "uv and per_face: how often the map fits into one repeat of the coat.",
      only_if(map, "by a solid"), with_default(1.0), by_contents("a coat that is mapped along the axes"));
  row("tile", Type::pair(length(positive)), "triplanar: size of one repeat.", only_if(map, "by a solid"),
      or_else("the map's own, else that of the coat"), by_contents("a coat that is mapped by texture coordinates"));
  solid("amplitude", length(positive), "Heights lie between minus and plus this.", &S::amplitude, every);
  solid("wavelength", length(positive), "Of waves; of a pulse the radius.", &S::wavelength, every);
  solid("direction", Type::direction(), "Of waves.", &S::direction, {"waves"},
        by_contents("three zeros, which are no direction"));
  solid("centre", Type::vector(Dimension::length), "Of rings and a pulse.", &S::centre, {"rings", "pulse"});
  solid("phase", angle(), "Of waves, a lattice and rings.", &S::phase, {"waves", "lattice", "rings"});
  solid("frequency", frequency({0.0, 1e4}), "How often they pass a second; 0: they stand still.", &S::frequency,
        {"waves", "lattice", "rings", "pulse"}, by_contents("a pulse that stands still"));
  solid("drift", Type::vector(Dimension::speed, {-100.0, 100.0}), "Of noise: how it wanders.", &S::drift, {"noise"});
  solid("octaves", Type::integer(1, 8), "Of noise.", &S::octaves, {"noise"});
  solid("persistence", Type::number({0.0, 1.0}), "Of noise: amplitude of an octave over that of the one before.",
        &S::persistence, {"noise"});
  solid("seed", Type::seed(), "Of noise.", &S::seed, {"noise"});
}

void material_maps(SceneObject& row) {
  row("stiffness", Type::object("stiffness map"), "Stiffness.");
  row("damping", Type::object("damping map"), "Damping along the normal.");
  row("friction", Type::object("factor map"), "Factor of both coefficients.");
  row("viscosity", Type::object("damping map"), "Drag against any motion while in touch.");
  row("magnetism", Type::object("magnetism map"), "How steeply the surface draws the probe.");
  row("stickiness", Type::object("stickiness map"), "Pull up to which it holds the probe.");
  row("lay", Type::object("lay map"), "Direction of least friction.");
}

void values_map(SceneObject& row, const Type& value) {
  row("image", heights_source(), "An image file, or an object with a generator or a name of the library.", always_there,
      by_contents("a file that cannot be read, and what is no map"));
  row("channel", Type::file(), "Channel that holds the value; of an OpenEXR file any channel by its own name.",
      only_if(Test::none({Test::an_object("image")}), generated_heights_why), with_default(Channel::automatic),
      by_contents("a channel that the image does not have"));
  row("low", value, "What black stands for.", always_there);
  row("high", value, "What white stands for.", always_there);
}

void lay_map(SceneObject& row) {
  row("image", Type::file(), "An image file with colours.", always_there,
      by_contents("a file that cannot be read, and an image without colours"));
}

void closing(SceneObject& row) {
  row("radius", length(positive), "Of the ball; at least that of the probe.", &ClosingSettings::radius,
      by_contents("a ball that is too large or too small for the relief"));
  row("texels", Type::integer(0, 512),
      "Of the answer along each edge of a triangle; 0: as fine as the coat or an eighth of the radius.",
      &ClosingSettings::texels, by_contents("1, and more than fit into memory"));
}

}  // namespace

void heights(SceneObject& row, bool shares, const std::function<void(Option&)>& each) {
  const std::string units = " (" + accepted_units(Dimension::length) + ")";
  const std::string share = shares ? ", or a share of the mean edge (\"10 %\")" : "";
  const auto height = [&](const char* what) {
    return (shares ? Type::length_or_share() : length()).saying(what + units + share);
  };
  const Test alone = Test::without("height_range");
  each(row("height_map", heights_source(),
           "An image (PNG of 8 or 16 bits, JPEG, OpenEXR; the path is relative to the scene), an object with a "
           "generator, or one that names a relief of the library. A JSON file beside the image with width, height, "
           "pixel_size_m, height_min_m, height_max_m gives its scale where the scene does not; values of an OpenEXR "
           "file are metres where it does not.",
           by_contents("a file that cannot be read, what is no map, and heights that the mesh cannot bear")));
  each(
      row("channel", Type::file(),
          "Channel that holds the height: automatic, luminance, red, green, blue, alpha; of an OpenEXR file any "
          "channel by its own name. automatic: alpha when it varies under a colour image, else luminance. Images only.",
          only_if(Test::none({Test::an_object("height_map")}), generated_heights_why), with_default(Channel::automatic),
          by_contents("a channel that the image does not have")));
  each(row("white_is", Type::one_of({"high", "deep"}),
           "high: white is the highest. deep: white is the lowest, as in depth maps. Images only.",
           only_if(Test::none({Test::an_object("height_map")}), generated_heights_why), with_default("high")));
  each(row(
      "height", height("a length of 0 or more"),
      "Distance between the heights of black and white, 0 or more; for H_0 the height itself. A share is of the mesh's "
      "mean edge, the papers' shorthand (1, 5, 10, 15, 20 %).",
      only_if(alone, "beside height_range"),
      or_else("the sidecar's, else 10% of the mean edge (0 for H_0); none for a feature"),
      by_contents("less than 0 but for H_0, more than half the mesh's diagonal, and none where it has no default")));
  each(row("offset", height("a length"), "Height of black (of 0 for generators); may be negative.",
           only_if(alone, "beside height_range"), or_else("the sidecar's, else 0"),
           by_contents("a share where there is no mesh that it could be of")));
  each(row("height_range", Type::array(height("a length"), 2, 2, "heights").saying("two lengths [lowest, highest]"),
           "Lowest and highest height, in place of height and offset. Images only.",
           only_if(Test::none({Test::an_object("height_map")}), generated_heights_why),
           by_contents("the higher one first, and more than half the mesh's diagonal")));
}

Type heights_source() {
  return Type::any({Type::file(), Type::object("height generator"), Type::object("library relief")})
      .saying("an image file (PNG, JPEG, EXR) or an object with a generator or a name of the library");
}

Rows coat_rows() {
  return {
      {{"coat", "A mesostructure laid on the mesh: heights, and normals of its own or computed from the heights."},
       coat},
      {{"mesostructure", "What the geometry of M_G follows, with the keys of a coat."}, mesostructure},
      {{"height generator", "A mesostructure made from a formula (hrm-2010, Table 2)."}, height_generator},
      {{"library relief", "A relief that comes with the program (asperity library), of its own size."}, library_relief},
      {{"stitching",
        "How the reliefs of neighbouring faces are joined: weights over a band around each edge that sum to one."},
       stitching},
      {{"blend map", "Blend weights from the columns of an image: its left edge is the outside of the band."},
       blend_map},
      {{"detail", "Levels of detail of a coat (formulation D5)."}, detail_levels},
      {{"layer", "A mesostructure summed to the coat: a map, or a solid."}, layer},
      {{"face group", "Faces of a coated mesh that wear a map of their own."}, face_group},
      {{"material maps", "Maps of the material, in place of its constant properties."}, material_maps},
      {{"stiffness map", "A map of stiffness."}, [](SceneObject& row) { values_map(row, stiffness(positive)); }},
      {{"damping map", "A map of damping."}, [](SceneObject& row) { values_map(row, damping(not_negative)); }},
      {{"factor map", "A map of factors."},
       [](SceneObject& row) {
         values_map(row, Type::number({0.0, 1e3}));
       }},
      {{"magnetism map", "A map of magnetism."}, [](SceneObject& row) { values_map(row, stiffness(not_negative)); }},
      {{"stickiness map", "A map of stickiness."}, [](SceneObject& row) { values_map(row, force(not_negative)); }},
      {{"lay map",
        "Directed friction: red along s, green along t, half grey none; the farther from grey, the less friction along "
        "the direction."},
       lay_map},
      {{"closing", "Morphological closing of the displaced surface."}, closing},
  };
}

}  // namespace asperity::scene_rows
