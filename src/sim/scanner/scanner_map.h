// From the bed to the pixels of a scan.
#pragma once

#include "base/result.h"
#include "sim/scanner/scanner_traits.h"
#include "sim/sheet/sheet_print.h"

namespace trammel::sim {

/// A place in the picture in px, measured from the outer corner of the first pixel: pixel i covers
/// i … i + 1.
struct PixelPlace {
  double x_px = 0;
  double y_px = 0;
};

/// How far the print reaches from its middle once it is turned on the glass, without dirt.
struct TurnedPrint {
  PlaneMm middle;  ///< of the box around the print, bed
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
  /// Whether what runs counter-clockwise on the bed runs clockwise in x right, y down.
  [[nodiscard]] bool keeps_handedness() const { return !traits_.mirrored; }

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
