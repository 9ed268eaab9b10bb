// Partitioned grids (.pvti, .pvtr): each piece is read, copied to its place, and let go.

#include <fmt/format.h>
#include <vtkImageData.h>
#include <vtkRectilinearGrid.h>

#include <algorithm>
#include <limits>

#include "asperity/io/detail/file_reading.h"
#include "asperity/io/vtk/vtk_data.h"
#include "asperity/io/vtk/xml_scan.h"

namespace asperity::vtk_io {
namespace {

using Extent = std::array<std::int64_t, 6>;

struct Piece {
  Extent extent{};
  std::string source;
  std::string place;
};

/// What the file that joins the pieces says.
struct Partition {
  bool image = false;
  Extent whole{};
  std::array<double, 3> origin{};
  std::array<double, 3> spacing{1.0, 1.0, 1.0};
  std::vector<Piece> pieces;
};

Result<Extent> read_extent(std::string_view text, const XmlElement& element, std::string_view key) {
  constexpr std::int64_t most = std::int64_t{1} << 24;
  ASPERITY_TRY(const std::vector<std::int64_t> read, whole_numbers(text, element, key, 6));
  Extent extent{};
  for (std::size_t a = 0; a < 3; ++a) {
    if (read[2 * a] < -most || read[2 * a + 1] > most || read[2 * a + 1] <= read[2 * a]) {
      return bad_value(fmt::format("{} of axis {} is {} to {}", key, "xyz"[a], read[2 * a], read[2 * a + 1]),
                       line_of(text, element.at), "two whole numbers, the second above the first");
    }
    extent[2 * a] = read[2 * a];
    extent[2 * a + 1] = read[2 * a + 1];
  }
  return extent;
}

Status read_image_geometry(std::string_view text, const XmlElement& element, Partition& partition) {
  for (const char* key : {"Origin", "Spacing"}) {
    if (!element.has(key)) continue;
    ASPERITY_TRY(const std::vector<double> read, numbers(text, element, key, 3));
    std::copy(read.begin(), read.end(), (key[0] == 'O' ? partition.origin : partition.spacing).begin());
  }
  for (std::size_t a = 0; a < 3; ++a) {
    if (!(partition.spacing[a] > 0.0)) {
      return bad_value(fmt::format("Spacing of axis {} is {:g}", "xyz"[a], partition.spacing[a]),
                       line_of(text, element.at), "a number above 0");
    }
  }
  return success();
}

Result<Partition> read_partition(std::string_view text, bool image) {
  ASPERITY_TRY(const std::vector<XmlElement> elements, scan_xml(text));
  const std::string type = image ? "PImageData" : "PRectilinearGrid";
  if (elements.front().attribute("type") != type) {
    return refused(ErrorCode::file_unsupported,
                   fmt::format("type is \"{}\"", elements.front().attribute("type").substr(0, 40)), "line 1", type);
  }
  Partition partition;
  partition.image = image;
  bool have_whole = false;
  for (const XmlElement& element : elements) {
    if (element.name == type) {
      ASPERITY_TRY(partition.whole, read_extent(text, element, "WholeExtent"));
      have_whole = true;
      if (image) ASPERITY_CHECK(read_image_geometry(text, element, partition));
    }
    if (element.name != "Piece") continue;
    const std::string place = fmt::format("piece {} ({})", partition.pieces.size(), line_of(text, element.at));
    if (!element.has("Source") || element.attribute("Source").empty())
      return refused(ErrorCode::file_malformed, "names no file", place, "Source=\"FILE\"");
    ASPERITY_TRY(const Extent extent, read_extent(text, element, "Extent"));
    for (std::size_t a = 0; a < 3; ++a) {
      if (!have_whole || extent[2 * a] < partition.whole[2 * a] || extent[2 * a + 1] > partition.whole[2 * a + 1])
        return bad_value("its Extent is not within WholeExtent", place, "a piece of the whole");
    }
    partition.pieces.push_back({extent, std::string(element.attribute("Source")), place});
  }
  if (!have_whole || partition.pieces.empty())
    return refused(ErrorCode::file_malformed, "names no pieces", {}, "one piece or more");
  return partition;
}

/// Whether every piece is there, and whether all together can hold the whole: before room for it is made.
Status check_pieces(const Partition& partition, const std::filesystem::path& folder) {
  constexpr double most_packed = 1100.0;  // zlib
  double held = 0.0;
  for (const Piece& piece : partition.pieces) {
    std::error_code problem;
    const std::filesystem::path file = folder / piece.source;
    const std::uintmax_t size = std::filesystem::file_size(file, problem);
    if (problem || !std::filesystem::is_regular_file(file, problem)) {
      return refused(ErrorCode::file_missing, fmt::format("its file \"{}\" is missing", piece.source), piece.place,
                     "every piece beside the file that joins them");
    }
    held += most_packed * static_cast<double>(size);
  }
  double cells = 1.0;
  for (std::size_t a = 0; a < 3; ++a) cells *= static_cast<double>(partition.whole[2 * a + 1] - partition.whole[2 * a]);
  if (cells <= held) return success();
  return refused(ErrorCode::too_large, fmt::format("declares {:g} cells, more than its pieces can hold", cells),
                 "WholeExtent", "pieces that cover the whole");
}

/// The volume being filled.
class Assembly {
 public:
  Assembly(const Partition& partition, const VolumeRequest& request) : partition_(partition), request_(request) {}

