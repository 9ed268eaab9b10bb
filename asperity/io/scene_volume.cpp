// Volumes in a scene file, and the isosurfaces in them.

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "asperity/field/volume/derived_fields.h"
#include "asperity/field/volume/generators.h"
#include "asperity/io/detail/scene_reader.h"
#include "asperity/io/volume_io.h"

namespace asperity {
namespace {

using Samples = std::variant<ScalarGrid, VectorGrid>;

/// What a volume's object says beyond where its samples come from.
struct VolumeWords {
  std::optional<DerivedField> derive;
  std::optional<VectorPart> part;  ///< "component" as a text
  int component = -1;              ///< "component" as a number
  CellReconstruction reconstruction = CellReconstruction::smooth;
};

template <class T>
std::optional<T> named(ObjectReader& reader, std::string_view key, Result<T> (*parse)(std::string_view)) {
  const SceneJson* value = reader.raw(key);
  if (value == nullptr) return std::nullopt;
  if (!value->is_string()) {
    reader.fail_type(key, *value, parse("?").error().accepted);
    return std::nullopt;
  }
  const Result<T> parsed = parse(value->get_ref<const std::string&>());
  reader.write(key, *value);
  if (parsed) return *parsed;
  reader.fail(key, parsed.error().what, parsed.error().accepted);
  return std::nullopt;
}

VolumeWords read_words(ObjectReader& reader) {
  VolumeWords words;
  words.derive = named<DerivedField>(reader, "derive", parse_derived_field);
  const SceneJson* component = reader.raw("component");
  if (component != nullptr && component->is_number()) {
    words.component = reader.integer("component", 0, 0, 1000);
  } else {
    words.part = named<VectorPart>(reader, "component", parse_vector_part);
  }
  if (words.derive && component != nullptr) reader.refuse({"component"}, "beside \"derive\"");
  words.reconstruction = reader.choice("reconstruction", words.reconstruction);
  return words;
}

std::array<std::uint32_t, 3> three_counts(ObjectReader& reader, std::string_view key, std::uint32_t least) {
  std::array<std::uint32_t, 3> counts{};
  const SceneJson* value = reader.raw(key);
  if (value == nullptr) return counts;
  const std::string accepted = fmt::format("three whole numbers, {} to 4096", least);
  if (!value->is_array() || value->size() != 3) {
    reader.fail_type(key, *value, accepted);
    return counts;
  }
  for (std::size_t a = 0; a < 3; ++a) {
    const SceneJson& n = (*value)[a];
    if (!n.is_number_unsigned() || n.get<std::uint64_t>() < least || n.get<std::uint64_t>() > 4096) {
      reader.fail(fmt::format("{}[{}]", key, a), fmt::format("is {}", n.dump()), accepted);
      return counts;
    }
    counts[a] = n.get<std::uint32_t>();
  }
  reader.write(key, *value);
  return counts;
}

/// The parameters of a generator, by the names that its kind takes.
class GeneratorWords {
 public:
  GeneratorWords(ObjectReader& reader, VolumeGenerator& generator) : reader_(reader), generator_(generator) {}

  void read() {
    refuse_others();
    if (reader_.has("size")) generator_.size = three_counts(reader_, "size", 2);
    if (reader_.has("extent")) generator_.extent = reader_.lengths("extent", Vec3::Zero());
    if (reader_.has("stretch")) generator_.stretch = reader_.number("stretch", 1.0, Range{1.0, 100.0});
    length("radius", generator_.radius);
    length("wavelength", generator_.wavelength);
    length("thickness", generator_.thickness);
    if (reader_.has("amplitude")) generator_.amplitude = amplitude();
    if (reader_.has("gradient")) generator_.gradient = reader_.number("gradient", generator_.gradient);
    if (reader_.has("count")) generator_.count = reader_.integer("count", generator_.count, 1, 64);
    if (reader_.has("speed"))
      generator_.speed = reader_.quantity("speed", Dimension::speed, generator_.speed, Range::positive());
    if (reader_.has("strength")) generator_.strength = reader_.number("strength", generator_.strength, Range{0.0, 0.9});
    if (reader_.has("time")) generator_.time = reader_.quantity("time", Dimension::time, generator_.time);
    if (reader_.has("type")) generator_.type = reader_.choice("type", SampleType::float32);
  }

