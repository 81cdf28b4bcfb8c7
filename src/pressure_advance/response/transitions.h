// Plans where along a line the speed changes, and which stretches belong to which change.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/measured.h"
#include "base/result.h"
#include "pressure_advance/profile/line_profile.h"
#include "pressure_advance/response/response_options.h"

namespace trammel::pressure_advance {

/// Of a transition's window: a line is unusable where more than this is unread in one piece.
inline constexpr double kMostUnread = 0.25;

/// A stretch of the line in which all filament that one speed change moves is laid down.
struct TransitionWindow {
  Interval span;                 ///< positions, in the profiles' PositionUnit
  double boundary = 0;           ///< where the commanded speed changes
  double speed_change_mm_s = 0;  ///< > 0 for the acceleration, < 0 for the deceleration
  double fast_length = 0;        ///< part of span that was printed in the fast segment
  double ramp_length = 0;        ///< part of that on which the speed changes; 0 where unknown
};

struct TransitionPlan {
  std::vector<Interval> reference;  ///< two stretches untouched by either transition
  TransitionWindow acceleration;
  TransitionWindow deceleration;
  bool steady_middle = false;  ///< whether the fast segment's middle is a reference
  /// Where the acceleration's tail is judged from: its window, ending earlier. Empty (lo == hi)
  /// with a steady middle, where the tail has passed, and where the window reaches into the next
  /// ramp.
  Interval early;
};

/// Plans the windows for a line with one fast segment between two slower ones.
///
/// On a short line (the paper's) the filament that an acceleration holds back is missing over most
/// of the fast segment (lag * speed: 5 mm at 150 mm/s), so the two windows share it, split late
/// because a deceleration's surplus drops where it happens, and the slow stretches are the
/// reference. Where the fast segment has a steady middle, that middle and the last slow stretch are
/// the reference: nearer to the transitions, and free of what happens at a line's start. A photo
/// does not tell the line's length; its lines are taken to have such a middle.
/// @param longest_lag_s  largest PA tested. Four of these must pass before a middle is steady, and
/// must fit
///   behind the deceleration.
/// @returns an error that names the segments where they are not slow, fast, slow.
[[nodiscard]] Result<TransitionPlan> PlanTransitions(const LineMotion& motion, PositionUnit unit,
                                                     double longest_lag_s,
                                                     const TransitionOptions& options = {});

/// Narrows a window to the stretch where the reading changes with pressure advance. Outside it an
/// integral gathers only noise and uneven light.
///
/// In each bin along the window, the slope of the relative reading over pressure advance is the
/// median of the slopes between all pairs of lines (Theil 1950, Sen 1968). The stretch is grown
/// from the bin with the strongest slope of the expected sign, in both directions, until the slope
/// falls below the threshold.
/// @param rising  whether the reading rises with pressure advance there (acceleration) or falls.
/// @returns nothing where no bin's answer stands out from the others' scatter; otherwise a part of
/// `window`.
[[nodiscard]] std::optional<Interval> RespondingStretch(const std::vector<LineProfile>& profiles,
                                                        Reading reading, const Interval& window,
                                                        bool rising);

/// Names the stretch of a transition that no frame shows: "no frame shows the line from 17.2 to
/// 21.4 mm". Empty where each window is seen as densely as MeasureExcess asks (kMostUnread), and
/// where the sweep's frames are that far apart throughout: a gap is longer than three usual steps.
/// @param frame_positions_mm  as in ScanLine; at least two of them present, or the answer is empty
/// @param plan                in mm
[[nodiscard]] std::string NameUnseenStretch(
    const std::vector<std::optional<double>>& frame_positions_mm, const TransitionPlan& plan);

}  // namespace trammel::pressure_advance
