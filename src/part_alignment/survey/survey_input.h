// A survey's pictures and bars as a network, and what is wrong with them.
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

/// Why the pictures cannot be of one camera: two of them by name with their sizes.
[[nodiscard]] std::optional<std::string> MixedPictures(const SurveyInput& input);

/// Errors (kInput): a target or a plain point outside of its picture.
[[nodiscard]] Result<void> CheckPlaces(const SurveyInput& input);

struct IndexedSurvey {
  Network network;                  ///< stations as the pictures, bars that are used
  std::vector<std::string> ids;     ///< of the points; numbers ascending, then texts
  std::size_t coded = 0;            ///< points; what follows them are plain targets
  std::vector<std::size_t> bar_of;  ///< index into the input's bars of each of the network's
  /// Of each of network.observations, where its picture has discs.
  std::vector<std::optional<ImageEllipse>> discs;
  std::vector<bool> corrected;  ///< of each, whether perspective is taken out of it
  int longer_side_px = 0;
};

/// Bars whose ends no picture shows are left out. REQUIRES CheckSurvey and pictures of one size.
[[nodiscard]] IndexedSurvey IndexSurvey(const SurveyInput& input);

}  // namespace trammel::part_alignment
