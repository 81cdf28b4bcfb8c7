// From the centres of discs' images to the images of their centres, and an alignment of these.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "base/result.h"
#include "part_alignment/pose/measurement.h"
#include "part_alignment/pose/solve.h"
#include "part_alignment/targets/image_ellipse.h"

namespace trammel::part_alignment {

/// What all targets of a part share.
struct TargetDisc {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< in the part's frame, any length
  double radius_mm = 0;                               ///< 0: as the discs look
};

/// The ellipses that the observations are the centres of, by view and in the observations' order.
using SeenDiscs = std::vector<std::vector<ImageEllipse>>;

/// Solves, corrects each observation for perspective by that answer (eccentricity.h), and solves
/// once more. Verdict refused, with the reason, where the discs look otherwise than what they are
/// said to be: a radius 10 % off, or axes by which the normal is some 10 degrees off. Assumes flat
/// round discs of one size and one normal.
/// @param measurement  its observations are moved, where the first answer is good and the discs are
///                     what they are said to be
/// REQUIRES an ellipse for each observation.
/// Errors: those of Solve; kInput for a normal that is none, a radius < 0 or not finite.
[[nodiscard]] Result<Alignment> SolveByDiscs(const SolveOptions& options, const TargetDisc& disc,
                                             const SeenDiscs& seen, Measurement& measurement);

}  // namespace trammel::part_alignment
