// Lines that are just as the bound assumes, and an estimator that knows all but what it has to
// learn: whether the bound is one that can be attained.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "base/random.h"
#include "pressure_advance_bound.h"
#include "sim/print/printer_traits.h"

namespace trammel {
namespace {

using test::CovarianceOf, test::Expected, test::kBendSigma, test::kBoundLines,
    test::KnownBeforehand, test::Learnt, test::TestedPa;

double RootMeanSquareOf(const std::vector<double>& values) {
  double squares = 0;
  for (const double value : values) squares += value * value;
  return std::sqrt(squares / static_cast<double>(values.size()));
}

// An estimator that knows all but what has to be learnt, on lines that are just as assumed.
double OracleError(const sim::PrinterTraits& traits, Random& random) {
  const Eigen::Matrix2d covariance = CovarianceOf(traits);
  const Eigen::Matrix2d root = covariance.llt().matrixL();
  const Learnt truth{traits.k_star_s, 1, kBendSigma * random.Normal(), random.Uniform(-0.5, 0.5)};
  std::vector<Eigen::VectorXd> seen;
  Eigen::MatrixXd gradient;
  for (int i = 0; i < kBoundLines; ++i) {
    const Eigen::VectorXd excess = Expected(truth, TestedPa(i), gradient);
    const Eigen::Vector2d noise = root * Eigen::Vector2d(random.Normal(), random.Normal());
    seen.emplace_back(excess + noise.head(excess.rows()));
  }
  Learnt fit{traits.k_star_s};
  constexpr int kIterations = 6;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    Eigen::Matrix4d information = KnownBeforehand();
    Eigen::Vector4d right = -information * Eigen::Vector4d(0, 0, fit.bend, fit.slip);
    for (int i = 0; i < kBoundLines; ++i) {
      const Eigen::VectorXd& line = seen[static_cast<std::size_t>(i)];
      const Eigen::VectorXd excess = Expected(fit, TestedPa(i), gradient);
      const auto rows = std::min(line.rows(), excess.rows());
      const Eigen::MatrixXd weighted =
          gradient.topRows(rows).transpose() * covariance.topLeftCorner(rows, rows).inverse();
      information += weighted * gradient.topRows(rows);
      right += weighted * (line.head(rows) - excess.head(rows));
    }
    const Eigen::Vector4d step = information.ldlt().solve(right);
    fit = {fit.crossing_s + step(0), fit.slope + step(1), fit.bend + step(2), fit.slip + step(3)};
  }
  return fit.crossing_s - truth.crossing_s;
}

TEST(PressureAdvanceBound, IsAttainedWhereLinesAreAsItAssumes) {
  // 20000 draws know an rms error to 0.5 % (1 sigma); that the lines about the crossing may lie on
  // either side of it is not in the bound.
  constexpr int kDraws = 20000;
  constexpr double kShare = 0.04;
  Random random(1000);
  for (const double at_s : {0.034, 0.0365, 0.039}) {
    const sim::PrinterTraits traits = sim::DrawTraits(at_s, random);
    std::vector<double> errors;
    for (int i = 0; i < kDraws; ++i) errors.push_back(OracleError(traits, random));
    const double bound_s = test::BoundOf(traits);
    fmt::print("bound {:.3f} ms, attained {:.3f} ms, bound of a mean {:.3f} ms\n", 1e3 * bound_s,
               1e3 * RootMeanSquareOf(errors), 1e3 * test::MeanBoundOf(traits));
    EXPECT_NEAR(RootMeanSquareOf(errors), bound_s, kShare * bound_s);
  }
}

}  // namespace
}  // namespace trammel
