// The ring about a disc: which segments are inked, or why that cannot be told.
#pragma once

#include <cstdint>

#include "base/page.h"
#include "part_alignment/targets/disc_fit.h"

namespace trammel::part_alignment {

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
  double start_rad = 0;    ///< in the plane of W (p - c)
};

/// @param disc  about right: centre within a pixel, levels within a quarter of the contrast.
/// @param bits  12, 14 or 20.
[[nodiscard]] RingReading ReadRing(const PageView& picture, const DiscModel& disc, int bits);

/// The ring that was read, for FitDisc.
[[nodiscard]] RingShade ShadeOf(const RingReading& reading, int bits);

}  // namespace trammel::part_alignment
