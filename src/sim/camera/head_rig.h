// Interface of the virtual machine to the camera.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "base/random.h"
#include "base/result.h"
#include "sim/laser/laser_camera.h"
#include "sim/laser/laser_traits.h"
#include "sim/print/bed.h"
#include "sim/print/conditions.h"
#include "sim/print/named_number.h"

namespace trammel::sim {

/// State of the machine at one moment.
struct MachineView {
  double x_mm = 0;  ///< the toolhead's true position, in the middle of a move too
  double y_mm = 0;
  double z_mm = 0;
  double speed_mm_s = 0;  ///< >= 0, along the path
  bool laser_on = false;
  bool lights_on = false;
};

/// Machine as seen by a camera. Thread-safe. `monotonic_s` is the host's CLOCK_MONOTONIC in
/// seconds, now or in the last few seconds.
class MachineSource {
 public:
  virtual ~MachineSource() = default;
  [[nodiscard]] virtual MachineView At(double monotonic_s) const = 0;
  /// Returns the print so far; a new pointer whenever it grew, never null.
  [[nodiscard]] virtual std::shared_ptr<const Bed> bed(double monotonic_s) const = 0;
};

/// Camera with laser as mounted on one head: the same in the dark and with the lights on.
struct HeadOptics {
  Condition condition;  ///< plate and filament; its light means nothing here
  LaserTraits dark;     ///< looks and exposure with the lights off
  LaserTraits lit;      ///< and with the lights on; REQUIRES the same geometry
};

struct CameraMount {
  double offset_x_mm = 28;         ///< nozzle to laser point on the plate at the
  double offset_y_mm = 50.2;       ///< focus height; the paper's
  double focus_height_mm = 17.86;  ///< nozzle height where the laser is sharp; the paper's
};

/// Deviations of one head from its world's drawn camera. The defaults change nothing.
struct HeadRig {
  double scale = 1;             ///< px/mm over the drawn eye's, by the focal length; 0.5 … 2
  double camera_turn_rad = 0;   ///< camera alone about its axis, counter-clockwise from above
  double laser_turn_rad = 0;    ///< laser sheet about the vertical, likewise; +-0.045
  double laser_angle_rad = 0;   ///< over the drawn eye's, +-0.35
  double laser_brightness = 1;  ///< factor of all laser light, 0 (none) … 20 (saturated)
  double room_brightness = 1;   ///< factor of all other light, 0 … 20
  bool flip_x = false;          ///< the picture is mirrored left to right,
  bool flip_y = false;          ///< top to bottom; both: the camera is mounted the other way round
  double mount_backlash_mm =
      0;  ///< each reversal of an axis leaves the eye within this of its place
  std::array<double, 3> backlash_mm = {0, 0, 0};  ///< x, y and z: the head lags by half of it
};

struct MountedRig {
  CameraMount mount;
  HeadRig rig;
};

/// Draws a realistic mounting: the camera rotated by up to 3 degrees and the laser by 1, the offset
/// wrong by up to 4 mm, the focus by 1 mm, the scale by 10 %, the laser's angle by 3 degrees, the
/// laser's light by a fifth.
[[nodiscard]] MountedRig DrawHeadRig(Random random);

/// Values of a head that options set; angles end in -deg, lengths in -mm.
inline constexpr NamedNumber<MountedRig> kHeadRigNumbers[] = {
    {"offset-x-mm", [](double v, MountedRig& r) { r.mount.offset_x_mm = v; }, -200, 200},
    {"offset-y-mm", [](double v, MountedRig& r) { r.mount.offset_y_mm = v; }, -200, 200},
    {"focus-height-mm", [](double v, MountedRig& r) { r.mount.focus_height_mm = v; }, 1, 100},
    {"scale", [](double v, MountedRig& r) { r.rig.scale = v; }, 0.5, 2},
    {"camera-turn-deg",
     [](double v, MountedRig& r) { r.rig.camera_turn_rad = v * (std::numbers::pi / 180); }, -180,
     180},
    {"laser-turn-deg",
     [](double v, MountedRig& r) { r.rig.laser_turn_rad = v * (std::numbers::pi / 180); }, -2.5,
     2.5},
    {"laser-angle-deg",
     [](double v, MountedRig& r) {
       r.rig.laser_angle_rad = v * (std::numbers::pi / 180) - LaserTraits{}.laser_angle_rad;
     },
     25, 65},
    {"laser-brightness", [](double v, MountedRig& r) { r.rig.laser_brightness = v; }, 0, 20},
    {"room-brightness", [](double v, MountedRig& r) { r.rig.room_brightness = v; }, 0, 20},
    {"flip-x", [](double v, MountedRig& r) { r.rig.flip_x = v >= 0.5; }, 0, 1},
    {"flip-y", [](double v, MountedRig& r) { r.rig.flip_y = v >= 0.5; }, 0, 1},
    {"mount-play-mm", [](double v, MountedRig& r) { r.rig.mount_backlash_mm = v; }, 0, 2},
    {"backlash-x-mm", [](double v, MountedRig& r) { r.rig.backlash_mm[0] = v; }, 0, 2},
    {"backlash-y-mm", [](double v, MountedRig& r) { r.rig.backlash_mm[1] = v; }, 0, 2},
    {"backlash-z-mm", [](double v, MountedRig& r) { r.rig.backlash_mm[2] = v; }, 0, 2},
};

/// Returns the camera with scale, angles and brightness of this head.
[[nodiscard]] HeadOptics MountOptics(const HeadOptics& optics, const HeadRig& rig);

/// Maps positions in the picture to an upright, unmirrored sensor; both have their origin in the
/// first pixel of the full sensor.
struct PictureMap {
  double xx = 1, xy = 0, yx = 0, yy = 1;  ///< about the sensor's middle

