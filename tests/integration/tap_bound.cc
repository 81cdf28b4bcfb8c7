#include "tap_bound.h"

#include <Eigen/Dense>
#include <cmath>
#include <limits>

namespace trammel {

double ContactBound(std::span<const double> height_mm, double noise_g, const sim::ContactLaw& law,
                    const PressModel& model) {
  constexpr double kStepMm = 1e-7;     // of the law's slope by a central difference
  constexpr double kUnitMm = 0.01;     // keeps the matrix well conditioned
  constexpr double kSingular = 1e-13;  // reciprocal condition of a matrix that says nothing
  const int baseline = model.sloped_baseline ? 2 : 1;
  const int parameters = 1 + baseline + model.press_terms;
  Eigen::MatrixXd fisher = Eigen::MatrixXd::Zero(parameters, parameters);
  Eigen::VectorXd gradient(parameters);
  for (const double height : height_mm) {
    const double depth_mm = std::max(0.0, -height);
    const double slope_g_mm =
        depth_mm > kStepMm
            ? (ContactForce(law, depth_mm + kStepMm) - ContactForce(law, depth_mm - kStepMm)) /
                  (2 * kStepMm)
            : 0;
    gradient(0) = slope_g_mm * kUnitMm;
    gradient(1) = 1;
    if (model.sloped_baseline) gradient(2) = height / kUnitMm;
    for (int i = 0; i < model.press_terms; ++i) {
      gradient(1 + baseline + i) = std::pow(depth_mm / kUnitMm, i + 1);
    }
    fisher += gradient * gradient.transpose() / (noise_g * noise_g);
  }
  const Eigen::LDLT<Eigen::MatrixXd> factors(fisher);
  if (factors.info() != Eigen::Success || factors.rcond() < kSingular) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  Eigen::VectorXd unit = Eigen::VectorXd::Zero(parameters);
  unit(0) = 1;
  return kUnitMm * std::sqrt(factors.solve(unit)(0));
}

}  // namespace trammel
