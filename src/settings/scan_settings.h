// Settings of the scanning machine in trammel.toml: its address, its camera's view, and the
// commands for its laser and lights.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/axis_direction.h"
#include "settings/setting.h"

namespace trammel::settings {

/// ScanFields() has the range and documentation of each setting.
/// "Paper": Abbott, Automatic Pressure Advance Calibration Using Laser Triangulation, and its
/// released code.
struct ScanSettings {
  // [moonraker]
  std::string address = "localhost";  ///< like machine::MoonrakerOptions::address
  std::string http_address;           ///< for uploads if `address` is a Unix socket
  std::string api_key;
  std::string api_key_file;  ///< first line: the key
  std::string ca_file;
  bool accept_any_certificate = false;
  bool quote_messages = false;    ///< like machine::MoonrakerOptions; command line only
  bool keep_in_spoolman = false;  ///< whatever `pa apply` sets

  // [camera]
  std::string camera;         ///< machine::OpenCamera's address; empty: what Moonraker lists
  std::string webcam;         ///< name in Moonraker's list; empty: the first that is enabled
  int frame_width_px = 1280;  ///< asked of a V4L2 device
  int frame_height_px = 720;
  double frames_per_s = 30;
  double camera_offset_x_mm = 28;  ///< nozzle to laser point on the plate; paper
  double camera_offset_y_mm = 50.2;
  double focus_height_mm =
      17.86;                    ///< nozzle's z at which that holds and the picture is sharp; paper
  std::vector<double> crop_px;  ///< x, y, width, height; empty: found from the frames
  std::optional<double> px_per_mm;
  std::optional<double> px_per_mm_sigma;
  double laser_angle_deg = 45;
  std::optional<double> laser_angle_sigma_deg;
  AxisDirection height_direction = AxisDirection::kMinusX;
  bool opaque_plate = false;  ///< true: the laser's light does not enter the plate

  // [scan]
  double scan_speed_mm_s = 400.0 / 60;  ///< paper
  double skip_mm = 4;                   ///< at either end of a line; paper
  double run_up_mm = 1;                 ///< acceleration distance, before and after
  double settle_s =
      0.7;  ///< standing before and after each sweep: longest latency, 5 frames, slack
  int lines_at_once = 1;                   ///< swept without standing in between; 1: paper
  double scan_nozzle_temperature_c = 150;  ///< the nozzle cools to this before the scan: no ooze;
                                           ///< 0: off, and no waiting
  double heat_time_limit_s = 900;
  std::string laser_on_gcode = "_LASER_ON";
  std::string laser_off_gcode = "LASER_OFF";
  std::string lights_off_gcode;
  std::string lights_on_gcode;
  std::string clean_nozzle_gcode;
};

using ScanField = SettingField<ScanSettings, double, std::optional<double>, int, bool, std::string,
                               std::vector<double>, AxisDirection>;

/// Returns all settings, in the order of `trammel config keys`; sections are contiguous.
[[nodiscard]] std::span<const ScanField> ScanFields();

/// Returns the first invalid setting, if any. The procedure checks that the settings suffice for a
/// scan (commands for the laser, lines longer than the skipped part), since a printer without a
/// laser has the same file.
[[nodiscard]] std::optional<SettingProblem> FindProblem(const ScanSettings& settings);

}  // namespace trammel::settings
