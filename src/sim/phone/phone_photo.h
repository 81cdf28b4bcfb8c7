// Phone photo of a printed sheet: lens, tilt, bent paper, lines with their own height.
#pragma once

#include <array>
#include <string>
#include <string_view>

#include "base/frame.h"
#include "base/random.h"
#include "base/result.h"
#include "sim/scanner/scanner_page.h"
#include "sim/scanner/scanner_traits.h"
#include "sim/sheet/sheet_print.h"

namespace trammel::sim {

/// The defaults are an ideal camera of 12 MP straight above flat paper. Angles and shifts are as
/// seen in the picture: x right, y down.
struct PhoneTraits {
  int width_px = 4032;       ///< 64 … 9000
  int height_px = 3024;      ///< 64 … 9000
  double focal_px = 5600;    ///< 500 … 20000
  double distance_mm = 310;  ///< lens to the print's middle, 50 … 5000
  double turn_rad = 0;       ///< sheet rotation, counter-clockwise in the picture
  double tilt_rad = 0;       ///< between the optical axis and the paper's normal, 0 … 0.8
  double tilt_to_rad = 0;    ///< towards where the paper falls away, counter-clockwise from right
  double shift_x_px = 0;     ///< shift of the whole picture; part of the sheet may be cut off
  double shift_y_px = 0;
  std::array<double, 3> radial = {0, 0, 0};   ///< k1, k2, k3 of the usual polynomial, +-0.5
  std::array<double, 2> tangential = {0, 0};  ///< p1, p2, +-0.01
  double centre_x_px = 0;                     ///< lens axis from the picture's middle, +-200
  double centre_y_px = 0;

  double bow_mm = 0;          ///< height of the paper's bend from its middle to the print's corners
  double bow_rad = 0;         ///< direction in which it bends
  double wave_mm = 0;         ///< amplitude of a wave of 70 mm on top, across the bend
  double line_height_mm = 0;  ///< ink height above the paper, all tools, 0 … 1
  std::array<double, kInkCount> extra_height_mm{};  ///< and of each tool's, on top
  double colour_px = 0;  ///< red lies so much further out in the corner than green, blue less far
  std::array<double, kInkCount> tool_colour_px{};  ///< each tool's lines lie further out by this

  double blur_px = 0.6;   ///< 1 sigma of lens, focus and sensor, 0.29 … 20
  double sharpen = 0;     ///< phone's own sharpening, 0 … 3
  double noise = 0;       ///< 1 sigma of reflectance, 0 … 0.2
  double vignetting = 0;  ///< loss of light in the corners, 0 … 0.9
  double gradient = 0;    ///< brightness over the picture's width, relative, +-1
  double gradient_rad = 0;
  double glare = 0;    ///< reflectance that a lamp's image adds in its middle, 0 … 3
  double glare_x = 0;  ///< position from the picture's middle, in its widths
  double glare_y = 0;
  double glare_size = 0.06;  ///< 1 sigma of it, in widths, 0.005 … 1
  double gamma = 2.2;
  int jpeg_quality = 92;  ///< 1 … 100
};

/// Draws a photo taken according to the instructions: the sheet fills four fifths of the frame at
/// "2x", tilt up to 15 degrees, |k1| up to 0.03, bow up to 1 mm, lines that differ by 30 um in
/// height (1 sigma) and 0.2 px in colour.
[[nodiscard]] PhoneTraits DrawPhone(const PrintedSheet& sheet, Random random);

/// Map from the bed to the picture; places in px from the outer corner of the first pixel.
class PhoneMap {
 public:
  /// REQUIRES valid traits and a sheet with strokes.
  PhoneMap(const PrintedSheet& sheet, const PhoneTraits& traits);

  /// @param height_mm  above the paper.
  /// @param outwards   factor of the distance from the lens's centre.
  [[nodiscard]] PixelPlace PixelOf(const PlaneMm& bed, double height_mm = 0,
                                   double outwards = 1) const;
  /// Returns the scale that moves the corner outwards by this distance.
  [[nodiscard]] double OutwardsBy(double corner_px) const;
  /// Returns the corners of the paper on the bed: 20 mm around the print.
  [[nodiscard]] std::array<PlaneMm, 4> Paper() const;
  [[nodiscard]] double PaperHeightAt(double right_mm, double up_mm) const;

 private:
  PhoneTraits traits_;
  TurnedPrint print_;  // as placed on the bed
  double reach_mm_ = 1;
  std::array<std::array<double, 3>, 3> camera_from_sheet_{};
};

/// REQUIRES traits within their bounds. Error (kInput): a sheet without strokes.
[[nodiscard]] Result<Frame> PhotographSheet(const PrintedSheet& sheet, const PhoneTraits& traits,
                                            Random random);

/// Returns the names of the traits that can be set, separated by commas; angles end in -deg,
/// heights in -um.
[[nodiscard]] std::string PhoneTraitNames();
/// Error (kInput): a name that is not there; a value outside its bounds.
[[nodiscard]] Result<void> SetPhoneTrait(std::string_view name, double value, PhoneTraits& traits);

/// Returns the truth of a photo as JSON (docs/reference/formats.md).
[[nodiscard]] std::string PhoneTruthJson(const SheetName& name, const PrintedSheet& sheet,
                                         int reference, const PhoneTraits& traits);

/// Returns a JPEG with the focal length in its EXIF data, as phones write it (35 mm equivalent,
/// whole mm).
[[nodiscard]] std::string PhoneJpeg(const Frame& frame, const PhoneTraits& traits);

}  // namespace trammel::sim
