// Neighbours so close that some views make one disc of the two.
#pragma once

#include <vector>

#include "part_alignment/survey/plain_matching.h"

namespace trammel::part_alignment {

/// Takes from the targets what is one disc of two: where two neighbours stand nearer to one another
/// in a view than in any that tells them apart, and the view shows neither but one disc amid them.
/// Such discs of many views meet in the middle between the two as those of a target do; what has
/// most of its rays of them is none. So is what other views show as two to either side of it,
/// where one of the two is seen too seldom to be a target.
void LeaveMerged(const std::vector<PlainView>& views, const PlainMatchOptions& options,
                 PlainMatches& matches);

}  // namespace trammel::part_alignment
