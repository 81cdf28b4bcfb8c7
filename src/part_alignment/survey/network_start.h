// Computes starting values of a network, from codes alone: no guess of any station or point.
#pragma once

#include <vector>

#include "base/random.h"
#include "part_alignment/survey/bundle.h"
#include "part_alignment/survey/network.h"

namespace trammel::part_alignment {

struct NetworkStartOptions {
  /// Initial focal lengths, px; each is tried.
  std::vector<double> focal_guesses_px;
  int longer_side_px = 0;  ///< picture's side: scales the tolerances
};

/// Orients one pair of pictures (five points, both solutions of a flat part, every focal length),
/// and selects among the candidates by further pictures. Then resects picture by picture and
/// intersects targets, with bundle adjustments in between (Cauchy's loss). Stations and points
/// without a place do not fit the others; observations far off are not `used`. Sizes have no unit.
/// @param network  observations; and the lens, whose principal point is the initial value.
/// @returns false if no pair of pictures could be oriented.
[[nodiscard]] bool StartNetwork(const NetworkStartOptions& options, Network& network,
                                Random& random);

/// Places further stations (by resection) and points (by intersection) in a started network, with
/// adjustments in between.
void GrowNetwork(const NetworkStartOptions& options, Network& network, Random& random);

/// Places further stations and points without moving those that are placed.
/// @param barred  points that are not placed.
void PlaceMore(double tolerance_px, const std::vector<bool>& barred, Network& network,
               Random& random);

/// Returns indices into network.observations, by station.
[[nodiscard]] std::vector<std::vector<std::size_t>> ObservationsByStation(const Network& network);

}  // namespace trammel::part_alignment
