// The paper's method: how much a printed line's surface deviates along its length.
//
// Abbott, Automatic Pressure Advance Calibration Using Laser Triangulation: mask by red, grey,
// Gaussian blur, weighted mean of powers per row, standard deviation along the scan summed over the
// rows; the lowest score wins.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/frame.h"
#include "pressure_advance/laser/plate.h"
#include "pressure_advance/profile/analysis.h"
#include "pressure_advance/recording/scan.h"

namespace trammel::pressure_advance {

// The constants are those of the paper's released code.

/// Scratch and results of one frame, reused from frame to frame.
struct DeviationFrame {
  Frame masked;                       ///< BGR, pixels below the threshold blacked out
  std::vector<std::uint8_t> grey;     ///< masked and grey, shape (height, width)
  std::vector<std::uint8_t> blurred;  ///< shape (height, width)
  std::vector<double> centre_px;      ///< per row; NaN never: kNoCentre where no pixel is lit
};

/// In DeviationFrame::centre_px: this row has no lit pixel.
inline constexpr double kNoCentre = -1;

/// One frame through mask, grey, blur and weighted mean. The stripe runs down the crop.
void FilterFrame(const BgrView& crop, DeviationFrame& result);

/// The paper's heights of a whole sweep: crop width - centre for lines that move towards smaller x
/// or y where the surface rises, else centre; not relative to anything.
/// @param frames  upright and cropped, all of one size.
/// @param order   which of them, in the order of the map's columns.
/// sigma_px is 1 where the row has a height (the method knows no uncertainty), 0 where not.
[[nodiscard]] HeightMap DeviationHeights(std::span<const Frame> frames,
                                         std::span<const std::size_t> order,
                                         AxisDirection height_direction);

/// The paper's score: for each row the standard deviation of its heights along the scan, summed
/// over the rows. Unlike the original, rows of a frame without laser are left out of the deviation
/// (there they became a constant outside the crop), and rows seen in fewer than half of the frames
/// are left out of the sum, which is then scaled to all rows of the crop.
/// @param heights  sigma_px > 0 marks the rows with a height.
/// @returns absent with fewer than two frames, or where more than half of the rows are left out.
[[nodiscard]] std::optional<double> DeviationScore(const HeightMap& heights);

/// Lowest score, and a cubic through all scores with its minimum inside the tested range.
/// @param pressure_advance_s  per line, finite.
/// @param score_px            per line; absent where a line has none.
/// Without five scored lines at four different values there is no cubic.
[[nodiscard]] DeviationResult ScoreByDeviation(std::span<const double> pressure_advance_s,
                                               std::span<const std::optional<double>> score_px);

}  // namespace trammel::pressure_advance
