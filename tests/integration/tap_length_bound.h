// How long intervals have to be that hold the contacts of soft toes, too.
#pragma once

#include "tap_bound.h"

namespace trammel {

/// The least mean half-width of intervals on a smooth press (Pratt 1961, Journal of the American
/// Statistical Association 56, 549-567), in um.
///
/// Their mean length is the integral over all heights of the share that holds a height. Of a height
/// that is the contact of another press, d deviations of the noise away, that share is at least
/// Phi(Phi^-1(held) - d) where the share `held` of the other's intervals holds it (Neyman and
/// Pearson 1933). The other presses here are the smooth ones of tap_bound.h and soft toes in front
/// of a straight or quadratic press: 1 to 30 um wide, at 0.1 to 0.5 of its stiffness, which stiffen
/// at once or from half their depth to one and a half. Some of each are looked at; more would only
/// lengthen the intervals.
/// @param held     Share of the intervals on each of them that hold its contact, 0.5 … 1 - 1e-9.
/// @param refused  Share of the smooth press's taps without an interval, 0 … 0.5.
/// REQUIRES white normal noise.
[[nodiscard]] double LeastHalfWidthUm(const QuietPress& smooth, double held, double refused);

}  // namespace trammel
