// From pictures' readings at known places of the head to the constants of a scan.
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

/// A stripe's reading, and where the head stood.
struct PlacedStripe {
  HeadPlace head;
  StripeReading reading;
};

struct PictureSize {
  int width_px = 0;
  int height_px = 0;
};

/// What a sweep over heights says, before a mark is looked at.
struct StripeSweep {
  Measured focus_mm;
  /// The nozzle's height with the narrowest stripe on the plate: where to look anew if the focus is
  /// not among the heights. Absent without a stripe.
  std::optional<double> sharpest_mm;
};

/// Focus from readings without a fault. Where there are too few, the commonest fault is the reason.
[[nodiscard]] StripeSweep SolveSweep(std::span<const PlacedStripe> stripes);

struct SetupObservations {
  std::vector<PlacedStripe> stripes;
  std::vector<SeenMark> marks;  ///< all at `height_mm`
  std::string mark_fault;       ///< why there are no marks
  double height_mm = 0;         ///< of the nozzle, at which the marks were seen: the focus
  double mark_x_mm = 0;         ///< as commanded
  double mark_y_mm = 0;
  PictureSize picture;
  double line_width_mm = 0.495;  ///< of the beads to be scanned
  double layer_height_mm = 0.25;
};

/// How well the stripe is exposed at the focus.
struct Exposure {
  double peak = 0;          ///< grey levels over the background
  double background = 0;    ///< grey levels beside the stripe
  double saturated_px = 0;  ///< at full scale, in the typical row
  double width_px = 0;      ///< at half height
};

struct SetupResult {
  Measured focus_mm;
  CameraScale scale;
  CameraOffset offset;  ///< from the nozzle to the spot
  StripeHeight height;
  /// By which heights follow from shifts as a scan takes them: height = shift / (px_per_mm · tan).
  /// The laser's own angle and what the picture's change of scale adds.
  Measured scan_angle_rad;
  Measured laser_turn_rad;  ///< of the sheet about the vertical, counter-clockwise from above
  AxisDirection height_direction = AxisDirection::kMinusX;
  double spot_column_px = 0;  ///< where the laser meets the plate, in the picture's middle row
  double spot_row_px = 0;     ///< (column, where the stripe runs across)
  std::optional<PixelRect> crop;
  std::optional<Exposure> exposure;
  std::optional<double> check_mm;  ///< of the mark from the spot, once it was brought there

  /// Every value that a scan needs, in the order in which they are told.
  [[nodiscard]] std::vector<const Measured*> Needed() const;
  [[nodiscard]] Verdict verdict() const;
  [[nodiscard]] std::string reason() const;  ///< empty when good
};

/// Compares where the mark stands with where it should, once the head was moved by the offset.
/// Beyond the offset's own uncertainty and the axes' play, or where the mark is not there, the
/// offset is not good any more.
void CheckSpot(const MarkReading& mark, SetupResult& result);

[[nodiscard]] SetupResult SolveSetup(const SetupObservations& seen);

// Advice on crop, threshold and exposure, from how the stripe looks at the focus.

struct SetupAdvice {
  /// Level of red, 0 … 255, above which a pixel is the stripe's: half of its height over the plate,
  /// for programs that want one; the laser eye of trammel learns its own. Absent without a stripe.
  std::optional<int> threshold;
  std::vector<std::string> lines;  ///< what to do, or what is as it should be
};

/// Of a result whatever its verdict: what it lacks is not spoken of.
[[nodiscard]] SetupAdvice AdviseSetup(const SetupResult& result, const PictureSize& picture);

}  // namespace trammel::pressure_advance
