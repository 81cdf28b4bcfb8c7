// Speed changes along photographed lines, found from the lines themselves.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "pressure_advance/profile/line_profile.h"

namespace trammel::pressure_advance {

/// Positions of the two speed changes, in line lengths as in the profiles. They may differ from the
/// plan's fractions: a line's first and last part may be under the frame.
struct FoundSegments {
  double fast_begin = 0;    ///< the acceleration: centre of where widths grow with PA
  double fast_end = 0;      ///< the deceleration: centre of where they shrink with PA
  double sigma = 0;         ///< 1 sigma of both
  double significance = 0;  ///< width change with PA at the weaker place, over the scatter
};

/// Dependence of the width on PA, at each place along the lines.
struct WidthTrend {
  std::vector<double> position;  ///< line lengths, from the profiles' position 0
  std::vector<double> slope;     ///< change of width over its line's usual width, from the lowest
                                 ///< tested PA to the highest
  double scatter = 0;            ///< 1 sigma of a slope where nothing happens
};

/// Fits by least squares at each position, over the lines that show it. Empty if fewer than 4 lines
/// with different PA are usable. REQUIRES profiles with the same positions.
[[nodiscard]] WidthTrend MeasureWidthTrend(const std::vector<LineProfile>& profiles);

/// Part of the lines that the trend's positions 0 … 1 cover, in line lengths. May extend beyond the
/// lines' ends.
struct ShownPart {
  double begin = 0, end = 1;

  [[nodiscard]] double InLine(double position) const { return begin + position * (end - begin); }
};

/// Direction and order of the lines, from the trend.
struct TrendReading {
  bool reversed = false;     ///< the lines' printed starts lie at position 1
  bool upside_down = false;  ///< the PA list runs the other way: the first value's line is the last
  double significance = 0;   ///< best reading's, over the scatter
  bool order_compared = false;  ///< true if the other order was tested
  double lead = 0;              ///< of the best reading over the best with the other direction or
                                ///< order, same scale; 0 where the plan cannot tell them apart
  std::optional<FoundSegments> segments;  ///< by the best reading, from the printed start
  ShownPart shown;                        ///< best fit of the plan to the best reading
};

/// Determines direction and order from physics and plan: with rising PA a line becomes wider where
/// it accelerates and thinner where it decelerates. These two positions are after the first
/// `slow_before` and before the last `slow_after` of the line.
/// @param reversed  given if the direction is known; then only the order is determined.
/// @param parts     candidates for the visible part of the lines; not empty. Each reading uses
///                  the part that fits it best, so that its lead is valid whichever is right.
[[nodiscard]] TrendReading ReadTrend(const WidthTrend& trend, double slow_before, double slow_after,
                                     std::optional<bool> reversed,
                                     std::span<const ShownPart> parts);

/// Lists the possible visible parts of lines with only one end, or neither, in view: up to two
/// fifths of a line may be missing. With both ends in view only the whole line is possible.
[[nodiscard]] std::vector<ShownPart> PossibleParts(bool first_end_seen, bool last_end_seen);

}  // namespace trammel::pressure_advance
