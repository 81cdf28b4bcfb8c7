// Kneedle, the elbow finder that the write-up dropped. Kept to show why.
#pragma once

#include <cstddef>

#include "tap/samples/line_fit.h"

namespace trammel::tap {

/// The bend of a curve, as Kneedle finds it (Satopaa, Albrecht, Irwin, Raghavan 2011, offline form,
/// sensitivity 1): the curve is smoothed and scaled into the unit square, its distance above the
/// diagonal taken, and the first local maximum after which that distance falls by more than the
/// mean spacing is the knee. Noise makes local maxima; the first one that qualifies need not lie at
/// the bend.
///
/// The paper smooths with a spline whose stiffness is the user's; here it is the mean of nine
/// samples, wider would round a collision of four samples away.
/// @param late_bend  True where the curve starts flat and ends steep (a collision), false where it
///                   starts steep and ends flat (the end of a press, or a break).
/// @returns a sample of first … end - 1 that begins the right line, or the farthest from the
/// diagonal
///          where no maximum qualifies; `end` for fewer than four samples or a curve without
///          height.
[[nodiscard]] std::size_t FindKnee(const Samples& samples, std::size_t first, std::size_t end,
                                   bool late_bend);

}  // namespace trammel::tap
