// How well a machine repeats, where nobody states it.
#pragma once

#include "part_alignment/pose/input_uncertainty.h"
#include "part_alignment/pose/pose_problem.h"

namespace trammel::part_alignment {

/// The worst that a machine is taken to repeat, per axis, k = 1: residuals that contradict it are
/// contradicted by something else.
constexpr double kWorstRepeatability_mm = 0.010;

/// Repeatability of the machine's axes (mm, k = 1) that the residuals of a fit ask for, beside what
/// is known of usual machines: kUsualRepeatability_mm, as if from four trial runs. Of few degrees
/// of freedom a scatter is badly known, and a region stated by it would hold too little; so it is
/// taken as large as puts chi-square, trial runs and all, to what one in ten falls below. At most
/// twice kWorstRepeatability_mm. Of PoseProblem::errors all but the machine's counts.
/// @param targets_known  false: the targets' errors are of no known size, so that residuals which
///                       they can explain tell nothing of the machine
[[nodiscard]] double RepeatabilityByResiduals(const PoseProblem& problem, const Theta& theta,
                                              bool targets_known);

}  // namespace trammel::part_alignment
