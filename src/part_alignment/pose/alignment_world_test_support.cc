#include "part_alignment/pose/alignment_world_test_support.h"

#include <cmath>

namespace trammel::test_support {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

Matrix3d About(int axis, double angle_rad) {
  const double c = std::cos(angle_rad);
  const double s = std::sin(angle_rad);
  const int i = (axis + 1) % 3;
  const int j = (axis + 2) % 3;
  Matrix3d rotation = Matrix3d::Identity();
  rotation(i, i) = rotation(j, j) = c;
  rotation(i, j) = -s;
  rotation(j, i) = s;
  return rotation;
}

Matrix3d Turned(const Vector3d& angles_rad) {
  return About(2, angles_rad.z()) * About(1, angles_rad.y()) * About(0, angles_rad.x());
}

Vector2d Lens(const WorldCamera& camera, const Vector2d& p) {
  const double x = p.x();
  const double y = p.y();
  const double r2 = x * x + y * y;
  const double a = camera.opencv ? camera.p2 : camera.p1;
  const double b = camera.opencv ? camera.p1 : camera.p2;
  const double radial = camera.k1 * r2 + camera.k2 * r2 * r2;
  return {x + x * radial + a * (r2 + 2 * x * x) + 2 * b * x * y,
          y + y * radial + b * (r2 + 2 * y * y) + 2 * a * x * y};
}

/// Spindle from camera: a rotation and where the camera's origin is.
struct Mounting {
  Matrix3d rotation;
  Vector3d origin_mm;
};

Mounting MountingOf(const AlignmentWorld& world) {
  const Matrix3d clamped = About(2, -world.clamping.angle_rad) *
                           About(0, world.clamping.tilt_rad.x()) *
                           About(1, world.clamping.tilt_rad.y());
  const geometry::Pose& taper = world.camera.taper_from_camera;
  Vector3d origin_mm = clamped * taper.translation_mm;
  origin_mm.head<2>() += world.clamping.eccentricity_mm;
  return {clamped * Turned(taper.angles_rad), origin_mm};
}

Vector3d InMachine(const AlignmentWorld& world, int target) {
  return Turned(world.machine_from_part.angles_rad) * world.targets_mm[target] +
         world.machine_from_part.translation_mm;
}

}  // namespace

std::optional<Vector2d> WorldPixel(const AlignmentWorld& world, const WorldView& view,
                                   const Vector3d& machine_mm) {
  const WorldCamera& camera = world.camera;
  const Mounting mounting = MountingOf(world);
  const Vector3d spindle_mm = view.spindle_rotation.transpose() * (machine_mm - view.spindle_mm);
  const Vector3d seen_mm = mounting.rotation.transpose() * (spindle_mm - mounting.origin_mm);
  if ((seen_mm.z() > 0) != camera.looks_along_plus_z) {
    return std::nullopt;
  }
  const Vector2d ideal_px =
      camera.focal_length_mm / kWorldPitch_mm * seen_mm.head<2>() / seen_mm.z();
  Vector2d place = camera.opencv ? Lens(camera, ideal_px) : ideal_px;
  constexpr int kFixedPoint = 200;  // a contraction by more than 3 a turn inside the picture
  for (int i = 0; i < kFixedPoint && !camera.opencv; ++i) {
    place += 0.8 * (ideal_px - Lens(camera, place));
  }
  place +=
      camera.principal_point_offset_px + 0.5 * Vector2d(kWorldWidth_px - 1, kWorldHeight_px - 1);
  const bool inside = place.x() >= 0 && place.x() <= kWorldWidth_px - 1 && place.y() >= 0 &&
                      place.y() <= kWorldHeight_px - 1;
  return inside ? std::optional(place) : std::nullopt;
}

WorldView ViewOf(const AlignmentWorld& world, int target, const Matrix3d& spindle_rotation,
                 double distance_mm, const Vector2d& across_mm) {
  const Mounting mounting = MountingOf(world);
  const double side = world.camera.looks_along_plus_z ? 1 : -1;
  const Vector3d seen_mm(across_mm.x(), across_mm.y(), side * distance_mm);
  WorldView view;
  view.spindle_rotation = spindle_rotation;
  view.spindle_mm = InMachine(world, target) -
                    spindle_rotation * (mounting.rotation * seen_mm + mounting.origin_mm);
  view.observations = {{target, Vector2d::Zero()}};
  return view;
}

void LookFrom(AlignmentWorld& world,
              const std::function<Eigen::Vector2d(std::size_t view)>& across_mm,
              double distance_mm) {
  for (std::size_t i = 0; i < world.views.size(); ++i) {
    world.views[i] = ViewOf(world, world.views[i].observations[0].target,
                            Eigen::Matrix3d::Identity(), distance_mm, across_mm(i));
  }
}

void TakePictures(AlignmentWorld& world, double sigma_px, Random& random) {
  for (WorldView& view : world.views) {
    std::vector<WorldObservation> seen;
    for (WorldObservation observation : view.observations) {
      if (const auto pixel = WorldPixel(world, view, InMachine(world, observation.target))) {
        const double column_px = sigma_px * random.Normal();
        observation.pixel = *pixel + Vector2d(column_px, sigma_px * random.Normal());
        seen.push_back(observation);
      }
    }
    view.observations = seen;
  }
}

AlignmentWorld BenchWorld(double distance_mm) {
  constexpr double kHalfBase_mm = 38;
  AlignmentWorld world;
  world.clamping.angle_rad = 0.003;
  world.machine_from_part = {{812, 430, -655}, {0.004, -0.003, 0.011}};
  world.targets_mm = {{-750, -500, 0}, {750, -500, 12}, {750, 500, -7}, {-750, 500, 4}};
  for (int target = 0; target < 4; ++target) {
    for (const double side : {-1.0, 1.0}) {
      // Two targets with a base in X, two in Y.
      const Vector2d across_mm =
          target % 2 == 0 ? Vector2d(side * kHalfBase_mm, 0) : Vector2d(0, side * kHalfBase_mm);
      world.views.push_back(ViewOf(world, target, Matrix3d::Identity(), distance_mm, across_mm));
    }
  }
  return world;
}

}  // namespace trammel::test_support
