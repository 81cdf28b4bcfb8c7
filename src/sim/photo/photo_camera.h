// The geometry of a photo: a pinhole with slight distortion, held at an angle over the plate.
#pragma once

#include <array>

#include "sim/photo/photo_traits.h"
#include "sim/print/surface.h"

namespace trammel::sim {

struct Vector3 {
  double x = 0;
  double y = 0;
  double z = 0;
};

struct ImagePoint {
  double x_px = 0;
  double y_px = 0;
};

/// Places and directions in bed coordinates, mm.
class PhotoCamera {
 public:
  /// Looks at the middle of `subject`, from the distance at which it fills the picture as wanted.
  PhotoCamera(const PhotoTraits& traits, const BedRegion& subject);

  [[nodiscard]] const Vector3& position() const { return position_; }
  /// The direction in which a pixel looks, with z = -1. Never level: the field of view is narrow.
  [[nodiscard]] Vector3 Ray(double x_px, double y_px) const;
  /// Where a point is seen; inverts the distortion to 1e-6 px.
  [[nodiscard]] ImagePoint Project(const Vector3& point) const;

 private:
  [[nodiscard]] ImagePoint ProjectStraight(const Vector3& point) const;

  double focal_px_ = 0;
  double distortion_ = 0;
  double centre_x_px_ = 0;  // where the subject's middle is seen
  double centre_y_px_ = 0;
  double axis_x_px_ = 0;  // centre of the distortion
  double axis_y_px_ = 0;
  Vector3 position_;
  Vector3 right_;
  Vector3 down_;
  Vector3 forward_;
};

}  // namespace trammel::sim
