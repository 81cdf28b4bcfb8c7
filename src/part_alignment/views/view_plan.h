// Plans the views to take: within the machine's travel, clear of obstacles, until the part's pose
// is determined.
#pragma once

#include <string>
#include <vector>

#include "base/measured.h"
#include "base/result.h"
#include "part_alignment/pose/solve.h"
#include "part_alignment/views/machine_box.h"

namespace trammel::part_alignment {

struct ViewPlanOptions {
  Unknowns unknowns;
  /// Limits of spindle_mm. No default: the machine's own.
  MachineBox travel;
  /// Distance from the camera's origin to the target, along the camera's axis, 20 ... 10,000 mm.
  double working_distance_mm = 300;
  /// Share of the picture's width and height, about its centre, for the targets, 0.1 ... 1: the
  /// rest allows for the approximate place of the part.
  double field_share = 0.8;
  double sigma_px = 0.05;  ///< expected, per axis
  /// Obstacles: part, fixtures, clamps. If there are none, no distance is checked.
  std::vector<MachineBox> obstacles;
  /// Minimum distance of obstacles from spindle, tool and camera, 0 ... 1000 mm; must allow for the
  /// approximate place of the part.
  double clearance_mm = 50;
  /// Camera and holder as a cylinder about the spindle's axis, with this length in front of the
  /// point whose position is spindle_mm. 0: up to the camera's origin and 30 mm more.
  double tool_length_mm = 0;
  double tool_radius_mm = 80;
  /// Orientations of the spindle, all with one direction of its axis. The second direction of C
  /// determines eccentricity and camera offset.
  std::vector<Eigen::Matrix3d> orientations = {Eigen::Matrix3d::Identity()};
  /// Minimum number of views of each target, to detect a wrong one, 1 ... 10.
  int observations_per_target = 2;
  /// Required uncertainty along the weakest direction (k = 1), 0.0001 ... 10 mm.
  double weakest_goal_mm = 0.02;
  int max_views = 40;  ///< 1 ... 200
};

struct PlannedView {
  Eigen::Vector3d spindle_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d spindle_rotation = Eigen::Matrix3d::Identity();
  std::vector<std::string> targets;  ///< in the picture; first: aimed at
  std::string why;
};

struct ViewPlan {
  Verdict verdict = Verdict::kCannotTell;
  std::string reason;
  std::vector<PlannedView> views;  ///< in an order of short ways
  /// Spindle positions of a way in straight lines: along the spindle's axis out to the safe plane,
  /// across, and in to the next view. The first is in the safe plane before the first view, the
  /// last after the last. The way from elsewhere to the first is not planned.
  std::vector<Eigen::Vector3d> way_mm;
  std::vector<int> view_at;     ///< per position of the path the view taken there, or -1
  Observability observability;  ///< whole plan's observability
};

/// Plans greedily: first the view of most information (determinant) until each target has
/// observations_per_target views, then until the weakest direction's uncertainty is
/// weakest_goal_mm. A view counts only if the spindle's place is within the travel, its target
/// within the field, and camera, tool and the whole way are clear of the obstacles. Does not check
/// whether an obstacle hides a target from the camera.
///
/// Verdict cannot_tell, with shortfall and reason, if the goal is not reached; the views are then
/// the best available.
/// Errors (kInput): options out of range, inverted boxes, an invalid camera, doubled target ids, no
/// target, orientations that are no rotations or differ in the spindle's direction.
[[nodiscard]] Result<ViewPlan> PlanViews(const Camera& camera,
                                         const std::vector<PartTarget>& targets,
                                         const geometry::Pose& rough_machine_from_part,
                                         const ViewPlanOptions& options);

/// Returns the camera's extent before the point whose position is spindle_mm.
/// @param stated_mm  0: as far as the camera's origin, and 30 mm of lens more.
[[nodiscard]] double ToolLength(const Camera& camera, double stated_mm);

[[nodiscard]] bool WithinTravel(const ViewPlanOptions& options, const Eigen::Vector3d& spindle_mm);

/// True if a cylinder about the spindle's axis, from the tool's end backwards without end, clears
/// all obstacles. So does the path out along the axis. Checks the obstacles' bounding boxes along
/// the spindle's own axes.
[[nodiscard]] bool ClearOfObstacles(const ViewPlanOptions& options, double tool_length_mm,
                                    const Eigen::Vector3d& spindle_mm,
                                    const Eigen::Matrix3d& spindle_rotation);

}  // namespace trammel::part_alignment
