// Centres of discs from the centres of their images: what perspective puts between the two.
#pragma once

#include <optional>
#include <vector>

#include "part_alignment/survey/network.h"
#include "part_alignment/targets/image_ellipse.h"

namespace trammel::part_alignment {

/// Fits each placed point's disc (normal, radius) to the shapes of its images: to first order an
/// image's second moments are J P J^T with J the projection's derivative and
/// P = radius² (1 - normal normal^T), which is linear in P. Then takes the eccentricity
/// (targets/eccentricity.h) out of the point's observations, and a tenth of it into their sigmas.
/// Where the images give no disc, the sigmas take all that it may be, a² sin(tilt) / f.
/// @param discs  of each of network.observations; absent where the shape is not known: nothing is
/// done.
void CorrectDiscs(const std::vector<std::optional<ImageEllipse>>& discs, Network& network);

}  // namespace trammel::part_alignment
