// Scale, focus and offset of the camera, from pictures of the printed mark.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "base/measured.h"

namespace trammel::pressure_advance {

// Pictures from known positions of the head: the machine's own motion is the scale.

/// Commanded position of the nozzle, and the sign of the last motion of each axis before it: -1,
/// +1, or 0 if unknown. Positions approached from both sides show the backlash of an axis or a
/// mount.
struct HeadPlace {
  double x_mm = 0;
  double y_mm = 0;
  double z_mm = 0;
  int from_x = 0;
  int from_y = 0;
  int from_z = 0;
};

/// Mark fixed on the plate, in one picture; pixel-centre origin, row down.
struct SeenMark {
  HeadPlace head;
  double column_px = 0;
  double row_px = 0;
};

/// Laser stripe on the bare plate, in one picture.
struct SeenStripe {
  HeadPlace head;
  double across_px = 0;  ///< along the stripe's normal in the picture, from the picture's middle
  double width_px = 0;   ///< 1 sigma of the stripe's profile
};

/// Change of the picture's scale with the head's height: z mm above `height_mm` it is that of
/// `height_mm` over 1 + z · inverse_mm. 0: none.
struct Perspective {
  double height_mm = 0;
  double inverse_mm = 0;  ///< 1 / distance from lens to plate, 1/mm
  double inverse_uncertainty = 0;

  [[nodiscard]] double Shrinks(double z_mm) const { return 1 + (z_mm - height_mm) * inverse_mm; }
};

// Uncertainties of the machine's motion.

/// Standard uncertainty of an axis' own scale: steps per mm and belts.
inline constexpr double kAxisScaleUncertainty = 0.001;
/// Maximum rms of the repeatability; above it the mount or a belt is loose. mm.
inline constexpr double kMaxRepeat_mm = 0.05;
/// Maximum difference between the two directions of approach; above it nothing can be positioned to
/// 0.05 mm.
inline constexpr double kMaxBacklash_mm = 0.15;

// Linear least squares with a covariance from the fit's own residuals.

struct LinearFit {
  Eigen::VectorXd value;
  Eigen::MatrixXd covariance;  ///< scaled by the residuals' variance
  double residual = 0;         ///< their standard deviation, in the observations' unit
  double degrees_of_freedom = 0;
};

/// Fits design · value = observed with equal weights.
/// @returns nothing if the redundancy is below three, or if the columns, each scaled to length 1,
/// do not determine every value (condition above 1e5: the observations do not vary in that column's
/// quantity).
[[nodiscard]] std::optional<LinearFit> FitLinear(const Eigen::MatrixXd& design,
                                                 const Eigen::VectorXd& observed);

/// Propagates the fit's covariance to a function with this gradient.
[[nodiscard]] double Variance(const LinearFit& fit, const Eigen::VectorXd& gradient);

/// Returns a value whose uncertainty combines the fit (variance `statistical`, Student's t) and
/// causes without residuals (variance `systematic`, taken as known: normal).
[[nodiscard]] Measured MeasuredFrom(double value, double statistical, double systematic,
                                    double degrees_of_freedom);

/// Model: picture = origin + picture_from_bed · (mark - head), the columns of picture_from_bed
/// being px per mm of x and of y. A camera above the plate that is rotated counter-clockwise by r
/// has scale · [cos r, sin r; sin r, -cos r]: the picture's rows count downwards.
struct CameraScale {
  Measured px_per_mm;
  Measured rotation_rad;   ///< counter-clockwise from above; 0: columns run along +x
  Measured backlash_x_mm;  ///< between the two directions of approach
  Measured backlash_y_mm;
  double repeat_mm = 0;  ///< rms of what places and pictures leave unexplained
  /// Values: column and row of the mark with the head at `middle`; d column, d row per mm of head
  /// motion in x, then y; backlash in x as pixels of column and row, then y.
  std::optional<LinearFit> fit;
  double middle_x_mm = 0;
  double middle_y_mm = 0;
};

/// Fits all values at once. If none is possible, every Measured has the same reason: too few
/// positions, an axis that was not moved, a mount or belt that does not repeat, too much backlash,
/// a mirrored picture or an axis of the wrong sign, scales of the axes that differ.
/// @param marks  of one mark, all at one height; positions some mm apart in both axes, each
///               approached from both sides.
/// @param height_uncertainty  relative standard uncertainty of the scale, due to the height
///               between the plate and the bead's top at which the mark's edges are seen.
[[nodiscard]] CameraScale FitCameraScale(std::span<const SeenMark> marks,
                                         double height_uncertainty = 0);

// Offset from the nozzle to a place in the picture, by a mark that the nozzle itself printed.

/// Mark's commanded position on the bed when it was printed, and the target pixel.
struct OffsetQuestion {
  double mark_x_mm = 0;
  double mark_y_mm = 0;
  double mark_uncertainty_mm = 0.01;  ///< mark centre, from its own shape; standard
  double column_px = 0;               ///< laser on the plate
  double row_px = 0;
  double pixel_uncertainty_px = 0.5;  ///< standard, in either direction
};

struct CameraOffset {
  Measured x_mm;
  Measured y_mm;
};

/// Solves for the head's position that moves the mark to the pixel; the mark's position minus that
/// is the offset. An error of the axes' scales cancels: marks are printed and located with the same
/// axes. Half of the backlash may be in either: modelled as uniform over its width. If the scale is
/// not good, its reason is returned.
[[nodiscard]] CameraOffset FindCameraOffset(const CameraScale& scale,
                                            const OffsetQuestion& question);

// Height of the sharpest picture, from the stripe's width while the head rises.

/// Fits width² = sharpest² + (spread · (z - focus))², a parabola in z, to widths on the plate's
/// scale (width_px times the picture's reduction): blur adds in squares, and on the plate it grows
/// in proportion to the distance from the focus. In pixels it does not: at 34 mm from the lens the
/// parabola's minimum would be 0.6 mm too high. A halo or a tilted sheet shifts the minima of a
/// cubic, and of a parabola of the nearer heights: the difference is part of the uncertainty.
/// Cannot tell if the width has no curvature, those readings differ by more than half a millimetre,
/// or the sharpest height is outside the heights seen; then the reason names the side to search.
[[nodiscard]] Measured FitFocusHeight(std::span<const SeenStripe> stripes,
                                      const Perspective& perspective);

}  // namespace trammel::pressure_advance
