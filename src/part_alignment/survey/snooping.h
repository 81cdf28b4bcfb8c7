// Finds outliers of a network: single observations by data snooping, and causes of many at once.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "base/random.h"
#include "part_alignment/survey/bundle.h"

namespace trammel::part_alignment {

/// Computes the scatter of the used observations in their stated sigmas, from the median of their
/// residuals: outliers do not count.
[[nodiscard]] double RobustScatter(const Network& network);

/// Drops, round by round, the observation that contradicts the others most in both its picture and
/// its point, and adjusts anew each time. Ends when none exceeds what chance lets expect of all of
/// them together with this probability. Each station retains three observations and each point two.
/// REQUIRES those at the start.
/// @returns the precision of the rest, by least squares.
[[nodiscard]] NetworkPrecision SnoopObservations(const BundleOptions& options, double false_alarm,
                                                 Network& network);

/// Point that unused observations place together elsewhere.
struct DoublePoint {
  std::size_t point = 0;
  std::size_t here = 0;   ///< observations in use
  std::size_t there = 0;  ///< agreeing on the other place
};
/// Finds such points. REQUIRES sigmas that match the observations' scatter.
[[nodiscard]] std::vector<DoublePoint> FindDoublePoints(const Network& network);

/// Point that was elsewhere from one station on.
struct MovedPoint {
  std::size_t point = 0;
  std::size_t first_after = 0;  ///< station
  double by = 0;                ///< length of the motion
};
/// Finds points whose observations contradict one another as one point, but agree as two, before
/// and after one station (stations in the order of time). Uses all observations of placed points
/// and stations, unused ones too.
[[nodiscard]] std::vector<MovedPoint> FindMovedPoints(const Network& network);

/// Change of the part's shape between two stations, of many points together.
struct ShapeStep {
  std::size_t first_after = 0;  ///< station
  std::size_t points = 0;       ///< each changed by more than 0.1 %
  std::size_t most = 0;         ///< the point that changed most in its sigmas
  double by = 0;                ///< amount
};
/// Compares the positions of all points, jointly, before and after each station in turn: half a
/// part may have moved by less than one target alone shows. The threshold is the step that the same
/// stations show in random orders, so a lens that no model describes is no step. Each point counts
/// up to a bound, so one moved point is no step either. REQUIRES a converged network with sigmas
/// that match the observations' scatter.
[[nodiscard]] std::optional<ShapeStep> FindShapeStep(const Network& network, Random& random);

/// Change of the focal length between two stations.
struct FocalStep {
  std::size_t first_after = 0;  ///< station
  double before_px = 0;
  double after_px = 0;
};
/// Solves each station with a focal length of its own, and searches for one step in time.
[[nodiscard]] std::optional<FocalStep> FindFocalStep(const Network& network);

}  // namespace trammel::part_alignment
