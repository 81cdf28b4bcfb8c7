#include "part_alignment/pose/fit.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/chi_square.h"
#include "geometry/decompositions.h"
#include "part_alignment/pose/ceres_descend.h"
#include "part_alignment/pose/first_guess.h"
#include "part_alignment/pose/observability.h"

namespace trammel::part_alignment {
namespace {

constexpr double kOneIn = 1e-4;
/// Of an answer that nothing checks: it must fit exactly.
constexpr double kExact = 1e-6;

/// Whether two solutions are different places, not one to its rounding.
bool Differ(const PoseProblem& problem, const Theta& a, const Theta& b) {
  constexpr double kApart = 1e-3;
  const Layout layout = LayoutOf(problem.unknowns);
  const auto turn = [](const Theta& theta) {
    return geometry::RotationFromAngles(theta.segment<3>(3));
  };
  const double clamp = layout.clamp_angle >= 0 ? a[layout.clamp_angle] - b[layout.clamp_angle] : 0;
  return (turn(a) - turn(b)).norm() > kApart ||
         std::abs(std::remainder(clamp, 2 * std::numbers::pi)) > kApart;
}

bool FullRank(const PoseProblem& problem, const Theta& theta) {
  const MiddleFrame frame =
      MiddleFrameOf(problem, geometry::RotationFromAngles(theta.segment<3>(3)));
  const Observability seen =
      Observe(InMiddleFrame(problem, frame), ToMiddleFrame(frame, theta), kUnseen_mm);
  return seen.rank == seen.unknowns;
}

}  // namespace

int DegreesOfFreedom(const PoseProblem& problem) {
  return 2 * static_cast<int>(problem.sights.size()) - LayoutOf(problem.unknowns).size;
}

double ChiSquareHigh(int degrees_of_freedom) {
  return degrees_of_freedom > 0 ? ChiSquareQuantile(1 - kOneIn, degrees_of_freedom) : kExact;
}

double ChiSquareLow(int degrees_of_freedom) {
  return degrees_of_freedom > 0 ? ChiSquareQuantile(kOneIn, degrees_of_freedom) : 0;
}

double BesideShared(const PoseProblem& problem, const Theta& theta, double chi_square) {
  if (problem.shared.empty() || !std::isfinite(chi_square)) {
    return chi_square;
  }
  const Eigen::Index rows = 2 * static_cast<Eigen::Index>(problem.sights.size());
  Eigen::VectorXd residuals(rows);
  Eigen::MatrixXd moves(rows, kCameraParameters);
  const Chain chain(problem, theta, false);
  for (std::size_t i = 0; i < problem.sights.size(); ++i) {
    const Sight& sight = problem.sights[i];
    Eigen::Vector2d residual_px;
    if (!chain.Residual(sight, residual_px)) {
      return chi_square;
    }
    residuals.segment<2>(2 * static_cast<Eigen::Index>(i)) = residual_px / sight.sigma_px;
    moves.middleRows<2>(2 * static_cast<Eigen::Index>(i)) = problem.shared[i] / sight.sigma_px;
  }
  const Eigen::MatrixXd jacobian = WeightedJacobian(problem, theta);
  const Eigen::VectorXd scale = jacobian.colwise().norm().cwiseMax(1e-300).cwiseInverse();
  const geometry::SingularValues of = geometry::DecomposeSingular(jacobian * scale.asDiagonal());
  constexpr double kSingular = 1e-9;
  const Eigen::Index rank = (of.values.array() > kSingular * of.values.maxCoeff()).count();
  const auto taken_up = of.u.leftCols(rank);
  const Eigen::MatrixXd left = moves - taken_up * (taken_up.transpose() * moves);
  const CameraVector pull = left.transpose() * residuals;
  const CameraCovariance stiffness = CameraCovariance::Identity() + left.transpose() * left;
  return chi_square - pull.dot(stiffness.llt().solve(pull));
}

Descent Refine(const PoseProblem& problem, const Theta& guess, SolveMethod method) {
  const MiddleFrame frame =
      MiddleFrameOf(problem, geometry::RotationFromAngles(guess.segment<3>(3)));
  PoseProblem middle = InMiddleFrame(problem, frame);
  Theta theta = ToMiddleFrame(frame, guess);
  Unknowns few;
  few.clamp_angle = problem.unknowns.clamp_angle;
  const int few_count = LayoutOf(few).size;
  if (few_count < theta.size()) {
    middle.unknowns = few;
    theta.head(few_count) = Descend(middle, theta.head(few_count)).theta;
    middle.unknowns = problem.unknowns;
  }
  Descent descent =
      method == SolveMethod::kCeres ? DescendByCeres(middle, theta, 0) : Descend(middle, theta);
  descent.theta = FromMiddleFrame(frame, descent.theta);
  descent.chi_square = BesideShared(problem, descent.theta, descent.chi_square);
  const Layout layout = LayoutOf(problem.unknowns);
  if (layout.clamp_angle >= 0) {
    descent.theta[layout.clamp_angle] =
        std::remainder(descent.theta[layout.clamp_angle], 2 * std::numbers::pi);
  }
  return descent;
}

Fit FitFrom(const PoseProblem& problem, SolveMethod method,
            const std::vector<double>& clamp_angles_rad) {
  constexpr std::size_t kGuesses = 6;
  const double high = ChiSquareHigh(DegreesOfFreedom(problem));
  Fit fit;
  fit.chi_square = std::numeric_limits<double>::infinity();
  std::optional<Theta> best_guess;
  std::vector<Theta> fitting;
  for (const double angle_rad : clamp_angles_rad) {
    for (const Theta& guess : FirstGuesses(problem, angle_rad, kGuesses)) {
      const Descent descent = Refine(problem, guess, SolveMethod::kGaussNewton);
      if (descent.chi_square <= high) {
        fitting.push_back(descent.theta);
      }
      if (descent.chi_square < fit.chi_square) {
        fit = {true, descent.converged, descent.theta, descent.chi_square, descent.steps, {}};
        best_guess = guess;
      }
    }
  }
  if (fit.found && method == SolveMethod::kCeres && FullRank(problem, fit.theta)) {
    // From the same guess, so that the two methods stay a check of one another. Below full rank
    // there is no answer, only a valley that Levenberg's growing steps would run along.
    const Descent descent = Refine(problem, *best_guess, method);
    fit = {true, descent.converged, descent.theta, descent.chi_square, descent.steps, {}};
  }
  for (const Theta& theta : fitting) {
    if (Differ(problem, theta, fit.theta)) {
      fit.other = theta;
    }
  }
  return fit;
}

Fit FitFromNothing(const PoseProblem& problem, SolveMethod method) {
  const Fit near = FitFrom(problem, method, {0});
  if (!problem.unknowns.clamp_angle ||
      (near.found && near.chi_square <= ChiSquareHigh(DegreesOfFreedom(problem)))) {
    return near;
  }
  constexpr int kAround = 24;
  std::vector<double> angles_rad;
  for (int i = 1; i < kAround; ++i) {
    angles_rad.push_back(i * 2 * std::numbers::pi / kAround);
  }
  const Fit far = FitFrom(problem, method, angles_rad);
  return far.found && (!near.found || far.chi_square < near.chi_square) ? far : near;
}

}  // namespace trammel::part_alignment