  /// Room for the array that the first piece settles, not a number until it is filled.
  Status begin(vtkDataSet& piece) {
    const DataArrays found = arrays_of(piece);
    ASPERITY_TRY(const std::size_t chosen, volume_assembly::choose_array(found.described, request_, notes_));
    described_ = found.described[chosen];
    raw_.components = described_.components;
    std::vector<std::string> ignored;
    const SampleArray first = samples_of(*found.arrays[chosen], ignored);
    const auto components = static_cast<std::size_t>(raw_.components);
    std::array<std::uint64_t, 3> size{};
    for (std::size_t a = 0; a < 3; ++a) {
      const auto cells = static_cast<std::size_t>(partition_.whole[2 * a + 1] - partition_.whole[2 * a]);
      size[a] = counts_[a] = of_cells() ? cells : cells + 1;
    }
    ASPERITY_TRY(
        const std::size_t count,
        at_place(volume_assembly::sample_count(size, components * sizeof(float), request_.most_bytes), "WholeExtent"));
    place_nodes();
    covered_.assign(count, false);
    raw_.samples = std::visit(
        [&](const auto& samples) { return SampleArray(std::decay_t<decltype(samples)>(count * components)); }, first);
    return success();
  }

  Status add(vtkDataSet& data, const Piece& piece) {
    const GridData grid = grid_of(&data);
    for (std::size_t a = 0; a < 3; ++a) {
      const auto nodes = static_cast<std::size_t>(piece.extent[2 * a + 1] - piece.extent[2 * a]) + 1;
      if (grid.nodes[a].size() != nodes) {
        return refused(ErrorCode::mismatch,
                       fmt::format("\"{}\" has {} nodes along axis {}, its Extent says {}", piece.source,
                                   grid.nodes[a].size(), "xyz"[a], nodes),
                       piece.place, "a piece of that size");
      }
      const auto from = static_cast<std::size_t>(piece.extent[2 * a] - partition_.whole[2 * a]);
      if (!partition_.image)
        std::copy(grid.nodes[a].begin(), grid.nodes[a].end(),
                  raw_.nodes[a].begin() + static_cast<std::ptrdiff_t>(from));
    }
    const DataArrays found = arrays_of(data);
    VolumeRequest wanted = request_;
    wanted.array = described_.name;
    wanted.association = described_.association;
    std::vector<std::string> notes;
    ASPERITY_TRY(const std::size_t chosen,
                 at_place(volume_assembly::choose_array(found.described, wanted, notes), piece.place));
    const auto other = [&](const char* what) {
      return refused(ErrorCode::mismatch, fmt::format("\"{}\" has other {}", piece.source, what), piece.place,
                     "the same arrays in every piece");
    };
    if (found.described[chosen].components != described_.components) return other("components");
    std::vector<std::string> lost;
    const SampleArray samples = samples_of(*found.arrays[chosen], lost);
    if (samples.index() != raw_.samples.index()) return other("types");
    for (std::string& note : lost) {
      if (std::find(notes_.begin(), notes_.end(), note) == notes_.end()) notes_.push_back(std::move(note));
    }
    copy(samples, piece);
    return success();
  }

