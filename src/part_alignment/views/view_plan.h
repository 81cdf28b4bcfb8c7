// The views to take: within the machine's travel, clear of obstacles, until the part is known.
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
  /// Of spindle_mm. No default: the machine's own.
  MachineBox travel;
  /// From the camera's origin to the target, along the camera's axis, 20 ... 10,000 mm.
  double working_distance_mm = 300;
  /// Share of the picture's width and height, about its centre, that targets are brought into,
  /// 0.1 ... 1: the rest is for how roughly the part's place is known.
  double field_share = 0.8;
  double sigma_px = 0.05;  ///< expected, per axis
  /// Part, fixtures, clamps: what nothing may come near. Where there is none, nothing is checked.
  std::vector<MachineBox> obstacles;
  /// Kept between the obstacles and spindle, tool and camera, 0 ... 1000 mm; it has to hold for how
  /// roughly the part's place is known.
  double clearance_mm = 50;
  /// The camera and its holder as a cylinder about the spindle's axis that reaches this far before
  /// the point whose position is spindle_mm. 0: as far as the camera's origin and 30 mm more.
  double tool_length_mm = 0;
  double tool_radius_mm = 80;
  /// Of the spindle, all with one direction of its axis. The second direction of C tells
  /// eccentricity and camera offset.
  std::vector<Eigen::Matrix3d> orientations = {Eigen::Matrix3d::Identity()};
  /// Each target is seen at least so often, so that a wrong one can be told, 1 ... 10.
  int observations_per_target = 2;
  /// Wanted along the weakest direction (k = 1), 0.0001 ... 10 mm.
  double weakest_goal_mm = 0.02;
  int most_views = 40;  ///< 1 ... 200
};

struct PlannedView {
  Eigen::Vector3d spindle_mm = Eigen::Vector3d::Zero();
  Eigen::Matrix3d spindle_rotation = Eigen::Matrix3d::Identity();
  std::vector<std::string> targets;  ///< in the picture, the one aimed at first
  std::string why;
};

struct ViewPlan {
  Verdict verdict = Verdict::kCannotTell;
  std::string reason;
  std::vector<PlannedView> views;  ///< in an order of short ways
  /// Spindle positions, to be gone through in straight lines: the way along the spindle's axis out
  /// to the safe plane, across, and in to the next view. The first lies in the safe plane before
  /// the first view, the last after the last; the way from elsewhere to the first is not planned.
  std::vector<Eigen::Vector3d> way_mm;
  std::vector<int> view_at;     ///< for each place of the way the view taken there, or -1
  Observability observability;  ///< of the whole plan
};

/// Greedy: first whatever tells most (determinant of the information) until each target is seen
/// observations_per_target times, then until the weakest direction is known to weakest_goal_mm. A
/// view counts only if the spindle's place lies within the travel, its target within the field, and
/// camera and tool keep clear of the obstacles, as does the whole way. Whether an obstacle hides a
/// target from the camera is not looked at.
///
/// Verdict cannot_tell, with what is short and why, where the goal is not reached; the views then
/// are the best there are.
/// Errors (kInput): options out of range, boxes turned inside out, a camera that cannot be, doubled
/// target ids, no target, orientations that are no rotations or differ in the spindle's direction.
[[nodiscard]] Result<ViewPlan> PlanViews(const Camera& camera,
                                         const std::vector<PartTarget>& targets,
                                         const geometry::Pose& rough_machine_from_part,
                                         const ViewPlanOptions& options);

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

}  // namespace trammel::part_alignment
