// Checks of a part fit's input, and its scale.
#pragma once

#include "part_alignment/part_fit/part_fit.h"
#include "part_alignment/part_fit/scale_bars.h"

namespace trammel::part_alignment {

/// The input with directions of length 1. Errors (kInput) as in FitPart.
[[nodiscard]] Result<PartFitInput> CheckedPartFit(const PartFitInput& input,
                                                  const PartFitOptions& options);

/// The factor that brings measured lengths to the calibrated ones, the bars tested against one
/// another; without bars 1, unchecked. A fault, too, where it is farther from 1 than
/// most_scale_change. REQUIRES a checked input.
[[nodiscard]] BarScale ScaleOf(const PartFitInput& input, const PartFitOptions& options);

}  // namespace trammel::part_alignment