  Result<VolumeSource> finish() {
    const auto left = static_cast<std::size_t>(std::count(covered_.begin(), covered_.end(), false));
    if (left > 0) {
      return refused(ErrorCode::file_malformed,
                     fmt::format("its pieces leave {} of {} samples out", left, covered_.size()), "WholeExtent",
                     "pieces that cover the whole");
    }
    described_.values = covered_.size();
    raw_.cell_data = of_cells();
    raw_.array = described_.name;
    volume_assembly::measure(raw_.samples, described_);
    ASPERITY_TRY(VolumeSource source, volume_assembly::assemble(std::move(raw_), request_));
    source.arrays = {described_};
    source.notes.insert(source.notes.begin(), notes_.begin(), notes_.end());
    return source;
  }

 private:
  [[nodiscard]] bool of_cells() const { return described_.association == Association::cell; }

  /// Of images; the axes of others come with their pieces.
  void place_nodes() {
    for (std::size_t a = 0; a < 3; ++a) {
      const std::size_t nodes = counts_[a] + (of_cells() ? 1 : 0);
      const double first = partition_.origin[a] + partition_.spacing[a] * static_cast<double>(partition_.whole[2 * a]);
      raw_.nodes[a] = partition_.image ? volume_assembly::even_nodes(first, partition_.spacing[a], nodes)
                                       : std::vector<double>(nodes, std::numeric_limits<double>::quiet_NaN());
    }
  }

  void copy(const SampleArray& samples, const Piece& piece) {
    const auto components = static_cast<std::size_t>(raw_.components);
    std::array<std::size_t, 3> from{};
    std::array<std::size_t, 3> size{};
    for (std::size_t a = 0; a < 3; ++a) {
      from[a] = static_cast<std::size_t>(piece.extent[2 * a] - partition_.whole[2 * a]);
      size[a] = static_cast<std::size_t>(piece.extent[2 * a + 1] - piece.extent[2 * a]) + (of_cells() ? 0 : 1);
    }
    std::visit(
        [&](auto& to) {
          const auto& of = *std::get_if<std::decay_t<decltype(to)>>(&samples);
          std::size_t row = 0;
          for (std::size_t k = 0; k < size[2]; ++k) {
            for (std::size_t j = 0; j < size[1]; ++j, row += size[0]) {
              const std::size_t at = from[0] + counts_[0] * (from[1] + j + counts_[1] * (from[2] + k));
              std::copy_n(of.begin() + static_cast<std::ptrdiff_t>(row * components), size[0] * components,
                          to.begin() + static_cast<std::ptrdiff_t>(at * components));
              std::fill_n(covered_.begin() + static_cast<std::ptrdiff_t>(at), size[0], true);
            }
          }
        },
        raw_.samples);
  }

  const Partition& partition_;
  const VolumeRequest& request_;
  volume_assembly::RawVolume raw_;
  VolumeArray described_;
  std::array<std::size_t, 3> counts_{};
  std::vector<bool> covered_;
  std::vector<std::string> notes_;
};

}  // namespace

Result<VolumeSource> read_pieces(const std::filesystem::path& path, const VolumeRequest& request,
                                 const Progress& progress, const VtkSession& session) {
  constexpr std::size_t largest_partition = std::size_t{64} << 20U;
  const bool image = path.extension().string()[4] == 'i' || path.extension().string()[4] == 'I';
  ASPERITY_TRY(const std::string text, file_bytes(path, largest_partition));
  ASPERITY_TRY(const Partition partition, read_partition(text, image));
  ASPERITY_CHECK(check_pieces(partition, path.parent_path()));
  Assembly assembly(partition, request);
  for (std::size_t i = 0; i < partition.pieces.size(); ++i) {
    const Piece& piece = partition.pieces[i];
    if (progress) progress("reading pieces", static_cast<double>(i) / static_cast<double>(partition.pieces.size()));
    const std::filesystem::path file = path.parent_path() / piece.source;
    ASPERITY_TRY(const vtkSmartPointer<vtkDataSet> data, load_dataset(file, request.most_bytes, session));
    if (i == 0) ASPERITY_CHECK(assembly.begin(*data));
    ASPERITY_CHECK(assembly.add(*data, piece));
  }
  return assembly.finish();
}

}  // namespace asperity::vtk_io
