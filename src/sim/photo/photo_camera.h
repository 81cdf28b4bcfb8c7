// Virtual phone or endoscope: position, light and image quality.
#pragma once

#include <array>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

#include "base/random.h"
#include "base/result.h"
#include "sim/print/named_number.h"
#include "sim/print/surface.h"

namespace trammel::sim {

inline constexpr double kRadiansPerDegree = std::numbers::pi / 180;

/// Natural: translucent, whitish.
enum class PhotoFilament { kNatural, kBlack, kWhite, kOrange, kBlue, kGrey };

/// Gold and dark: textured PEI, but for smooth gold. Magnetic: black, fine grain.
enum class PhotoPlate { kGold, kDark, kLight, kSmoothGold, kGlass, kMagnetic };

/// Filament and plate of the print.
struct PhotoScene {
  PhotoFilament filament = PhotoFilament::kNatural;
  PhotoPlate plate = PhotoPlate::kGold;
  bool matte = false;  ///< filament without gloss
};

/// Parses FILAMENT-on-PLATE or matte-FILAMENT-on-PLATE, for example "natural-on-gold" or
/// "matte-white-on-magnetic". Filaments: natural, black, white, orange, blue, grey; plates: gold,
/// dark, light, smooth-gold, glass, magnetic. Error (kInput): another name.
[[nodiscard]] Result<PhotoScene> ParsePhotoScene(std::string_view name);
[[nodiscard]] std::string ToString(const PhotoScene& scene);

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

/// Finger at the picture's edge: a capsule. Positions and sizes are shares of the picture's height,
/// from its centre.
struct PhotoFinger {
  double x = 0;  ///< tip
  double y = 0;
  double azimuth_rad = 0;  ///< from the tip to the hand, from +x towards +y (down)
  double length = 0.5;
  double radius = 0.05;
};

/// The defaults are an ideal camera straight above, in even light, without noise.
struct PhotoTraits {
  PhotoScene scene;
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
  Reflection glare;  ///< one more lamp, of which the filament shines as the plate does
  /// Shadow of the photographer: a soft edge, towards its azimuth all is darker by `shadow`.
  double shadow = 0;         ///< share of the light, 0 … 0.9
  double shadow_offset = 0;  ///< edge from the picture's centre, in picture heights
  double shadow_azimuth_rad = 0;
  double shadow_softness = 0.05;  ///< width of the edge, in picture heights, 0.001 … 1
  std::vector<PhotoFinger> fingers;

