// Plans the way between views, clear of obstacles, and drives to each.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <vector>

#include "base/result.h"
#include "machine/camera/camera.h"
#include "part_alignment/pose/measurement.h"
#include "part_alignment/views/machine_box.h"

namespace trammel::procedure {

struct RouteOptions {
  double safe_z_mm = 0;  ///< of the spindle, machine coordinates: all crossings are at least there
  /// Cylinder of camera and holder about the spindle's axis. Nothing passes below an obstacle.
  double camera_radius_mm = 80;
  double camera_below_mm = 400;  ///< spindle's reference point to the camera's lower end
  std::vector<part_alignment::MachineBox> obstacles;  ///< nothing may touch them
  /// Travel of the spindle; unlimited by default: the controller's own limits hold, too.
  part_alignment::MachineBox travel{Eigen::Vector3d::Constant(-1e5),
                                    Eigen::Vector3d::Constant(1e5)};
};

/// Waypoint; `view` is -1 between views.
struct Waypoint {
  Eigen::Vector3d spindle_mm = Eigen::Vector3d::Zero();
  int view = -1;
};

/// Plans the whole way, from the spindle's position, and back up at the end. Every piece of it is
/// checked before anything moves. Errors: kInput for invalid options; kSafety, naming view and
/// obstacle, for the start, a view or the safe height outside the travel, a way or a place where
/// the camera touches an obstacle, a view that turns the spindle (only X, Y and Z are driven).
[[nodiscard]] Result<std::vector<Waypoint>> RouteThrough(
    const Eigen::Vector3d& start_mm, const std::vector<part_alignment::View>& views,
    const RouteOptions& options);

/// Hooks of a drive: a failure of any ends it. `move_to` must stop all motion before it fails
/// (machine/linuxcnc/linuxcnc.h does).
struct ViewHooks {
  /// Moves the spindle. Empty: the pictures were taken before, one for each view in the order of
  /// the plan.
  std::function<Result<void>(const Eigen::Vector3d& spindle_mm)> move_to;
  /// Returns the spindle's position; an error unless it is stopped and oriented. With `move_to`.
  std::function<Result<Eigen::Vector3d>()> stands_at;
  /// Takes a picture whose exposure begins after this call.
  std::function<Result<machine::CapturedFrame>()> take_picture;
  /// Stores a picture unchanged, before it is read.
  std::function<Result<void>(std::size_t view, const machine::CapturedFrame& picture)> keep_picture;
};

/// Processes the picture of a view, which is stored by then.
using OnPicture =
    std::function<Result<void>(std::size_t view, const machine::CapturedFrame& picture)>;

/// Takes one picture at the spindle's position, and stores it. Errors: the hooks', that of
/// `on_picture`; kMachine if the spindle moved meanwhile.
[[nodiscard]] Result<void> TakeView(std::size_t number, const part_alignment::View& view,
                                    const ViewHooks& shop, const OnPicture& on_picture);

/// Drives through the views. Errors: as of TakeView, with the view at which or on the way to which
/// they happened. REQUIRES every waypoint's view among `views`, every hook but `move_to`,
/// `stands_at`.
[[nodiscard]] Result<void> DriveThroughViews(const std::vector<Waypoint>& way,
                                             const std::vector<part_alignment::View>& views,
                                             const ViewHooks& shop, const OnPicture& on_picture);

}  // namespace trammel::procedure
