// Outliers of a network: single observations by data snooping, and what makes many of them at once.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "base/random.h"
#include "part_alignment/survey/bundle.h"

namespace trammel::part_alignment {

/// Scatter of the used observations in their stated sigmas, from the median of their residuals:
/// outliers do not count.
[[nodiscard]] double RobustScatter(const Network& network);

/// Leaves out, round by round, the observation that contradicts the others most in both its picture
/// and its point, adjusting anew each time, until none exceeds what chance lets expect of all of
/// them together with this probability. Leaves each station three observations and each point two.
/// REQUIRES those to begin with.
/// @returns the precision of what is left, by least squares.
[[nodiscard]] NetworkPrecision SnoopObservations(const BundleOptions& options, double false_alarm,
                                                 Network& network);

/// A point that unused observations put together at another place.
struct DoublePoint {
  std::size_t point = 0;
  std::size_t here = 0;   ///< observations in use
  std::size_t there = 0;  ///< that agree on the other place
};
/// REQUIRES sigmas that the observations scatter by.
[[nodiscard]] std::vector<DoublePoint> FindDoublePoints(const Network& network);

/// A point that was elsewhere from one station on.
struct MovedPoint {
  std::size_t point = 0;
  std::size_t first_after = 0;  ///< station
  double by = 0;                ///< length of the motion
};
/// Points whose observations contradict one another as one point, and agree as two, before and
/// after one station (stations in the order of time). Looks at all observations of placed points
/// and stations, the unused ones too.
[[nodiscard]] std::vector<MovedPoint> FindMovedPoints(const Network& network);

/// A change of the part's shape between two stations, of many points together.
struct ShapeStep {
  std::size_t first_after = 0;  ///< station
  std::size_t points = 0;       ///< that changed, each by itself beyond 0.1 %
  std::size_t most = 0;         ///< the point that changed most in its sigmas
  double by = 0;                ///< how far
};
/// Compares where the stations before and after each station in turn have all points, jointly: of
/// half a part each target may have moved by less than shows in it alone. What the step exceeds is
/// what the same stations show in random orders, so that a lens that no model describes is none.
/// Each point counts up to a bound, so that one that moved is none either.
/// REQUIRES a network at rest with sigmas that the observations scatter by.
[[nodiscard]] std::optional<ShapeStep> FindShapeStep(const Network& network, Random& random);

/// A change of the focal length between two stations.
struct FocalStep {
  std::size_t first_after = 0;  ///< station
  double before_px = 0;
  double after_px = 0;
};
/// Solves each station with a focal length of its own, and looks for one step in time.
[[nodiscard]] std::optional<FocalStep> FindFocalStep(const Network& network);

}  // namespace trammel::part_alignment
