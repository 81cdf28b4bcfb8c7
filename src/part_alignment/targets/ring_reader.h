// Reads the ring about a disc: its code, or evidence of pieces of ink that cannot be read.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "base/page.h"
#include "part_alignment/targets/disc_fit.h"
#include "part_alignment/targets/target.h"

namespace trammel::part_alignment {

struct RingEvidence {
  double contrast = 0;  ///< grey levels, of the disc less what is about it: the median around
  bool uneven = false;  ///< true if light around the disc varies by a quarter of the contrast
  int clear = 0;        ///< directions, of 40, in which the ring is one of two shades
};

/// Searches for a ring about the disc; absent if there is none. Each direction is judged by its own
/// light, and half of them are enough.
/// @param disc   the ellipse to some tenths of the radius; of its contrast only the sign counts.
/// @param noise  of the picture's pixels, grey levels.
[[nodiscard]] std::optional<RingEvidence> FindRingEvidence(const PageView& picture,
                                                           const DiscModel& disc, double noise);

struct UnreadTarget {
  DiscModel disc;
  RingEvidence ring;
  RejectReason reason = RejectReason::kHidden;  ///< without light or contrast
};

/// Drops duplicates of a clearer target, and those that look like a disc within its ring.
void LeaveOutParts(std::vector<UnreadTarget>& unread);

enum class RingState {
  kClear,    ///< every segment is one of two shades
  kNone,     ///< all about the disc is as plain as its surroundings
  kUnclear,  ///< a ring, parts of which are covered
  kClutter,  ///< nothing that looks like a ring
  kCutOff,   ///< beyond the picture's border
};

struct RingReading {
  RingState state = RingState::kClutter;
  std::uint32_t word = 0;  ///< bit k: segment k, clockwise from start_rad; with kClear
  double start_rad = 0;    ///< in the W (p - c) plane
};

/// @param disc  about right: centre within a pixel, levels within a quarter of the contrast.
/// @param bits  12, 14 or 20.
[[nodiscard]] RingReading ReadRing(const PageView& picture, const DiscModel& disc, int bits);

/// Returns the shade of the ring that was read, for FitDisc.
[[nodiscard]] RingShade ShadeOf(const RingReading& reading, int bits);

}  // namespace trammel::part_alignment
