// Where the speed changes along photographed lines, found from the lines themselves.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "pressure_advance/profile/line_profile.h"

namespace trammel::pressure_advance {

/// Positions of the two speed changes, in line lengths as the profiles count them. They need not be
/// the plan's fractions: a line's first and last bit may lie under the frame.
struct FoundSegments {
  double fast_begin = 0;    ///< the acceleration: centre of where widths grow with PA
  double fast_end = 0;      ///< the deceleration: centre of where they shrink with PA
  double sigma = 0;         ///< 1 sigma of both
  double significance = 0;  ///< of the weaker one's change of width with PA, over the scatter
};

/// How the width at each place along the lines goes with PA.
struct WidthTrend {
  std::vector<double> position;  ///< line lengths, from the profiles' position 0
  std::vector<double> slope;     ///< change of width over its line's usual width, from the lowest
                                 ///< tested PA to the highest
  double scatter = 0;            ///< 1 sigma of a slope where nothing happens
};

/// Least squares at each place, over the lines that see it. Empty where fewer than 4 lines with
/// different PA are usable. REQUIRES profiles with the same positions.
[[nodiscard]] WidthTrend MeasureWidthTrend(const std::vector<LineProfile>& profiles);

/// The part of the lines that the trend's positions 0 … 1 are, in line lengths. Beyond the ends of
/// the lines where it is larger.
struct ShownPart {
  double begin = 0, end = 1;

  [[nodiscard]] double InLine(double position) const { return begin + position * (end - begin); }
};

/// What the trend says about the lines' direction and order.
struct TrendReading {
  bool reversed = false;     ///< the lines' printed starts lie at position 1
  bool upside_down = false;  ///< the PA list runs the other way: the first value's line is the last
  double significance = 0;   ///< of the best reading, over the scatter
  bool order_compared = false;  ///< whether the other order was among the readings
  double lead = 0;              ///< of the best reading over the best with the other direction or
                                ///< order, same scale; 0 where the plan cannot tell them apart
  std::optional<FoundSegments> segments;  ///< as the best reading sees them, from the printed start
  ShownPart shown;                        ///< with which the plan fits the best reading best
};

/// Reads direction and order from physics and plan: with rising PA a line grows wider where it
/// accelerates and thinner where it decelerates, and these two places lie behind `slow_before` and
/// before `slow_after` of the line.
/// @param reversed  given where the direction is known; then only the order is judged.
/// @param parts     what the trend may show of the lines; not empty. Each reading has the part that
///                  suits it best, so that its lead holds whichever is right.
[[nodiscard]] TrendReading ReadTrend(const WidthTrend& trend, double slow_before, double slow_after,
                                     std::optional<bool> reversed,
                                     std::span<const ShownPart> parts);

/// What a trend may show of lines one end of which, or neither, is seen: up to two fifths of a line
/// may be missing. The only one is the whole line where both ends are seen.
[[nodiscard]] std::vector<ShownPart> PossibleParts(bool first_end_seen, bool last_end_seen);

}  // namespace trammel::pressure_advance
