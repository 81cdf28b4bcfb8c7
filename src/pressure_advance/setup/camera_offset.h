// From the nozzle to a place in the picture, by a mark that the nozzle itself printed.
#pragma once

#include "base/measured.h"
#include "pressure_advance/setup/camera_scale.h"

namespace trammel::pressure_advance {

/// The mark's place on the bed, as commanded when it was printed, and the pixel that is asked for.
struct OffsetQuestion {
  double mark_x_mm = 0;
  double mark_y_mm = 0;
  double mark_uncertainty_mm = 0.01;  ///< of its middle, by its own shape; standard
  double column_px = 0;               ///< where the laser meets the plate
  double row_px = 0;
  double pixel_uncertainty_px = 0.5;  ///< standard, in either direction
};

struct CameraOffset {
  Measured x_mm;
  Measured y_mm;
};

/// Solves for the head's place that brings the mark to the pixel; the mark's place less that is the
/// offset. An error of the axes' scales cancels: marks are printed and sought with the same axes.
/// Of the play half may be in either: it is taken as evenly spread over its width. Where the scale
/// is not good, its reason is given.
[[nodiscard]] CameraOffset FindCameraOffset(const CameraScale& scale,
                                            const OffsetQuestion& question);

}  // namespace trammel::pressure_advance
