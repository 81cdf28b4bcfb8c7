// Which points of several pictures are one plain target: by epipolar bands in pairs of pictures,
// then by all pictures together.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "part_alignment/survey/plain_view.h"

namespace trammel::part_alignment {

struct PlainMatchOptions {
  PlainRoom room;
  /// Places of targets that are known already (their members are not read): what stands there is
  /// theirs.
  std::vector<PlainMatch> known = {};
  /// Chi-square of two degrees up to which a sight is that of a place: 3 sigma.
  double gate = 11.83;
  /// Fewer rays than this beyond those in any one plane with the target are no target, >= 1.
  int least_off_plane = 1;
  /// Ends the search early.
  std::size_t most_targets = SIZE_MAX;
  /// Places that are looked for in all views, before the search gives up.
  std::size_t most_places = 2'000'000;
};

enum class PlainFate : std::uint8_t {
  kFree,       ///< agrees with no two others
  kUsed,       ///< of a target
  kOnePlane,   ///< its rays all lie in one epipolar plane: a row of targets looks so
  kChance,     ///< agrees with too few, where so many points are: may be by chance
  kAmbiguous,  ///< of two targets that exclude one another, or two points at one place
  kResidual,   ///< of a target whose rays miss one another
  kNotStill,   ///< of one that other pictures show beside its place: moved, or a reflection
  kMoved,      ///< of one that stands elsewhere from some picture on
  kCoded,      ///< the disc of a coded target whose code was not read there
  kNoDisc,     ///< of one whose outlines are not those of a round disc
  kMerged,     ///< what a view makes of two neighbours, one disc amid them
};

struct PlainMatches {
  std::vector<PlainMatch> targets;
  std::vector<std::vector<PlainFate>> fates;  ///< of each view's sights
  bool gave_up = false;                       ///< at most_places
};

/// Method: a sight and those in its epipolar bands, within the room, give places (Maas, ISPRS XVII,
/// 1992); a place is a target by the rays that meet there in all views. Those with most rays first,
/// each sight once. Rays off the plane, and lonely ones in it, are the evidence: as many as chance
/// would not bring together among all sights that are free (expected number of false targets below
/// a thousandth), one of them at least off the plane. Two that
/// exclude one another with the same evidence are both left out.
[[nodiscard]] PlainMatches MatchPlainSights(const std::vector<PlainView>& views,
                                            const PlainMatchOptions& options);

}  // namespace trammel::part_alignment