 private:
  void refuse_others() {
    const std::span<const std::string_view> own = parameters_of(generator_.kind);
    for (const std::string_view key :
         {"radius", "wavelength", "thickness", "amplitude", "gradient", "count", "speed", "strength", "time"}) {
      if (std::find(own.begin(), own.end(), key) == own.end())
        reader_.refuse({key}, fmt::format("by the generator \"{}\"", to_string(generator_.kind)));
    }
  }
  void length(std::string_view key, std::optional<double>& value) {
    if (reader_.has(key)) value = reader_.quantity(key, Dimension::length, 0.0, Range::positive());
  }
  /// A length for waves, in the field's unit for a ramp.
  double amplitude() {
    if (generator_.kind == VolumeKind::waves)
      return reader_.quantity("amplitude", Dimension::length, 0.0, Range::not_negative());
    return reader_.number("amplitude", 0.0, Range::not_negative());
  }

  ObjectReader& reader_;
  VolumeGenerator& generator_;
};

Result<Samples> generate(ObjectReader& reader, SceneContext& context, std::string& name) {
  reader.refuse({"file", "array", "association", "resample", "residency"}, "beside a generator");
  const std::optional<VolumeKind> kind = named<VolumeKind>(reader, "generator", parse_volume_kind);
  ASPERITY_CHECK(reader.status());
  VolumeGenerator generator;
  generator.kind = *kind;
  GeneratorWords(reader, generator).read();
  ASPERITY_CHECK(reader.status());
  name = to_string(generator.kind);
  return at_place(generate_volume(generator, context.progress), reader.place());
}

Result<Samples> read_file(ObjectReader& reader, const VolumeWords& words, SceneContext& context,
                          const std::filesystem::path& path) {
  VolumeRequest request;
  request.array = reader.text("array", "");
  request.association = reader.choice("association", Association::any);
  request.component = words.component;
  request.vectors = words.part.has_value() || (words.derive && *words.derive != DerivedField::gradient_magnitude);
  request.resample = three_counts(reader, "resample", 0);
  if (const SceneJson* time = reader.raw("time")) {
    if (!time->is_string() && !time->is_number()) reader.fail_type("time", *time, "the name of a time step");
    request.time = time->is_string() ? time->get<std::string>() : time->dump();
    reader.write("time", request.time);
  }
  ASPERITY_CHECK(reader.status());
  ASPERITY_TRY(VolumeSource source,
               in_file(read_volume(path, request, context.progress), path.string(), reader.place()));
  for (const std::string& note : source.notes)
    context.note(fmt::format("volume \"{}\": {}", path.stem().string(), note));
  reader.write("array", source.array);
  if (source.resample_max == 0.0) reader.write("association", source.cell_data ? "cell" : "node");
  return std::move(source.data);
}

/// One number at each sample: a component, or what is derived.
Result<ScalarGrid> scalars_of(Samples samples, const VolumeWords& words, const ObjectReader& reader,
                              SceneContext& context) {
  const auto located = [&](Result<ScalarGrid> grid, const char* key) -> Result<ScalarGrid> {
    if (grid) return grid;
    Error error = std::move(grid).error();
    const bool more = !error.place.empty() && error.place != key;
    error.place = reader.place_of(key) + (more ? " (" + error.place + ")" : "");
    return error;
  };
  if (auto* grid = std::get_if<ScalarGrid>(&samples)) {
    if (words.derive) return located(derive(*grid, *words.derive, context.progress), "derive");
    if (words.part) {
      return bad_value(fmt::format("\"{}\" holds scalars", grid->name()), reader.place_of("component"),
                       "no component, or an array of vectors");
    }
    return std::move(*grid);
  }
  const VectorGrid& vectors = *std::get_if<VectorGrid>(&samples);
  if (words.derive) return located(derive(vectors, *words.derive, context.progress), "derive");
  if (words.part) return located(part_of(vectors, *words.part), "component");
  if (words.component >= 0) {
    constexpr std::array<VectorPart, 3> parts{VectorPart::x, VectorPart::y, VectorPart::z};
    if (words.component < 3) return part_of(vectors, parts[static_cast<std::size_t>(words.component)]);
  }
  return bad_value(fmt::format("\"{}\" holds vectors, and a surface is of one number", vectors.name), reader.place(),
                   "\"component\" (magnitude, x, y, z), or \"derive\" (vorticity_magnitude, q_criterion, helicity, "
                   "gradient_magnitude)");
}

void scale(Samples& samples, double factor, const Vec3& offset) {
  if (auto* grid = std::get_if<ScalarGrid>(&samples)) {
    samples = std::move(*grid).placed(factor, offset);
    return;
  }
  auto& vectors = *std::get_if<VectorGrid>(&samples);
  for (std::size_t a = 0; a < 3; ++a) vectors.axes[a] = vectors.axes[a].placed(factor, offset[static_cast<int>(a)]);
}

Result<VolumePart> open_bricks(ObjectReader& object, ObjectReader& reader, const VolumeWords& words,
                               const std::filesystem::path& path) {
  reader.refuse({"array", "component", "association", "time", "resample", "derive"},
                "from a bricked file, which holds one scalar: asperity convert chooses it");
  object.refuse({"units", "fit"}, "for a bricked file, whose axes are in metres: asperity convert scales them");
  BrickSettings settings;
  settings.resident_bytes = read_bytes(reader, "residency", BrickSettings{}.resident_bytes);
  ASPERITY_CHECK(reader.status());
  ASPERITY_CHECK(object.status());
  ASPERITY_TRY(std::unique_ptr<BrickStore> store, in_file(BrickStore::open(path, settings), path.string()));
  return VolumePart{std::make_shared<const ScalarField>(std::move(store), words.reconstruction), path.stem().string()};
}

/// A volume whose samples are in memory: scaled to metres, derived from, then fitted to the workspace.
Result<VolumePart> in_memory(ObjectReader& object, ObjectReader& reader, const VolumeWords& words,
                             const std::filesystem::path& path, SceneContext& context) {
  const bool from_file = !reader.has("generator");
  std::string name = path.stem().string();
  if (from_file) reader.refuse({"residency"}, "for a volume in memory: bricked files (.aspvol) have one");
  const bool stated = object.has("units") || object.has("fit");
  const double unit = read_units(object, from_file);
  const double size = read_fit(object, from_file && !stated, context);
  ASPERITY_CHECK(object.status());
  ASPERITY_CHECK(reader.status());
  ASPERITY_TRY(Samples samples, from_file ? read_file(reader, words, context, path) : generate(reader, context, name));
  if (unit != 1.0) scale(samples, unit, Vec3::Zero());
  ASPERITY_TRY(ScalarGrid grid, scalars_of(std::move(samples), words, reader, context));
  const Box bounds = grid.bounds();
  const double largest = bounds.extent().maxCoeff();
  const bool fitted = size > 0.0 && largest > 0.0;
  const double factor = fitted ? size / largest : 1.0;
  if (fitted || !from_file) grid = std::move(grid).placed(factor, -factor * bounds.centre());
  if (fitted && from_file && !stated) {
    note_fit(fmt::format("volume \"{}\": its file states no unit", name), factor, factor * bounds.extent(), context);
  }
  if (context.progress) context.progress("building the octree", 0.0);
  return VolumePart{std::make_shared<const ScalarField>(std::move(grid), words.reconstruction), std::move(name)};
}

Result<VolumePart> read_part(ObjectReader& object, const SceneJson& json, SceneContext& context) {
  ObjectReader reader(json, object.place_of("volume"), "volume");
  const VolumeWords words = read_words(reader);
  std::filesystem::path path;
  if (!reader.has("generator")) {
    reader.refuse({"size", "extent", "stretch", "radius", "wavelength", "thickness", "amplitude", "gradient", "count",
                   "speed", "strength", "type"},
                  "without a generator");
    path = context.resolve(reader.required_text("file", "a volume file, or a generator"));
    reader.write("file", path.string());
  }
  ASPERITY_CHECK(reader.status());
  ASPERITY_TRY(VolumePart part, is_bricked_path(path) ? open_bricks(object, reader, words, path)
                                                      : in_memory(object, reader, words, path, context));
  object.take("volume", std::move(reader));
  ASPERITY_CHECK(object.status());
  return part;
}

/// A number, or a share of the field's range.
std::optional<double> read_threshold(ObjectReader& reader, const ScalarField& field) {
  const SceneJson* value = reader.raw("threshold");
  const char* accepted = "a number in the field's unit, or a share of its range (\"50 %\")";
  if (value == nullptr) return std::nullopt;
  if (value->is_number()) return reader.number("threshold", 0.0);
  if (!value->is_string()) {
    reader.fail_type("threshold", *value, accepted);
    return std::nullopt;
  }
  const auto& text = value->get_ref<const std::string&>();
  const Result<double> share = parse_quantity(text, Dimension::ratio);
  if (!share || text.find('%') == std::string::npos || *share < 0.0 || *share > 1.0) {
    reader.fail("threshold", fmt::format("\"{}\" is no share of a range", text), accepted);
    return std::nullopt;
  }
  return field.lowest() + *share * (field.highest() - field.lowest());
}

double chosen_threshold(const VolumePart& volume, SceneContext& context) {
  const ScalarField& field = *volume.field;
  const double threshold =
      field.grid() != nullptr ? otsu_threshold(*field.grid()) : 0.5 * (field.lowest() + field.highest());
  context.note(fmt::format(
      "volume \"{}\": no threshold given; {:.6g} was taken, {} (values {:.6g} to {:.6g})", volume.name, threshold,
      field.grid() != nullptr ? "which splits the samples best in two (Otsu)" : "the middle of the range",
      field.lowest(), field.highest()));
  return threshold;
}

}  // namespace

std::size_t read_bytes(ObjectReader& reader, std::string_view key, std::size_t fallback) {
  constexpr double least = 1048576.0;
  constexpr double most = 1099511627776.0;
  const char* accepted = "bytes, or a text with kB, MB, GB, KiB, MiB or GiB; 1 MiB to 1 TiB";
  const SceneJson* value = reader.raw(key);
  double bytes = static_cast<double>(fallback);
  if (value != nullptr && value->is_number()) {
    bytes = value->get<double>();
  } else if (value != nullptr && value->is_string()) {
    const auto& text = value->get_ref<const std::string&>();
    const std::size_t end = text.find_first_not_of("0123456789. ");
    Result<double> number = parse_quantity(text.substr(0, end), Dimension::ratio);
    const std::string unit = end == std::string::npos ? "" : text.substr(end);
    static const std::vector<std::pair<std::string, double>> units{
        {"B", 1.0}, {"kB", 1e3}, {"MB", 1e6}, {"GB", 1e9}, {"KiB", 1024.0}, {"MiB", 1048576.0}, {"GiB", 1073741824.0}};
    const auto found = std::find_if(units.begin(), units.end(), [&](const auto& entry) { return entry.first == unit; });
    if (!number || found == units.end()) {
      reader.fail(key, fmt::format("\"{}\" is no size", text), accepted);
    } else {
      bytes = *number * found->second;
    }
  } else if (value != nullptr) {
    reader.fail_type(key, *value, accepted);
  }
  if (!(bytes >= least && bytes <= most)) reader.fail(key, fmt::format("is {:g} bytes", bytes), accepted);
  if (reader.failed()) return fallback;
  const auto resident = static_cast<std::size_t>(bytes);
  reader.write(key, resident);
  return resident;
}

Result<VolumePart> read_volume_part(ObjectReader& object, SceneContext& context) {
  const SceneJson* volume = object.raw("volume");
  const char* accepted = "a volume file or an object with \"file\" or \"generator\"";
  object.require("volume", accepted);
  if (volume != nullptr && !volume->is_string() && !volume->is_object()) object.fail_type("volume", *volume, accepted);
  ASPERITY_CHECK(object.status());
  std::string key;
  for (const char* part : {"volume", "units", "fit"}) key += object.has(part) ? object.raw(part)->dump() + "\n" : "\n";
  for (const SharedVolume& shared : context.volumes) {
    if (shared.key != key) continue;
    for (const auto& item : shared.canonical.items()) object.write(item.key(), item.value());
    return shared.part;
  }
  const SceneJson whole = volume->is_string() ? SceneJson{{"file", *volume}} : *volume;
  ASPERITY_TRY(VolumePart part, read_part(object, whole, context));
  SceneJson canonical = SceneJson::object();
  for (const char* name : {"volume", "units", "fit"}) {
    if (object.canonical().contains(name)) canonical[name] = object.canonical()[name];
  }
  context.volumes.push_back({std::move(key), part, std::move(canonical)});
  return part;
}

Result<std::shared_ptr<const IsoSurface>> read_iso(ObjectReader& surface, const VolumePart& volume,
                                                   SceneContext& context) {
  ObjectReader reader(surface.raw("iso"), surface.place_of("iso"), "iso");
  reader.write("threshold", nullptr);  // first in its canonical copy, however it is found
  const std::optional<double> given = read_threshold(reader, *volume.field);
  const auto inside = reader.choice("inside", Inside::high);
  const double speed = reader.quantity("threshold_speed", Dimension::speed, 0.02, Range::positive());
  ASPERITY_CHECK(reader.status());
  const double threshold = given ? *given : chosen_threshold(volume, context);
  reader.write("threshold", threshold);
  Result<IsoSurface> iso = IsoSurface::build(volume.field, threshold, inside, speed);
  if (!iso) {
    iso.error().place = reader.place_of("threshold");
    return std::move(iso).error();
  }
  surface.take("iso", std::move(reader));
  return std::make_shared<const IsoSurface>(std::move(*iso));
}

}  // namespace asperity
