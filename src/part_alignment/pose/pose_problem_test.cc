#include "part_alignment/pose/pose_problem.h"

#include <gtest/gtest.h>

#include <cmath>

#include "part_alignment/pose/alignment_test_support.h"
#include "part_alignment/pose/measurement.h"
#include "support/matchers.h"

namespace trammel::part_alignment {
using Eigen::Vector3d;
using test_support::AlignmentWorld;
using test_support::BenchWorld;

namespace {

// The numbers come from a program of its own (numpy, fixed-point inversion) written from the paper,
// printed with 12 and 10 digits.
TEST(Measurement, TheWholeChainIsThatOfAnIndependentProgram) {
  View view;
  view.spindle_mm = {120, -30, -230};
  Clamping clamping;
  clamping.angle_rad = 0.0123;
  const Camera camera = CameraOf({});
  const Vector3d point =
      CameraFromPart(camera, clamping, view, {{100, -50, -700}, {0.02, -0.015, 0.4}}, {25, -10, 5});
  EXPECT_LT((point - Vector3d(7.370029958113, -19.644551796912, -144.658310686771)).norm(), 3e-12);
  const auto pixel = Must(Project(camera, point));
  EXPECT_NEAR(pixel.x(), 1144.1885212726, 1e-9);
  EXPECT_NEAR(pixel.y(), 1379.0316892935, 1e-9);
}

const Unknowns kAll{true, true, true, true, true};

/// Somewhere in general: every derivative is far from 0.
Theta SomewhereNear(const PoseProblem& problem, const AlignmentWorld& world) {
  geometry::Pose pose = world.machine_from_part;
  pose.translation_mm += Eigen::Vector3d(3, -2, 4);
  pose.angles_rad += Eigen::Vector3d(0.002, -0.003, 0.001);
  return ThetaOf(problem, pose, {0.02, {0.05, -0.03}, {0.004, -0.006}});
}

/// Columns by finite differences of fourth order.
Eigen::MatrixXd Numeric(const PoseProblem& problem, const Theta& theta) {
  const auto places = [&](const Theta& there) {
    const Chain chain(problem, there, false);
    Eigen::VectorXd all(2 * problem.observations.size());
    for (std::size_t i = 0; i < problem.observations.size(); ++i) {
      Eigen::Vector2d residual;
      EXPECT_TRUE(chain.Residual(problem.observations[i], residual));
      all.segment<2>(2 * static_cast<Eigen::Index>(i)) =
          (problem.observations[i].pixel - residual) / problem.observations[i].sigma_px;
    }
    return all;
  };
  Eigen::MatrixXd jacobian(2 * problem.observations.size(), theta.size());
  for (Eigen::Index k = 0; k < theta.size(); ++k) {
    const bool angle = (k >= 3 && k <= 6) || k == 9 || k == 10;
    const double step = angle ? 1e-5 : 1e-3;
    const auto at = [&](double steps) {
      Theta moved = theta;
      moved[k] += steps * step;
      return places(moved);
    };
    jacobian.col(k) = (8 * (at(1) - at(-1)) - (at(2) - at(-2))) / (12 * step);
  }
  return jacobian;
}

TEST(PoseProblem, AllDerivativesAreThoseOfFiniteDifferencesTo1e7) {
  constexpr double kRelative = 1e-7;
  for (const bool opencv : {false, true}) {
    AlignmentWorld world = BenchWorld();
    world.camera.opencv = opencv;
    Random random(3);
    TakePictures(world, 0, random);
    const auto problem = Must(MakeProblem(MeasurementOf(world, 0.05), kAll));
    const Theta theta = SomewhereNear(problem, world);
    const Eigen::MatrixXd analytic = WeightedJacobian(problem, theta);
    const Eigen::MatrixXd numeric = Numeric(problem, theta);
    ASSERT_EQ(analytic.cols(), kMaxUnknowns);
    for (Eigen::Index k = 0; k < analytic.cols(); ++k) {
      EXPECT_GT(analytic.col(k).norm(), 0);
      EXPECT_LT((analytic.col(k) - numeric.col(k)).norm(), kRelative * analytic.col(k).norm())
          << ParameterNames(kAll)[k];
    }
  }
}

}  // namespace

}  // namespace trammel::part_alignment
