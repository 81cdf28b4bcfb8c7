#include "tap_length_bound.h"

#include <Eigen/Dense>
#include <algorithm>
#include <limits>

#include "sim/cell/contact_law.h"
#include "tap_miss_bound.h"
#include "tap_study_row.h"

namespace trammel {
namespace {

// Deviations of the noise from the nearest press with a toe that touches at a height.
double DistanceToToes(const QuietPress& quiet, double contact_mm) {
  constexpr double kWidthsMm[] = {0.001, 0.002,  0.003, 0.004,  0.005, 0.006, 0.0075, 0.0085,
                                  0.010, 0.0125, 0.015, 0.0175, 0.02,  0.025, 0.03};
  constexpr double kShares[] = {0.1, 0.14, 0.2, 0.3, 0.4, 0.5};
  constexpr double kRoundings[] = {0, 0.5, 1};
  constexpr double kUnitMm = 0.05;
  const auto count = static_cast<Eigen::Index>(quiet.height_mm.size());
  const Eigen::Map<const Eigen::VectorXd> force(quiet.force_g.data(), count);
  const Eigen::Map<const Eigen::VectorXd> height(quiet.height_mm.data(), count);
  Eigen::MatrixXd design(count, 4);
  design.col(0).setOnes();
  design.col(1) = height / kUnitMm;
  double nearest = std::numeric_limits<double>::infinity();
  sim::ContactLaw law;
  law.stiffness_g_mm = 1 / kUnitMm;  // its force is the depth behind the toe, then
  for (const double width_mm : kWidthsMm) {
    for (const double share : kShares) {
      for (const double rounding : kRoundings) {
        law.toe_mm = width_mm;
        law.toe_share = share;
        law.toe_rounding = rounding;
        for (Eigen::Index i = 0; i < count; ++i) {
          design(i, 2) = sim::ContactForce(law, contact_mm - height(i));
        }
        design.col(3) = design.col(2).cwiseAbs2();
        const Eigen::Vector4d fitted =
            (design.transpose() * design).ldlt().solve(design.transpose() * force);
        const bool presses =
            fitted(2) > 0 && fitted(2) + 2 * fitted(3) * design.col(2).maxCoeff() > 0;
        if (presses) {
          nearest = std::min(nearest, (force - design * fitted).norm() / quiet.noise_g);
        }
      }
    }
  }
  return nearest;
}

}  // namespace

double LeastHalfWidthUm(const QuietPress& smooth, double held, double refused) {
  constexpr double kReachMm = 0.03;
  constexpr double kStepMm = 1e-4;
  const double quantile = NormalQuantile(held);
  double length_um = 0;
  double last = 0;
  for (double at_mm = -kReachMm; at_mm <= kReachMm; at_mm += kStepMm) {
    const double distance =
        std::min(SmoothPressAt(smooth, at_mm).misfit, DistanceToToes(smooth, at_mm));
    const double share = std::max(0.0, NormalShare(quantile - distance) - refused);
    length_um += kUmPerMm * kStepMm * std::min(share, last);  // the lower sum
    last = share;
  }
  return 0.5 * length_um / (1 - refused);
}

}  // namespace trammel
