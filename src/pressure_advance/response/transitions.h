// Where along a line the speed changes, and which stretches belong to which change.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/measured.h"
#include "base/result.h"
#include "pressure_advance/profile/line_motion.h"
#include "pressure_advance/profile/line_profile.h"

namespace trammel::pressure_advance {

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

/// Fractions that set the windows apart. The defaults suit lines of 20 mm and more; they were
/// chosen from the footprint of a bead (about 0.5 mm) and the lag of a direct drive.
struct TransitionOptions {
  double before = 0.025;  ///< of the line, before the acceleration's boundary
  /// Of the line, after the deceleration's boundary. The surplus drains with the lag of the *slow*
  /// flow, which is several times the mean lag where the melt thins under shear: at 0.06 laws with
  /// an exponent of 0.3 came out 2 ms low, from 0.1 on no law does.
  double after = 0.10;
  double early_end = 0.62;  ///< of the acceleration's fast stretch: the early window ends here
  double split = kSplitOfFastSegment;  ///< of the fast segment: the acceleration's window ends here
  double plateau_begin = 0.35;         ///< of the fast segment: a steady middle begins …
  double plateau_end = 0.65;  ///< … and ends here, where the line is long enough to have one
  double end_margin = 0.02;   ///< of the line, at both ends: never a reference
  /// In mm from the printed start: never a reference either. There the flow still rises to what is
  /// asked for, over three lags of the slow flow.
  double start_margin_mm = 2.5;
  /// In mm, what `after` is at least: three lags of the slow flow again.
  double after_mm = 3;
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

}  // namespace trammel::pressure_advance
