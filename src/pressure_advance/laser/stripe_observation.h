// Checks the visibility of the laser line, and finds the rows of a frame that show it.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/frame.h"
#include "pressure_advance/recording/scan.h"
#include "vision/laser_line.h"

namespace trammel::pressure_advance {

/// Laser line on the plate.
struct StripeObservation {
  double width_px = 0;  ///< full width at half maximum, from its narrower side; 0: no line
  double peak = 0;      ///< grey levels of red over what is beside it
  double burnt_px = 0;  ///< width in which red is at the sensor's full scale, in the mean row
};

/// Examines the mean of some frames of a sweep near their upper and lower ends, where the plate is
/// and the line does not move. Uses no line finder, which might follow another feature.
/// @param frames  upright and cropped, at least one, all of one size
[[nodiscard]] StripeObservation SeeStripe(std::span<const BgrView> frames);

/// Returns why no line could be followed, if one is there but too wide for the picture; else empty.
[[nodiscard]] std::string FaultOfWidth(const StripeObservation& observation, int picture_width_px);

/// Returns warnings about faults of a scan's laser line, in the median of its sweeps, each with its
/// figure and the remedy; empty for a good line.
/// @param px_per_mm  absent: the width is not checked
[[nodiscard]] std::vector<std::string> ObservationNotices(std::span<const StripeObservation> sweeps,
                                                          std::optional<double> px_per_mm);

struct FoundCrop {
  std::optional<PixelRect> crop;  ///< in coordinates of the recorded frame
  std::string fault;              ///< why there is no crop
};

/// Finds the laser line, and along it the bead nearest to the picture's centre. The scanned line is
/// at the same position in every frame, while its neighbours (and the pattern's border) appear and
/// disappear at the picture's ends.
/// @param frames  upright (TurnUpright), some ten of one sweep, whole, all of one size.
[[nodiscard]] FoundCrop FindCrop(std::span<const Frame> frames, AxisDirection height_direction,
                                 vision::LaserLineWorkspace& workspace);

}  // namespace trammel::pressure_advance
