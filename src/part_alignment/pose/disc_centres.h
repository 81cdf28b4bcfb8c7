// Correction from the centres of discs' images to the images of their centres, and their alignment.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "base/result.h"
#include "part_alignment/pose/measurement.h"
#include "part_alignment/pose/solve.h"
#include "part_alignment/targets/image_ellipse.h"

namespace trammel::part_alignment {

/// Normal and radius that all targets of a part share.
struct TargetDisc {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< part frame, any length
  double radius_mm = 0;                               ///< 0: as the discs look
};

/// Ellipses whose centres the observations are, by view and in the observations' order.
using SeenDiscs = std::vector<std::vector<ImageEllipse>>;

/// Solves, corrects each observation for perspective by that solution (eccentricity.h), and solves
/// again. Verdict refused, with the reason, if the discs contradict `disc`: a radius 10 % off, or
/// axes by which the normal is some 10 degrees off. Assumes flat round discs of one size and one
/// normal.
/// @param measurement  its observations are corrected if the first solution is good and the discs
/// match `disc`
/// REQUIRES an ellipse for each observation.
/// Errors: those of Solve; kInput for an invalid normal, a radius < 0 or not finite.
[[nodiscard]] Result<Alignment> SolveByDiscs(const SolveOptions& options, const TargetDisc& disc,
                                             const SeenDiscs& seen, Measurement& measurement);

}  // namespace trammel::part_alignment
