// Implements the paper's method: the deviation of a printed line's surface along its length.
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

/// Buffers and results of one frame, reused from frame to frame.
struct DeviationFrame {
  Frame masked;                       ///< BGR, pixels below the threshold blacked out
  std::vector<std::uint8_t> grey;     ///< masked and grey, shape (height, width)
  std::vector<std::uint8_t> blurred;  ///< shape (height, width)
  std::vector<double> centre_px;      ///< per row; NaN never: kNoCentre where no pixel is lit
};

/// Value of DeviationFrame::centre_px if this row has no lit pixel.
inline constexpr double kNoCentre = -1;

/// Applies mask, grey, blur and weighted mean to one frame. The stripe runs down the crop.
void FilterFrame(const BgrView& crop, DeviationFrame& result);

/// Returns the paper's heights of a whole sweep: crop width - centre for lines that move towards
/// smaller x or y where the surface rises, else centre; not relative to anything.
/// @param frames  upright and cropped, all of one size.
/// @param order   indices of frames, in the order of the map's columns.
/// sigma_px is 1 if the row has a height (the method has no uncertainty), else 0.
[[nodiscard]] HeightMap DeviationHeights(std::span<const Frame> frames,
                                         std::span<const std::size_t> order,
                                         AxisDirection height_direction);

/// Returns the paper's score: the standard deviation of each row's heights along the scan, summed
/// over the rows. Unlike the original, rows of a frame without laser are excluded from the
/// deviation (there they became a constant outside the crop). Rows seen in fewer than half of the
/// frames are excluded from the sum, which is then scaled to all rows of the crop.
/// @param heights  sigma_px > 0 marks the rows with a height.
/// @returns absent with fewer than two frames, or if more than half of the rows are excluded.
[[nodiscard]] std::optional<double> DeviationScore(const HeightMap& heights);

/// Finds the lowest score, and fits a cubic through all scores with its minimum inside the tested
/// range.
/// @param pressure_advance_s  per line, finite.
/// @param score_px            per line; absent if a line has none.
/// The cubic requires five scored lines at four different values.
[[nodiscard]] DeviationResult ScoreByDeviation(std::span<const double> pressure_advance_s,
                                               std::span<const std::optional<double>> score_px);

}  // namespace trammel::pressure_advance
