// How large a sum of squares may be by chance.
#pragma once

namespace trammel::part_alignment {

/// P(chi-square with `freedom` degrees <= value): the regularised incomplete gamma function by its
/// series or continued fraction, right to 1e-12. REQUIRES freedom > 0.
[[nodiscard]] double ChiSquareProbability(double value, int freedom);

/// The value with that probability, 0 < probability < 1, right to 1e-9 of itself.
[[nodiscard]] double ChiSquareQuantile(double probability, int freedom);

}  // namespace trammel::part_alignment
