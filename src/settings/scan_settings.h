// What trammel.toml says of the machine that scans: where it is, what its camera sees, and the
// commands by which its laser and lights are switched.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/axis_direction.h"
#include "settings/setting.h"

namespace trammel::settings {

/// Ranges and what users read about each setting stand in ScanFields().
/// "Paper": Abbott, Automatic Pressure Advance Calibration Using Laser Triangulation, and its
/// released code.
struct ScanSettings {
  // [moonraker]
  std::string address = "localhost";  ///< as machine::MoonrakerOptions::address
  std::string http_address;           ///< for uploads where `address` is a Unix socket
  std::string api_key;
  std::string api_key_file;  ///< its first line is the key
  std::string ca_file;
  bool accept_any_certificate = false;
  bool quote_messages = false;    ///< as machine::MoonrakerOptions; of the command line alone
  bool keep_in_spoolman = false;  ///< whatever `pa apply` sets

  // [camera]
  std::string camera;         ///< machine::OpenCamera's address; empty: what Moonraker lists
  std::string webcam;         ///< name in Moonraker's list; empty: the first that is enabled
  int frame_width_px = 1280;  ///< asked of a V4L2 device
  int frame_height_px = 720;
  double frames_per_s = 30;
  double camera_offset_x_mm = 28;  ///< from the nozzle to where the laser meets the plate; paper
  double camera_offset_y_mm = 50.2;
  double focus_height_mm =
      17.86;                    ///< nozzle's z at which that holds and the picture is sharp; paper
  std::vector<double> crop_px;  ///< x, y, width, height; empty: found from the frames
  std::optional<double> px_per_mm;
  std::optional<double> px_per_mm_sigma;
  double laser_angle_deg = 45;
  std::optional<double> laser_angle_sigma_deg;
  AxisDirection height_direction = AxisDirection::kMinusX;

  // [scan]
  double scan_speed_mm_s = 400.0 / 60;  ///< paper
  double skip_mm = 4;                   ///< of a line, at either end; paper
  double run_up_mm = 1;                 ///< in which the head reaches its speed, before and behind
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

/// All settings, in the order in which `trammel config keys` shows them; sections are contiguous.
[[nodiscard]] std::span<const ScanField> ScanFields();

/// The first thing that cannot be, if any. Whether what is there suffices for a scan (commands for
/// the laser, lines longer than what is skipped of them) is for the procedure to say: a printer
/// without a laser has the same file.
[[nodiscard]] std::optional<SettingProblem> FindProblem(const ScanSettings& settings);

}  // namespace trammel::settings
