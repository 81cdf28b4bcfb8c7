#include "part_alignment/budget/repeated.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/random.h"
#include "part_alignment/camera/camera_convert.h"

namespace trammel::part_alignment {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;

constexpr double kSigmaPx = 0.03;

// Four targets, each seen from two stops 300 mm above it.
Measurement Clean() {
  Measurement measurement;
  measurement.camera = TableOneCamera();
  measurement.camera.taper_from_camera.translation_mm = {-2, 0, -320};
  const geometry::Pose truth{{100, 50, -700}, {0.001, -0.002, 0.003}};
  int number = 0;
  for (const Vector3d& ideal :
       {Vector3d(0, 0, 0), Vector3d(1500, 0, 0), Vector3d(1500, 1000, 0), Vector3d(0, 1000, 0)}) {
    measurement.targets.push_back({std::to_string(++number), ideal});
    for (const double side : {-1.0, 1.0}) {
      View view;
      const Vector3d at =
          geometry::RotationFromAngles(truth.angles_rad) * ideal + truth.translation_mm;
      view.spindle_mm = at + Vector3d(40 * side + 5, 25 * side - 3, 620);
      const auto pixel =
          Project(measurement.camera, CameraFromPart(measurement.camera, {}, view, truth, ideal));
      EXPECT_TRUE(pixel);
      view.observations.push_back(
          {measurement.targets.back().id, pixel->x(), pixel->y(), kSigmaPx});
      measurement.views.push_back(view);
    }
  }
  return measurement;
}

TEST(Repeated, ShiftsOfTheCameraComeOutAsTheCalibrationsShare) {
  const std::uint64_t seed = 111;
  Random random(seed);
  const Measurement clean = Clean();
  std::vector<Camera> cameras;
  constexpr int kOfEach = 8;
  constexpr double kShift_mm = 0.05;
  for (int i = 0; i < kOfEach; ++i) {
    cameras.push_back(clean.camera);
    cameras.back().taper_from_camera.translation_mm.z() += random.Normal(0, kShift_mm);
  }
  std::vector<Measurement> measurements;
  for (int i = 0; i < kOfEach; ++i) {
    measurements.push_back(clean);
    for (View& view : measurements.back().views) {
      view.observations[0].column_px += random.Normal(0, kSigmaPx);
      view.observations[0].row_px += random.Normal(0, kSigmaPx);
    }
  }
  SolveOptions options;
  options.inputs = ExactInputs();
  const auto repeated = RepeatAlignments(cameras, measurements, options);
  ASSERT_TRUE(repeated) << repeated.error().message;
  ASSERT_EQ(repeated->targets.size(), 4U);
  for (const RepeatedTarget& target : repeated->targets) {
    // Seven degrees of freedom: a standard deviation scatters by a quarter of
    // itself; three of them.
    EXPECT_NEAR(target.scatter.calibration_mm.z(), kShift_mm, 0.8 * kShift_mm) << seed;
    EXPECT_LT(target.scatter.calibration_mm.x(), 0.2 * kShift_mm);
    EXPECT_GT(target.scatter.measurement_mm.z(), 0.001);
  }
  EXPECT_GT(repeated->single_mm.z(), repeated->joint_mm.z());
  // All targets move together: the budget of the part's middle must not average that out.
  BudgetScene scene;
  for (const PartTarget& target : clean.targets) scene.targets_mm.push_back(target.ideal_mm);
  scene.target_sigma_mm = repeated->single_mm;
  scene.high_mm = {1500, 1000, 1};
  const Vector3d middle_mm(750, 500, 0);
  const auto averaged = PointUncertainty(scene, middle_mm);
  scene.motion_covariance = repeated->motion_covariance;
  const auto together = PointUncertainty(scene, middle_mm);
  ASSERT_TRUE(averaged && together);
  EXPECT_GE(together->z(), repeated->targets[0].scatter.calibration_mm.z());
  EXPECT_LE(together->z(), repeated->single_mm.z());
  EXPECT_NEAR(averaged->z() / repeated->single_mm.z(), 0.5, 1e-6);
  const auto budget = MakeBudget(scene, 20'000, random);
  ASSERT_TRUE(budget);
  EXPECT_NEAR(budget->axes[2].simulated_mm / budget->axes[2].combined_mm, 1, 0.03);
}

TEST(Repeated, WhatCannotBeComparedIsNamed) {
  const Measurement clean = Clean();
  const std::vector<Camera> cameras(2, clean.camera);
  std::vector<Measurement> measurements(2, clean);
  EXPECT_THAT(RepeatAlignments(std::span(cameras).first(1), measurements, {}).error().message,
              HasSubstr("two or more"));
  measurements[1].targets[2].ideal_mm.x() += 1;
  EXPECT_THAT(RepeatAlignments(cameras, measurements, {}).error().message,
              HasSubstr("measurement 2 has other targets"));
  measurements[1] = clean;
  measurements[1].views.resize(1);
  const auto unsolved = RepeatAlignments(cameras, measurements, {});
  ASSERT_FALSE(unsolved);
  EXPECT_EQ(unsolved.error().kind, ErrorKind::kMeasurement);
}

}  // namespace
}  // namespace trammel::part_alignment
