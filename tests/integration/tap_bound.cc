#include "tap_bound.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

namespace trammel {
namespace {

// Whether c1 d + c2 d^2 + c3 d^3 nowhere falls between 0 and the depth: at the ends and where the
// slope has its extreme.
bool NeverFalls(double c1, double c2, double c3, double depth) {
  const auto slope = [&](double d) { return c1 + d * (2 * c2 + 3 * d * c3); };
  const double extreme = c3 != 0 ? std::clamp(-c2 / (3 * c3), 0.0, depth) : 0;
  return slope(0) >= 0 && slope(extreme) >= 0 && slope(depth) >= 0;
}

}  // namespace

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

SmoothPress NearestSmoothPress(std::span<const double> height_mm, std::span<const double> force_g,
                               double noise_g) {
  constexpr double kReachMm = 0.03;
  constexpr double kStepMm = 1e-4;
  constexpr int kParameters = 5;  // a sloped baseline and three terms of the press
  const auto count = static_cast<Eigen::Index>(height_mm.size());
  const Eigen::Map<const Eigen::VectorXd> force(force_g.data(), count);
  const Eigen::Map<const Eigen::VectorXd> height(height_mm.data(), count);
  Eigen::MatrixXd design(count, kParameters);
  const double unit_mm = std::max(height.cwiseAbs().maxCoeff(), kStepMm);
  SmoothPress nearest{std::numeric_limits<double>::infinity(), 0, {}};
  for (double shift_mm = -kReachMm; shift_mm <= kReachMm; shift_mm += kStepMm) {
    const Eigen::ArrayXd depth = ((shift_mm - height.array()) / unit_mm).max(0.0);
    design.col(0).setOnes();
    design.col(1) = height / unit_mm;
    design.col(2) = depth;
    design.col(3) = depth.square();
    design.col(4) = depth.cube();
    const Eigen::MatrixXd normal = design.transpose() * design;
    const Eigen::VectorXd fitted = normal.ldlt().solve(design.transpose() * force);
    const Eigen::VectorXd smooth = design * fitted;
    const double misfit = (force - smooth).norm() / noise_g;
    if (misfit < nearest.misfit && NeverFalls(fitted(2), fitted(3), fitted(4), depth.maxCoeff())) {
      nearest = {misfit, shift_mm, {smooth.begin(), smooth.end()}};
    }
  }
  return nearest;
}

}  // namespace trammel
