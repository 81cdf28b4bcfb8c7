// Checks of a part fit's input, and its scale.
#pragma once

#include <map>
#include <string>

#include "part_alignment/part_fit/part_fit.h"

namespace trammel::part_alignment {

/// The input with directions of length 1. Errors (kInput) as in FitPart.
[[nodiscard]] Result<PartFitInput> CheckedPartFit(const PartFitInput& input,
                                                  const PartFitOptions& options);

struct BarScale {
  double scale = 1;
  double sigma = 0;
  std::string fault;   ///< why the bars cannot be used; empty where they can
  std::string notice;  ///< empty where there is nothing to say
};

/// The factor that brings measured lengths to the calibrated ones, by weighted least squares.
/// REQUIRES a checked input.
[[nodiscard]] BarScale ScaleOf(const PartFitInput& input, const PartFitOptions& options);

}  // namespace trammel::part_alignment
