#include "part_alignment/pose/fit.h"

#include <cmath>
#include <limits>
#include <numbers>

#include "base/statistics.h"
#include "part_alignment/pose/ceres_descend.h"
#include "part_alignment/pose/first_guess.h"
#include "part_alignment/pose/joint_fit.h"
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

}  // namespace

int DegreesOfFreedom(const PoseProblem& problem) {
  return 2 * static_cast<int>(problem.observations.size()) - LayoutOf(problem.unknowns).size;
}

bool FullRank(const PoseProblem& problem, const Theta& theta) {
  const MiddleFrame frame =
      MiddleFrameOf(problem, geometry::RotationFromAngles(theta.segment<3>(3)));
  const Observability seen =
      Observe(InMiddleFrame(problem, frame), ToMiddleFrame(frame, theta), kUnseen_mm);
  return seen.rank == seen.unknowns;
}

double ChiSquareHigh(int degrees_of_freedom) {
  return degrees_of_freedom > 0 ? ChiSquareQuantile(1 - kOneIn, degrees_of_freedom) : kExact;
}

double ChiSquareLow(int degrees_of_freedom) {
  return degrees_of_freedom > 0 ? ChiSquareQuantile(kOneIn, degrees_of_freedom) : 0;
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
  descent.chi_square = JointChiSquare(problem, descent.theta);
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

Fit SolveWithoutInitialGuess(const PoseProblem& problem, SolveMethod method) {
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
