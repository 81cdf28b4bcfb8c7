// How far targets are off their stated places, where nobody states it.
#pragma once

#include "part_alignment/pose/pose_problem.h"

namespace trammel::part_alignment {

/// Standard deviation (mm, k = 1) of each coordinate of each target that the residuals of a fit ask
/// for, at least `usual_mm`. Few targets tell little of their scatter: so it is taken as large as
/// puts their share of chi-square, along the directions in which `usual_mm` would show, to what
/// `share` of samples fall below. `usual_mm` where no residual shows the targets' errors.
/// @param problem  its errors.targets those of usual_mm, independent; all else as it counts
/// @param share    0.0001 ... 0.5
[[nodiscard]] double TargetErrorByResiduals(const PoseProblem& problem, const Theta& theta,
                                            double usual_mm, double share);

}  // namespace trammel::part_alignment
