// The plain targets of a survey: found once its stations are known by the coded ones.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "part_alignment/survey/bundle.h"
#include "part_alignment/survey/plain_matching.h"
#include "part_alignment/survey/survey.h"
#include "part_alignment/survey/survey_input.h"

namespace trammel::part_alignment {

/// More plain points than these are refused: of a picture, of all of them, and targets.
inline constexpr std::size_t kMostPlainOfPicture = 2000;
inline constexpr std::size_t kMostPlainPoints = 60'000;
inline constexpr std::size_t kMostPlainTargets = 1000;

/// What becomes of the plain points of a survey while it is solved.
struct PlainSearch {
  std::size_t first_point = 0;        ///< of the network's points the first that is a plain target
  std::size_t first_observation = 0;  ///< the same of its observations
  /// Of each picture's plain points; empty of a picture that is not used.
  std::vector<std::vector<PlainFate>> fates;
  /// Of each of the network's observations from the first one on.
  struct Source {
    std::size_t picture = 0;
    std::size_t point = 0;
  };
  std::vector<Source> sources;
  double noise = 1;     ///< what plain points scatter by, in their stated sigmas
  std::string refused;  ///< why none is given
};

[[nodiscard]] bool HasPlainPoints(const SurveyInput& input);

/// Matches the plain points of the pictures in use and adds them to the network as points P1, P2, …
/// by their x, with their observations. REQUIRES a network at its least squares with its datum
/// laid, of which this is the precision.
/// @param scatter  of the coded targets' centres, in their stated sigmas.
[[nodiscard]] PlainSearch AddPlainTargets(const SurveyInput& input,
                                          const NetworkPrecision& precision, double scatter,
                                          IndexedSurvey& indexed);

/// Takes them out again, with all observations that were added since.
void RemovePlainTargets(const PlainSearch& search, IndexedSurvey& indexed);

/// Leaves out plain targets that moved between two pictures.
void LeaveOutMovedPlain(const PlainSearch& search, IndexedSurvey& indexed,
                        std::vector<std::size_t>& moved);

/// What was found of what the pictures show; REQUIRES the adjusted network.
[[nodiscard]] PlainSummary SummarisePlain(const SurveyInput& input, const PlainSearch& search,
                                          const std::vector<std::size_t>& moved,
                                          const Network& network);

}  // namespace trammel::part_alignment
