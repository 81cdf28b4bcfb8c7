// Drives a spindle along a way and takes a picture at each view.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <vector>

#include "base/result.h"
#include "machine/camera/camera.h"
#include "part_alignment/pose/measurement.h"
#include "part_alignment/procedure/align_route.h"

namespace trammel::procedure {

/// The outside: each may fail, which ends the drive. `move_to` must leave no motion running when it
/// fails (machine/linuxcnc/linuxcnc.h does).
struct ViewHooks {
  /// Empty: the pictures were taken before, one for each view in the order of the plan.
  std::function<Result<void>(const Eigen::Vector3d& spindle_mm)> move_to;
  /// Where the spindle stands; an error unless it is stopped and oriented. With `move_to`.
  std::function<Result<Eigen::Vector3d>()> stands_at;
  /// A picture that was begun after this call.
  std::function<Result<machine::CapturedFrame>()> take_picture;
  /// Keeps a picture as it came, before anybody looks into it.
  std::function<Result<void>(std::size_t view, const machine::CapturedFrame& picture)> keep_picture;
};

/// What is done with the picture of a view, which is kept by then.
using OnPicture =
    std::function<Result<void>(std::size_t view, const machine::CapturedFrame& picture)>;

/// Takes one picture where the spindle stands, and keeps it.
/// Errors: the hooks', that of `on_picture`; kMachine where the spindle moved meanwhile.
[[nodiscard]] Result<void> TakeView(std::size_t number, const part_alignment::View& view,
                                    const ViewHooks& shop, const OnPicture& on_picture);

/// Errors: as of TakeView, with the view at which or on the way to which it happened.
/// REQUIRES every waypoint's view among `views`, every hook but `move_to`, `stands_at`.
[[nodiscard]] Result<void> DriveThroughViews(const std::vector<Waypoint>& way,
                                             const std::vector<part_alignment::View>& views,
                                             const ViewHooks& shop, const OnPicture& on_picture);

}  // namespace trammel::procedure
