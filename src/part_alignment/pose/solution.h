// The camera and the pictures as a solution has them.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "part_alignment/pose/measurement.h"
#include "part_alignment/pose/solve.h"

namespace trammel::part_alignment {

/// The measurement's camera with what was solved for of it. REQUIRES verdict good, as all below.
[[nodiscard]] Camera SolvedCamera(const Measurement& measurement, const Alignment& alignment);

/// Where the solution has a target in a view, (column, row) in px; absent outside the picture.
[[nodiscard]] std::optional<Eigen::Vector2d> ImageOf(const Measurement& measurement,
                                                     const Alignment& alignment, const View& view,
                                                     const PartTarget& target);

/// Along the camera's axis, in mm.
struct DistanceRange {
  double nearest_mm = 0;
  double farthest_mm = 0;
};

/// From how near and how far the targets were seen that were observed; 0 where none was.
[[nodiscard]] DistanceRange SeenDistances(const Measurement& measurement,
                                          const Alignment& alignment);

/// The part's target with this id; none where there is none.
[[nodiscard]] const PartTarget* FindTarget(const Measurement& measurement, const std::string& id);

}  // namespace trammel::part_alignment
