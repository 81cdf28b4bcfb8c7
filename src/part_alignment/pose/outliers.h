// Identifies the wrong target, view or observation, if there is one.
#pragma once

#include <string>
#include <vector>

#include "part_alignment/pose/pose_fit.h"

namespace trammel::part_alignment {

struct Outliers {
  std::vector<std::size_t> observations;  ///< left out; empty: nothing explains the residuals
  std::string what;                       ///< "target 7 in view 2"
  Fit fit;                                ///< without the outliers
  std::string doubt;                      ///< not empty: more than one explanation, or none
};

/// Finds the smallest exclusion after which the rest fits its sigmas: one observation; a whole
/// target or view, or two targets of a view with exchanged ids; two observations. Of many
/// observations (more than 60) those that a Cauchy loss shows far off, at most a quarter.
/// RejectionTally limits how much a solution may exclude.
/// An explanation counts only if the rest has redundancy to check it and no other of its kind fits
/// as well.
/// @param all     the fit of all observations, which does not fit.
/// @param labels  the targets' ids, by WeightedObservation::target.
[[nodiscard]] Outliers FindOutliers(const PoseProblem& problem, const Fit& all,
                                    const std::vector<std::string>& labels);

}  // namespace trammel::part_alignment
