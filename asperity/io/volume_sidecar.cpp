// Raw samples and the JSON file that tells what they are.

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <new>

#include "asperity/io/detail/file_reading.h"
#include "asperity/io/detail/scene_json.h"
#include "asperity/io/detail/volume_assembly.h"

namespace asperity {
namespace {

namespace fs = std::filesystem;
using volume_assembly::RawVolume;

constexpr std::array<const char*, 3> sidecar_axis_names{"x", "y", "z"};

/// What a sidecar says.
struct Sidecar {
  std::string file;
  std::array<std::uint64_t, 3> size{};
  SampleType type = SampleType::float32;
  bool big_endian = false;
  RawVolume raw;
  std::size_t samples = 0;  ///< tuples
};

void read_axis(ObjectReader& reader, const char* key, std::size_t count, std::vector<double>& nodes) {
  nodes = reader.get(key, std::vector<double>());
  if (nodes.size() != count)
    reader.fail(key, fmt::format("has {} coordinates", nodes.size()), fmt::format("an array of {} coordinates", count));
}

void read_places(ObjectReader& reader, Sidecar& sidecar) {
  const std::size_t more = sidecar.raw.cell_data ? 1 : 0;
  if (const SceneJson* axes = reader.raw("axes")) {
    ObjectReader axes_reader(*axes, reader.place_of("axes"), "sidecar's axes");
    for (std::size_t a = 0; a < 3; ++a)
      read_axis(axes_reader, sidecar_axis_names[a], sidecar.size[a] + more, sidecar.raw.nodes[a]);
    return reader.take("axes", std::move(axes_reader));
  }
  const auto spacing = reader.get<Vec3>("spacing");
  const auto origin = reader.get<Vec3>("origin");
  for (std::size_t a = 0; a < 3 && !reader.failed(); ++a) {
    const auto along = static_cast<int>(a);
    sidecar.raw.nodes[a] = volume_assembly::even_nodes(origin[along], spacing[along], sidecar.size[a] + more);
  }
}

/// Everything but the samples, checked against `most_bytes` before anything of their size is made.
Result<Sidecar> read_description(std::string_view text, const std::string& name, const VolumeRequest& request) {
  ASPERITY_TRY(const SceneJson json, parse_scene_json(text, name));
  ObjectReader reader(json, "", "volume's sidecar");
  if (const int version = reader.get("asperity_volume", 1); version != 1) {
    reader.fail("asperity_volume", fmt::format("is {}, a newer format than this program reads", version), "1",
                ErrorCode::file_unsupported);
  }
  ASPERITY_CHECK(reader.status());
  Sidecar sidecar;
  sidecar.file = reader.get("file", std::string());
  for (std::size_t a = 0; a < 3; ++a)
    sidecar.size[a] = static_cast<std::uint64_t>((*reader.raw("size"))[a].get<double>());
  sidecar.type = reader.get("type", SampleType::float32);
  sidecar.big_endian = reader.get("byte_order", std::string()) == "big";
  sidecar.raw.components = reader.get<int>("components");
  if (sidecar.raw.components == 2) reader.fail("components", "is 2", "1 or 3");
  sidecar.raw.cell_data = reader.get<std::string>("association") == "cell";
  sidecar.raw.array = reader.get("array", fs::path(sidecar.file).stem().string());
  sidecar.raw.unit = reader.get("unit", std::string());
  ASPERITY_CHECK(reader.status());
  const std::size_t bytes_each = sample_bytes(sidecar.type) * static_cast<std::size_t>(sidecar.raw.components);
  ASPERITY_TRY(sidecar.samples,
               at_place(volume_assembly::sample_count(sidecar.size, bytes_each, request.most_bytes), "size"));
  read_places(reader, sidecar);
  ASPERITY_CHECK(reader.status());
  return sidecar;
}

std::size_t declared_bytes(const Sidecar& sidecar) {
  return sidecar.samples * static_cast<std::size_t>(sidecar.raw.components) * sample_bytes(sidecar.type);
}

Status check_length(const Sidecar& sidecar, std::uint64_t held, const std::string& file) {
  const std::size_t declared = declared_bytes(sidecar);
  if (held == declared) return success();
  return Error{held < declared ? ErrorCode::file_truncated : ErrorCode::file_malformed,
               fmt::format("has {} bytes; its sidecar declares {} x {} x {} samples, {} bytes", held, sidecar.size[0],
                           sidecar.size[1], sidecar.size[2], declared),
               file, held < declared ? fmt::format("byte {}", held) : fmt::format("byte {}", declared),
               "a file of exactly the declared size"};
}

template <class T>
void swap_bytes(std::vector<T>& samples) {
  for (T& sample : samples) {
    auto raw = std::bit_cast<std::array<std::byte, sizeof(T)>>(sample);
    std::reverse(raw.begin(), raw.end());
    sample = std::bit_cast<T>(raw);
  }
}

/// Room for the samples, filled by `fill(pointer, bytes)`.
template <class Fill>
Result<SampleArray> load_samples(const Sidecar& sidecar, Fill&& fill) {
  const std::size_t count = sidecar.samples * static_cast<std::size_t>(sidecar.raw.components);
  SampleArray samples;
  switch (sidecar.type) {
    case SampleType::float32: samples = std::vector<float>(count); break;
    case SampleType::int16: samples = std::vector<std::int16_t>(count); break;
    case SampleType::uint8: samples = std::vector<std::uint8_t>(count); break;
  }
  const auto filled = [&](auto& values) -> Status {
    ASPERITY_CHECK(fill(reinterpret_cast<char*>(values.data()), values.size() * sizeof(values[0])));
    static_assert(std::endian::native == std::endian::little);
    if (sidecar.big_endian) swap_bytes(values);
    return success();
  };
  ASPERITY_CHECK(std::visit(filled, samples));
  return samples;
}

Result<VolumeSource> finish(Sidecar sidecar, const VolumeRequest& request) {
  std::vector<VolumeArray> arrays(1);
  VolumeArray& array = arrays[0];
  array.name = sidecar.raw.array;
  array.type = to_string(sidecar.type);
  array.components = sidecar.raw.components;
  array.association = sidecar.raw.cell_data ? Association::cell : Association::node;
  array.values = sidecar.samples;
  volume_assembly::measure(sidecar.raw.samples, array);
  std::vector<std::string> notes;
  ASPERITY_CHECK(volume_assembly::choose_array(arrays, request, notes));
  ASPERITY_TRY(VolumeSource source, volume_assembly::assemble(std::move(sidecar.raw), request));
  source.arrays = std::move(arrays);
  return source;
}

}  // namespace

Result<VolumeSource> read_sidecar_volume(std::string_view text, std::string_view samples, const std::string& name,
                                         const VolumeRequest& request) {
  try {
    ASPERITY_TRY(Sidecar sidecar, in_file(read_description(text, name, request), name));
    ASPERITY_CHECK(in_file(check_length(sidecar, samples.size(), sidecar.file), name));
    ASPERITY_TRY(sidecar.raw.samples, load_samples(sidecar, [&](char* to, std::size_t bytes) {
                   std::memcpy(to, samples.data(), bytes);
                   return success();
                 }));
    return in_file(finish(std::move(sidecar), request), name);
  } catch (const std::bad_alloc&) {
    return refused_file(ErrorCode::too_large, "needs more memory than there is", name, "a smaller volume");
  }
}

Result<VolumeSource> read_sidecar_volume(const fs::path& path, const VolumeRequest& request, const Progress& progress) {
  constexpr std::uintmax_t largest_sidecar = std::uintmax_t{16} << 20U;
  std::error_code problem;
  const std::uintmax_t length = fs::file_size(path, problem);
  std::ifstream stream(path, std::ios::binary);
  if (problem || !stream)
    return refused_file(ErrorCode::file_missing, "cannot be read", path.string(), "a volume's sidecar (JSON)");
  if (length > largest_sidecar) {
    return refused_file(ErrorCode::too_large, fmt::format("has {} bytes", length), path.string(),
                        "a sidecar of at most 16 MiB");
  }
  const std::string text{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  ASPERITY_TRY(Sidecar sidecar, in_file(read_description(text, path.string(), request), path.string()));
  const fs::path raw = path.parent_path() / fs::path(sidecar.file);
  const std::uintmax_t held = fs::file_size(raw, problem);
  std::ifstream data(raw, std::ios::binary);
  if (problem || !data || !fs::is_regular_file(raw, problem)) {
    return Error{ErrorCode::file_missing, fmt::format("the file of samples, \"{}\", cannot be read", raw.string()),
                 path.string(), "file", "a readable file, its path relative to the sidecar"};
  }
  ASPERITY_CHECK(check_length(sidecar, held, raw.string()));
  if (progress) progress("reading volume", 0.0);
  ASPERITY_TRY(sidecar.raw.samples, load_samples(sidecar, [&](char* to, std::size_t bytes) -> Status {
                 data.read(to, static_cast<std::streamsize>(bytes));
                 if (static_cast<std::size_t>(data.gcount()) == bytes) return success();
                 return Error{ErrorCode::file_truncated, "cannot be read to its end", raw.string(),
                              fmt::format("byte {}", data.gcount()), "a readable file"};
               }));
  return in_file(finish(std::move(sidecar), request), raw.string());
}

}  // namespace asperity
