// Which stretch of the lines answers to pressure advance at all.
#pragma once

#include <optional>
#include <vector>

#include "base/measured.h"
#include "pressure_advance/profile/line_profile.h"
#include "pressure_advance/response/excess.h"

namespace trammel::pressure_advance {

struct RespondingOptions {
  int bins = 60;           ///< over the window
  double threshold = 0.2;  ///< of the strongest answer: where the stretch ends
  double margin = 0.15;    ///< of the stretch's length, added at both ends
};

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
                                                        bool rising,
                                                        const RespondingOptions& options = {});

}  // namespace trammel::pressure_advance
