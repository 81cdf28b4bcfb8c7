// From a measurement, as it came from outside, to a problem that can be computed with.
#pragma once

#include <cstddef>

#include "base/result.h"
#include "part_alignment/pose/pose_problem.h"

namespace trammel::part_alignment {

/// Errors (kInput) say what a covariance of the targets' coordinates is not: of their size, of
/// numbers, symmetric, nowhere below 0.
[[nodiscard]] Result<void> ValidateTargetCovariance(const Eigen::MatrixXd& covariance,
                                                    std::size_t target_count);

/// The options' inputs as they count for a measurement: usual sizes in place of what is not stated.
[[nodiscard]] InputUncertainty CountedInputs(const Measurement& measurement,
                                             const SolveOptions& options);

/// With the errors of the inputs, usual sizes in place of what is not stated. The errors are those
/// of Solve, as below.
[[nodiscard]] Result<PoseProblem> MakeProblem(const Measurement& measurement,
                                              const SolveOptions& options);

/// Without errors of inputs.
[[nodiscard]] Result<PoseProblem> MakeProblem(const Measurement& measurement,
                                              const Unknowns& unknowns);

}  // namespace trammel::part_alignment
