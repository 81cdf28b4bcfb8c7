// Where the spindle may be: travel and obstacles.
#pragma once

#include <string>

#include "part_alignment/views/view_plan.h"

namespace trammel::part_alignment {

/// How far the camera reaches before the point whose position is spindle_mm.
/// @param stated_mm  0: as far as the camera's origin, and 30 mm of lens more.
[[nodiscard]] double ToolLength(const Camera& camera, double stated_mm);

[[nodiscard]] bool WithinTravel(const ViewPlanOptions& options, const Eigen::Vector3d& spindle_mm);

/// Whether a cylinder about the spindle's axis, from the tool's end backwards without end, stays
/// clear of all obstacles: so does the way out along the axis. Judged by the obstacles' boxes along
/// the spindle's own axes, which hold them.
[[nodiscard]] bool ClearOfObstacles(const ViewPlanOptions& options, double tool_length_mm,
                                    const Eigen::Vector3d& spindle_mm,
                                    const Eigen::Matrix3d& spindle_rotation);

/// How far along the spindle's axis (towards the spindle) its point must be for the tool's end to
/// pass everything; minus infinity without obstacles.
[[nodiscard]] double SafeHeight(const ViewPlanOptions& options, double tool_length_mm,
                                const Eigen::Vector3d& axis);

/// Fills the plan's way through its views in their order; false and a reason where the safe plane
/// lies outside the travel.
[[nodiscard]] bool FillWay(const ViewPlanOptions& options, double tool_length_mm, ViewPlan& plan);

}  // namespace trammel::part_alignment
