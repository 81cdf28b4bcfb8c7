// How a printed line was driven: the part of the plan that the analysis needs.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace trammel::pressure_advance {

/// A stretch of a line printed at one speed.
struct Segment {
  double fraction = 0;    ///< of the line's length, (0, 1]; the fractions of a line sum to 1
  double speed_mm_s = 0;  ///< commanded, > 0

  bool operator==(const Segment&) const = default;
};

/// The motion along one line. Length and acceleration may be unknown (a photo tells neither); then
/// positions along the line are fractions of its length.
struct LineMotion {
  std::vector<Segment> segments;    ///< in print order; slow, fast, slow in the usual pattern
  std::optional<double> length_mm;  ///< > 0
  std::optional<double> acceleration_mm_s2;  ///< > 0
};

[[nodiscard]] bool IsSlowFastSlow(const std::vector<Segment>& segments);

/// Share of the fast segment that belongs to the acceleration where the segment has no steady
/// middle; the rest belongs to the deceleration, whose surplus drops where it happens.
inline constexpr double kSplitOfFastSegment = 0.65;

/// Finds a fast segment that is too short for its two speed changes.
///
/// The deceleration must not begin within the acceleration's share: no steady flow would part the
/// two. Virtual lines of a melt that thins under shear then come out up to 2.5 ms high, and as few
/// as 57 % of their intervals hold the truth.
/// @returns the reason with speed, acceleration and length that would do; nothing for a segment
///   that is long enough, for other lines than slow, fast, slow, and without length or
///   acceleration.
[[nodiscard]] std::optional<std::string> FindShortFastSegment(const LineMotion& motion);

}  // namespace trammel::pressure_advance
