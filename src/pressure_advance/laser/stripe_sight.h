// How the camera sees a laser line: how sharp, how bright; and what a user can mend of it.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/frame.h"

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

}  // namespace trammel::pressure_advance
