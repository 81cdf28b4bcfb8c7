#include "settings/scan_settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

namespace trammel::settings {
namespace {

using S = ScanSettings;

constexpr std::string_view kMoonraker = "moonraker";
constexpr std::string_view kCamera = "camera";
constexpr std::string_view kScan = "scan";

constexpr auto kFields = std::to_array<ScanField>({
    {kMoonraker, "address", &S::address, "", 0, 0,
     "Where Moonraker is: a host (voron.local), host:port, http://, https://, ws:// or wss:// with "
     "host and path, or unix: and the path of its socket."},
    {kMoonraker, "http_address", &S::http_address, "", 0, 0,
     "Where files are uploaded if address is a socket, which takes none. Empty: "
     "http://localhost:7125."},
    {kMoonraker, "api_key", &S::api_key, "", 0, 0,
     "Only where Moonraker does not trust this computer. It is a secret: whoever has it controls "
     "the printer. Only you should be able to read this file, then (chmod 600)."},
    {kMoonraker, "api_key_file", &S::api_key_file, "", 0, 0,
     "Instead of api_key: a file whose first line is the key. The environment's TRAMMEL_API_KEY "
     "goes before both."},
    {kMoonraker, "ca_file", &S::ca_file, "", 0, 0,
     "PEM file of the authority that signed the server's certificate. Empty: the system's."},
    {kMoonraker, "accept_any_certificate", &S::accept_any_certificate, "", 0, 0,
     "For self-signed certificates. Anyone in between could then pose as the printer."},
    {kMoonraker, "keep_in_spoolman", &S::keep_in_spoolman, "", 0, 0,
     "What is applied (pa apply, Use it in a dialog) is kept on Spoolman's active spool and its "
     "filament, too; where that cannot be, it is said, and applied all the same."},

    {kCamera, "url", &S::camera, "", 0, 0,
     "The camera: http:// or https:// of an MJPEG stream, a device such as /dev/video0, or aravis: "
     "and the id of a GigE or USB3 Vision camera. Empty: a webcam that Moonraker lists."},
    {kCamera, "webcam", &S::webcam, "", 0, 0,
     "Name of the webcam in Moonraker's list. Empty: the first that is enabled."},
    {kCamera, "width", &S::frame_width_px, "px", 16, 8192, "Width asked of a /dev/video device."},
    {kCamera, "height", &S::frame_height_px, "px", 16, 8192,
     "Height asked of a /dev/video device."},
    {kCamera, "fps", &S::frames_per_s, "1/s", 1, 1000, "Frames per second that the camera makes."},
    {kCamera, "offset_x", &S::camera_offset_x_mm, "mm", -1000, 1000,
     "From the nozzle to where the laser meets the plate at focus_height."},
    {kCamera, "offset_y", &S::camera_offset_y_mm, "mm", -1000, 1000, "The same in y."},
    {kCamera, "focus_height", &S::focus_height_mm, "mm", 0.5, 1000,
     "The nozzle's z while scanning: where the picture is sharp and the offsets hold."},
    {kCamera, "crop", &S::crop_px, "px", 0, 100000,
     "Part of the picture that is analysed: x, y, width, height. Empty: found from the frames."},
    {kCamera, "px_per_mm", &S::px_per_mm, "1/mm", 1, 10000,
     "Pixels per mm on the plate. Left out: cross-sections stay in pixels, which is enough for "
     "pressure advance."},
    {kCamera, "px_per_mm_sigma", &S::px_per_mm_sigma, "1/mm", 1e-6, 1000,
     "Standard uncertainty of px_per_mm. Left out: what heights and areas are known to is not "
     "said."},
    {kCamera, "laser_angle", &S::laser_angle_deg, "°", 5, 85,
     "Between the laser's sheet of light and the camera's axis."},
    {kCamera, "laser_angle_sigma", &S::laser_angle_sigma_deg, "°", 1e-6, 10,
     "Standard uncertainty of laser_angle, likewise."},
    {kCamera, "height_direction", &S::height_direction, "", 0, 0,
     "Direction in the picture in which the laser line moves where the surface rises: +x, -x, +y "
     "or -y."},
    {kCamera, "opaque_plate", &S::opaque_plate, "", 0, 0,
     "true: the plate is dark and lets no light in, such as steel with a dark, smooth or textured "
     "coat. A scan then tells the flow ratio, too. Leave it out for amber PEI and for glass."},

    {kScan, "speed", &S::scan_speed_mm_s, "mm/s", 0.1, 500, "Speed of the sweep along a line."},
    {kScan, "skip", &S::skip_mm, "mm", 0.1, 500, "Left unscanned at either end of a line."},
    {kScan, "run_up", &S::run_up_mm, "mm", 0.01, 100,
     "Before and behind the scanned part, where the head speeds up and slows down."},
    {kScan, "settle", &S::settle_s, "s", 0.1, 60,
     "Standing still before each sweep: it shows in the frames where the motion begins."},
    {kScan, "lines_at_once", &S::lines_at_once, "", 1, 100,
     "Lines that are swept one after the other without standing still in between, each from its "
     "nearer end."},
    {kScan, "nozzle_temperature", &S::scan_nozzle_temperature_c, "°C", 0, 300,
     "The nozzle cools to this before the scan, so that it does not ooze; at least 50, which it "
     "reaches in any room. 0: its heater is switched off, and nothing is waited for."},
    {kScan, "heat_time_limit", &S::heat_time_limit_s, "s", 10, 7200,
     "How long a heater may take to reach its temperature, up or down."},
    {kScan, "laser_on_gcode", &S::laser_on_gcode, "", 0, 0,
     "Switches the laser on; klipper/trammel_laser.cfg has the macro of this name."},
    {kScan, "laser_off_gcode", &S::laser_off_gcode, "", 0, 0,
     "Switches the laser off, on every way out as well."},
    {kScan, "lights_off_gcode", &S::lights_off_gcode, "", 0, 0,
     "Darkens the printer for the scan. Empty: its lights stay as they are."},
    {kScan, "lights_on_gcode", &S::lights_on_gcode, "", 0, 0, "Brings the lights back."},
    {kScan, "clean_nozzle_gcode", &S::clean_nozzle_gcode, "", 0, 0,
     "Wipes the nozzle before the print and before the scan. Empty: nothing."},
});

SettingProblem In(std::string_view section, std::string_view key, std::string message) {
  return {std::string(section), std::string(key), std::move(message)};
}

std::optional<SettingProblem> CheckCrop(const ScanSettings& settings) {
  constexpr double kSmallest_px = 8;  // like a recording's crop_px
  const std::vector<double>& crop = settings.crop_px;
  if (crop.empty()) return std::nullopt;
  if (crop.size() != 4) {
    return In(kCamera, "crop",
              fmt::format("has {} number(s); it must be [x, y, width, height]", crop.size()));
  }
  for (const double number : crop) {
    if (number != std::floor(number)) {
      return In(kCamera, "crop", fmt::format("{} px is not a whole number", number));
    }
  }
  if (crop[2] < kSmallest_px || crop[3] < kSmallest_px) {
    return In(kCamera, "crop",
              fmt::format("{} x {} px is too small; width and height must be at least {}", crop[2],
                          crop[3], kSmallest_px));
  }
  return std::nullopt;
}

/// A nozzle above a warm bed never cools to room temperature.
std::optional<SettingProblem> CheckScanTemperature(const ScanSettings& settings) {
  constexpr double kReachable_c = 50;
  const double temperature_c = settings.scan_nozzle_temperature_c;
  if (temperature_c == 0 || temperature_c >= kReachable_c) return std::nullopt;
  return In(
      kScan, "nozzle_temperature",
      fmt::format("{} °C is below {} °C, which a nozzle above a warm bed may never cool to; 0 "
                  "switches it off and waits for nothing",
                  temperature_c, kReachable_c));
}

/// Addresses, names and keys must be single lines: a line break would begin another header.
std::optional<SettingProblem> CheckSingleLines(const ScanSettings& settings) {
  for (const ScanField& field : ScanFields()) {
    const auto* member = std::get_if<std::string ScanSettings::*>(&field.member);
    if (member == nullptr || field.key.ends_with("_gcode")) continue;
    if ((settings.**member).find_first_of("\r\n") != std::string::npos) {
      return In(field.section, field.key, "holds a line break; it must be a single line");
    }
  }
  return std::nullopt;
}

}  // namespace

std::span<const ScanField> ScanFields() { return kFields; }

std::optional<SettingProblem> FindProblem(const ScanSettings& settings) {
  if (auto problem = FindFieldProblems(settings, ScanFields())) return problem;
  if (auto problem = CheckScanTemperature(settings)) return problem;
  if (auto problem = CheckCrop(settings)) return problem;
  return CheckSingleLines(settings);
}

}  // namespace trammel::settings
