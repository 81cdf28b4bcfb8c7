#include "part_alignment/pose/solve.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "geometry/decompositions.h"
#include "geometry/linear_systems.h"
#include "part_alignment/pose/solve_test_support.h"
#include "support/matchers.h"

namespace trammel::part_alignment {
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using test_support::AlignmentWorld;
using test_support::BenchWorld;
using ::testing::Contains;
using ::testing::HasSubstr;

namespace {

/// Tolerance without noise: the pixel's rounding (2e-13 px) by 0.1 mm per px, and by 2 m.
constexpr double kExact_mm = 1e-9;
constexpr double kExact_rad = 1e-12;

void ExpectTruth(const AlignmentWorld& world, const Alignment& alignment) {
  ASSERT_EQ(alignment.verdict, Verdict::kGood) << alignment.reason;
  const geometry::Pose& pose = alignment.machine_from_part;
  EXPECT_LT((pose.translation_mm - world.machine_from_part.translation_mm).cwiseAbs().maxCoeff(),
            kExact_mm);
  const Matrix3d truth = geometry::RotationFromAngles(world.machine_from_part.angles_rad);
  const Matrix3d turn = geometry::RotationFromAngles(pose.angles_rad) * truth.transpose();
  EXPECT_LT((turn - Matrix3d::Identity()).cwiseAbs().maxCoeff(), 2 * kExact_rad);
  EXPECT_NEAR(alignment.clamping.angle_rad, world.clamping.angle_rad, kExact_rad);
  EXPECT_LT((alignment.clamping.eccentricity_mm - world.clamping.eccentricity_mm).norm(),
            2 * kExact_mm);
  EXPECT_LT((alignment.clamping.tilt_rad - world.clamping.tilt_rad).norm(), 2 * kExact_rad);
}

TEST(Solve, WithoutNoiseReturnsTheTruthInEveryConvention) {
  for (const bool opencv : {false, true}) {
    for (const bool plus_z : {false, true}) {
      AlignmentWorld world = BenchWorld();
      world.camera.opencv = opencv;
      world.camera.looks_along_plus_z = plus_z;
      if (plus_z) world.camera.taper_from_camera.angles_rad.x() += std::numbers::pi;
      LookFrom(world, [](std::size_t i) {
        const double side = i % 2 == 0 ? -35 : 35;
        return Vector2d(side, 0.5 * side);
      });
      ExpectTruth(world, Solved(Pictured(world), Exact()));
    }
  }
}

TEST(Solve, NeverBelievesACameraThatLooksTheOtherWay) {
  // Each may be wrong: the camera's side, its turn about x, the sign of its position.
  for (const bool plus_z : {false, true}) {
    AlignmentWorld world = BenchWorld();
    world.camera.looks_along_plus_z = plus_z;
    if (plus_z) world.camera.taper_from_camera.angles_rad.x() += std::numbers::pi;
    for (Vector3d& target : world.targets_mm) target.z() = 0;  // a plane is its own mirror image
    for (std::size_t i = 0; i < world.views.size(); ++i) {
      const double side = i % 2 == 0 ? -38 : 38;
      const int target = world.views[i].observations[0].target;
      const Vector2d across = target % 2 == 0 ? Vector2d(side, 0) : Vector2d(0, side);
      world.views[i] = ViewOf(world, target, Matrix3d::Identity(), 300, across);
    }
    const Measurement right = MeasurementOf(Pictured(world), kSigma_px);
    ASSERT_EQ(Solve(right, Exact())->verdict, Verdict::kGood);
    for (int wrong = 1; wrong < 8; ++wrong) {
      SCOPED_TRACE(fmt::format("looks along {}z, faults {:03b}", plus_z ? '+' : '-', wrong));
      Measurement measurement = right;
      Camera& camera = measurement.camera;
      if ((wrong & 1) != 0) {
        camera.looks_along = plus_z ? LooksAlong::kMinusZ : LooksAlong::kPlusZ;
      }
      if ((wrong & 2) != 0) camera.taper_from_camera.angles_rad.x() += std::numbers::pi;
      if ((wrong & 4) != 0) camera.taper_from_camera.translation_mm.z() *= -1;
      const auto alignment = Must(Solve(measurement, Exact()));
      EXPECT_NE(alignment.verdict, Verdict::kGood)
          << "Z off by "
          << alignment.machine_from_part.translation_mm.z() -
                 world.machine_from_part.translation_mm.z();
      if (wrong == 1) EXPECT_THAT(alignment.reason, HasSubstr("looks back at the spindle"));
    }
  }
}

TEST(Solve, SpeaksOfACameraThatIsClampedTheOtherWayRound) {
  const AlignmentWorld world = BenchWorld();
  Measurement measurement = MeasurementOf(Pictured(world), kSigma_px);
  for (View& view : measurement.views) view.spindle_mm.head<2>() *= -1;
  const auto alignment = Good(Solve(measurement, Exact()));
  EXPECT_THAT(alignment.notices, Contains(HasSubstr("two axes have the wrong sign")));
}

TEST(Solve, MeasuresAlongYInALargeMachine) {
  AlignmentWorld world = BenchWorld(150);
  // The spindle's axis along the machine's -Y... its z shows away from the part, to +Y.
  Matrix3d along_y;
  along_y << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  world.targets_mm = {{-5000, 0, -1500}, {5000, 10, -1500}, {5000, 0, 1500}, {-5000, -5, 1500}};
  world.machine_from_part = {{6000, 2500, 1800}, {0.003, -0.002, 0.001}};
  world.views.clear();
  for (int target = 0; target < 4; ++target) {
    for (const double side : {-20.0, 20.0}) {
      world.views.push_back(ViewOf(world, target, along_y, 150, {side, 0.3 * side}));
    }
  }
  const Alignment alignment = Solved(Pictured(world), Exact());
  ASSERT_EQ(alignment.verdict, Verdict::kGood) << alignment.reason;
  ExpectTruth(world, alignment);
}

TEST(Solve, FindsAnyTurnOfThePartWithoutAGuess) {
  constexpr std::uint64_t kSeed = 5;
  constexpr int kWorlds = 200;
  SCOPED_TRACE(kSeed);
  Random random(kSeed);
  int right = 0;
  for (int i = 0; i < kWorlds; ++i) {
    AlignmentWorld world = BenchWorld();
    world.clamping.angle_rad = random.Uniform(-0.1, 0.1);
    world.machine_from_part.angles_rad = {random.Uniform(-std::numbers::pi, std::numbers::pi),
                                          random.Uniform(-1.5, 1.5),
                                          random.Uniform(-std::numbers::pi, std::numbers::pi)};
    for (Vector3d& target : world.targets_mm) {
      target += 100 * Vector3d{random.Normal(), random.Normal(), random.Normal()};
    }
    for (std::size_t k = 0; k < world.views.size(); ++k) {
      const double angle = random.Uniform(0, std::numbers::pi);
      const double side = k % 2 == 0 ? -35 : 35;
      world.views[k] = ViewOf(world, world.views[k].observations[0].target, Matrix3d::Identity(),
                              300, side * Vector2d(std::cos(angle), std::sin(angle)));
    }
    const Alignment alignment = Solved(Pictured(world, kSigma_px, kSeed + i), Exact());
    const Vector3d off_mm =
        alignment.machine_from_part.translation_mm - world.machine_from_part.translation_mm;
    right += alignment.verdict == Verdict::kGood && off_mm.norm() < 1 ? 1 : 0;
  }
  // Chi-square refuses one in 10,000.
  EXPECT_GE(right, kWorlds - 1);
}

TEST(Solve, FindsACameraClampedTheWrongWayRound) {
  for (const double angle_rad : {3.1, -2.0, 1.0}) {
    AlignmentWorld world = BenchWorld();
    world.clamping.angle_rad = angle_rad;
    LookFrom(world, [](std::size_t i) { return Vector2d(i % 2 == 0 ? -30.0 : 30.0, 10); });
    ExpectTruth(world, Solved(Pictured(world), Exact()));
  }
}

/// Two heights, and C at 0 and 180 degrees: what the further unknowns need.
AlignmentWorld RichWorld() {
  AlignmentWorld world = BenchWorld();
  world.clamping = {0.004, {0.02, -0.015}, {0.001, -0.0007}};
  world.views.clear();
  for (int target = 0; target < 4; ++target) {
    for (int i = 0; i < 8; ++i) {
      const Matrix3d turned = geometry::RotationFromAngles({0, 0, i % 2 * std::numbers::pi});
      const double side = i / 2 % 2 == 0 ? -40 : 40;
      world.views.push_back(
          ViewOf(world, target, turned, i < 4 ? 250 : 450, {side, (i < 4 ? 0.5 : -0.5) * side}));
    }
  }
  return world;
}

TEST(Solve, EccentricityTiltAndFocalLengthComeBackWhereTheViewsTellThem) {
  SolveOptions options = Exact();
  options.unknowns = {true, true, true, false, false};
  ExpectTruth(RichWorld(), Solved(Pictured(RichWorld()), options));
  options.unknowns = {true, true, false, true, false};
  AlignmentWorld world = RichWorld();
  world.clamping.tilt_rad.setZero();
  world = Pictured(world);
  Measurement measurement = MeasurementOf(world, kSigma_px);
  measurement.camera.focal_length_mm += 0.01;
  const auto alignment = Must(Solve(measurement, options));
  ExpectTruth(world, alignment);
  EXPECT_NEAR(alignment.focal_length_mm, 6.189, 1e-9);
}

TEST(Solve, FourLinesOfSightAreEnoughForSevenUnknowns) {
  AlignmentWorld world = BenchWorld();
  const std::array<Vector2d, 4> places{Vector2d(-38, 20), {30, 25}, {35, -28}, {20, 29}};
  world.views.clear();
  for (int target = 0; target < 4; ++target) {
    world.views.push_back(ViewOf(world, target, Matrix3d::Identity(), 300, places[target]));
  }
  ExpectTruth(world, Solved(Pictured(world), Exact()));
}

TEST(Solve, TooFewLinesOfSightAreCounted) {
  AlignmentWorld world = BenchWorld();
  world.views.resize(3);
  EXPECT_THAT(Solved(Pictured(world, kSigma_px, 2), Exact()),
              Answers(Verdict::kCannotTell, "7 unknowns need at least 4 lines of sight"));
  world.views.resize(1);
  EXPECT_EQ(Solved(Pictured(world, kSigma_px, 2), Exact()).verdict, Verdict::kCannotTell);
}

TEST(Solve, InputErrorsNameWhatIsWrong) {
  const Measurement good = MeasurementOf(Pictured(BenchWorld()), kSigma_px);
  const auto message = [&](auto&& spoil) {
    Measurement measurement = good;
    spoil(measurement);
    const auto alignment = Solve(measurement, Exact());
    return alignment ? std::string("no error") : alignment.error().message;
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(message([](Measurement& m) { m.views[2].observations[0].target = "T9"; }),
              HasSubstr("view 3: target T9 is not among the 4 targets"));
  EXPECT_THAT(message([](Measurement& m) { m.targets[1].id = "T1"; }),
              HasSubstr("T1 is given twice"));
  EXPECT_THAT(message([&](Measurement& m) { m.views[0].observations[0].row_px = nan; }),
              HasSubstr("outside the picture"));
  EXPECT_THAT(message([](Measurement& m) { m.views[0].observations[0].sigma_px = 0; }),
              HasSubstr("sigma_px is 0"));
  EXPECT_THAT(message([&](Measurement& m) { m.views[1].spindle_mm.x() = nan; }),
              HasSubstr("view 2: spindle_mm"));
  EXPECT_THAT(message([](Measurement& m) { m.views[1].spindle_rotation(2, 2) = -1; }),
              HasSubstr("no rotation"));
  EXPECT_THAT(message([](Measurement& m) { m.views[1].spindle_rotation *= 2; }),
              HasSubstr("no rotation"));
  EXPECT_THAT(message([&](Measurement& m) { m.targets[0].ideal_mm.z() = nan; }),
              HasSubstr("target T1: ideal_mm"));
  EXPECT_THAT(message([](Measurement& m) { m.camera.focal_length_mm = -6; }),
              HasSubstr("focal_length_mm is -6"));
  EXPECT_THAT(message([](Measurement& m) {
                m.views[0].observations.push_back(m.views[0].observations[0]);
              }),
              HasSubstr("observed twice"));
  EXPECT_THAT(message([](Measurement& m) { m.views.clear(); }), HasSubstr("no view"));
}

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

/// Statistics of 200 cameras drawn from the covariance.
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

TEST(Solve, IdenticalLeversAreToldWithTheDirection) {
  AlignmentWorld world = BenchWorld();
  LookFrom(world, [](std::size_t) { return Vector2d(30, 0); });
  const Alignment alignment = Solved(Pictured(world, kSigma_px, 2), Exact());
  EXPECT_THAT(alignment, Answers(Verdict::kCannotTell, "the clamp angle",
                                 "no target is seen from two different positions"));
  EXPECT_LT(alignment.observability.rank, 7);
}

TEST(Solve, RadialLeversAliasWithThePartsRotation) {
  AlignmentWorld world = BenchWorld();
  world.camera.taper_from_camera = {{0, 0, -320.3}, {0, 0, 0}};
  world.machine_from_part = {{800, 400, -600}, {0, 0, 0}};
  world.clamping = {};
  world.views.clear();
  for (int target = 0; target < 4; ++target) {
    const Vector2d across = world.targets_mm[target].head<2>() / 20;
    world.views.push_back(ViewOf(world, target, Matrix3d::Identity(), 300, across));
  }
  EXPECT_THAT(Solved(Pictured(world, kSigma_px, 2), Exact()),
              Answers(Verdict::kCannotTell,
                      "the clamp angle cannot be told from the part's rotation about Z"));
}

TEST(Solve, NearlyUnobservablePlansAreJudgedByTheirUncertainty) {
  AlignmentWorld world = BenchWorld();
  LookFrom(world, [](std::size_t i) { return Vector2d(i % 2 == 0 ? 30 : 30.3, 0); });
  const Alignment alignment = Solved(Pictured(world, kSigma_px, 2), Exact());
  EXPECT_THAT(alignment, Answers(Verdict::kCannotTell, "known to"));
  EXPECT_EQ(alignment.observability.rank, 7);
  EXPECT_THAT(alignment.reason, HasSubstr("cannot be told well enough from"));
}

TEST(Solve, EccentricityAtOneOrientationIsToldFromNothing) {
  SolveOptions options = Exact();
  options.unknowns.clamp_eccentricity = true;
  EXPECT_THAT(Solved(Pictured(BenchWorld(), kSigma_px, 2), options),
              Answers(Verdict::kCannotTell, "the clamp eccentricity in",
                      "same orientation of the spindle"));
}

// Given the advised views, the same measurement is good.
TEST(Solve, TheAdvisedViewsMakeTheAnswerGood) {
  AlignmentWorld world = BenchWorld();
  LookFrom(world, [](std::size_t) { return Vector2d(30, 5); });
  const Alignment before = Solved(Pictured(world, kSigma_px, 2), Exact());
  ASSERT_EQ(before.verdict, Verdict::kCannotTell);
  const std::string& advice = before.observability.advice;
  int added = 0;
  for (std::size_t at = advice.find("target T"); at != std::string::npos;
       at = advice.find("target T", at + 1)) {
    int target = 0;
    test_support::WorldView view;
    ASSERT_EQ(std::sscanf(advice.c_str() + at, "target T%d from spindle X %lf Y %lf Z %lf", &target,
                          &view.spindle_mm.x(), &view.spindle_mm.y(), &view.spindle_mm.z()),
              4)
        << advice;
    view.observations = {{target - 1, {}}};
    world.views.push_back(view);
    ++added;
  }
  ASSERT_GE(added, 1) << advice;
  const AlignmentWorld again = Pictured(world, kSigma_px, 2);
  const Alignment after = Solved(again, Exact());
  EXPECT_EQ(after.verdict, Verdict::kGood) << after.reason << "\n" << advice;
}

}  // namespace

}  // namespace trammel::part_alignment
