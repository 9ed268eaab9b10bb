#pragma once
// Private to asperity/io/vtk: from VTK's data to ours, and VTK's voice kept off the terminal.

#include <vtkDataArray.h>
#include <vtkDataSet.h>
#include <vtkSmartPointer.h>

#include <memory>
#include <string>
#include <vector>

#include "asperity/io/detail/volume_assembly.h"

namespace asperity::vtk_io {

/// While it lives VTK is used by this thread alone, and what it would print is kept here.
class VtkSession {
 public:
  VtkSession();
  ~VtkSession();
  VtkSession(const VtkSession&) = delete;
  VtkSession& operator=(const VtkSession&) = delete;
  /// The first error said so far, as file_malformed; success when there was none.
  [[nodiscard]] Status status(const std::string& file) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// The arrays of numbers of a dataset.
struct DataArrays {
  std::vector<VolumeArray> described;
  std::vector<vtkDataArray*> arrays;  ///< owned by the dataset
};
/// Arrays that do not hold a tuple for each point or cell are left out. [build]
DataArrays arrays_of(vtkDataSet& data);

/// Values in one of our types: float32, int16 and uint8 as they are, bits and small integers exactly, others as float32
/// with a note where that loses digits. [build]
SampleArray samples_of(vtkDataArray& array, std::vector<std::string>& notes);

/// A dataset that is a rectilinear grid, with its nodes.
struct GridData {
  vtkSmartPointer<vtkDataSet> data;
  std::array<std::vector<double>, 3> nodes;
};

/// The volume that `request` means. [build]
Result<VolumeSource> volume_of(const GridData& grid, const VolumeRequest& request);

/// The nodes of a structured grid whose points are the product of three axes to a thousandth of a cell; empty nodes
/// where they are not. [build]
std::array<std::vector<double>, 3> tensor_product_nodes(vtkDataSet& data, const int size[3]);

/// Any grid of three-dimensional cells resampled onto a rectilinear one, with the error of doing so. Errors: bad_value,
/// file_unsupported (kinds of cells), too_large. [build]
Result<VolumeSource> resampled(vtkDataSet& data, const VolumeRequest& request, const Progress& progress);
/// Whether every cell of an unstructured grid is of a known kind and names points that exist. [build]
Status check_cells(vtkDataSet& data);

/// One serial file (.vtk, .vti, .vtr, .vts, .vtu), checked, then read; as VTK has it. [build]
Result<vtkSmartPointer<vtkDataSet>> load_dataset(const std::filesystem::path& path, std::size_t most_bytes,
                                                 const VtkSession& session);
/// The nodes of a dataset that is rectilinear; nodes stay empty where it is not. [build]
GridData grid_of(vtkSmartPointer<vtkDataSet> data);

/// .nrrd and .nhdr. [build]
Result<VolumeSource> read_nrrd(const std::filesystem::path& path, const VolumeRequest& request,
                               const VtkSession& session);
/// .pvti and .pvtr: a piece at a time. [build]
Result<VolumeSource> read_pieces(const std::filesystem::path& path, const VolumeRequest& request,
                                 const Progress& progress, const VtkSession& session);
/// A case folder or its .foam file. [build]
Result<VolumeSource> read_foam(const std::filesystem::path& path, const VolumeRequest& request,
                               const Progress& progress, const VtkSession& session);
/// The bytes of a file of at most `most_bytes`. Errors: file_missing, too_large. [build]
Result<std::string> file_bytes(const std::filesystem::path& path, std::size_t most_bytes);

}  // namespace asperity::vtk_io
