// Starting values of a network, from codes alone: no guess of any station or point.
#pragma once

#include <vector>

#include "base/random.h"
#include "part_alignment/survey/bundle.h"
#include "part_alignment/survey/network.h"

namespace trammel::part_alignment {

struct NetworkStartOptions {
  /// Focal lengths to begin with, px; each is tried.
  std::vector<double> focal_guesses_px;
  int longer_side_px = 0;  ///< of the pictures: tolerances follow it
};

/// Orients one pair of pictures (five points, both solutions of a flat part, every focal length),
/// lets further pictures decide among the candidates, then resects picture by picture and
/// intersects targets, with bundle adjustments in between (Cauchy's loss). Stations and points that
/// stay unplaced do not fit the others; observations far off are not `used`. Sizes are in no unit.
/// @param network  observations; and the lens, whose principal point is taken as it is at first.
/// @returns false where no pair of pictures could be oriented.
[[nodiscard]] bool StartNetwork(const NetworkStartOptions& options, Network& network,
                                Random& random);

/// Places what still can be (stations by resection, points by intersection) in a network that
/// stands, with adjustments in between.
void GrowNetwork(const NetworkStartOptions& options, Network& network, Random& random);

/// Places what can be without moving anything that is placed.
/// @param barred  points that stay out.
void PlaceMore(double tolerance_px, const std::vector<bool>& barred, Network& network,
               Random& random);

/// Indices into network.observations, station by station.
[[nodiscard]] std::vector<std::vector<std::size_t>> ObservationsByStation(const Network& network);

}  // namespace trammel::part_alignment
