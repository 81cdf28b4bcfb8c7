// Where a part fit begins.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "part_alignment/part_fit/part_fit_problem.h"

namespace trammel::part_alignment {

/// The middles of planes, shafts and bores against those of their points (Kabsch's rotation); three
/// surfaces, not in one line, are needed.
[[nodiscard]] std::optional<Motion> StartFromMiddles(const Problem& problem);

/// A placement in which points lie on the mesh after least squares, and how evenly.
struct FoundPlacement {
  Motion motion;
  double scatter_mm = 0;  ///< of stock allowance less wanted, about its mean
};

/// Looks among all rotations: the principal axes of mesh and points on one another in all 24 ways,
/// and 48 rotations spread evenly, each refined with few points, the best with some hundred.
/// @returns different placements, the most even first. REQUIRES contacts with a mesh.
[[nodiscard]] std::vector<FoundPlacement> SearchPlacements(const Problem& problem);

/// Whether one placement is the other, but for what a descent leaves.
[[nodiscard]] bool SamePlacement(const Problem& problem, const Motion& a, const Motion& b);

/// "turned by 180.0° about (0.00, 0.00, 1.00)": from one placement to the other.
[[nodiscard]] std::string TurnWords(const Motion& from, const Motion& to);

/// Why points are of another size than the mesh that they belong to; empty where they are not.
/// Factors that units explain are named.
[[nodiscard]] std::string OtherSize(const Problem& problem);

/// Of a mesh, corner to corner of the box about it.
[[nodiscard]] double DiameterOf(const MeshDistance& mesh);

}  // namespace trammel::part_alignment
