// What the paper found under its twelve conditions (its figures 16 and 17, and section V).
#pragma once

#include <array>

#include "sim/print/conditions.h"

namespace trammel::app {

struct PaperFigures {
  double chosen_sd_s = 0;         ///< of the values that 27 patterns chose
  std::array<double, 4> cubic{};  ///< deviation (px) = c0 + c1 p + c2 p^2 + c3 p^3, p in s
  double r_squared = 0;           ///< of that cubic over the lines of all patterns
  double minimum_s = 0;           ///< of that cubic
};

inline constexpr int kPaperPatterns = 27;
/// Share of the patterns on its two black plates whose value lies within a step of the average, as
/// its figure 16 shows it: 106 of 108.
inline constexpr double kPaperWithinStep = 106.0 / 108.0;
/// Section V.B: by how much calibrated lines deviate less than lines without pressure advance.
inline constexpr double kPaperImprovement = 0.804;

[[nodiscard]] PaperFigures PaperOf(const sim::Condition& condition);

}  // namespace trammel::app
