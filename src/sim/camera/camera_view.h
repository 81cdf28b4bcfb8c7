// What the camera on the print head sees of a virtual machine at one moment.
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

/// One eye among those that plate and filament leave open. A generator in the same state gives
/// RecordScan the same eye, in the dark and lit.
[[nodiscard]] HeadEye DrawHeadEye(const Condition& condition, const Random& random);

struct CameraViewOptions {
  CameraMount mount;
  int frame_width_px = kSensorWidthPx;    ///< 64 … 1280; smaller frames are windows of the sensor
  int frame_height_px = kSensorHeightPx;  ///< 64 … 720
  HeadRig rig = {};                       ///< what else differs from the eye that is drawn
};

/// The traits of an eye that stands rise_mm above its focus height: its scale, where laser and
/// printed line appear, and how blurred. Clamped to rises of -24 … 60 mm.
[[nodiscard]] LaserTraits AtRise(const LaserTraits& focused, double rise_mm);

/// A machine during one exposure.
struct CameraMoment {
  MachineView machine;     ///< at mid-exposure
  double travel_x_mm = 0;  ///< of the head during the exposure
  double travel_y_mm = 0;
  double time_s = 0;  ///< of mid-exposure
  std::shared_ptr<const Bed> bed;
};

/// Whether two moments look alike but for the sensor's noise.
[[nodiscard]] bool LookAlike(const CameraMoment& a, const CameraMoment& b);

/// Renders frames. Keeps the surroundings of the head between calls and draws them anew where the
/// head leaves them, the bed grows or the light changes. Not safe for several threads at once.
class CameraView {
 public:
  /// @param random  As RecordScan's: names the textures; afterwards, noise and drift.
  CameraView(const HeadEye& eye, const CameraViewOptions& options, const Random& random);

  /// Asks the machine for what happens while an exposure is centred on `mid_exposure_s`.
  /// @param machine_time_scale  how many times faster than life the machine runs: the exposure is
  ///        shorter by as much.
  [[nodiscard]] CameraMoment MomentAt(const MachineSource& machine, double mid_exposure_s,
                                      double machine_time_scale = 1) const;

  /// Puts a moment's head, and what it has printed, where backlash and a loose mount leave them.
  /// Moments have to come in the order of their time. Nothing changes on a tight head.
  void Settle(CameraMoment& moment);

  /// The eye on this head: its traits with the rig's deviations.
  [[nodiscard]] const HeadEye& eye() const { return eye_; }

  /// Longest exposure, at natural speed.
  [[nodiscard]] double exposure_s() const;

  /// Where the laser meets the plate: nozzle, offset, and what the mount is off by. The laser shows
  /// at other heights as far beyond (before) as the head is above (below) the focus height, for an
  /// angle of 45 degrees.
  struct Spot {
    double x_mm = 0;
    double y_mm = 0;
  };
  [[nodiscard]] Spot LaserSpot(const MachineView& machine) const;

  /// REQUIRES a bed. Cost at 1280 x 720: see docs/tutorial/virtual-printer.md.
  void Render(const CameraMoment& moment, Frame& frame);

 private:
  struct Look {  // what a scene was made for
    std::shared_ptr<const Bed> bed;
    bool lit = false;
    double cell_mm = 0;
    int blur_step = 0;
    BedRegion region;
  };
  void Focus(double rise_mm, bool lit);
  void KeepScene(const CameraMoment& moment, const Spot& spot, double rise_mm);

  HeadEye eye_;
  CameraMount mount_;
  PictureMap map_;
  SensorWindow picture_;  // of the sensor, as it is read out
  SensorWindow upright_;  // as it is drawn
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
