// Constants of a scan, from pictures' readings at known places of the head.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/axis_direction.h"
#include "base/frame.h"
#include "base/measured.h"
#include "pressure_advance/setup/camera_scale.h"
#include "pressure_advance/setup/mark_reading.h"
#include "pressure_advance/setup/stripe_reading.h"

namespace trammel::pressure_advance {

/// Reading of a stripe, with the head's position.
struct PlacedStripe {
  HeadPlace head;
  StripeReading reading;
};

struct PictureSize {
  int width_px = 0;
  int height_px = 0;
};

/// Result of a sweep over heights, before a mark is observed.
struct StripeSweep {
  Measured focus_mm;
  /// Nozzle height with the narrowest stripe on the plate: where to search if the focus is not
  /// among the heights. Absent without a stripe.
  std::optional<double> sharpest_mm;
};

/// Computes the focus from readings without a fault. If there are too few, the reason is the
/// commonest fault.
[[nodiscard]] StripeSweep SolveSweep(std::span<const PlacedStripe> stripes);

struct SetupObservations {
  std::vector<PlacedStripe> stripes;
  std::vector<SeenMark> marks;  ///< all at `height_mm`
  std::string mark_fault;       ///< why there are no marks
  double height_mm = 0;         ///< nozzle height when the marks were seen: the focus
  double mark_x_mm = 0;         ///< commanded
  double mark_y_mm = 0;
  PictureSize picture;
  double line_width_mm = 0.495;  ///< width of the beads to be scanned
  double layer_height_mm = 0.25;
};

/// Exposure of the stripe at the focus.
struct Exposure {
  double peak = 0;          ///< grey levels over the background
  double background = 0;    ///< grey levels beside the stripe
  double saturated_px = 0;  ///< width at full scale, typical row
  double width_px = 0;      ///< width at half maximum
};

struct SetupResult {
  Measured focus_mm;
  CameraScale scale;
  CameraOffset offset;  ///< nozzle to spot
  StripeHeight height;
  /// Angle that converts shifts to heights in a scan: height = shift / (px_per_mm · tan). The
  /// laser's own angle plus the effect of the picture's change of scale.
  Measured scan_angle_rad;
  Measured laser_turn_rad;  ///< laser sheet about the vertical, counter-clockwise from above
  AxisDirection height_direction = AxisDirection::kMinusX;
  double spot_column_px = 0;  ///< laser on the plate, in the picture's middle row
  double spot_row_px = 0;     ///< (column, where the stripe runs across)
  std::optional<PixelRect> crop;
  std::optional<Exposure> exposure;
  std::optional<double> check_mm;  ///< distance of the mark from the spot after moving it there

  /// Returns every value that a scan needs, in display order.
  [[nodiscard]] std::vector<const Measured*> Needed() const;
  [[nodiscard]] Verdict verdict() const;
  [[nodiscard]] std::string reason() const;  ///< empty when good
};

/// Compares the mark's position with the expected one, after the head was moved by the offset. If
/// the difference exceeds the offset's own uncertainty and the axes' backlash, or the mark is
/// missing, the offset is no longer good.
void CheckSpot(const MarkReading& mark, SetupResult& result);

[[nodiscard]] SetupResult SolveSetup(const SetupObservations& seen);

// Advice on crop, threshold and exposure, from the stripe at the focus.

struct SetupAdvice {
  /// Threshold of red, 0 … 255, of the stripe's pixels: half of its height over the plate, for
  /// programs that need one; trammel's laser reader estimates its own. Absent without a stripe.
  std::optional<int> threshold;
  std::vector<std::string> lines;  ///< actions, or confirmations
};

/// Returns advice on a result of any verdict; missing values are skipped.
[[nodiscard]] SetupAdvice AdviseSetup(const SetupResult& result, const PictureSize& picture);

}  // namespace trammel::pressure_advance
