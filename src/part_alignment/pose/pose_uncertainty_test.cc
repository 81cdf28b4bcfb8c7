#include "part_alignment/pose/pose_uncertainty.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "part_alignment/pose/alignment_test_support.h"
#include "part_alignment/pose/solve.h"
#include "support/matchers.h"

namespace trammel::part_alignment {
using test_support::AlignmentWorld;
using test_support::BenchWorld;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

namespace {

constexpr double kPixelSigma_px = 0.05;
constexpr std::uint64_t kSeed = 21;
constexpr int kTrials = 10000;
/// A standard deviation of 10,000 draws scatters by 0.7 %: 5 % is seven of those.
constexpr double kAgreement = 0.05;

struct Bench {
  Measurement measurement;
  AlignmentState state;
};

Bench PaperBench() {
  AlignmentWorld world = BenchWorld();
  Random random(kSeed);
  TakePictures(world, 0, random);
  Clamping clamping;
  clamping.angle_rad = world.clamping.angle_rad;
  return {MeasurementOf(world, kPixelSigma_px), {world.machine_from_part, clamping}};
}

void ExpectAgreement(const Eigen::MatrixXd& linear, const MonteCarloUncertainty& simulated) {
  for (Eigen::Index i = 0; i < linear.rows(); ++i) {
    const double linear_sigma = std::sqrt(linear(i, i));
    EXPECT_NEAR(std::sqrt(simulated.covariance(i, i)) / linear_sigma, 1, kAgreement)
        << simulated.parameters[i];
    // Symmetric normal errors: the quantiles lie at 1.96 sigma, each to 2.7 % of that (10,000
    // draws).
    EXPECT_NEAR(simulated.high95[i] / linear_sigma, 1.96, 0.15) << simulated.parameters[i];
    EXPECT_NEAR(simulated.low95[i] / linear_sigma, -1.96, 0.15) << simulated.parameters[i];
    EXPECT_LT(std::abs(simulated.mean_error[i]), 4 * linear_sigma / 100);
    for (Eigen::Index k = 0; k < i; ++k) {
      const double product = linear_sigma * std::sqrt(linear(k, k));
      EXPECT_NEAR(simulated.covariance(i, k) / product, linear(i, k) / product, kAgreement);
    }
  }
  EXPECT_GT(simulated.inside95, 0.93);
  EXPECT_LT(simulated.inside95, 0.97);
}

SolveOptions Exact() {
  SolveOptions options;
  options.inputs = ExactInputs();
  return options;
}

TEST(PoseUncertainty, LinearPropagationHoldsForMachineTargetsAndClampingToo) {
  SCOPED_TRACE(kSeed);
  const Bench bench = PaperBench();
  SolveOptions options = Exact();
  options.inputs.machine_mm = 0.003;
  options.inputs.target_mm = 0.02;
  options.inputs.clamp_eccentricity_mm = 0.015;
  options.inputs.clamp_tilt_rad = 2e-5;
  options.inputs.focal_length_mm = 1e-4;
  options.inputs.camera_offset_mm = 0.01;
  const auto linear = Must(PropagateLinearly(bench.measurement, options, bench.state));
  Random random(kSeed);
  const auto simulated =
      Must(SimulateMeasurements(bench.measurement, options, bench.state, kTrials, random));
  ExpectAgreement(linear.covariance, simulated);
}

/// A calibration whose focal length and distance, and whose middle and angles, go together.
CameraCovariance Calibration() {
  CameraVector sigmas;
  sigmas << 0.002, 0.5, 0.5, 1e-10, 1e-17, 1e-9, 1e-9, 0.01, 0.01, 0.02, 5e-5, 5e-5, 5e-5;
  CameraCovariance correlation = CameraCovariance::Identity();
  const auto correlate = [&](int i, int k, double with) {
    correlation(i, k) = correlation(k, i) = with;
  };
  correlate(0, 9, -0.9);
  correlate(1, 11, 0.8);
  correlate(2, 10, -0.8);
  return sigmas.asDiagonal() * correlation * sigmas.asDiagonal();
}

TEST(PoseUncertainty, AnUncertainCalibrationMovesTheAnswerAsStated) {
  SCOPED_TRACE(kSeed);
  const Bench bench = PaperBench();
  SolveOptions options = Exact();
  options.camera_covariance = Calibration();
  for (const bool focal_length : {false, true}) {
    options.unknowns.focal_length = focal_length;
    SCOPED_TRACE(focal_length);
    Measurement measurement = bench.measurement;
    if (focal_length) {
      // A single distance does not determine the focal length.
      for (std::size_t i = 0; i < measurement.views.size(); i += 2) {
        measurement.views[i].spindle_mm.z() -= 80;
      }
    }
    const auto linear = Must(PropagateLinearly(measurement, options, bench.state));
    SolveOptions exact = options;
    exact.camera_covariance.reset();
    const auto without = Must(PropagateLinearly(measurement, exact, bench.state));
    EXPECT_GT(linear.covariance(0, 0), 4 * without.covariance(0, 0));
    Random random(kSeed);
    const auto simulated =
        Must(SimulateMeasurements(measurement, options, bench.state, kTrials, random));
    ExpectAgreement(linear.covariance, simulated);
  }
}

// At a constant orientation of the spindle an eccentric clamping is a shift of the part, one to one
// and with zero residual.
TEST(PoseUncertainty, EccentricClampingGoesIntoThePartsXAndYWhole) {
  const Bench bench = PaperBench();
  SolveOptions stated = Exact();
  stated.inputs.clamp_eccentricity_mm = 0.015;
  const auto without = PropagateLinearly(bench.measurement, Exact(), bench.state);
  const auto with = PropagateLinearly(bench.measurement, stated, bench.state);
  ASSERT_TRUE(without && with);
  const Eigen::VectorXd added =
      (with->covariance.diagonal() - without->covariance.diagonal()).cwiseAbs().cwiseSqrt();
  EXPECT_NEAR(added[0], 0.015, 1e-5);
  EXPECT_NEAR(added[1], 0.015, 1e-5);
  EXPECT_LT(added.segment<4>(3).maxCoeff(), 1e-7);
}

// The paper's targets stand at the corners of 1.5 x 1 m: 1.803 m may be wrong by 0.0861 mm, so each
// end by 0.0351 mm, 1 sigma, and the middle of four by half of it, in whichever way the part lies.
TEST(PoseUncertainty, TargetsOfWhichNothingIsStatedMoveThePartByHalfOfTheirUsualSize) {
  EXPECT_NEAR(UsualTarget_mm(1802.8), 0.0351, 5e-5);
  EXPECT_NEAR(UsualTarget_mm(0), 0.0204, 5e-5);
  const Bench bench = PaperBench();
  SolveOptions nothing;
  SolveOptions exact;
  exact.inputs.target_mm = 0;
  SolveOptions covariance;
  covariance.target_covariance = Eigen::MatrixXd::Zero(12, 12);
  const auto usual = PropagateLinearly(bench.measurement, nothing, bench.state);
  const auto without = PropagateLinearly(bench.measurement, exact, bench.state);
  const auto known = PropagateLinearly(bench.measurement, covariance, bench.state);
  ASSERT_TRUE(usual && without && known);
  const Eigen::Vector3d added_mm =
      (usual->covariance - without->covariance).diagonal().head<3>().cwiseMax(0).cwiseSqrt();
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(added_mm(axis), UsualTarget_mm(1802.8) / 2, 1e-3) << axis;
    EXPECT_NEAR(known->covariance(axis, axis), without->covariance(axis, axis), 1e-9) << axis;
  }
}

TEST(PoseUncertainty, TooManyTargetsOfWhichNothingIsStatedAreRefusedWithWhatToState) {
  Bench bench = PaperBench();
  for (int i = 0; i < 300; ++i) {
    bench.measurement.targets.push_back({fmt::format("more {}", i), {1.0 * i, 0, 0}});
  }
  EXPECT_THAT(PropagateLinearly(bench.measurement, {}, bench.state),
              FailsWith("state target_mm: 0 if they are exact"));
  EXPECT_TRUE(PropagateLinearly(bench.measurement, Exact(), bench.state));
}

TEST(PoseUncertainty, ErrorsNameTheInput) {
  const Bench bench = PaperBench();
  SolveOptions options = Exact();
  options.inputs.target_mm = -1;
  EXPECT_THAT(PropagateLinearly(bench.measurement, options, bench.state),
              FailsWith("target_mm is -1"));
  Random random(kSeed);
  EXPECT_FALSE(SimulateMeasurements(bench.measurement, Exact(), bench.state, 3, random));
  Bench few = bench;
  few.measurement.views.resize(2);
  EXPECT_THAT(PropagateLinearly(few.measurement, {}, few.state), FailsWith("do not determine"));
  Bench away = bench;
  away.state.machine_from_part.translation_mm.z() += 5000;
  EXPECT_FALSE(PropagateLinearly(away.measurement, {}, away.state));
}

constexpr const char* kToday = "2026-11-22";

struct AnsweredBench {
  explicit AnsweredBench(double turned_rad) {
    test_support::AlignmentWorld world = test_support::BenchWorld(300);
    world.views.push_back(test_support::ViewOf(
        world, 0, geometry::RotationFromAngles({0, 0, turned_rad}), 300, {10, 20}));
    Random random(5);
    test_support::TakePictures(world, 0, random);
    measurement = MeasurementOf(world, 0.05);
    alignment = Solve(measurement, {}).value();
  }
  [[nodiscard]] std::vector<std::string> Found(
      const SolveOptions& options, const std::optional<CalibrationRecord>& calibration = {}) const {
    return Caveats(measurement, options, alignment, calibration, kToday);
  }
  Measurement measurement;
  Alignment alignment;
};

TEST(Caveats, InputsThatLeaveThePlaceOpenAreSpokenOf) {
  AnsweredBench bench(0);
  SolveOptions slip;
  slip.inputs.clamp_eccentricity_mm = 15;  // meant in um
  bench.alignment = Solve(bench.measurement, slip).value();
  EXPECT_THAT(bench.Found(slip), ElementsAre(HasSubstr("leaves the part's place uncertain by 30")));
}

TEST(Caveats, ACameraFromOtherDistancesOrYearsIsSpokenOf) {
  const AnsweredBench bench(std::numbers::pi);
  SolveOptions options;
  options.inputs.clamp_eccentricity_mm = 0.015;
  EXPECT_THAT(bench.Found(options, CalibrationRecord{"2026-11-01", 200, 400}), IsEmpty());
  EXPECT_THAT(bench.Found(options, CalibrationRecord{"2026-11-01", 395, 1430}),
              ElementsAre(HasSubstr("calibrated (2026-11-01) from 395 to 1430 mm")));
  EXPECT_THAT(bench.Found(options, CalibrationRecord{"2024-11-01", 200, 400}),
              ElementsAre(HasSubstr("calibrated 751 days ago")));
}

struct ContributionBench {
  explicit ContributionBench(const SolveOptions& stated) : options(stated) {
    test_support::AlignmentWorld world = test_support::BenchWorld(300);
    Random random(5);
    test_support::TakePictures(world, 0.03, random);
    measurement = MeasurementOf(world, 0.03);
    alignment = Solve(measurement, options).value();
    EXPECT_EQ(alignment.verdict, Verdict::kGood) << alignment.reason;
    parts = ContributionsOf(measurement, options, alignment);
  }
  [[nodiscard]] std::vector<std::string> Names() const {
    std::vector<std::string> names;
    for (const Contribution& part : parts) names.push_back(part.input);
    return names;
  }
  SolveOptions options;
  Measurement measurement;
  Alignment alignment;
  std::vector<Contribution> parts;
};

TEST(Contributions, AreTheStatedFigureFirstThenWhatWouldHelpMostThenThePicturesAlone) {
  const ContributionBench bench({});
  EXPECT_THAT(bench.Names(), ElementsAre("all", "clamp_eccentricity_mm", "target_mm",
                                         "camera_offset_mm", "machine_mm", "pixels"));
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(bench.parts.front().sigma_mm(axis),
                std::sqrt(bench.alignment.covariance(axis, axis)),
                0.02 * bench.parts.front().sigma_mm(axis));
    for (const Contribution& part : bench.parts) {
      EXPECT_LE(part.sigma_mm(axis), 1.0001 * bench.parts.front().sigma_mm(axis)) << part.input;
      EXPECT_GE(part.sigma_mm(axis), 0.9999 * bench.parts.back().sigma_mm(axis)) << part.input;
    }
  }
  EXPECT_TRUE(bench.parts[1].usual);
  EXPECT_EQ(bench.parts[1].size, kUsualEccentricity_mm);
  EXPECT_TRUE(bench.parts[2].usual);
}

}  // namespace

}  // namespace trammel::part_alignment
