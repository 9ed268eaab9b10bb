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

VolumeWords read_words(ObjectReader& reader) {
  VolumeWords words;
  words.derive = reader.find<DerivedField>("derive");
  if (const SceneJson* component = reader.raw("component"); component != nullptr && component->is_number()) {
    words.component = reader.get("component", 0);
  } else {
    words.part = reader.find<VectorPart>("component");
  }
  words.reconstruction = reader.get<CellReconstruction>("reconstruction");
  return words;
}

std::array<std::uint32_t, 3> three_counts(ObjectReader& reader, std::string_view key) {
  std::array<std::uint32_t, 3> counts{};
  const SceneJson* value = reader.raw(key);
  if (value == nullptr) return counts;
  for (std::size_t a = 0; a < 3; ++a) counts[a] = static_cast<std::uint32_t>((*value)[a].get<double>());
  reader.write(key, *value);
  return counts;
}

Result<Samples> generate(ObjectReader& reader, SceneContext& context, std::string& name) {
  VolumeGenerator generator;
  generator.kind = *reader.find<VolumeKind>("generator");
  if (reader.has("size")) generator.size = three_counts(reader, "size");
  reader.read_all(generator, true);
  ASPERITY_CHECK(reader.status());
  name = to_string(generator.kind);
  return at_place(generate_volume(generator, context.progress), reader.place());
}

Result<Samples> read_file(ObjectReader& reader, const VolumeWords& words, SceneContext& context,
                          const std::filesystem::path& path) {
  VolumeRequest request;
  request.array = reader.get("array", std::string());
  request.association = reader.get("association", Association::any);
  request.component = words.component;
  request.vectors = words.part.has_value() || (words.derive && *words.derive != DerivedField::gradient_magnitude);
  request.resample = three_counts(reader, "resample");
  if (const SceneJson* time = reader.raw("time")) {
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
  ASPERITY_CHECK(reader.status());
  const VolumeWords words = read_words(reader);
  std::filesystem::path path;
  if (!reader.has("generator")) {
    path = context.resolve(reader.get("file", std::string()));
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
  const std::optional<double> given = reader.find<double>("threshold");
  if (!given || !reader.raw("threshold")->is_string()) return given;
  return field.lowest() + *given * (field.highest() - field.lowest());
}

/// Steps of a threshold that changes by the clock; none where there are none.
Result<std::vector<ThresholdStep>> read_schedule(ObjectReader& iso, const ScalarField& field) {
  std::vector<ThresholdStep> steps;
  const SceneJson* json = iso.raw("schedule");
  if (json == nullptr) return steps;
  SceneJson canonical = SceneJson::array();
  for (std::size_t i = 0; i < json->size(); ++i) {
    ObjectReader reader((*json)[i], iso.place_of("schedule", i), "threshold step");
    ThresholdStep& step = steps.emplace_back();
    step.time = reader.get<Seconds>("time");
    step.threshold = read_threshold(reader, field).value_or(0.0);
    reader.write("threshold", step.threshold);
    ASPERITY_CHECK(reader.status());
    canonical.push_back(std::move(reader.canonical()));
  }
  iso.write("schedule", std::move(canonical));
  return steps;
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
  const auto bytes = static_cast<std::size_t>(reader.get(key, static_cast<double>(fallback)));
  reader.write(key, bytes);
  return bytes;
}

Result<VolumePart> read_volume_part(ObjectReader& object, SceneContext& context) {
  const SceneJson* volume = object.raw("volume");
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
  const auto inside = reader.get<Inside>("inside");
  const double speed = reader.get<double>("threshold_speed");
  ASPERITY_CHECK(reader.status());
  const double threshold = given ? *given : chosen_threshold(volume, context);
  reader.write("threshold", threshold);
  Result<IsoSurface> iso = IsoSurface::build(volume.field, threshold, inside, speed);
  if (!iso) {
    iso.error().place = reader.place_of("threshold");
    return std::move(iso).error();
  }
  ASPERITY_TRY(std::vector<ThresholdStep> steps, read_schedule(reader, *volume.field));
  if (!steps.empty()) {
    ASPERITY_TRY(iso, at_place(iso->with_schedule(std::move(steps)), reader.place()));
  }
  surface.take("iso", std::move(reader));
  return std::make_shared<const IsoSurface>(std::move(*iso));
}

}  // namespace asperity
