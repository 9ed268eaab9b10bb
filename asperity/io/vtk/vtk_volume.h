#pragma once

#include "asperity/io/volume_io.h"

namespace asperity {

/// Reads volumes with VTK, each file checked before VTK sees it:
///   legacy .vtk         STRUCTURED_POINTS, RECTILINEAR_GRID; STRUCTURED_GRID whose points are the product of three
///   axes
///                       to a thousandth of a cell, others only where `resample` says so
///   .vti .vtr .vts      the same in XML; .pvti .pvtr: a piece at a time, every piece has to be there
///   .vtu                resampled onto a rectilinear grid, with the error stated
///   .foam, a folder     an OpenFOAM case: the internal mesh at `time`, resampled likewise
///   .nrrd .nhdr         three dimensions, or four with the components first; an image is refused
/// Values that are neither float32, int16 nor uint8 become float32, with a note where digits are lost. Errors as
/// read_volume. Calls from several threads take turns: VTK's messages are global. [build]
Result<VolumeSource> read_vtk_volume(const std::filesystem::path& path, const VolumeRequest& request = {},
                                     const Progress& progress = {});

/// Makes read_volume use it. [main]
void register_vtk_volumes();

}  // namespace asperity
