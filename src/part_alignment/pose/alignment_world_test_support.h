// A camera in a spindle above a part with targets, by its own equations: what the pictures show.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

#include "base/random.h"
#include "geometry/euler.h"

namespace trammel::test_support {

/// Table 1 of Mendikute et al., or OpenCV's lens with the same numbers.
struct WorldCamera {
  bool opencv = false;
  bool looks_along_plus_z = false;
  double focal_length_mm = 6.189;
  Eigen::Vector2d principal_point_offset_px{-8.732, 27.52};
  double k1 = 2.997e-8;
  double k2 = -1.937e-15;
  double p1 = -6.188e-8;
  double p2 = 3.408e-7;
  geometry::Pose taper_from_camera{{-2.139, 0.301, -320.3}, {-0.003, -0.009, 0.03}};
};
constexpr int kWorldWidth_px = 2592;
constexpr int kWorldHeight_px = 1944;
constexpr double kWorldPitch_mm = 0.0022;

struct WorldClamping {
  double angle_rad = 0;
  Eigen::Vector2d eccentricity_mm = Eigen::Vector2d::Zero();
  Eigen::Vector2d tilt_rad = Eigen::Vector2d::Zero();
};

struct WorldObservation {
  int target = 0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
};

struct WorldView {
  Eigen::Vector3d spindle_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d spindle_rotation = Eigen::Matrix3d::Identity();
  std::vector<WorldObservation> observations;
};

struct AlignmentWorld {
  WorldCamera camera;
  WorldClamping clamping;
  geometry::Pose machine_from_part;
  std::vector<Eigen::Vector3d> targets_mm;
  std::vector<WorldView> views;
};

/// (column, row) of a point of the machine, absent outside the picture.
[[nodiscard]] std::optional<Eigen::Vector2d> WorldPixel(const AlignmentWorld& world,
                                                        const WorldView& view,
                                                        const Eigen::Vector3d& machine_mm);

/// A view in which the target lies at the camera's (u, v) mm at `distance_mm` before it.
[[nodiscard]] WorldView ViewOf(const AlignmentWorld& world, int target,
                               const Eigen::Matrix3d& spindle_rotation, double distance_mm,
                               const Eigen::Vector2d& across_mm);

/// Has each view's first target seen from elsewhere, the spindle not turned.
/// @param across_mm  of a view: where the target lies before the camera, as ViewOf has it
void LookFrom(AlignmentWorld& world,
              const std::function<Eigen::Vector2d(std::size_t view)>& across_mm,
              double distance_mm = 300);

/// Fills the observations of all views with the targets named; drops what lies outside the picture.
/// Normal noise of `sigma_px` per axis.
void TakePictures(AlignmentWorld& world, double sigma_px, Random& random);

/// The paper's bench: 4 targets on 1.5 x 1 m, two views each from places 76 mm apart, 300 mm before
/// the camera, measured along -Z.
[[nodiscard]] AlignmentWorld BenchWorld(double distance_mm = 300);

}  // namespace trammel::test_support
