// Virtual phone or endoscope: position, light and image quality.
#pragma once

#include <array>
#include <string_view>
#include <vector>

#include "base/random.h"
#include "base/result.h"
#include "sim/print/surface.h"

namespace trammel::sim {

/// Filament and plate of the print. Natural: translucent, whitish.
enum class PhotoScene { kNaturalOnGold, kNaturalOnDark, kBlackOnLight };

/// "natural-on-gold", "natural-on-dark" or "black-on-light". Error (kInput): another name.
[[nodiscard]] Result<PhotoScene> ParsePhotoScene(std::string_view name);

/// Reflection of one lamp from the plate towards the camera, with a Gaussian falloff. Positions and
/// radii are shares of the picture's height, from its centre.
struct Reflection {
  double x = 0;
  double y = 0;
  double radius = 0.1;
  double sheen = 0;   ///< brightness of an even glow, of full scale
  double glints = 0;  ///< brightness of the texture's glints
  std::array<double, 3> bgr = {1, 1, 1};
};

/// The defaults are an ideal camera straight above, in even light, without noise.
struct PhotoTraits {
  PhotoScene scene = PhotoScene::kNaturalOnGold;
  int width_px = 1080;   ///< 64 … 20000
  int height_px = 1920;  ///< 64 … 20000, at most 100 million pixels in all

  double fill = 0.75;           ///< print size in the picture, larger direction, 0.1 … 1.2
  double tilt_rad = 0;          ///< optical axis from the plate's normal, 0 … 1
  double tilt_towards_rad = 0;  ///< the camera stands on this side of the print, from +x
  double roll_rad = 0;          ///< about the optical axis, counter-clockwise
  double offset_x = 0;          ///< print from the picture's centre, in picture heights
  double offset_y = 0;
  double focal_heights = 1;  ///< focal length in picture heights, 0.3 … 5
  double distortion = 0;     ///< r_straight = r (1 + distortion r^2), r in focal lengths; +-0.2

  double light_azimuth_rad = 1.5;     ///< lamp azimuth, from +x
  double light_elevation_rad = 0.8;   ///< 0.2 … 1.5
  double unevenness = 0;              ///< illumination over the picture, 0 … 0.9
  double unevenness_azimuth_rad = 0;  ///< towards the bright side of the picture
  double vignetting = 0;              ///< loss of light in the corners, 0 … 0.9
  double exposure = 1;                ///< 0.2 … 3
  std::vector<Reflection> reflections;

  double blur_sigma_px = 0.5;  ///< lens blur, 0 … 10
  double sharpening = 0;       ///< overshoot by the camera's own processing, 0 … 2
  double noise = 0;            ///< 1 sigma of 255 in middle grey, 0 … 30
  int jpeg_quality = 95;       ///< 1 … 100
};

/// Draws a realistic photo: handheld tilt and roll, uneven light, reflections.
[[nodiscard]] PhotoTraits DrawPhotoTraits(PhotoScene scene, Random& random);

struct Vector3 {
  double x = 0;
  double y = 0;
  double z = 0;
};

struct ImagePoint {
  double x_px = 0;
  double y_px = 0;
};

/// Positions and directions in bed coordinates, mm.
class PhotoCamera {
 public:
  /// Aims at the centre of `subject`, from the distance at which it fills the picture as wanted.
  PhotoCamera(const PhotoTraits& traits, const BedRegion& subject);

  [[nodiscard]] const Vector3& position() const { return position_; }
  /// Returns the viewing direction of a pixel, with z = -1. Never level: the field of view is
  /// narrow.
  [[nodiscard]] Vector3 Ray(double x_px, double y_px) const;
  /// Projects a point to the picture; inverts the distortion to 1e-6 px.
  [[nodiscard]] ImagePoint Project(const Vector3& point) const;

 private:
  [[nodiscard]] ImagePoint ProjectStraight(const Vector3& point) const;

  double focal_px_ = 0;
  double distortion_ = 0;
  double centre_x_px_ = 0;  // image of the subject's centre
  double centre_y_px_ = 0;
  double axis_x_px_ = 0;  // centre of the distortion
  double axis_y_px_ = 0;
  Vector3 position_;
  Vector3 right_;
  Vector3 down_;
  Vector3 forward_;
};

}  // namespace trammel::sim
