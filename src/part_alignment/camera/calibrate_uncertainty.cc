#include "part_alignment/camera/calibrate_uncertainty.h"

#include <array>
#include <cmath>
#include <limits>

#include "base/check.h"
#include "geometry/decompositions.h"
#include "geometry/linear_systems.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;

// What the fitted camera becomes when the target or the taper were elsewhere than stated: the views
// fix the camera in the measuring machine's frame, so taper_from_camera follows them.
Eigen::Matrix<double, 6, 1> TaperFromCamera(const Eigen::Matrix3d& cmm_from_camera,
                                            const Vector3d& camera_in_cmm_mm,
                                            const geometry::Pose& cmm_from_taper) {
  const Eigen::Matrix3d taper_from_cmm =
      geometry::RotationFromAngles(cmm_from_taper.angles_rad).transpose();
  Eigen::Matrix<double, 6, 1> pose;
  pose << taper_from_cmm * (camera_in_cmm_mm - cmm_from_taper.translation_mm),
      geometry::AnglesFromRotation(taper_from_cmm * cmm_from_camera);
  return pose;
}

}  // namespace

CameraCovariance CovarianceOfSetUp(const GridMeasurement& grid, const Camera& camera) {
  const Eigen::Matrix3d cmm_from_taper =
      geometry::RotationFromAngles(grid.cmm_from_taper.angles_rad);
  const Eigen::Matrix3d cmm_from_camera =
      cmm_from_taper * geometry::RotationFromAngles(camera.taper_from_camera.angles_rad);
  const Vector3d in_cmm_mm =
      cmm_from_taper * camera.taper_from_camera.translation_mm + grid.cmm_from_taper.translation_mm;
  Eigen::Matrix<double, 6, 9> by_sigma;  // columns: taper, target; each times its sigma
  constexpr double kStep = 1e-5;         // mm and rad
  for (int i = 0; i < 9; ++i) {
    std::array<Eigen::Matrix<double, 6, 1>, 2> pose;
    for (const int side : {0, 1}) {
      geometry::Pose taper = grid.cmm_from_taper;
      Vector3d moved_mm = in_cmm_mm;
      const double step = side == 0 ? -kStep : kStep;
      if (i < 3) taper.translation_mm[i] += step;
      if (i >= 3 && i < 6) taper.angles_rad[i - 3] += step;
      if (i >= 6) moved_mm[i - 6] += step;
      pose[static_cast<std::size_t>(side)] = TaperFromCamera(cmm_from_camera, moved_mm, taper);
    }
    const double sigma = i < 6 ? grid.taper_sigma[i] : grid.target_from_tip_sigma_mm[i - 6];
    by_sigma.col(i) = (pose[1] - pose[0]) / (2 * kStep) * sigma;
  }
  CameraCovariance covariance = CameraCovariance::Zero();
  covariance.bottomRightCorner<6, 6>() = by_sigma.lazyProduct(by_sigma.transpose());
  return covariance;
}

SensorUncertainty UncertaintyOverSensor(const Camera& camera, const CameraCovariance& covariance,
                                        double distance_mm, int columns, int rows) {
  TRAMMEL_CHECK(columns >= 2 && rows >= 2 && distance_mm > 0, "{} x {}, {} mm", columns, rows,
                distance_mm);
  SensorUncertainty uncertainty{columns, rows, distance_mm, {}};
  const geometry::Pose& pose = camera.taper_from_camera;
  const Eigen::Matrix3d rotation = geometry::RotationFromAngles(pose.angles_rad);
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const Vector2d pixel((camera.width_px - 1.0) * column / (columns - 1),
                           (camera.height_px - 1.0) * row / (rows - 1));
      double sigma_px = std::numeric_limits<double>::quiet_NaN();
      if (const auto observation = LineOfSight(camera, pixel)) {
        const Vector3d camera_mm = *observation * (distance_mm / std::abs(observation->z()));
        const auto projected = ProjectFromTaper(camera, rotation * camera_mm + pose.translation_mm);
        if (projected) {
          const Matrix2d of_pixel =
              geometry::PropagateCovariance(projected->by_parameter, covariance);
          sigma_px = std::sqrt(std::max(0.0, geometry::SymmetricEigenvalues(of_pixel)[1]));
        }
      }
      uncertainty.sigma_px.push_back(sigma_px);
    }
  }
  return uncertainty;
}

}  // namespace trammel::part_alignment