  double blur_sigma_px = 0.5;  ///< lens blur, 0 … 10
  double sharpening = 0;       ///< overshoot by the camera's own processing, 0 … 2
  double noise = 0;            ///< 1 sigma of 255 in middle grey, 0 … 30
  int jpeg_quality = 95;       ///< 1 … 100
  bool mirrored = false;       ///< left and right exchanged, as by a selfie camera
};

/// Lays three fingers over the picture from its left edge, side by side at its middle.
/// @param depth  how far they reach in, in picture heights; 0: none
void ReachIn(double depth, PhotoTraits& traits);

/// Photo traits that options set by name.
inline constexpr NamedNumber<PhotoTraits> kPhotoNumbers[] = {
    {"fill", [](double v, PhotoTraits& t) { t.fill = v; }, 0.1, 1.2},
    {"tilt-deg", [](double v, PhotoTraits& t) { t.tilt_rad = v * kRadiansPerDegree; }, 0, 45},
    {"tilt-towards-deg",
     [](double v, PhotoTraits& t) { t.tilt_towards_rad = v * kRadiansPerDegree; }, -360, 360},
    {"roll-deg", [](double v, PhotoTraits& t) { t.roll_rad = v * kRadiansPerDegree; }, -360, 360},
    {"offset-x", [](double v, PhotoTraits& t) { t.offset_x = v; }, -2, 2},
    {"offset-y", [](double v, PhotoTraits& t) { t.offset_y = v; }, -2, 2},
    {"focal-heights", [](double v, PhotoTraits& t) { t.focal_heights = v; }, 0.3, 5},
    {"distortion", [](double v, PhotoTraits& t) { t.distortion = v; }, -0.2, 0.2},
    {"light-azimuth-deg",
     [](double v, PhotoTraits& t) { t.light_azimuth_rad = v * kRadiansPerDegree; }, -360, 360},
    {"light-elevation-deg",
     [](double v, PhotoTraits& t) { t.light_elevation_rad = v * kRadiansPerDegree; }, 12, 85},
    {"unevenness", [](double v, PhotoTraits& t) { t.unevenness = v; }, 0, 0.9},
    {"vignetting", [](double v, PhotoTraits& t) { t.vignetting = v; }, 0, 0.9},
    {"exposure", [](double v, PhotoTraits& t) { t.exposure = v; }, 0.2, 3},
    {"reflections",
     [](double v, PhotoTraits& t) {
       if (v == 0) t.reflections.clear();
     },
     0, 0},
    {"shadow", [](double v, PhotoTraits& t) { t.shadow = v; }, 0, 0.9},
    {"shadow-offset", [](double v, PhotoTraits& t) { t.shadow_offset = v; }, -2, 2},
    {"shadow-azimuth-deg",
     [](double v, PhotoTraits& t) { t.shadow_azimuth_rad = v * kRadiansPerDegree; }, -360, 360},
    {"shadow-softness", [](double v, PhotoTraits& t) { t.shadow_softness = v; }, 0.001, 1},
    {"glare", [](double v, PhotoTraits& t) { t.glare.sheen = v; }, 0, 3},
    {"glare-x", [](double v, PhotoTraits& t) { t.glare.x = v; }, -2, 2},
    {"glare-y", [](double v, PhotoTraits& t) { t.glare.y = v; }, -2, 2},
    {"glare-radius", [](double v, PhotoTraits& t) { t.glare.radius = v; }, 0.01, 1},
    {"hand", [](double v, PhotoTraits& t) { ReachIn(v, t); }, 0, 1.5},
    {"blur-px", [](double v, PhotoTraits& t) { t.blur_sigma_px = v; }, 0, 10},
    {"sharpening", [](double v, PhotoTraits& t) { t.sharpening = v; }, 0, 2},
    {"noise", [](double v, PhotoTraits& t) { t.noise = v; }, 0, 30},
    {"jpeg-quality", [](double v, PhotoTraits& t) { t.jpeg_quality = static_cast<int>(v); }, 1,
     100},
    {"mirrored", [](double v, PhotoTraits& t) { t.mirrored = v != 0; }, 0, 1}};

/// Draws a realistic photo: handheld tilt and roll, uneven light, reflections.
[[nodiscard]] PhotoTraits DrawPhotoTraits(const PhotoScene& scene, Random& random);

/// Draws a filament on a plate that it can be seen on.
[[nodiscard]] PhotoScene DrawPhotoScene(Random& random);

/// Limits of a drawn photo's distance from the ideal one.
struct PhotoDistortion {
  double most_roll_rad = 0.15;  ///< 0 … pi
  double most_tilt_rad = 0.3;   ///< 0 … 0.6; 0.3 is about 20 % of perspective
  double crop_odds = 0;         ///< that part of the print is cut off, 0 … 1
  double mirror_odds = 0;       ///< 0 … 1
  double hand_odds = 0;         ///< 0 … 1
  double shadow_odds = 0.3;     ///< 0 … 1
  double sharpness = 1;  ///< factor of blur and noise: 0.3 a tripod in daylight, 3 a bad phone
};

/// Draws a photo by a phone: position, light and image quality within the distortion's limits.
/// REQUIRES all fields within their ranges.
[[nodiscard]] PhotoTraits DrawPhonePhoto(const PhotoScene& scene, int width_px, int height_px,
                                         const PhotoDistortion& distortion, Random& random);

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
