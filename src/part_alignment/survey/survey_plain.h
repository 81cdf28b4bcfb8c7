// Finds the plain targets of a survey after the coded ones have determined its stations.
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

/// Maximum numbers of plain points of a picture and in all, and of plain targets; more are refused.
inline constexpr std::size_t kMaxPlainOfPicture = 2000;
inline constexpr std::size_t kMaxPlainPoints = 60'000;
inline constexpr std::size_t kMaxPlainTargets = 1000;

/// State of a survey's plain points while it is solved.
struct PlainSearch {
  std::size_t first_point = 0;        ///< index of the first plain target among network points
  std::size_t first_observation = 0;  ///< the same of its observations
  /// Fates of each picture's plain points; empty for unused pictures.
  std::vector<std::vector<PlainFate>> fates;
  /// Source of each of the network's observations from the first one on.
  struct Source {
    std::size_t picture = 0;
    std::size_t point = 0;
  };
  std::vector<Source> sources;
  double noise = 1;     ///< scatter of plain points, in their stated sigmas
  std::string refused;  ///< why there is none
};

[[nodiscard]] bool HasPlainPoints(const SurveyInput& input);

/// Matches the plain points of the pictures in use and adds them to the network as points P1, P2, …
/// by their x, with their observations. REQUIRES a network at its least squares with its datum set,
/// and its precision.
/// @param scatter  of the coded targets' centres, in their stated sigmas.
[[nodiscard]] PlainSearch AddPlainTargets(const SurveyInput& input,
                                          const NetworkPrecision& precision, double scatter,
                                          IndexedSurvey& indexed);

/// Removes the plain targets, with all observations that were added since.
void RemovePlainTargets(const PlainSearch& search, IndexedSurvey& indexed);

/// Drops plain targets that moved between two pictures.
void LeaveOutMovedPlain(const PlainSearch& search, IndexedSurvey& indexed,
                        std::vector<std::size_t>& moved);

/// Counts used and unused plain points by fate; REQUIRES the adjusted network.
[[nodiscard]] PlainSummary SummarisePlain(const SurveyInput& input, const PlainSearch& search,
                                          const std::vector<std::size_t>& moved,
                                          const Network& network);

}  // namespace trammel::part_alignment
