// Where along a line the speed changes, and which stretches belong to which change.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/measured.h"
#include "base/result.h"
#include "pressure_advance/line_motion.h"
#include "pressure_advance/line_profile.h"

namespace trammel::pressure_advance {

/// A stretch of the line in which all filament that one speed change moves is laid down.
struct TransitionWindow {
  Interval span;                 ///< positions, in the profiles' PositionUnit
  double boundary = 0;           ///< where the commanded speed changes
  double speed_change_mm_s = 0;  ///< > 0 for the acceleration, < 0 for the deceleration
  double fast_length = 0;        ///< part of span that was printed in the fast segment
};

struct TransitionPlan {
  std::vector<Interval> reference;  ///< slow stretches untouched by either transition
  TransitionWindow acceleration;
  TransitionWindow deceleration;
};

/// Fractions of the line's length that set the windows apart. The defaults suit lines of 20 mm and
/// more; they were chosen from the footprint of a bead (about 0.5 mm) and the lag of a direct
/// drive.
struct TransitionOptions {
  double before = 0.025;     ///< of the line, before the acceleration's boundary
  double after = 0.06;       ///< of the line, after the deceleration's boundary
  double split = 0.65;       ///< of the fast segment: the acceleration's window ends here
  double end_margin = 0.02;  ///< of the line, at both ends: never a reference
};

/// Plans the windows for a line with one fast segment between two slower ones.
///
/// The split lies late in the fast segment because the filament that an acceleration holds back is
/// missing over lag * speed (5 mm at 150 mm/s), while a deceleration's surplus drops where it
/// happens.
/// @param longest_lag_s  largest PA tested: at the slow speed the deceleration's window is made to
///   hold four of these where the length of the line is known.
/// @returns an error that names the segments where they are not slow, fast, slow.
[[nodiscard]] Result<TransitionPlan> PlanTransitions(const LineMotion& motion, PositionUnit unit,
                                                     double longest_lag_s,
                                                     const TransitionOptions& options = {});

}  // namespace trammel::pressure_advance
