// What makes the stated uncertainty of a part's place as large as it is.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "part_alignment/pose/measurement.h"
#include "part_alignment/pose/solve.h"

namespace trammel::part_alignment {

struct Contribution {
  std::string input;   ///< of InputUncertainty, "targets", "camera", "all" or "pixels"
  double size = 0;     ///< k = 1, mm or rad; 0 where it is a covariance, or none of its own
  bool usual = false;  ///< nobody stated its size
  /// k = 1 of the part's x, y, z in the machine: of "all" as stated, of "pixels" were all else
  /// exact, of any other were this one exact.
  Eigen::Vector3d sigma_mm = Eigen::Vector3d::Zero();
};

/// "all" first, then what counts, the largest first, "pixels" last. Empty unless the verdict is
/// good. By linear propagation at the answer (pose_uncertainty.h): the weights follow what counts,
/// so that the parts need not add up. REQUIRES an answer of this measurement and these options.
[[nodiscard]] std::vector<Contribution> ContributionsOf(const Measurement& measurement,
                                                        const SolveOptions& options,
                                                        const Alignment& alignment);

}  // namespace trammel::part_alignment
