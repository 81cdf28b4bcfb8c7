// Virtual laser and camera: mounting, optics and image quality.
#pragma once

#include <array>

#include "base/random.h"
#include "sim/print/conditions.h"

namespace trammel::sim {

/// Sensor size of the paper's camera. Smaller frames are windows of it around the paper's crop.
inline constexpr int kSensorWidthPx = 1280;
inline constexpr int kSensorHeightPx = 720;

/// Reflection of light by one material. Brightness is relative to the sensor's full scale in red.
struct Sheen {
  double peak = 1;           ///< laser line on a level surface, 0 … 3; above 1 it clips
  double speckle = 0;        ///< contrast of the speckle that the exposure leaves, 0 … 1
  double glow = 0;           ///< peak of the light that spreads below the surface, 0 … 2
  double glow_sigma_px = 8;  ///< width, 4 … 20
  double glow_shift_px = 0;  ///< it re-emerges this far on, in the light's direction (+x)
  std::array<double, 3> ambient_bgr = {0, 0, 0};  ///< look without laser, 0 … 255
};

/// Geometry: a pinhole camera looks straight down from distance_mm; the laser's sheet is
/// laser_angle_rad from the camera's axis and comes from -x, so that a rising surface moves the
/// line towards -x. The defaults are an ideal, noiseless setup in the paper's position.
struct LaserTraits {
  double px_per_mm = 44;      ///< on the plate
  double distance_mm = 34.5;  ///< optical distance from pinhole to plate
  double laser_angle_rad = 0.785398163397448;
  double stripe_column_px = 872;  ///< line on the plate, full sensor
  double line_row_px = 371;       ///< printed line's centre, full sensor
  double stripe_tilt_rad = 0;     ///< line in the image, +-0.05
  double plate_slope = 0;         ///< rise of the plate along the sweep, +-0.01
  double fan_distance_mm = 60;    ///< laser slit to plate
  double fan_offset_mm = 0;       ///< slit from the sheet's middle, +-20
  double position_error_mm = 0;   ///< laser ahead of where the recording says it is

  double stripe_sigma_px = 2.7;  ///< line on a level surface, 1.5 … 6
  Sheen plate;
  Sheen filament;
  bool textured = false;  ///< true if surfaces have the texture of sim/print/texture.h

  double exposure_s = 0;  ///< 0 … 0.033
  double gain_drift = 0;  ///< amplitude of a slow change of brightness, 0 … 0.3
  double gain_period_s = 5;
  double noise_floor = 0;     ///< 1 sigma in the dark, of 255
  double noise_shot = 0;      ///< variance per level, of 255
  double frame_jitter_s = 0;  ///< 1 sigma of capture times about the frame rate
  int jpeg_quality = 95;      ///< 1 … 100
};

/// Draws a setup consistent with the paper's condition: all traits that vary between worlds are
/// random.
[[nodiscard]] LaserTraits DrawLaserTraits(const Condition& condition, Random& random);

}  // namespace trammel::sim
