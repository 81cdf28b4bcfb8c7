// Scale, focus and offset of the camera, from sightings of the printed mark.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "base/measured.h"

namespace trammel::pressure_advance {

// Pictures taken at known places of the head: the machine's own motion is the ruler.

/// Commanded place of the nozzle, and the sign of the last motion of each axis before it: -1, +1,
/// or 0 where that is not known. Places approached from both sides show the play of an axis or a
/// mount.
struct HeadPlace {
  double x_mm = 0;
  double y_mm = 0;
  double z_mm = 0;
  int from_x = 0;
  int from_y = 0;
  int from_z = 0;
};

/// A mark that is fixed on the plate, as one picture shows it; pixel-centre origin, row down.
struct SeenMark {
  HeadPlace head;
  double column_px = 0;
  double row_px = 0;
};

/// The laser's stripe on the bare plate, as one picture shows it.
struct SeenStripe {
  HeadPlace head;
  double across_px = 0;  ///< along the stripe's normal in the picture, from the picture's middle
  double width_px = 0;   ///< 1 sigma of the stripe's profile
};

/// How the picture's scale changes with the head's height: z mm above `height_mm` it is that of
/// `height_mm` over 1 + z · inverse_mm. 0: not at all.
struct Perspective {
  double height_mm = 0;
  double inverse_mm = 0;  ///< 1 / distance from lens to plate, 1/mm
  double inverse_uncertainty = 0;

  [[nodiscard]] double Shrinks(double z_mm) const { return 1 + (z_mm - height_mm) * inverse_mm; }
};

// What the machine's motion is trusted with.

/// Standard uncertainty of an axis' own scale: steps per mm and belts.
inline constexpr double kAxisScaleUncertainty = 0.001;
/// Rms by which a place may fail to come back; above it the mount or a belt is loose. mm.
inline constexpr double kMostRepeat_mm = 0.05;
/// Difference between the two directions of approach; above it nothing can be placed to 0.05 mm.
inline constexpr double kMostPlay_mm = 0.15;

// Linear least squares with a covariance from the fit's own residuals.

struct LinearFit {
  Eigen::VectorXd value;
  Eigen::MatrixXd covariance;  ///< scaled by the residuals' variance
  double residual = 0;         ///< their standard deviation, in the observations' unit
  double degrees_of_freedom = 0;
};

/// Fits design · value = observed with equal weights.
/// @returns nothing where fewer than three observations are left over, or where the columns, each
/// brought to length 1, do not determine every value (condition above 1e5: the observations do not
/// vary in what that column stands for).
[[nodiscard]] std::optional<LinearFit> FitLinear(const Eigen::MatrixXd& design,
                                                 const Eigen::VectorXd& observed);

/// A function's variance by its gradient over the fit's values.
[[nodiscard]] double Variance(const LinearFit& fit, const Eigen::VectorXd& gradient);

/// A value whose uncertainty is of the fit (variance `statistical`, Student's t) and of what no
/// residual shows (variance `systematic`, taken as known: normal).
[[nodiscard]] Measured MeasuredFrom(double value, double statistical, double systematic,
                                    double degrees_of_freedom);

/// Model: picture = origin + picture_from_bed · (mark - head), the columns of picture_from_bed
/// being px per mm of x and of y. A camera above the plate that is turned counter-clockwise by r
/// has scale · [cos r, sin r; sin r, -cos r]: the picture's rows count downwards.
struct CameraScale {
  Measured px_per_mm;
  Measured rotation_rad;  ///< counter-clockwise from above; 0: columns run along +x
  Measured play_x_mm;     ///< between the two directions of approach
  Measured play_y_mm;
  double repeat_mm = 0;  ///< rms of what places and pictures leave unexplained
  /// Values: column and row of the mark with the head at `middle`; d column, d row per mm of head
  /// motion in x, then y; play in x as pixels of column and row, then y.
  std::optional<LinearFit> fit;
  double middle_x_mm = 0;
  double middle_y_mm = 0;
};

/// Fits all values at once. Every Measured carries the same reason where there is none: too few
/// places, an axis that was not moved, a mount or belt that does not repeat, more play than can be
/// borne, a mirrored picture or an axis of the wrong sign, scales of the axes that differ.
/// @param marks  of one mark, all at one height; places some mm apart in both axes, each approached
///               from both sides.
/// @param height_uncertainty  relative standard uncertainty of the scale, of the height between the
///               plate and the bead's top at which the mark's edges are seen.
[[nodiscard]] CameraScale FitCameraScale(std::span<const SeenMark> marks,
                                         double height_uncertainty = 0);

// From the nozzle to a place in the picture, by a mark that the nozzle itself printed.

/// The mark's place on the bed, as commanded when it was printed, and the pixel that is asked for.
struct OffsetQuestion {
  double mark_x_mm = 0;
  double mark_y_mm = 0;
  double mark_uncertainty_mm = 0.01;  ///< of its middle, by its own shape; standard
  double column_px = 0;               ///< where the laser meets the plate
  double row_px = 0;
  double pixel_uncertainty_px = 0.5;  ///< standard, in either direction
};

struct CameraOffset {
  Measured x_mm;
  Measured y_mm;
};

/// Solves for the head's place that brings the mark to the pixel; the mark's place less that is the
/// offset. An error of the axes' scales cancels: marks are printed and sought with the same axes.
/// Of the play half may be in either: it is taken as evenly spread over its width. Where the scale
/// is not good, its reason is given.
[[nodiscard]] CameraOffset FindCameraOffset(const CameraScale& scale,
                                            const OffsetQuestion& question);

// The height of the sharpest picture, from the stripe's width while the head rises.

/// Fits width² = sharpest² + (spread · (z - focus))², a parabola in z, to widths as the plate has
/// them (width_px times what the picture has shrunk): blur adds in squares, and on the plate it
/// grows in proportion to the distance from the focus. In pixels it does not: at 34 mm from the
/// lens the parabola's lowest point would stand 0.6 mm too high. Where a halo or a tilted sheet
/// bends the widths otherwise, a cubic and a parabola of the nearer heights stand elsewhere: that
/// is part of the uncertainty. Cannot tell where the width does not bend, where those readings
/// differ by more than half a millimetre, or where the sharpest height is not among those seen;
/// then the reason says on which side to look.
[[nodiscard]] Measured FitFocusHeight(std::span<const SeenStripe> stripes,
                                      const Perspective& perspective);

}  // namespace trammel::pressure_advance
