// What pictures of targets say beside their centres, once it is known where the part is.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "part_alignment/solve.h"
#include "part_alignment/target_finder.h"
#include "store/alignment_file.h"

namespace trammel::app {

struct TargetDisc {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< in the part's frame
  double radius_mm = 0;
};

/// The middle value over all observations of the radius that a disc must have to look as large as
/// it was found, 0 where none was. Within some 2 % where the lens stretches little. REQUIRES an
/// alignment with verdict good; `found` by view, as all below.
[[nodiscard]] double DiscRadius(const part_alignment::Measurement& measurement,
                                const part_alignment::Alignment& alignment,
                                const std::vector<part_alignment::FoundTargets>& found);

/// Moves each observation from the centre of its disc's image to the image of the disc's centre
/// (part_alignment/eccentricity.h).
void CorrectCentres(const TargetDisc& disc, const part_alignment::Alignment& alignment,
                    part_alignment::Measurement& measurement);

/// One line for each target that a view should show by the solution and that was not found, with
/// why what is there was rejected, if it was; none unless the verdict is good.
[[nodiscard]] std::vector<std::string> MissingTargets(
    const store::AlignmentInput& input, const part_alignment::Alignment& alignment,
    const std::vector<part_alignment::FoundTargets>& found);

}  // namespace trammel::app
