// Which target, view or observation is wrong, when something is.
#pragma once

#include <string>
#include <vector>

#include "part_alignment/pose/pose_fit.h"

namespace trammel::part_alignment {

struct Outliers {
  std::vector<std::size_t> observations;  ///< left out; empty: nothing explains the residuals
  std::string what;                       ///< "target 7 in view 2"
  Fit fit;                                ///< of the others
  std::string doubt;                      ///< not empty: more than one explanation, or none
};

/// Looks for the least that, left out, makes the rest fit its sigmas: one observation; a target or
/// a view altogether or two targets of a view with one another's ids; two observations. Of many
/// observations (more than 60) those that a Cauchy loss leaves far off, at most a quarter: how much
/// may be left out of an answer is RejectionTally's to say.
/// An explanation counts only if the rest has redundancy to check it and no other of its kind does
/// as well.
/// @param all     the fit of all observations, which does not fit.
/// @param labels  the targets' ids, by WeightedObservation::target.
[[nodiscard]] Outliers FindOutliers(const PoseProblem& problem, const Fit& all,
                                    const std::vector<std::string>& labels);

}  // namespace trammel::part_alignment
