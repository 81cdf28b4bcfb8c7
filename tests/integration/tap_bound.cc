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

SmoothPress SmoothPressAt(const QuietPress& quiet, double shift_mm) {
  // Of the presses by a power; from there on they are hardly to be told from cubic ones.
  constexpr double kPowers[] = {0.7, 0.8, 0.9, 1.1, 1.2, 1.3, 1.4, 1.5, 1.7, 2};
  constexpr double kLeastUnitMm = 1e-4;
  const auto count = static_cast<Eigen::Index>(quiet.height_mm.size());
  const Eigen::Map<const Eigen::VectorXd> force(quiet.force_g.data(), count);
  const Eigen::Map<const Eigen::VectorXd> height(quiet.height_mm.data(), count);
  const double unit_mm = std::max(height.cwiseAbs().maxCoeff(), kLeastUnitMm);
  const Eigen::ArrayXd depth = ((shift_mm - height.array()) / unit_mm).max(0.0);
  const double deepest = depth.maxCoeff();
  SmoothPress nearest{std::numeric_limits<double>::infinity(), shift_mm, {}};
  const auto fit = [&](const Eigen::MatrixXd& design, bool straight) {
    const Eigen::MatrixXd normal = design.transpose() * design;
    const Eigen::VectorXd fitted = normal.ldlt().solve(design.transpose() * force);
    const bool presses =
        straight ? fitted(2) > 0 : NeverFalls(fitted(2), fitted(3), fitted(4), deepest);
    const Eigen::VectorXd smooth = design * fitted;
    const double misfit = (force - smooth).norm() / quiet.noise_g;
    if (presses && misfit < nearest.misfit) {
      nearest = {misfit, shift_mm, {smooth.begin(), smooth.end()}};
    }
  };
  Eigen::MatrixXd design(count, 5);
  design.col(0).setOnes();
  design.col(1) = height / unit_mm;
  design.col(2) = depth;
  design.col(3) = depth.square();
  design.col(4) = depth.cube();
  fit(design, false);
  design.conservativeResize(Eigen::NoChange, 3);
  for (const double power : kPowers) {
    design.col(2) = depth.pow(power);
    fit(design, true);
  }
  return nearest;
}

SmoothPress NearestSmoothPress(const QuietPress& quiet) {
  constexpr double kReachMm = 0.03;
  constexpr double kCoarseMm = 5e-4;
  constexpr double kFineMm = 1e-4;
  SmoothPress nearest{std::numeric_limits<double>::infinity(), 0, {}};
  const auto scan = [&](double from_mm, double to_mm, double step_mm) {
    for (double shift_mm = from_mm; shift_mm <= to_mm; shift_mm += step_mm) {
      SmoothPress press = SmoothPressAt(quiet, shift_mm);
      if (press.misfit < nearest.misfit) nearest = std::move(press);
    }
  };
  scan(-kReachMm, kReachMm, kCoarseMm);
  scan(nearest.shift_mm - kCoarseMm, nearest.shift_mm + kCoarseMm, kFineMm);
  return nearest;
}

SmoothPress SmoothPressBeyond(const QuietPress& quiet, const SmoothPress& nearest, double excess) {
  constexpr double kReachMm = 0.01;
  constexpr double kStepMm = 1e-5;
  constexpr double kGrowth = 1.3;
  const double side = nearest.shift_mm < 0 ? -1 : 1;
  SmoothPress press = nearest;
  for (double way_mm = kStepMm; way_mm < kReachMm; way_mm *= kGrowth) {
    press = SmoothPressAt(quiet, nearest.shift_mm + side * way_mm);
    if (press.misfit * press.misfit >= nearest.misfit * nearest.misfit + excess) break;
  }
  return press;
}

}  // namespace trammel
