// Corrects the centres of discs' images for perspective.
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

/// Image of a disc: derivative of the projection by the place, and second moments, four times those
/// of its area.
struct DiscShape {
  Eigen::Matrix<double, 2, 3> by_place;
  Eigen::Matrix2d moments;
};

/// Computes the semi-axes squared along their directions, px².
[[nodiscard]] Eigen::Matrix2d MomentsOf(const ImageEllipse& disc);

/// Fits the round disc to its shapes from all sides, to first order; absent if none fits, and for
/// fewer than three images.
[[nodiscard]] std::optional<ObjectDisc> DiscOf(const std::vector<DiscShape>& shapes);

/// Fits each placed point's disc (normal, radius) to the shapes of its images. To first order an
/// image's second moments are J P J^T with J the projection's derivative and P = radius² (1 -
/// normal normal^T), which is linear in P. Then subtracts the eccentricity (targets/eccentricity.h)
/// from the point's observations, and adds a tenth of it to their sigmas. If the images yield no
/// disc, the sigmas include its maximum, a² sin(tilt) / f.
/// @param discs      of each of network.observations; absent: unknown shape, nothing is done.
/// @param corrected  of each, true if corrected before: only its shape is read. Those that are
/// corrected now are marked.
void CorrectDiscs(const std::vector<std::optional<ImageEllipse>>& discs,
                  std::vector<bool>& corrected, Network& network);

}  // namespace trammel::part_alignment
