// Whether there is ink in pieces about a disc, where it cannot be read.
#pragma once

#include <optional>
#include <vector>

#include "base/page.h"
#include "part_alignment/targets/disc_fit.h"
#include "part_alignment/targets/reject_reason.h"

namespace trammel::part_alignment {

struct RingEvidence {
  double contrast = 0;  ///< grey levels, of the disc less what is about it: the median around
  bool uneven = false;  ///< whether light differs about the disc by a quarter of the contrast
  int clear = 0;        ///< directions, of 40, in which the ring is one of two shades
};

/// Absent where nothing, or no ring, is about the disc. Each direction is judged by its own light,
/// and half of them are enough.
/// @param disc   the ellipse to some tenths of the radius; of its contrast only the sign counts.
/// @param noise  of the picture's pixels, grey levels.
[[nodiscard]] std::optional<RingEvidence> FindRingEvidence(const PageView& picture,
                                                           const DiscModel& disc, double noise);

struct UnreadTarget {
  DiscModel disc;
  RingEvidence ring;
  RejectReason reason = RejectReason::kHidden;  ///< where neither light nor contrast is
};

/// Leaves those out that are the same as a clearer one, or look like a disc within its ring.
void LeaveOutParts(std::vector<UnreadTarget>& unread);

}  // namespace trammel::part_alignment
