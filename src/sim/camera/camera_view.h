// View of the camera on the print head at one moment of a virtual machine.
#pragma once

#include <memory>
#include <optional>

#include "base/frame.h"
#include "base/random.h"
#include "sim/camera/head_rig.h"
#include "sim/laser/laser_camera.h"
#include "sim/laser/laser_traits.h"
#include "sim/print/conditions.h"

namespace trammel::sim {

/// Draws a camera consistent with plate and filament. A generator in the same state gives
/// RecordScan the same camera, in the dark and lit.
[[nodiscard]] HeadOptics DrawHeadOptics(const Condition& condition, const Random& random);

struct CameraViewOptions {
  CameraMount mount;
  int frame_width_px = kSensorWidthPx;    ///< 64 … 1280; smaller frames are windows of the sensor
  int frame_height_px = kSensorHeightPx;  ///< 64 … 720
  HeadRig rig = {};                       ///< other differences from the drawn camera
};

/// Returns a camera's traits rise_mm above its focus height: its scale, the positions of laser and
/// printed line, and the blur. Clamped to rises of -24 … 60 mm.
[[nodiscard]] LaserTraits AtRise(const LaserTraits& focused, double rise_mm);

/// State of a machine during one exposure.
struct CameraMoment {
  MachineView machine;     ///< at mid-exposure
  double travel_x_mm = 0;  ///< head travel during the exposure
  double travel_y_mm = 0;
  double time_s = 0;  ///< mid-exposure
  std::shared_ptr<const Bed> bed;
};

/// True if two moments look alike but for the sensor's noise.
[[nodiscard]] bool LookAlike(const CameraMoment& a, const CameraMoment& b);

/// Renders frames. Caches the surroundings of the head between calls and redraws them when the head
/// leaves them, the bed grows or the light changes. Not thread-safe.
class CameraView {
 public:
  /// @param random  As RecordScan's: names the textures; afterwards, noise and drift.
  CameraView(const HeadOptics& optics, const CameraViewOptions& options, const Random& random);

  /// Queries the machine's state for an exposure centred on `mid_exposure_s`.
  /// @param machine_time_scale  the machine's speed relative to real time: the exposure is
  ///        shorter by as much.
  [[nodiscard]] CameraMoment MomentAt(const MachineSource& machine, double mid_exposure_s,
                                      double machine_time_scale = 1) const;

  /// Shifts a moment's head, and its print, by backlash and a loose mount. Moments must be ordered
  /// by time. Changes nothing on a tight head.
  void Settle(CameraMoment& moment);

  /// Returns this head's camera: its traits with the rig's deviations.
  [[nodiscard]] const HeadOptics& optics() const { return optics_; }

  /// Returns the maximum exposure, at natural speed.
  [[nodiscard]] double exposure_s() const;

  /// Intersection of the laser and the plate: nozzle, offset, and the mount's error. At other
  /// heights the laser appears as far beyond (before) as the head is above (below) the focus
  /// height, for an angle of 45 degrees.
  struct Spot {
    double x_mm = 0;
    double y_mm = 0;
  };
  [[nodiscard]] Spot LaserSpot(const MachineView& machine) const;

  /// REQUIRES a bed. Cost at 1280 x 720: see docs/tutorial/virtual-printer.md.
  void Render(const CameraMoment& moment, Frame& frame);

 private:
  struct Look {  // parameters of a cached scene
    std::shared_ptr<const Bed> bed;
    bool lit = false;
    double cell_mm = 0;
    int blur_step = 0;
    BedRegion region;
  };
  void Focus(double rise_mm, bool lit);
  void KeepScene(const CameraMoment& moment, const Spot& spot, double rise_mm);

  HeadOptics optics_;
  CameraMount mount_;
  PictureMap map_;
  SensorWindow picture_;  // on the sensor, as read out
  SensorWindow upright_;  // as drawn
  RigMotion motion_;
  LaserCamera camera_;
  Random random_;
  Frame drawn_;
  double gain_phase_rad_ = 0;
  double rise_mm_ = 0;
  bool lit_ = false;
  std::optional<LaserScene> scene_;
  Look look_;
};

}  // namespace trammel::sim
