// Matching of plain targets across pictures: by epipolar bands in pairs of pictures, then by all
// pictures together.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "part_alignment/survey/plain_view.h"

namespace trammel::part_alignment {

struct PlainMatchOptions {
  PlainRoom room;
  /// Places of known targets (their members are not read); sights there belong to them.
  std::vector<PlainMatch> known = {};
  /// Upper limit of chi-square of two degrees between a sight and its place: 3 sigma.
  double gate = 11.83;
  /// Minimum number of a target's rays beyond those in any one plane with the target, >= 1.
  int min_off_plane = 1;
  /// Number of targets that ends the search early.
  std::size_t max_targets = SIZE_MAX;
  /// Maximum number of places checked in all views before the search stops.
  std::size_t max_places = 2'000'000;
};

enum class PlainFate : std::uint8_t {
  kFree,       ///< agrees with no two others
  kUsed,       ///< part of a target
  kOnePlane,   ///< rays all in one epipolar plane, as of a row of targets
  kChance,     ///< agrees with too few, where so many points are: may be by chance
  kAmbiguous,  ///< two targets exclude one another, or two points share a place
  kResidual,   ///< target's rays do not intersect
  kNotStill,   ///< seen displaced in other pictures: moved, or a reflection
  kMoved,      ///< at another place from some picture on
  kCoded,      ///< the disc of a coded target whose code was not read there
  kNoDisc,     ///< outlines do not fit a round disc
  kMerged,     ///< two neighbours seen as one disc between them
};

struct PlainMatches {
  std::vector<PlainMatch> targets;
  std::vector<std::vector<PlainFate>> fates;  ///< per view and sight
  bool gave_up = false;                       ///< true if at most_places
};

/// Matches sights by epipolar bands. A sight and those in its bands, within the room, yield places
/// (Maas, ISPRS XVII, 1992); the rays that meet there in all views confirm a target. Targets with
/// most rays are first; each sight is used once. Rays off the plane, and lonely ones in it, are the
/// evidence. They must be more than chance would bring together among all free sights (expected
/// number of false targets below a thousandth), with at least one off the plane. Two targets that
/// exclude one another with the same evidence are both dropped.
[[nodiscard]] PlainMatches MatchPlainObservations(const std::vector<PlainView>& views,
                                                  const PlainMatchOptions& options);

}  // namespace trammel::part_alignment
