// A virtual part with plain targets, as a survey is given its pictures; and what became of each.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "part_alignment/survey/survey.h"
#include "sim/survey/survey_pictures.h"

namespace trammel {

struct PlainScene {
  sim::SurveyPartTraits part;
  sim::HandLens lens;
  sim::HandWalk walk;
  sim::SurveyPictureTraits pictures;
  bool discs = true;          ///< ellipses told besides centres
  double stated_of_true = 1;  ///< sigma that is told, of the true one
  double moved_mm = 0;        ///< a plain target, by so much, from the middle picture on
};

struct PlainWorld {
  PlainScene scene;
  sim::SurveyPart part;
  std::vector<sim::HandShot> shots;
  std::vector<sim::SurveyShow> shows;
};

[[nodiscard]] PlainWorld DrawPlainWorld(const PlainScene& scene, std::uint64_t seed);

/// Coded spots by their codes, all others as plain points.
[[nodiscard]] part_alignment::SurveyInput PlainInput(const PlainWorld& world);

/// Results of a network. A plain target counts as *shown* if four pictures or more show it alone
/// and two of their lines of sight are 15 degrees apart; otherwise no method can locate it with a
/// known uncertainty. It does not count if it moved.
struct PlainCounts {
  int shown = 0;
  int found = 0;        ///< of these
  int pairs_shown = 0;  ///< of the shown, those within 10 mm of another
  int pairs_found = 0;
  int beyond = 0;       ///< given besides, of fewer pictures
  int given = 0;        ///< plain ones, all
  int twice = 0;        ///< given again where a target is given already
  int coded_again = 0;  ///< of these: at a coded target's place
  int astray = 0;       ///< farther from every true place than 5 of its sigmas
  int between = 0;      ///< of these: between two of a pair
  int on_screws = 0;    ///< of these: within 8 mm of a screw
  int moved_given = 0;  ///< at the moved target's place, then or later
  double nees = 0;      ///< plain targets found, by the full covariance
  int freedom = 0;
  double coded_nees = 0;
  int coded_freedom = 0;
  double squares_mm2 = 0;  ///< sum over all coordinates found
  double stated_mm2 = 0;
  double worst_mm = 0;
  int coordinates = 0;
};

/// The truth is laid onto the survey by its coded targets, then by all that were found.
[[nodiscard]] PlainCounts CountPlain(const PlainWorld& world, const part_alignment::Survey& survey);

}  // namespace trammel
