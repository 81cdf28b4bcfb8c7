#include "part_alignment/pose/repeatability.h"

#include <algorithm>
#include <cmath>

#include "base/statistics.h"
#include "part_alignment/pose/fit.h"
#include "part_alignment/pose/joint_fit.h"

namespace trammel::part_alignment {

double RepeatabilityByResiduals(const PoseProblem& problem, const Theta& theta,
                                bool targets_known) {
  constexpr int kTrialRuns = 4;
  constexpr double kOneInTen = 0.1;
  constexpr double kNear = 1.01;
  PoseProblem tried = problem;
  int freedom = DegreesOfFreedom(problem);
  if (!targets_known) {
    constexpr double kAnyTimes = 1000;
    constexpr double kExplained_sigma = 30;
    tried.errors.targets *= kAnyTimes;
    const Eigen::VectorXd reach = DirectionsOfTargets(tried, theta).reach;
    freedom -= static_cast<int>((reach.array() > kExplained_sigma).count());
  }
  const double wanted = ChiSquareQuantile(kOneInTen, std::max(0, freedom) + kTrialRuns);
  const auto chi_square = JointChiSquareByMachine(tried, theta);
  const auto too_small = [&](double machine_mm) {
    const double share = kUsualRepeatability_mm / machine_mm;
    return chi_square(machine_mm) + kTrialRuns * share * share > wanted;
  };
  double low_mm = kUsualRepeatability_mm / 10;
  double high_mm = 2 * kWorstRepeatability_mm;
  if (too_small(high_mm)) return high_mm;
  while (high_mm > kNear * low_mm) {
    const double middle_mm = std::sqrt(low_mm * high_mm);
    (too_small(middle_mm) ? low_mm : high_mm) = middle_mm;
  }
  return high_mm;
}

}  // namespace trammel::part_alignment
