// Plain targets whose rays meet although nothing stands still there.
#pragma once

#include <vector>

#include "part_alignment/survey/plain_matching.h"

namespace trammel::part_alignment {

/// Leaves out targets that several pictures show close beside their place, where nothing else
/// stands that is seen together with them (a small motion; a reflection, which wanders with the
/// camera), and pairs of which one ends
/// before the other begins (a target put elsewhere).
void DropDoubtful(const std::vector<PlainView>& views, PlainMatches& matches);

}  // namespace trammel::part_alignment
