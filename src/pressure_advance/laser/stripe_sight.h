// Checks how well the laser line is seen, and which rows of a frame show it.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/frame.h"
#include "pressure_advance/recording/scan.h"
#include "vision/laser_line.h"

namespace trammel::pressure_advance {

/// The laser line on the plate.
struct StripeSight {
  double width_px = 0;  ///< at half of its height, as its narrower side says; 0: no line
  double peak = 0;      ///< grey levels of red over what is beside it
  double burnt_px = 0;  ///< width in which red is at the sensor's full scale, in the mean row
};

/// Looks at the mean of some frames of a sweep, near their upper and lower ends, where the plate
/// is: the line stands still there. It asks no finder, which may follow something else.
/// @param frames  upright and cropped, at least one, all of one size
[[nodiscard]] StripeSight SeeStripe(std::span<const BgrView> frames);

/// Why no line could be followed, where one is there but too wide for the picture; else empty.
[[nodiscard]] std::string FaultOfWidth(const StripeSight& sight, int picture_width_px);

/// Says of a scan's laser line, in the median of its sweeps, what spoils or may spoil its readings,
/// each with the figure behind it and the remedy; nothing of a good one.
/// @param px_per_mm  absent: no width is judged
[[nodiscard]] std::vector<std::string> NoticesOfSight(std::span<const StripeSight> sweeps,
                                                      std::optional<double> px_per_mm);

struct FoundCrop {
  std::optional<PixelRect> crop;  ///< in the recorded frame's coordinates
  std::string fault;              ///< why there is none
};

/// Finds the laser line, and along it the bead nearest to the picture's middle: the line that is
/// being scanned stands at the same place in every frame, its neighbours (and the pattern's border)
/// come and go at the picture's ends.
/// @param frames  upright (TurnUpright), some ten of one sweep, whole, all of one size.
[[nodiscard]] FoundCrop FindCrop(std::span<const Frame> frames, AxisDirection height_direction,
                                 vision::LaserLineWorkspace& workspace);

}  // namespace trammel::pressure_advance
