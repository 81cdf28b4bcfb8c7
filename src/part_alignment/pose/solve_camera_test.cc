// A camera that is known only as well as its calibration.
#include <gtest/gtest.h>

#include "geometry/decompositions.h"
#include "geometry/linear_systems.h"
#include "part_alignment/pose/solve_test_support.h"

namespace trammel::part_alignment {
namespace {

using test_support::AlignmentWorld;
using test_support::BenchWorld;

// A camera that is not quite what its calibration says, anew in each of 200 worlds.
CameraCovariance UncertainCamera() {
  CameraVector sigmas = CameraVector::Zero();
  sigmas.head<3>() << 0.002, 0.5, 0.5;  // mm, px, px
  sigmas[3] = 3e-11;                    // 0.1 px at 1500 px, with r³
  sigmas.tail<6>() << 0.01, 0.01, 0.01, 5e-5, 5e-5, 5e-5;
  CameraCovariance covariance = sigmas.cwiseAbs2().asDiagonal();
  covariance(0, 9) = covariance(9, 0) = 0.8 * sigmas[0] * sigmas[9];  // f against Z
  return covariance;
}

/// Pictures of the world by a camera that is `off` what the measurement takes it for.
Measurement TakenBy(const CameraVector& off, AlignmentWorld world, double sigma_px,
                    Random& random) {
  const Camera nominal = CameraOf(world.camera);
  test_support::WorldCamera& camera = world.camera;
  camera.focal_length_mm += off[0];
  camera.principal_point_offset_px += off.segment<2>(1);
  camera.k1 += off[3];
  camera.taper_from_camera.translation_mm += off.segment<3>(7);
  camera.taper_from_camera.angles_rad += off.segment<3>(10);
  test_support::TakePictures(world, sigma_px, random);
  Measurement measurement = MeasurementOf(world, sigma_px);
  measurement.camera = nominal;
  return measurement;
}

/// Of 200 cameras drawn from the covariance.
struct Scatter {
  double mahalanobis2 = 0;  ///< mean, of the part's error in what is stated
  double chi_square = 0;    ///< mean per degree of freedom
  double plain = 0;         ///< the same of the residuals alone
  int good = 0;
};

constexpr int kWorlds = 200;

Scatter ScatterOf(const AlignmentWorld& world, double sigma_px) {
  SolveOptions options = Exact();
  options.camera_covariance = UncertainCamera();
  const CameraCovariance root = geometry::CovarianceRoot(UncertainCamera());
  Random random(7);
  Scatter scatter;
  for (int i = 0; i < kWorlds; ++i) {
    CameraVector draw;
    for (double& value : draw) value = random.Normal();
    const auto alignment = Solve(TakenBy(root * draw, world, sigma_px, random), options);
    EXPECT_TRUE(alignment);
    if (!alignment || alignment->verdict != Verdict::kGood) continue;
    ++scatter.good;
    const auto error = PartError(world, *alignment);
    const Eigen::MatrixXd part = alignment->covariance.topLeftCorner<6, 6>();
    scatter.mahalanobis2 += geometry::SquaredMahalanobisDistance(part, error) / kWorlds;
    scatter.chi_square += alignment->chi_square / alignment->degrees_of_freedom / kWorlds;
    for (const AlignmentResidual& residual : alignment->residuals) {
      const double size_px = std::hypot(residual.column_px, residual.row_px);
      scatter.plain +=
          size_px * size_px / (sigma_px * sigma_px) / alignment->degrees_of_freedom / kWorlds;
    }
  }
  return scatter;
}

TEST(Solve, AnUncertainCameraCountsAsItScatters) {
  const Scatter scatter = ScatterOf(BenchWorld(), kSigma_px);
  EXPECT_EQ(scatter.good, kWorlds);
  // Mean squared Mahalanobis distance of 6 numbers: sqrt(12 / 200) = 0.25 of scatter; four of it.
  EXPECT_NEAR(scatter.mahalanobis2, 6, 1);
  // 9 degrees of freedom: sqrt(2 / 9 / 200) = 0.03.
  EXPECT_NEAR(scatter.chi_square, 1, 0.13);
}

// Errors that all observations share are many sigmas of a fine detector, and no contradiction.
TEST(Solve, AnUncertainCameraIsNoContradictionToAFineDetector) {
  constexpr double kFine_px = 0.006;
  AlignmentWorld world = BenchWorld();
  LookFrom(world, [](std::size_t i) {
    return Eigen::Vector2d(i % 2 == 0 ? -110.0 : 110.0, i % 4 < 2 ? 75.0 : -75.0);
  });
  const Scatter scatter = ScatterOf(world, kFine_px);
  EXPECT_GE(scatter.good, kWorlds - 1);  // 1 in 10,000 on either side
  EXPECT_NEAR(scatter.mahalanobis2, 6, 1);
  EXPECT_NEAR(scatter.chi_square, 1, 0.13);
  EXPECT_GT(scatter.plain, 1.5) << "what is shared must be seen here";
}

TEST(Solve, ACovarianceThatIsNoneIsRefused) {
  const Measurement measurement = MeasurementOf(Pictured(BenchWorld()), kSigma_px);
  SolveOptions options;
  options.camera_covariance = CameraCovariance::Identity();
  (*options.camera_covariance)(0, 1) = 0.5;
  EXPECT_FALSE(Solve(measurement, options));
  (*options.camera_covariance)(1, 0) = 0.5;
  EXPECT_TRUE(Solve(measurement, options));
  (*options.camera_covariance)(0, 1) = (*options.camera_covariance)(1, 0) = 2;
  EXPECT_FALSE(Solve(measurement, options));
  (*options.camera_covariance)(0, 1) = (*options.camera_covariance)(1, 0) = NAN;
  EXPECT_FALSE(Solve(measurement, options));
}

}  // namespace
}  // namespace trammel::part_alignment
