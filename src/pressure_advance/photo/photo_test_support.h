// Draws simple photos of a pattern, for the photo eye's tests: areas and edges, no printer behind.
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "base/frame.h"
#include "pressure_advance/photo/photo_reader.h"

namespace trammel::pressure_advance {

/// A drawn pattern and the camera that sees it. Lengths in mm on the plate, origin at the first
/// line's start, x in print direction, y towards the last line.
struct DrawnPhoto {
  std::vector<double> pressure_advance_s;  ///< one line each
  double right_value_s = 0.03;             ///< lines at this PA have one width all along
  double length_mm = 60;                   ///< per line, between the frame's inner edges
  double spacing_mm = 4;
  double bead_mm = 1.6;
  double bar_mm = 2;     ///< the frame's bars
  double margin_mm = 6;  ///< outer lines to the frame's inner edges
  double slow_before = 0.1, slow_after = 0.3;
  bool frame = true;
  bool corner_mark = false;  ///< fills 3 mm of the frame's margin along 9 mm of the first line
  std::vector<std::size_t> left_out;  ///< lines that were not printed

  int width_px = 520, height_px = 540;
  double px_per_mm = 6.5;
  double tilt = 0.12;  ///< perspective: loss of size per picture height
  double roll_rad = 0.03;
  double bow = 0.004;       ///< lens distortion at the picture's corner
  double shift_y_mm = 0;    ///< pattern offset from the picture's centre, towards the last line
  bool darker = false;      ///< filament darker than the plate
  double contrast = 70;     ///< levels
  double unevenness = 0.5;  ///< illumination gradient across the picture
  double grain = 12;        ///< levels: texture of the plate, alike over 3 px
  double noise = 3;         ///< levels
  double blur_px = 0.7;
  std::uint64_t seed = 1;
};

/// Width of a line at a position (line lengths), in mm: what the eye should find.
[[nodiscard]] double DrawnWidth_mm(const DrawnPhoto& photo, double pressure_advance_s,
                                   double position);

/// The first line lies at the bottom of the picture, printed from left to right.
[[nodiscard]] Frame Draw(const DrawnPhoto& photo);

/// 0, 0.005 … 0.06 s unless told otherwise.
[[nodiscard]] std::vector<double> Steps(std::size_t count = 13, double step_s = 0.005);

/// The usual pattern of Steps().
[[nodiscard]] DrawnPhoto Usual();
[[nodiscard]] PhotoOptions OptionsFor(const DrawnPhoto& photo);

/// Measures the lines of a photo, or refuses it.
[[nodiscard]] PhotoMeasurement MeasurePhoto(const BgrView& photo, const PhotoOptions& options);

[[nodiscard]] cv::Mat ToMat(const Frame& frame);
[[nodiscard]] BgrView View(const cv::Mat& image);

/// Median of the seen widths.
[[nodiscard]] double UsualWidth(const LineProfile& profile);
/// Mean width between two positions, over the usual one; -1 where none is seen.
[[nodiscard]] double Relative(const LineProfile& profile, double from, double to);
/// Largest difference of the lines' relative widths at the deceleration.
[[nodiscard]] double Difference(const PhotoMeasurement& a, const PhotoMeasurement& b);

}  // namespace trammel::pressure_advance
