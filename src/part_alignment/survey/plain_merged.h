// Handles neighbours so close that some views merge the two into one disc.
#pragma once

#include <vector>

#include "part_alignment/survey/plain_matching.h"

namespace trammel::part_alignment {

/// Removes targets that are one disc of two: two neighbours are closer in a view than in any that
/// separates them, and the view shows neither but one disc between them. Such discs of many views
/// meet in the middle between the two like those of a target. A place with most of its rays from
/// such discs is no target. Nor is a place that other views show as two to either side of it, if
/// one of the two has too few views to be a target.
void LeaveMerged(const std::vector<PlainView>& views, const PlainMatchOptions& options,
                 PlainMatches& matches);

}  // namespace trammel::part_alignment
