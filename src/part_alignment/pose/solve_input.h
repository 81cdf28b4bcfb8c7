// From a measurement, as it came from outside, to a problem that can be computed with.
#pragma once

#include "base/result.h"
#include "part_alignment/pose/pose_problem.h"

namespace trammel::part_alignment {

/// Of what is uncertain beside the pixels. The errors are those of Solve, as below.
[[nodiscard]] Result<void> ValidateInputs(const SolveOptions& options);

[[nodiscard]] Result<PoseProblem> MakeProblem(const Measurement& measurement,
                                              const Unknowns& unknowns);

}  // namespace trammel::part_alignment
