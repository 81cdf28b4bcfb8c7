// Start of a part fit.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "part_alignment/part_fit/part_fit_problem.h"

namespace trammel::part_alignment {

/// Fits the middles of planes, shafts and bores to those of their points (Kabsch's rotation). Needs
/// three surfaces, not in one line.
[[nodiscard]] std::optional<Motion> StartFromMiddles(const Problem& problem);

/// Placement with points on the mesh after least squares, and its scatter.
struct FoundPlacement {
  Motion motion;
  double scatter_mm = 0;  ///< RMS of stock allowance less target, about its mean
};

/// Searches all rotations: the principal axes of mesh and points on one another in all 24 ways, and
/// 48 rotations spread evenly. Each is refined with few points, the best with some hundred.
/// @returns different placements, the most even first. REQUIRES contacts with a mesh.
[[nodiscard]] std::vector<FoundPlacement> SearchPlacements(const Problem& problem);

/// True if two placements are the same within a descent's tolerance.
[[nodiscard]] bool SamePlacement(const Problem& problem, const Motion& a, const Motion& b);

/// "turned by 180.0° about (0.00, 0.00, 1.00)": from one placement to the other.
[[nodiscard]] std::string TurnText(const Motion& from, const Motion& to);

/// Explains why points and their mesh differ in size; empty if they do not. Names factors that
/// units explain.
[[nodiscard]] std::string OtherSize(const Problem& problem);

/// Returns the diagonal of the mesh's bounding box.
[[nodiscard]] double DiameterOf(const MeshDistance& mesh);

}  // namespace trammel::part_alignment
