#include "asperity/io/vtk/vtk_data.h"

#include <fmt/format.h>
#include <vtkCellData.h>
#include <vtkFloatArray.h>
#include <vtkImageData.h>
#include <vtkLogger.h>
#include <vtkObjectFactory.h>
#include <vtkOutputWindow.h>
#include <vtkPointData.h>
#include <vtkRectilinearGrid.h>
#include <vtkShortArray.h>
#include <vtkStructuredGrid.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <cmath>
#include <mutex>

#include "asperity/io/detail/file_reading.h"

namespace asperity::vtk_io {
namespace {

/// Takes what VTK says.
class Listener : public vtkOutputWindow {
 public:
  static Listener* New();
  vtkTypeMacro(Listener, vtkOutputWindow) void DisplayText(const char* text) override { keep(text); }
  void DisplayErrorText(const char* text) override { keep(text); }
  void DisplayWarningText(const char* /*text*/) override {}
  void DisplayGenericWarningText(const char* /*text*/) override {}
  void DisplayDebugText(const char* /*text*/) override {}
  [[nodiscard]] const std::string& first() const { return first_; }

 private:
  void keep(const char* text) {
    if (first_.empty() && text != nullptr) first_ = text;
  }
  std::string first_;
};
vtkStandardNewMacro(Listener)