  struct Place {
    double x_px = 0;
    double y_px = 0;
  };
  [[nodiscard]] bool identity() const { return xx == 1 && xy == 0 && yx == 0 && yy == 1; }
  [[nodiscard]] Place Upright(Place picture) const;
  [[nodiscard]] Place Picture(Place upright) const;  ///< inverse
};
[[nodiscard]] PictureMap MapOf(const HeadRig& rig);

/// Returns the part of an upright sensor shown by a window of the picture, with a margin for
/// interpolation. Extends beyond the sensor if the camera is rotated.
[[nodiscard]] SensorWindow UprightWindow(const PictureMap& map, const SensorWindow& picture);

/// Resamples an upright frame (cubic).
void TurnPicture(const PictureMap& map, const SensorWindow& upright, const Frame& from,
                 const SensorWindow& picture, Frame& to);

/// True position of the head: the drive's commands, through backlash and a loose mount. Follows one
/// machine; calls must be in order of time.
class RigMotion {
 public:
  RigMotion(const HeadRig& rig, const Random& random);
  void Settle(MachineView& machine);
  /// Returns the bed as laid with this backlash. Travels between strands are assumed straight.
  /// Caches the last one: equal pointers, equal results.
  [[nodiscard]] std::shared_ptr<const Bed> Lay(const std::shared_ptr<const Bed>& bed);

 private:
  struct Axis {
    double extreme_mm = 0;
    int direction = 0;  // 0: has not moved yet
  };
  bool Reverses(Axis& axis, double place_mm);

  HeadRig rig_;
  Random random_;
  bool started_ = false;
  std::array<double, 3> head_mm_ = {0, 0, 0};
  std::array<Axis, 3> axes_;
  double shift_x_mm_ = 0;
  double shift_y_mm_ = 0;
  std::shared_ptr<const Bed> told_;
  std::shared_ptr<const Bed> laid_;
};

/// Writes the truth of a head as JSON (docs/reference/formats.md).
/// @param eye  As drawn, before MountOptics.
/// Error (kInput): the file exists already or cannot be created.
[[nodiscard]] Result<void> WriteRigTruth(const std::filesystem::path& path, const MountedRig& rig,
                                         const HeadOptics& optics, std::uint64_t seed);

}  // namespace trammel::sim
