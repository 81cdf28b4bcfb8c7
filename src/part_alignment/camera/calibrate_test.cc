#include "part_alignment/camera/calibrate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <limits>

#include "base/random.h"
#include "geometry/linear_systems.h"
#include "part_alignment/camera/calibration_record.h"
#include "part_alignment/camera/camera_convert.h"
#include "support/matchers.h"

namespace trammel::part_alignment {
using Eigen::Vector2d;
using Eigen::Vector3d;
using ::testing::Contains;
using ::testing::HasSubstr;

namespace {

constexpr double kSigmaPx = 0.02;

// Eq. 5 and Brown's polynomial, said anew: the fit is not to be judged by its own projection.
Vector2d PaperPixel(const Camera& camera, const Vector3d& taper_mm) {
  const Eigen::Matrix3d r = geometry::RotationFromAngles(camera.taper_from_camera.angles_rad);
  const Vector3d u = r.transpose() * (taper_mm - camera.taper_from_camera.translation_mm);
  const Vector2d ideal = camera.focal_length_mm / camera.pixel_pitch_mm * u.head<2>() / u.z();
  Vector2d m = ideal;
  for (int round = 0; round < 300; ++round) {
    const double r2 = m.squaredNorm();
    const double radial = camera.k1 * r2 + camera.k2 * r2 * r2;
    const Vector2d bent(
        m.x() * radial + camera.p1 * (r2 + 2 * m.x() * m.x()) + 2 * camera.p2 * m.x() * m.y(),
        m.y() * radial + camera.p2 * (r2 + 2 * m.y() * m.y()) + 2 * camera.p1 * m.x() * m.y());
    m = ideal - bent;
  }
  return m + Vector2d((camera.width_px - 1) / 2.0, (camera.height_px - 1) / 2.0) +
         camera.principal_point_offset_px;
}

Camera Truth() {
  Camera camera = TableOneCamera();
  camera.taper_from_camera.angles_rad = {-0.00312, -0.00891, 0.0304};
  return camera;
}

// The paper's pyramid: ten planes from 395 to 1430 mm before the camera, `across`² places in each.
GridMeasurement Pyramid(int planes, int across) {
  GridMeasurement grid;
  grid.camera = Truth();
  grid.cmm_from_taper = {{512.3, 418.7, 250.1}, {0.011, -0.007, 0.4}};
  grid.target_from_tip_mm = {0.4, -12.3, 3.1};
  const Camera truth = Truth();
  const Eigen::Matrix3d cmm_from_taper =
      geometry::RotationFromAngles(grid.cmm_from_taper.angles_rad);
  for (int plane = 0; plane < planes; ++plane) {
    const double z_mm = -395 - 1035.0 * plane / std::max(1, planes - 1);
    for (int i = 0; i < across; ++i) {
      for (int j = 0; j < across; ++j) {
        // 0.42 and 0.31 of the distance fill the picture.
        const double x_mm = 0.42 * z_mm * (2.0 * i / (across - 1) - 1);
        const double y_mm = 0.31 * z_mm * (2.0 * j / (across - 1) - 1);
        const Vector3d taper_mm =
            truth.taper_from_camera.translation_mm + Vector3d(x_mm, y_mm, z_mm);
        const Vector2d pixel = PaperPixel(truth, taper_mm);
        const Vector3d tip_mm = cmm_from_taper * taper_mm + grid.cmm_from_taper.translation_mm -
                                grid.target_from_tip_mm;
        grid.views.push_back({tip_mm, pixel.x(), pixel.y(), kSigmaPx});
      }
    }
  }
  // Nothing of the answer goes in.
  grid.camera.focal_length_mm = 0;
  grid.camera.principal_point_offset_px.setZero();
  grid.camera.k1 = grid.camera.k2 = grid.camera.p1 = grid.camera.p2 = 0;
  grid.camera.taper_from_camera = {};
  return grid;
}

TEST(CameraCalibration, ANoiseFreePyramidReturnsTheTruthWithoutAGuess) {
  const auto result = Good(CalibrateCamera(Pyramid(10, 4), {}));
  EXPECT_LT(result.residual_rms_px, 1e-9);
  const Camera truth = Truth();
  EXPECT_NEAR(result.camera.focal_length_mm, truth.focal_length_mm, 1e-9);
  EXPECT_LT(
      (result.camera.taper_from_camera.translation_mm - truth.taper_from_camera.translation_mm)
          .norm(),
      1e-8);
  EXPECT_LT(
      (result.camera.taper_from_camera.angles_rad - truth.taper_from_camera.angles_rad).norm(),
      1e-10);
  EXPECT_NEAR(result.camera.k1 / truth.k1, 1, 1e-8);
  EXPECT_NEAR(result.camera.p2 / truth.p2, 1, 1e-8);
  EXPECT_NEAR(result.nearest_mm, 395, 6) << "tilted by 10 mrad over 340 mm";
  EXPECT_NEAR(result.farthest_mm, 1430, 20);
  EXPECT_EQ(result.cross_validation.size(), 10U);
}

TEST(CameraCalibration, CovarianceIsWhatRepeatedCalibrationsScatterBy) {
  const std::uint64_t seed = 71;
  Random random(seed);
  const GridMeasurement clean = Pyramid(5, 4);
  const CameraVector truth = ParametersOf(Truth());
  constexpr int kRepeats = 60;
  double distance = 0;
  double held_out = 0;
  for (int repeat = 0; repeat < kRepeats; ++repeat) {
    GridMeasurement grid = clean;
    grid.position_sigma_mm = 0.005;
    for (GridView& view : grid.views) {
      view.column_px += random.Normal(0, kSigmaPx);
      view.row_px += random.Normal(0, kSigmaPx);
      for (double& mm : view.tip_mm) mm += random.Normal(0, grid.position_sigma_mm);
    }
    const auto result = Good(CalibrateCamera(grid, {}));
    const CameraVector error = ParametersOf(result.camera) - truth;
    const double widened = std::max(1.0, result.residual_rms_sigma);
    distance +=
        widened * widened * geometry::SquaredMahalanobisDistance(result.scatter, error) / kRepeats;
    for (const HeldOutPlane& plane : result.cross_validation) {
      held_out += plane.rms_sigma * plane.rms_sigma / (5.0 * kRepeats);
    }
  }
  // Chi-square of 13 degrees, mean of 60: four standard deviations are 4 sqrt(26 / 60) = 2.6.
  EXPECT_NEAR(distance, kCameraParameters, 2.6) << "seed " << seed;
  // Held-out planes are wrong by what both uncertainties say: 32 numbers in each of 300.
  EXPECT_NEAR(held_out, 1, 0.15) << "seed " << seed;
}

TEST(CameraCalibration, TheSetUpsUncertaintyJoinsTheCovariance) {
  GridMeasurement grid = Pyramid(5, 4);
  grid.target_from_tip_sigma_mm = {0.003, 0.003, 0.003};
  grid.taper_sigma << 0.002, 0.002, 0.002, 1e-5, 1e-5, 1e-5;
  const auto result = Must(CalibrateCamera(grid, {}));
  const CameraCovariance added = result.covariance - result.scatter;
  // Translations add; turns of the taper by 10 µrad move a camera 320 mm along its axis sideways.
  const double across = 0.003 * 0.003 + 0.002 * 0.002 + std::pow(320.3 * 1e-5, 2);
  const double along = 0.003 * 0.003 + 0.002 * 0.002;
  EXPECT_NEAR(added(7, 7), across, 0.02 * across);
  EXPECT_NEAR(added(8, 8), across, 0.02 * across);
  EXPECT_NEAR(added(9, 9), along, 0.02 * along);
  EXPECT_NEAR(added(11, 11), 1e-10, 1e-12);
  EXPECT_EQ(added.topLeftCorner(7, 7).norm(), 0);
}

TEST(CameraCalibration, OnePlaneIsNotEnoughAndTheReasonSaysWhy) {
  EXPECT_THAT(CalibrateCamera(Pyramid(1, 6), {}),
              Answers(Verdict::kCannotTell, "focal length and the camera's distance"));
}

TEST(CameraCalibration, PlanesTooNearToOneAnotherDoNotTellTheFocalLength) {
  GridMeasurement grid = Pyramid(10, 4);
  Random random(72);
  // Uses the two nearest of the ten planes, moved together to 1 mm.
  const Camera truth = Truth();
  const Eigen::Matrix3d rotation = geometry::RotationFromAngles(grid.cmm_from_taper.angles_rad);
  grid.views.resize(32);
  for (std::size_t i = 16; i < 32; ++i) {
    GridView& view = grid.views[i];
    Vector3d taper_mm = rotation.transpose() * (view.tip_mm + grid.target_from_tip_mm -
                                                grid.cmm_from_taper.translation_mm);
    taper_mm.z() += 114;
    view.tip_mm =
        rotation * taper_mm + grid.cmm_from_taper.translation_mm - grid.target_from_tip_mm;
    const Vector2d pixel = PaperPixel(truth, taper_mm);
    view.column_px = pixel.x();
    view.row_px = pixel.y();
  }
  for (GridView& view : grid.views) {
    view.column_px += random.Normal(0, kSigmaPx);
    view.row_px += random.Normal(0, kSigmaPx);
  }
  EXPECT_THAT(CalibrateCamera(grid, {}),
              Answers(Verdict::kCannotTell, "cannot be told apart", "z_mm"));
}

TEST(CameraCalibration, AMirroredPictureIsNamed) {
  GridMeasurement grid = Pyramid(5, 4);
  for (GridView& view : grid.views) view.row_px = 1943 - view.row_px;
  EXPECT_THAT(CalibrateCamera(grid, {}), Answers(Verdict::kRefused, "mirror"));
}

// Two coefficients can nearly turn round: what tells the directions apart is small, but not hidden.
TEST(CameraCalibration, WithoutNoiseOnlyTheRightDirectionOfDistortionFits) {
  GridMeasurement grid = Pyramid(5, 6);
  for (GridView& view : grid.views) view.sigma_px = 1e-3;
  ASSERT_EQ(CalibrateCamera(grid, {})->verdict, Verdict::kGood);
  grid.camera.convention = CameraConvention::kBrownIdealToDistorted;
  EXPECT_THAT(CalibrateCamera(grid, {}), Answers(Verdict::kRefused, "convention"));
}

TEST(CameraCalibration, AWrongViewIsLeftOutAndNamed) {
  GridMeasurement grid = Pyramid(5, 4);
  Random random(73);
  for (GridView& view : grid.views) view.column_px += random.Normal(0, kSigmaPx);
  grid.views[37].column_px += 4;
  const auto result = Good(CalibrateCamera(grid, {}));
  EXPECT_FALSE(result.residuals[37].used);
  EXPECT_THAT(result.notices, Contains(HasSubstr("view 38")));
  EXPECT_NEAR(result.residuals[37].column_px, 4, 0.2);
}

TEST(CameraCalibration, SigmasThatDoNotHoldAreSaid) {
  GridMeasurement grid = Pyramid(5, 4);
  Random random(74);
  for (GridView& view : grid.views) {
    view.column_px += random.Normal(0, 2 * kSigmaPx);
    view.row_px += random.Normal(0, 2 * kSigmaPx);
  }
  const auto result = Must(CalibrateCamera(grid, {}));
  EXPECT_NEAR(result.residual_rms_sigma, 2, 0.5);
  EXPECT_THAT(result.notices, Contains(HasSubstr("stated sigmas")));
}

TEST(CameraCalibration, WhatCannotBeIsNamed) {
  GridMeasurement grid = Pyramid(5, 4);
  grid.views[3].row_px = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(CalibrateCamera(grid, {}), FailsWith("view 4"));
  grid = Pyramid(5, 4);
  grid.views[5].sigma_px = 0;
  EXPECT_THAT(CalibrateCamera(grid, {}).error().message, HasSubstr("view 6"));
  grid = Pyramid(5, 4);
  grid.camera.pixel_pitch_mm = 0;
  EXPECT_THAT(CalibrateCamera(grid, {}).error().message, HasSubstr("pitch"));
  grid = Pyramid(5, 4);
  grid.views.resize(7);
  const auto few = Must(CalibrateCamera(grid, {}));
  EXPECT_EQ(few.verdict, Verdict::kCannotTell);
  // All in one place, and noise for pixels: no crash, no camera.
  grid = Pyramid(5, 4);
  for (GridView& view : grid.views) view.tip_mm.setZero();
  EXPECT_EQ(CalibrateCamera(grid, {})->verdict, Verdict::kCannotTell);
  grid = Pyramid(5, 4);
  Random random(75);
  for (GridView& view : grid.views) view.column_px = random.Uniform(0, 2592);
  EXPECT_EQ(CalibrateCamera(grid, {})->verdict, Verdict::kRefused);
}

TEST(SensorUncertainty, GrowsTowardsTheCornersAndOutsideTheCalibratedRange) {
  const auto result = Must(CalibrateCamera(Pyramid(10, 4), {}));
  const auto at = [&](double distance_mm) {
    return UncertaintyOverSensor(result.camera, result.scatter, distance_mm, 5, 5);
  };
  const SensorUncertainty middle = at(700);
  EXPECT_LT(middle.sigma_px[12], middle.sigma_px[0]);
  // 160 views of 0.02 px and 13 numbers: about 0.02 sqrt(13 / 320) = 0.004 px on average.
  EXPECT_LT(middle.sigma_px[12], 0.01);
  EXPECT_GT(middle.sigma_px[12], 0.0005);
  EXPECT_GT(at(100).sigma_px[12], middle.sigma_px[12]);
}

TEST(CalibrationAge, AYearIsTrustedAndADayMoreIsNot) {
  EXPECT_FALSE(NoticeOfAge("2025-11-22", "2026-11-22"));
  EXPECT_THAT(NoticeOfAge("2025-11-21", "2026-11-22").value_or(""), HasSubstr("366 days"));
  EXPECT_FALSE(NoticeOfAge("2026-11-22", "2026-11-22", 0));
}

TEST(CalibrationAge, DatesThatCannotBeAreSaid) {
  EXPECT_THAT(NoticeOfAge("2026-11-23", "2026-11-22").value_or(""), HasSubstr("after today"));
  for (const char* date :
       {"", "2026-13-01", "2026-02-30", "22.11.2026", "2026-1-010", "20x6-01-01"}) {
    EXPECT_THAT(NoticeOfAge(date, "2026-11-22").value_or(""), HasSubstr("no date")) << date;
  }
}

}  // namespace

}  // namespace trammel::part_alignment
