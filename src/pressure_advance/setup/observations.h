// Pictures taken at known places of the head: the machine's own motion is the ruler.
#pragma once

namespace trammel::pressure_advance {

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

/// What the machine's motion is trusted with.
struct SetupLimits {
  /// Standard uncertainty of an axis' own scale: steps per mm and belts, unless calibrated.
  double axis_scale_uncertainty = 0.001;
  /// Rms by which a place may fail to come back; above it the mount or a belt is loose. mm.
  double repeat_mm = 0.05;
  /// Difference between the two directions of approach; above it nothing can be placed to 0.05 mm.
  double play_mm = 0.15;
};

}  // namespace trammel::pressure_advance
