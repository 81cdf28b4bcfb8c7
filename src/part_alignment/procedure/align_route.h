// The way of a spindle from view to view: up, across at a safe height, down.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "base/result.h"
#include "part_alignment/pose/measurement.h"
#include "part_alignment/views/machine_box.h"

namespace trammel::procedure {

struct RouteOptions {
  double safe_z_mm = 0;  ///< of the spindle, machine coordinates: all crossings are at least there
  /// What hangs in the spindle, as a cylinder about its axis. Nothing passes below an obstacle.
  double camera_radius_mm = 80;
  double camera_below_mm = 400;  ///< from the spindle's reference point to the camera's lower end
  std::vector<part_alignment::MachineBox> obstacles;  ///< nothing may touch them
  /// Of the spindle; wide open where nobody says: the controller's own limits hold, too.
  part_alignment::MachineBox travel{Eigen::Vector3d::Constant(-1e5),
                                    Eigen::Vector3d::Constant(1e5)};
};

/// One stop of the way; `view` is -1 on the way to one.
struct Waypoint {
  Eigen::Vector3d spindle_mm = Eigen::Vector3d::Zero();
  int view = -1;
};

/// The whole way, from where the spindle stands, and back up at the end. Every piece of it is
/// checked before anything moves. Errors: kInput for options that cannot be; kSafety, naming view
/// and obstacle, for the start, a view or the safe height outside the travel, a way or a place
/// where the camera touches an obstacle, a view that turns the spindle (only X, Y and Z are
/// driven).
[[nodiscard]] Result<std::vector<Waypoint>> RouteThrough(
    const Eigen::Vector3d& start_mm, const std::vector<part_alignment::View>& views,
    const RouteOptions& options);

}  // namespace trammel::procedure
