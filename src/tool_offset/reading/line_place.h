// Where a printed line lies in a row of samples across it.
#pragma once

#include <optional>
#include <span>

namespace trammel::tool_offset {

/// Half of the ink of a line, and all of it.
struct LinePlace {
  double middle = 0;  ///< samples; half of the window's ink lies below it
  double ink = 0;     ///< sum of the samples in the window
};

/// Finds the place that parts the ink in [low, high] into equal halves.
///
/// Why this estimator: it weighs a line's two edges alike (the least that rough edges can do to a
/// position), needs neither the ink's level nor the blur, and whatever is the same on both sides of
/// the line - blur, halo, a resampled pixel grid - cancels. A sample is a block one sample wide, so
/// that for pixels that average over their area nothing is lost: a clean line is found exactly,
/// however few pixels wide. A centroid errs there by up to 0.03 samples and weighs far dirt more.
/// @param ink  zero on paper, positive on ink; noise may be negative.
/// @param low, high  samples; the window's ends, on paper or cut at the same distance from the
/// line.
/// @returns nothing where the window leaves the samples or holds no ink.
[[nodiscard]] std::optional<LinePlace> HalfInkPlace(std::span<const float> ink, double low,
                                                    double high);

}  // namespace trammel::tool_offset
