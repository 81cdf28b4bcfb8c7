// What the camera must know of the virtual machine.
#pragma once

#include <memory>

#include "sim/print/bed.h"

namespace trammel::sim {

/// The machine at one moment.
struct MachineView {
  double x_mm = 0;  ///< the toolhead's true position, in the middle of a move too
  double y_mm = 0;
  double z_mm = 0;
  double speed_mm_s = 0;  ///< >= 0, along the path
  bool laser_on = false;
  bool lights_on = false;
};

/// The machine as a camera sees it. Every function may be called from any thread.
/// `monotonic_s` is the host's CLOCK_MONOTONIC in seconds, now or in the last few seconds.
class MachineSource {
 public:
  virtual ~MachineSource() = default;
  [[nodiscard]] virtual MachineView At(double monotonic_s) const = 0;
  /// What has been printed so far; a new pointer whenever something was added, never null.
  [[nodiscard]] virtual std::shared_ptr<const Bed> bed(double monotonic_s) const = 0;
};

}  // namespace trammel::sim
