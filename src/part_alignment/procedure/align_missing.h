// What the pictures of a part should show and do not.
#pragma once

#include <string>
#include <vector>

#include "part_alignment/pose/solve.h"
#include "part_alignment/procedure/align_measure.h"

namespace trammel::procedure {

/// One line for each target that a view should show by the solution and that was not read, with why
/// what is there was rejected, if it was; none unless the verdict is good.
[[nodiscard]] std::vector<std::string> MissingTargets(const MeasureOutcome& outcome,
                                                      const part_alignment::Alignment& alignment);

}  // namespace trammel::procedure
