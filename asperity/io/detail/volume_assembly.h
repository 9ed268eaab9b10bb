#pragma once
// Private to asperity/io: what every volume reader ends with.

#include <array>
#include <string>
#include <vector>

#include "asperity/io/volume_io.h"

namespace asperity::volume_assembly {

/// Samples and axes as a file has them, not checked yet.
struct RawVolume {
  std::array<std::vector<double>, 3> nodes;  ///< of the grid, also where the samples belong to cells
  SampleArray samples;                       ///< x fastest; components of one sample after the other
  int components = 1;
  bool cell_data = false;
  std::string array;
  std::string unit;
};

/// Nodes evenly spaced. [build]
std::vector<double> even_nodes(double origin, double spacing, std::size_t count);
/// Samples of `size` nodes (or cells). Errors: too_large (overflow, or more than `most_bytes`). [build]
Result<std::size_t> sample_count(const std::array<std::uint64_t, 3>& size, std::size_t bytes_each,
                                 std::size_t most_bytes);
/// Checks the axes (turning those that descend, with a note), the samples (not infinite, not all unknown) and picks
/// the component that is asked for. Errors: bad_value (axis or sample as place), mismatch. [build]
Result<VolumeSource> assemble(RawVolume raw, const VolumeRequest& request);

/// Which of `arrays` a request means, with a note where it was chosen. Errors: bad_value listing what there is. [build]
Result<std::size_t> choose_array(const std::vector<VolumeArray>& arrays, const VolumeRequest& request,
                                 std::vector<std::string>& notes);
/// Range and count of unknown values of `samples`. [build]
void measure(const SampleArray& samples, VolumeArray& array);

}  // namespace asperity::volume_assembly
