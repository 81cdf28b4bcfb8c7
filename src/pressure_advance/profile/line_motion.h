// How a printed line was driven: the part of the plan that the analysis needs.
#pragma once

#include <optional>
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

}  // namespace trammel::pressure_advance