    /// "ERROR: In file, line 3\nvtkFoo (0x1): cannot\n\n" as "cannot".
    std::string sentence_of(const std::string& text) {
  const std::size_t address = text.find("): ");
  std::string sentence = address == std::string::npos ? text : text.substr(address + 3);
  for (char& c : sentence) c = c == '\n' || c == '\r' ? ' ' : c;
  while (!sentence.empty() && (sentence.back() == ' ' || sentence.back() == '.')) sentence.pop_back();
  return sentence.substr(0, 300);
}

std::string type_name(vtkDataArray& array) {
  switch (array.GetDataType()) {
    case VTK_FLOAT: return "float32";
    case VTK_DOUBLE: return "float64";
    case VTK_SHORT: return "int16";
    case VTK_UNSIGNED_SHORT: return "uint16";
    case VTK_UNSIGNED_CHAR: return "uint8";
    case VTK_CHAR:
    case VTK_SIGNED_CHAR: return "int8";
    case VTK_BIT: return "bit";
    default: return fmt::format("int{}", 8 * array.GetDataTypeSize());
  }
}

void describe(vtkFieldData& data, vtkIdType tuples, Association association, DataArrays& found) {
  for (int i = 0; i < data.GetNumberOfArrays(); ++i) {
    vtkDataArray* array = data.GetArray(i);
    if (array == nullptr || array->GetNumberOfTuples() != tuples || tuples == 0) continue;
    const std::string name = array->GetName() == nullptr ? fmt::format("array {}", i) : array->GetName();
    if (name == "vtkGhostType" || name == "vtkGhostLevels") continue;
    VolumeArray described;
    described.name = name;
    described.type = type_name(*array);
    described.components = array->GetNumberOfComponents();
    described.association = association;
    described.values = static_cast<std::size_t>(tuples);
    std::vector<std::string> ignored;
    volume_assembly::measure(samples_of(*array, ignored), described);
    found.described.push_back(std::move(described));
    found.arrays.push_back(array);
  }
}

std::vector<double> coordinates(vtkDataArray* array) {
  std::vector<double> nodes;
  for (vtkIdType i = 0; array != nullptr && i < array->GetNumberOfTuples(); ++i)
    nodes.push_back(array->GetComponent(i, 0));
  return nodes;
}

}  // namespace

struct VtkSession::State {
  static std::recursive_mutex& mutex() {
    static std::recursive_mutex one;
    return one;
  }
  std::lock_guard<std::recursive_mutex> lock{mutex()};
  vtkSmartPointer<Listener> listener = vtkSmartPointer<Listener>::New();
  vtkSmartPointer<vtkOutputWindow> before = vtkOutputWindow::GetInstance();
};

VtkSession::VtkSession() : state_(std::make_unique<State>()) {
  // Messages go to the terminal by a second way of their own, which nothing of ours wants.
  vtkLogger::SetStderrVerbosity(vtkLogger::VERBOSITY_OFF);
  vtkOutputWindow::SetInstance(state_->listener);
}

VtkSession::~VtkSession() {
  vtkOutputWindow::SetInstance(state_->before);
}

Status VtkSession::status(const std::string& file) const {
  const std::string& text = state_->listener->first();
  if (text.empty()) return success();
  return refused_file(ErrorCode::file_malformed, fmt::format("VTK cannot read it: {}", sentence_of(text)), file,
                      "a whole file");
}

DataArrays arrays_of(vtkDataSet& data) {
  DataArrays found;
  describe(*data.GetPointData(), data.GetNumberOfPoints(), Association::node, found);
  describe(*data.GetCellData(), data.GetNumberOfCells(), Association::cell, found);
  return found;
}

SampleArray samples_of(vtkDataArray& array, std::vector<std::string>& notes) {
  const auto components = static_cast<std::size_t>(array.GetNumberOfComponents());
  const std::size_t count = static_cast<std::size_t>(array.GetNumberOfTuples()) * components;
  const auto copy = [&](const auto* values) {
    return std::vector<std::remove_cvref_t<decltype(*values)>>(values, values + count);
  };
  if (auto* floats = vtkFloatArray::SafeDownCast(&array)) return copy(floats->GetPointer(0));
  if (auto* shorts = vtkShortArray::SafeDownCast(&array)) return copy(shorts->GetPointer(0));
  if (auto* bytes = vtkUnsignedCharArray::SafeDownCast(&array)) return copy(bytes->GetPointer(0));
  const auto each = [&](auto&& take) {
    for (std::size_t i = 0; i < count; ++i)
      take(i, array.GetComponent(static_cast<vtkIdType>(i / components), static_cast<int>(i % components)));
  };
  if (array.GetDataType() == VTK_BIT) {
    std::vector<std::uint8_t> bits(count);
    each([&](std::size_t i, double value) { bits[i] = value != 0.0 ? 1 : 0; });
    return bits;
  }
  if (array.GetDataTypeSize() == 1) {
    std::vector<std::int16_t> shorts(count);
    each([&](std::size_t i, double value) { shorts[i] = static_cast<std::int16_t>(value); });
    return shorts;
  }
  std::vector<float> floats(count);
  std::size_t rounded = 0;
  each([&](std::size_t i, double value) {
    floats[i] = static_cast<float>(value);
    if (static_cast<double>(floats[i]) != value && !std::isnan(value)) ++rounded;
  });
  if (rounded > 0) {
    notes.push_back(
        fmt::format("values of type {} are kept as float32: {} of {} are rounded", type_name(array), rounded, count));
  }
  return floats;
}

Result<VolumeSource> volume_of(const GridData& grid, const VolumeRequest& request) {
  const DataArrays found = arrays_of(*grid.data);
  std::vector<std::string> notes;
  ASPERITY_TRY(const std::size_t chosen, volume_assembly::choose_array(found.described, request, notes));
  const VolumeArray& described = found.described[chosen];
  volume_assembly::RawVolume raw;
  raw.nodes = grid.nodes;
  raw.samples = samples_of(*found.arrays[chosen], notes);
  raw.components = described.components;
  raw.cell_data = described.association == Association::cell;
  raw.array = described.name;
  ASPERITY_TRY(VolumeSource source, volume_assembly::assemble(std::move(raw), request));
  source.arrays = found.described;
  source.notes.insert(source.notes.begin(), notes.begin(), notes.end());
  return source;
}

GridData grid_of(vtkSmartPointer<vtkDataSet> data) {
  GridData grid{data, {}};
  if (auto* image = vtkImageData::SafeDownCast(data)) {
    for (int a = 0; a < 3; ++a) {
      const double first = image->GetOrigin()[a] + image->GetSpacing()[a] * image->GetExtent()[2 * a];
      grid.nodes[static_cast<std::size_t>(a)] = volume_assembly::even_nodes(
          first, image->GetSpacing()[a], static_cast<std::size_t>(image->GetDimensions()[a]));
    }
  } else if (auto* rectilinear = vtkRectilinearGrid::SafeDownCast(data)) {
    grid.nodes = {coordinates(rectilinear->GetXCoordinates()), coordinates(rectilinear->GetYCoordinates()),
                  coordinates(rectilinear->GetZCoordinates())};
  } else if (auto* structured = vtkStructuredGrid::SafeDownCast(data)) {
    int size[3];
    structured->GetDimensions(size);
    grid.nodes = tensor_product_nodes(*data, size);
  }
  return grid;
}

std::array<std::vector<double>, 3> tensor_product_nodes(vtkDataSet& data, const int size[3]) {
  constexpr double tolerance = 1e-3;  // of the narrowest cell along the axis
  std::array<std::vector<double>, 3> nodes;
  std::array<double, 3> allowed{};
  const std::array<vtkIdType, 3> stride{1, size[0], static_cast<vtkIdType>(size[0]) * size[1]};
  if (data.GetNumberOfPoints() != stride[2] * size[2]) return nodes;
  double p[3];
  for (std::size_t a = 0; a < 3; ++a) {
    double narrowest = HUGE_VAL;
    for (int i = 0; i < size[a]; ++i) {
      data.GetPoint(i * stride[a], p);
      nodes[a].push_back(p[a]);
      if (i > 0)
        narrowest = std::min(narrowest, std::abs(nodes[a][nodes[a].size() - 1] - nodes[a][nodes[a].size() - 2]));
    }
    allowed[a] = tolerance * narrowest;
  }
  vtkIdType at = 0;
  for (int k = 0; k < size[2]; ++k) {
    for (int j = 0; j < size[1]; ++j) {
      for (int i = 0; i < size[0]; ++i, ++at) {
        data.GetPoint(at, p);
        const std::array<int, 3> index{i, j, k};
        for (std::size_t a = 0; a < 3; ++a) {
          // Also false for what is not a number.
          if (!(std::abs(p[a] - nodes[a][static_cast<std::size_t>(index[a])]) <= allowed[a])) return {};
        }
      }
    }
  }
  return nodes;
}

}  // namespace asperity::vtk_io
