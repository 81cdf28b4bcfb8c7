// Plans the positions of a line's speed changes and the stretches that belong to each.
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "base/measured.h"
#include "base/result.h"
#include "pressure_advance/profile/line_profile.h"
#include "pressure_advance/response/response_options.h"

namespace trammel::pressure_advance {

/// Maximum unread fraction of a transition's window in one piece; above it a line is unusable.
inline constexpr double kMaxUnread = 0.25;

/// Stretch of the line in which all filament moved by one speed change is laid down.
struct TransitionWindow {
  Interval span;                 ///< positions, in the profiles' PositionUnit
  double boundary = 0;           ///< commanded speed change
  double speed_change_mm_s = 0;  ///< > 0 for the acceleration, < 0 for the deceleration
  double fast_length = 0;        ///< part of span that was printed in the fast segment
  double ramp_length = 0;        ///< part of that on which the speed changes; 0 where unknown
};

struct TransitionPlan {
  std::vector<Interval> reference;  ///< two stretches untouched by either transition
  TransitionWindow acceleration;
  TransitionWindow deceleration;
  bool steady_middle = false;  ///< whether the fast segment's middle is a reference
  /// Window for the acceleration's tail: the same, ending earlier. Empty (lo == hi) with a steady
  /// middle, where the tail has passed, and if the window extends into the next ramp.
  Interval early;
  /// Pressure advances whose lines are even again in the last reference (SettledLines).
  Interval settled_s{-std::numeric_limits<double>::infinity(),
                     std::numeric_limits<double>::infinity()};
};

/// Plans the windows for a line with one fast segment between two slower ones.
///
/// On a short line (the paper's) the filament held back by an acceleration is missing over most of
/// the fast segment (lag * speed: 5 mm at 150 mm/s). So the two windows share it, split late
/// because a deceleration's surplus drops immediately, and the slow stretches are the reference. If
/// the fast segment has a steady middle, that middle and the last slow stretch are the reference:
/// nearer to the transitions, and free of effects at a line's start. A photo does not show the
/// line's length; its lines are assumed to have such a middle.
/// @param longest_lag_s  maximum tested PA. Four of these must pass before a middle is steady,
///   and must fit after the deceleration.
/// @returns an error that names the segments if they are not slow, fast, slow.
[[nodiscard]] Result<TransitionPlan> PlanTransitions(const LineMotion& motion, PositionUnit unit,
                                                     double longest_lag_s,
                                                     const TransitionOptions& options = {});

/// Returns the pressure advances whose lines are even again to 1 % where the last reference begins.
/// Too low, the filament that is left over drains with a linear lag; too high, no filament flows
/// until the drive has pushed what it drew back. The four lines nearest to the lag always count.
/// @param lag_s      > 0, as far as it is known yet
/// @param pa_s       tested values, s
/// @param unit_mm    one unit of the plan's positions
/// @param slow_mm_s  speed after the deceleration
[[nodiscard]] Interval SettledLines(double lag_s, std::vector<double> pa_s,
                                    const TransitionPlan& plan, double unit_mm, double slow_mm_s);

/// Narrows a window to the stretch where the reading changes with pressure advance. Outside it an
/// integral gathers only noise and uneven light.
///
/// In each bin along the window, the slope of the relative reading over pressure advance is the
/// median of the slopes between all pairs of lines (Theil 1950, Sen 1968). The stretch is grown in
/// both directions from the bin with the strongest slope of the expected sign, until the slope
/// falls below the threshold.
/// @param rising  true if the reading rises with pressure advance there (acceleration), false if it
/// falls.
/// @param margin  added at both ends, relative to the stretch's length.
/// @returns nothing if no bin's response exceeds the others' scatter; else a part of `window`.
[[nodiscard]] std::optional<Interval> RespondingStretch(const std::vector<LineProfile>& profiles,
                                                        Reading reading, const Interval& window,
                                                        bool rising, double margin);

/// Names the stretch of a transition that no frame shows: "no frame shows the line from 17.2 to
/// 21.4 mm". Empty if each window is sampled as densely as MeasureSurplus requires (kMaxUnread),
/// and if the sweep's frames are that far apart throughout: a gap is longer than three usual steps.
/// @param frame_positions_mm  as in ScanLine; at least two of them present, or the answer is empty
/// @param plan                in mm
[[nodiscard]] std::string NameUnseenStretch(
    const std::vector<std::optional<double>>& frame_positions_mm, const TransitionPlan& plan);

}  // namespace trammel::pressure_advance
