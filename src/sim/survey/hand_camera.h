// A camera in hand, carried around a part.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

namespace trammel::sim {

/// The defaults are a 24 mm lens on 36 mm of sensor. Its distortion takes where a pin-hole would
/// have a point to where the lens has it; r in units of the focal length.
struct HandLens {
  int width_px = 4000;
  int height_px = 3000;
  double focal_px = 2773;
  double column_off_px = 14.2;  ///< principal point from the picture's middle
  double row_off_px = -9.7;
  double k1 = -0.09;
  double k2 = 0.03;
  double p1 = 3e-4;
  double p2 = -2e-4;
};

/// Axes of length 1, right-handed.
struct HandShot {
  Eigen::Vector3d place_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::UnitX();
  Eigen::Vector3d down = Eigen::Vector3d::UnitY();
  Eigen::Vector3d ahead = Eigen::Vector3d::UnitZ();
};

struct HandWalk {
  int pictures = 100;
  double distance_mm = 2500;  ///< +-10 %
  double lowest_rad = 0.087;  ///< elevation: 5 degrees
  double highest_rad = 1.222;
  bool rolled = true;  ///< a quarter turn in every other picture
};

/// Around the origin, by the golden angle, each aimed at some place of the part.
[[nodiscard]] std::vector<HandShot> WalkAround(const HandWalk& walk, std::uint64_t seed);

/// Column and row, (0, 0) the centre of the first pixel. Absent behind the camera, more than 50
/// degrees off its axis, and within `margin_px` of the picture's edge or outside of it.
[[nodiscard]] std::optional<Eigen::Vector2d> SeenAt(const HandLens& lens, const HandShot& shot,
                                                    const Eigen::Vector3d& at_mm, double margin_px);

/// The image of a round disc: middle of its area, and the ellipse of its second moments.
struct DiscImage {
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  double major_px = 0;  ///< semi-axes
  double minor_px = 0;
  double angle_rad = 0;  ///< from the columns to the major axis, towards the rows
};
/// Its outline projected point by point. Absent where some of it is not seen.
[[nodiscard]] std::optional<DiscImage> DiscSeenAt(const HandLens& lens, const HandShot& shot,
                                                  const Eigen::Vector3d& at_mm,
                                                  const Eigen::Vector3d& normal, double radius_mm,
                                                  double margin_px);

}  // namespace trammel::sim
