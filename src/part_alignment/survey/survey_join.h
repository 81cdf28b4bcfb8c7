// Joins pictures that share too few codes with the others, by known plain targets.
#pragma once

#include <cstddef>
#include <vector>

#include "base/random.h"
#include "part_alignment/survey/survey.h"
#include "part_alignment/survey/survey_input.h"

namespace trammel::part_alignment {

/// Resects pictures of which two or three codes are known: from three of them, or two and a plain
/// point taken for any plain target in turn. All known targets, coded and plain, then check the
/// resection by their predicted places. It needs more matches than chance would bring in a
/// millionth of the pictures. Then their codes are intersected, and further pictures resected by
/// these. REQUIRES a network with its plain targets among the points.
/// @param network  the joined stations' observations of plain targets are added to it.
/// @returns the stations that joined.
[[nodiscard]] std::vector<std::size_t> JoinPictures(const SurveyInput& input, std::size_t coded,
                                                    Network& network, Random& random);

}  // namespace trammel::part_alignment
