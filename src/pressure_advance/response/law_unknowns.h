// What a fit of the lag's law has to learn, and what is known of it beforehand.
#pragma once

#include <Eigen/Core>

#include "pressure_advance/response/lag_model.h"

namespace trammel::pressure_advance {

/// Unknowns of a fit: level, tilt, drift, what a swell reads too much, the power of
/// the area that is read, less one, how far along the bed's axis lines are read before their place,
/// then those of the lag.
inline constexpr int kLevel = 0, kTilt = 1, kDrift = 2, kSwell = 3, kPower = 4, kPlace = 5,
                     kOfLag = 6;
inline constexpr int kLagUnknowns = 10;
inline constexpr int kUnknowns = kOfLag + kLagUnknowns;
/// Of the lag's: its seconds, the share of the second stage.
inline constexpr int kLagSeconds = kOfLag, kSecondStage = kOfLag + 5;

using LawVector = Eigen::Matrix<double, kUnknowns, 1>;
using LawMatrix = Eigen::Matrix<double, kUnknowns, kUnknowns>;

/// The mean line's lag.
[[nodiscard]] Lag LagOf(const LawVector& theta);
/// A line's own lag in seconds.
/// @param drift  of the lag over the pattern, relative
/// @param along  of the pattern, -0.5 to 0.5
[[nodiscard]] double LagSecondsAt(double lag_s, double drift, double along);
/// The lag with one unknown moved by a step that stays in its range.
/// @param k  of the lag's unknowns, from 0
/// @param step  signed, is set
[[nodiscard]] Lag Moved(const Lag& lag, int k, double& step);
/// Brings unknowns into their ranges.
void Bound(LawVector& theta);

/// Normal distribution of what is known beforehand.
struct LawPrior {
  LawVector mean;
  LawMatrix information;  ///< inverse covariance; nothing is known of level and lag
};
[[nodiscard]] LawPrior PriorOfLaw();

}  // namespace trammel::pressure_advance
