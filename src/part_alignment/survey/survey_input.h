// Converts a survey's pictures and bars to a network, and checks them.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "part_alignment/survey/network.h"
#include "part_alignment/survey/survey.h"

namespace trammel::part_alignment {

/// Errors (kInput): as of SolveSurvey.
[[nodiscard]] Result<void> CheckSurvey(const SurveyInput& input, const SurveyOptions& options);

/// Explains why the pictures cannot be of one camera: names two of them with their sizes.
[[nodiscard]] std::optional<std::string> MixedPictures(const SurveyInput& input);

/// Checks the places of observations. Errors (kInput): a target or a plain point outside of its
/// picture.
[[nodiscard]] Result<void> CheckPlaces(const SurveyInput& input);

struct IndexedSurvey {
  Network network;                  ///< stations as the pictures, bars that are used
  std::vector<std::string> ids;     ///< point ids; numbers ascending, then texts
  std::size_t coded = 0;            ///< points; what follows them are plain targets
  std::vector<std::size_t> bar_of;  ///< index into the input's bars of each of the network's
  /// Discs of network.observations, for pictures that have them.
  std::vector<std::optional<ImageEllipse>> discs;
  std::vector<bool> corrected;  ///< per observation, true if corrected for perspective
  int longer_side_px = 0;
};

/// Builds the network. Bars whose ends no picture shows are skipped. REQUIRES CheckSurvey and
/// pictures of one size.
[[nodiscard]] IndexedSurvey IndexSurvey(const SurveyInput& input);

}  // namespace trammel::part_alignment
