// Description of a recorded laser scan (scan.json), as plain values.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "base/axis_direction.h"
#include "base/frame.h"
#include "base/result.h"
#include "pressure_advance/profile/line_profile.h"

namespace trammel::pressure_advance {

struct ScanLine {
  double pressure_advance_s = 0;                 ///< >= 0
  std::string video;                             ///< file name, relative to the recording's folder
  std::optional<AxisDirection> print_direction;  ///< on the bed; default +x
  std::optional<AxisDirection> sweep_direction;  ///< on the bed; default: print_direction
  std::vector<double> frame_times_s;             ///< capture times, increasing; empty: frames_per_s
  /// Laser position per frame, mm from the printed start; absent for a frame that must not be
  /// scored (the head is at rest or accelerates, the picture is damaged, its time is unknown). The
  /// numbers rise or fall strictly. If not empty, positions come from here, not from times, speed,
  /// sweep_direction and line_start_mm.
  std::vector<std::optional<double>> frame_positions_mm;
  int pattern = 0;              ///< index on a plate of several, 0 … 9999
  double late_s = 0;            ///< >= 0: delay of the latest frame beyond the promptest one's
  std::size_t lost_frames = 0;  ///< missing in its video: taken by the camera, never received
};

/// Format 1 of scan.json; docs/reference/formats.md has every key with its bounds.
struct Scan {
  std::vector<ScanLine> lines;
  double frames_per_s = 30;
  double scan_speed_mm_s = 0;                   ///< speed of the sweep along the line
  std::optional<double> px_per_mm;              ///< on the plate; absent: results stay in pixels
  std::optional<double> px_per_mm_sigma;        ///< 1 sigma, as set up
  std::optional<double> laser_angle_sigma_rad;  ///< 1 sigma, as set up
  double laser_angle_rad =
      0.785398163397448;  ///< between sheet and camera axis: shift = height tan
  AxisDirection height_direction = AxisDirection::kMinusX;  ///< image direction of a rising surface
  std::optional<PixelRect> crop;                            ///< absent: found from the frames
  std::optional<PixelRect> found_crop;       ///< used without `crop`: found while it was recorded
  std::optional<double> commanded_area_mm2;  ///< of the beads, > 0; flow in force included
  bool opaque_plate = false;  ///< true: no light enters the plate, as its owner states
  double line_start_mm = 0;   ///< laser in the first scored frame, from the printed start
  LineMotion motion;          ///< length and acceleration are present in a scan
};

/// Returns the scale from pixels to heights and areas. Absent without px_per_mm.
[[nodiscard]] std::optional<HeightScale> HeightScaleOf(const Scan& scan);

/// Errors state the key, the value and the bound of the first invalid entry.
[[nodiscard]] Result<void> Validate(const Scan& scan);

}  // namespace trammel::pressure_advance
