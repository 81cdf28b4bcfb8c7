#include "part_alignment/pose/joint_fit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>
#include <vector>

#include "geometry/linear_systems.h"
#include "part_alignment/pose/pose_problem.h"
#include "part_alignment/pose/solve_test_support.h"
#include "support/matchers.h"

namespace trammel::part_alignment {
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using test_support::AlignmentWorld;
using test_support::BenchWorld;
using ::testing::Contains;
using ::testing::HasSubstr;

namespace {

constexpr double kNoise_px = 0.03;

/// Two views of each target, the last one with the spindle turned by half, and one with two
/// targets.
struct Bench {
  explicit Bench(const SolveOptions& options) {
    AlignmentWorld world = test_support::BenchWorld(300);
    world.targets_mm.push_back(world.targets_mm[0] + Eigen::Vector3d(20, 10, 0));
    world.views.push_back(test_support::ViewOf(
        world, 0, geometry::RotationFromAngles({0, 0, std::numbers::pi}), 300, {10, 20}));
    world.views.back().observations.push_back({4, Eigen::Vector2d::Zero()});
    Random random(5);
    test_support::TakePictures(world, kNoise_px, random);
    problem = MakeProblem(MeasurementOf(world, kNoise_px), options).value();
    theta = ThetaOf(problem, world.machine_from_part, {world.clamping.angle_rad, {}, {}});
  }
  PoseProblem problem;
  Theta theta;
};

SolveOptions EverythingUncertain() {
  SolveOptions options;
  options.inputs.machine_mm = 0.005;
  options.inputs.target_mm = 0.01;
  options.inputs.clamp_eccentricity_mm = 0.02;
  options.inputs.clamp_tilt_rad = 2e-5;
  options.inputs.camera_offset_mm = 0.01;
  CameraVector sigmas = CameraVector::Zero();
  sigmas.head<3>() << 0.002, 0.5, 0.5;
  options.camera_covariance = sigmas.cwiseAbs2().asDiagonal();
  return options;
}

/// Covariance of all residuals, px², by finite differences of what each input moves.
MatrixXd CovarianceOfResiduals(const PoseProblem& problem, const Theta& theta) {
  const auto count = 2 * static_cast<Index>(problem.observations.size());
  const auto residuals = [&](const PoseProblem& moved, const Theta& everything) {
    const Chain chain(moved, everything, false);
    VectorXd all(count);
    for (std::size_t i = 0; i < moved.observations.size(); ++i) {
      Eigen::Vector2d one;
      EXPECT_TRUE(chain.Residual(moved.observations[i], one));
      all.segment<2>(2 * static_cast<Index>(i)) = one;
    }
    return all;
  };
  const PoseProblem all = WithEverything(problem);
  const Theta at = EverythingAt(problem, theta);
  const VectorXd still = residuals(all, at);
  MatrixXd covariance = MatrixXd::Zero(count, count);
  const auto add = [&](const PoseProblem& moved, const Theta& everything, double by, double sigma) {
    const VectorXd slope = (residuals(moved, everything) - still) / by * sigma;
    covariance += slope * slope.transpose();
  };
  constexpr double kStep = 1e-4;
  for (Index i = 6; i < at.size(); ++i) {
    Theta moved = at;
    moved[i] += kStep;
    add(all, moved, kStep, problem.errors.common[i]);
  }
  for (std::size_t view = 0; view <= problem.observations.back().view; ++view) {
    for (int axis = 0; axis < 3; ++axis) {
      PoseProblem moved = all;
      for (WeightedObservation& observation : moved.observations) {
        if (observation.view == view) observation.spindle_mm[axis] += kStep;
      }
      add(moved, at, kStep, problem.errors.machine_mm);
    }
  }
  for (Index draw = 0; draw < problem.errors.targets.cols(); ++draw) {
    PoseProblem moved = all;
    for (WeightedObservation& observation : moved.observations) {
      observation.part_mm += kStep * problem.errors.targets.block<3, 1>(
                                         3 * static_cast<Index>(observation.target), draw);
    }
    add(moved, at, kStep, 1);
  }
  for (int draw = 0; draw < kCameraParameters; ++draw) {
    const CameraVector by = kStep * problem.errors.camera->col(draw);
    PoseProblem moved = all;
    moved.camera = WithParameters(all.camera, ParametersOf(all.camera) + by);
    Theta everything = at;
    const Layout layout = LayoutOf(all.unknowns);
    everything[layout.focal_length] += by[0];
    everything.segment<3>(layout.camera_offset) += by.segment<3>(7);
    add(moved, everything, kStep, 1);
  }
  for (Index i = 0; i < count; ++i) covariance(i, i) += kNoise_px * kNoise_px;
  return covariance;
}

// Against the textbook: (J' V^-1 J)^-1 with the whole covariance of the residuals.
TEST(JointFit, IsGeneralisedLeastSquaresByTheResidualsWholeCovariance) {
  const Bench bench(EverythingUncertain());
  PoseProblem alone = bench.problem;
  for (WeightedObservation& observation : alone.observations) observation.sigma_px = 1;
  const MatrixXd jacobian = WeightedJacobian(alone, bench.theta);
  VectorXd residuals(jacobian.rows());
  const Chain chain(bench.problem, bench.theta, false);
  for (std::size_t i = 0; i < alone.observations.size(); ++i) {
    Eigen::Vector2d one;
    ASSERT_TRUE(chain.Residual(alone.observations[i], one));
    residuals.segment<2>(2 * static_cast<Index>(i)) = one;
  }
  const MatrixXd inverse = geometry::Inverse(CovarianceOfResiduals(bench.problem, bench.theta));
  const MatrixXd covariance = geometry::Inverse(jacobian.transpose() * inverse * jacobian);
  const VectorXd step = covariance * jacobian.transpose() * inverse * residuals;
  const VectorXd left = residuals - jacobian * step;

  const JointFit fit = FitJointly(bench.problem, bench.theta);
  const VectorXd sigma = covariance.diagonal().cwiseSqrt();
  constexpr double kDifferences = 1e-4;  // error of finite differences
  EXPECT_NEAR(fit.chi_square, left.dot(inverse * left), kDifferences * fit.chi_square);
  EXPECT_EQ(JointChiSquare(bench.problem, bench.theta), fit.chi_square);
  for (Index i = 0; i < step.size(); ++i) {
    EXPECT_NEAR(fit.step[i], step[i], 10 * kDifferences * sigma[i]) << i;
    for (Index k = 0; k < step.size(); ++k) {
      EXPECT_NEAR(fit.covariance(i, k), covariance(i, k), kDifferences * sigma[i] * sigma[k]);
    }
  }
  EXPECT_LT((fit.gain * residuals - fit.step).cwiseQuotient(sigma).norm(), 1e-9);
}

// An unchecked usual repeatability counts for more than itself: it comes from few runs.
TEST(Repeatability, IsThatOfUsualMachinesUnlessManyResidualsSayOtherwise) {
  SolveOptions options;
  const Bench exact(options);
  Bench few = exact;
  few.problem.observations.resize(3);
  EXPECT_GT(RepeatabilityByResiduals(few.problem, few.theta, true), kUsualRepeatability_mm);
  constexpr double kBad_mm = 0.012;
  Random random(9);
  Bench bad = exact;
  Bench good = exact;
  for (int again = 0; again < 20; ++again) {
    for (WeightedObservation observation : exact.problem.observations) {
      if (observation.target == 4) continue;  // shares its view's error with another observation
      observation.view += 100 * static_cast<std::size_t>(again + 1);
      good.problem.observations.push_back(observation);
      for (double& mm : observation.spindle_mm) mm += random.Normal(0, kBad_mm);
      bad.problem.observations.push_back(observation);
    }
  }
  EXPECT_NEAR(RepeatabilityByResiduals(bad.problem, bad.theta, true), kBad_mm, 0.2 * kBad_mm);
  EXPECT_LT(RepeatabilityByResiduals(good.problem, good.theta, true), kUsualRepeatability_mm / 2);
}

constexpr double kUsual_mm = 0.02;
constexpr double kMiddle = 0.5;

/// BenchWorld with its targets' places stated wrong after the pictures.
AlignmentWorld WithTargetsOff(double off_mm, std::uint64_t seed) {
  AlignmentWorld world = Pictured(BenchWorld(300), 0.03, seed);
  Random random(seed + 1000);
  for (auto& target_mm : world.targets_mm) {
    for (double& mm : target_mm) mm += random.Normal(0, off_mm);
  }
  return world;
}

struct TargetBench {
  explicit TargetBench(const AlignmentWorld& world) {
    SolveOptions options;
    options.inputs = ExactInputs();
    options.inputs.target_mm = kUsual_mm;
    problem = MakeProblem(MeasurementOf(world, 0.03), options).value();
    theta = ThetaOf(problem, world.machine_from_part, {world.clamping.angle_rad, {}, {}});
  }
  PoseProblem problem;
  Theta theta;
};

TEST(TargetErrors, OfManySamplesTheirMiddleIsTheTruth) {
  constexpr double kOff_mm = 0.1;
  std::vector<double> found_mm;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const TargetBench bench(WithTargetsOff(kOff_mm, seed));
    found_mm.push_back(TargetErrorByResiduals(bench.problem, bench.theta, kUsual_mm, kMiddle));
  }
  std::nth_element(found_mm.begin(), found_mm.begin() + 100, found_mm.end());
  // Half of 200 samples of some six degrees of freedom: the median is known to 4 % (1 sigma).
  EXPECT_NEAR(found_mm[100], kOff_mm, 0.12 * kOff_mm);
}

TEST(TargetErrors, OfWhichNothingIsStatedWidenTheAnswer) {
  const auto usual = Solve(MeasurementOf(WithTargetsOff(0, 5), 0.03), {});
  const auto off = Solve(MeasurementOf(WithTargetsOff(0.1, 5), 0.03), {});
  ASSERT_TRUE(usual && off);
  ASSERT_EQ(usual->verdict, Verdict::kGood) << usual->reason;
  ASSERT_EQ(off->verdict, Verdict::kGood) << off->reason;
  EXPECT_GT(*off->inputs.target_mm, 3 * *usual->inputs.target_mm);
  EXPECT_GT(off->covariance(0, 0), 2 * usual->covariance(0, 0));
  EXPECT_THAT(off->notices, Contains(HasSubstr("measure them on the part")));
  EXPECT_TRUE(usual->notices.empty());
}

TEST(TargetErrors, OneWrongTargetAmongSoundOnesIsNamedAllTheSame) {
  AlignmentWorld world = Pictured(BenchWorld(300), 0.03, 7);
  world.targets_mm[1] += Eigen::Vector3d(0.6, -0.5, 0);
  const auto alignment = Good(Solve(MeasurementOf(world, 0.03), {}));
  EXPECT_THAT(alignment.notices, Contains(HasSubstr("left out: target T2")));
  EXPECT_LT(*alignment.inputs.target_mm, 0.1);
  EXPECT_LT(
      (alignment.machine_from_part.translation_mm - world.machine_from_part.translation_mm).norm(),
      0.1);
}

TEST(TargetErrors, BeyondWhatTheAnswerMayBeUncertainByTellNothing) {
  EXPECT_THAT(Solve(MeasurementOf(WithTargetsOff(0.6, 5), 0.03), {}),
              Answers(Verdict::kCannotTell, "targets that are off by"));
}

}  // namespace

}  // namespace trammel::part_alignment
