#include "part_alignment/pose/target_errors.h"

#include <cmath>

#include "base/statistics.h"
#include "part_alignment/pose/joint_fit.h"

namespace trammel::part_alignment {

double TargetErrorByResiduals(const PoseProblem& problem, const Theta& theta, double usual_mm,
                              double share) {
  constexpr double kShows_sigma = 1;
  constexpr double kMost = 1e6;
  constexpr double kNear = 1.01;
  const TargetDirections all = DirectionsOfTargets(problem, theta);
  const Eigen::Index count = (all.reach.array() >= kShows_sigma).count();
  if (count == 0) return usual_mm;
  // From the smallest up, so that those that show stand last.
  const auto reach = all.reach.tail(count).array();
  const auto residual = all.residual.tail(count).array();
  const double wanted = ChiSquareQuantile(share, static_cast<int>(count));
  const auto too_small = [&](double times) {
    return (residual.square() / (1 + (times * reach).square())).sum() > wanted;
  };
  double low = 1;
  double high = kMost;
  if (!too_small(low)) return usual_mm;
  while (high > kNear * low) {
    const double middle = std::sqrt(low * high);
    (too_small(middle) ? low : high) = middle;
  }
  return high * usual_mm;
}

}  // namespace trammel::part_alignment
