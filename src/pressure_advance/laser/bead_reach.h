// How far a bead of its size reaches to either side.
#pragma once

#include <span>
#include <vector>

#include "pressure_advance/laser/bead_section.h"

namespace trammel::pressure_advance {

/// The rows of each frame that a bead of its size covers.
///
/// The band is as wide as the sweep's widest beads; beside most beads it holds plate, whose texture
/// is noise in the area and which shines where light that spreads in the bead comes out again. Each
/// flank's place is a straight line over the area, learnt of the sweep's own beads (least median of
/// squares), and a bead is summed up to a margin beyond it. A bead that stands up further by itself
/// is followed.
/// @param sections  of a sweep's frames, whatever their band.
/// @param tells  per frame: whether its flanks may be learnt of and its band may be narrowed.
/// @param noise_px  1 sigma of one row's height.
/// @returns per frame the rows within its band; the whole band where frames that tell are too few
///     (12) to learn of.
[[nodiscard]] std::vector<Interval> FindReach(std::span<const BeadSection> sections,
                                              const std::vector<bool>& tells, double noise_px);

}  // namespace trammel::pressure_advance
