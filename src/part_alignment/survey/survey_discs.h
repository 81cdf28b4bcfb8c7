// Centres of discs from the centres of their images: what perspective puts between the two.
#pragma once

#include <optional>
#include <vector>

#include "part_alignment/survey/network.h"
#include "part_alignment/targets/image_ellipse.h"

namespace trammel::part_alignment {

struct ObjectDisc {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  double radius = 0;
};

/// An image of a disc: what a view makes of small steps of its place, and its second moments, four
/// times those of its area.
struct DiscShape {
  Eigen::Matrix<double, 2, 3> by_place;
  Eigen::Matrix2d moments;
};

/// Semi-axes squared along their directions, px².
[[nodiscard]] Eigen::Matrix2d MomentsOf(const ImageEllipse& disc);

/// The round disc that looks so from all sides, to first order; absent where none does, and of
/// fewer than three images.
[[nodiscard]] std::optional<ObjectDisc> DiscOf(const std::vector<DiscShape>& shapes);

/// Fits each placed point's disc (normal, radius) to the shapes of its images: to first order an
/// image's second moments are J P J^T with J the projection's derivative and
/// P = radius² (1 - normal normal^T), which is linear in P. Then takes the eccentricity
/// (targets/eccentricity.h) out of the point's observations, and a tenth of it into their sigmas.
/// Where the images give no disc, the sigmas take all that it may be, a² sin(tilt) / f.
/// @param discs      of each of network.observations; absent where the shape is not known: nothing
/// is done.
/// @param corrected  of each, whether that was done before: only its shape is read. Those that are
/// corrected now are marked.
void CorrectDiscs(const std::vector<std::optional<ImageEllipse>>& discs,
                  std::vector<bool>& corrected, Network& network);

}  // namespace trammel::part_alignment
