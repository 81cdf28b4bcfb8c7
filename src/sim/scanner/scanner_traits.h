// Virtual flatbed: the sheet's position on it, and its image quality.
#pragma once

#include <array>
#include <vector>

#include "base/random.h"
#include "base/result.h"
#include "sim/sheet/sheet_machine.h"
#include "sim/sheet/sheet_print.h"

namespace trammel::sim {

/// The defaults are an ideal scanner that sees the whole print upright. In the picture x is right
/// and y down; the scan bar moves along y.
struct ScannerTraits {
  double dpi = 600;          ///< 50 … 4800
  double rotation_rad = 0;   ///< sheet rotation, counter-clockwise as seen in the picture
  double shift_x_mm = 0;     ///< print's middle from the area's, right in the picture
  double shift_y_mm = 0;     ///< down in the picture
  double area_width_mm = 0;  ///< scanned, 0 … 1000; 0: the print and 10 mm around it
  double area_height_mm = 0;
  double crop_left_mm = 0;  ///< not scanned of the area, 0 … 500
  double crop_top_mm = 0;
  bool mirrored = false;  ///< left and right exchanged, as by a faulty driver

  double scale_x = 1;  ///< pixels per mm, over what dpi says; 0.9 … 1.1
  double scale_y = 1;  ///< the same along the bar's way
  double skew = 0;     ///< x gains skew * y; +-0.05
  /// Perspective of an oblique view of the page, like a camera's over a book: enlargement of the
  /// area's right end over its left, and of its lower end over its upper; +-0.5.
  double perspective_x = 0;
  double perspective_y = 0;
  std::vector<PeriodicError> bar;  ///< errors of the bar's place along its way

  double shadow_strength = 0;  ///< loss of light right beside a line, 0 … 1
  double shadow_mm = 0.1;      ///< distance over which it fades, 0 … 1
  bool shadow_below = true;    ///< true: far side of the line as the bar moves, else near side

  /// Blur of the optics, 1 sigma, 0 … 0.5, but never below 0.29 px; a pixel's own area is added.
  double blur_mm = 0;
  double lamp_falloff = 0;     ///< loss of light at the area's left and right ends, 0 … 0.5
  double texture = 0;          ///< 1 sigma of the paper's grain, relative, 0 … 0.2
  double texture_mm = 0.08;    ///< smoothing length, 0 … 0.5
  double noise = 0;            ///< 1 sigma of reflectance, 0 … 0.2
  double gamma = 2.2;          ///< value = reflectance ^ (1 / gamma), 0.5 … 3
  LinearRgb cast = {1, 1, 1};  ///< gain per channel, 0.2 … 1.2
  bool colour = false;
  int bits = 8;  ///< 8 or 16
};

/// Draws a realistic scanner with a sheet on it: any quarter turn and up to 8 degrees more (A4 if
/// the print fits, else as large as it needs), scale errors up to 0.5 % per axis, skew up to 1.5
/// mrad, bar errors of 30 um over the page and 5 um over 5 … 20 mm, shadows of 10 … 50 % over 0.05
/// … 0.2 mm.
[[nodiscard]] ScannerTraits DrawScannerTraits(const PrintedSheet& sheet, Random& random);

/// Sets A4 if the rotated print fits with 5 mm around it (portrait, else landscape), with the print
/// anywhere on it; else the area follows the print.
void PlaceOnA4(const PrintedSheet& sheet, ScannerTraits& traits, Random& random);

/// Position in the picture in px, measured from the outer corner of the first pixel: pixel i covers
/// i … i + 1.
struct PixelPlace {
  double x_px = 0;
  double y_px = 0;
};

/// Half extents of the print, turned on the glass, without dirt.
struct TurnedPrint {
  PlaneMm middle;  ///< centre of the print's bounding box, bed
  double half_width_mm = 0;
  double half_height_mm = 0;
};

/// REQUIRES a sheet with strokes.
[[nodiscard]] TurnedPrint Turned(const PrintedSheet& sheet, double rotation_rad);

class ScannerMap {
 public:
  /// REQUIRES valid traits and a sheet with strokes. Error (kInput): cropped to nothing.
  [[nodiscard]] static Result<ScannerMap> Make(const PrintedSheet& sheet,
                                               const ScannerTraits& traits);

  [[nodiscard]] PixelPlace PixelOf(const PlaneMm& bed) const;
  [[nodiscard]] int width_px() const { return width_px_; }
  [[nodiscard]] int height_px() const { return height_px_; }

 private:
  ScannerMap() = default;

  ScannerTraits traits_;
  PlaneMm middle_;
  double area_width_mm_ = 0;
  double area_height_mm_ = 0;
  double cosine_ = 1;
  double sine_ = 0;
  int width_px_ = 0;
  int height_px_ = 0;
};

}  // namespace trammel::sim
