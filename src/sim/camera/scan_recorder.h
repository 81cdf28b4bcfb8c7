// Records a laser scan of a printed bed: a folder like that of a real printer.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "base/random.h"
#include "base/result.h"
#include "sim/laser/laser_camera.h"
#include "sim/print/bed.h"
#include "sim/print/plan_file.h"

namespace trammel::sim {

/// Scale and angle that a set-up of the camera found, with standard uncertainties.
struct SetUpScale {
  double px_per_mm = 0;
  double px_per_mm_sigma = 0;
  double laser_angle_rad = 0;  ///< shift over height, as an angle: perspective included
  double laser_angle_sigma_rad = 0;
};

/// Draws a set-up's answer, with the errors of trammel pa setup on virtual printers.
[[nodiscard]] SetUpScale DrawSetUpScale(const LaserTraits& optics, Random& random);

struct ScanOptions {
  int frame_width_px = kSensorWidthPx;    ///< 64 … 1280; smaller frames are windows of the sensor
  int frame_height_px = kSensorHeightPx;  ///< 64 … 720
  int pattern = 0;                        ///< index of the scanned pattern
  double scan_speed_mm_s = 400.0 / 60;    ///< the paper's 400 mm/min; > 0 … 100
  int frames_per_s = 30;                  ///< 1 … 240
  double skip_mm = 4;                     ///< at either end of a line; the paper's
  bool opaque_plate = false;              ///< state that no light enters the plate
  std::optional<SetUpScale> set_up;  ///< absent: a nominal scale of unknown uncertainty is stated
};

/// Returns the paper's scan, or, for lines that change speed before its skip ends, a faster one
/// that begins nearer to their ends.
[[nodiscard]] ScanOptions ScanOptionsFor(const Plan& plan);

/// Sweeps every line of one pattern along its print direction and writes scan.json with a video per
/// line into a new folder.
/// @param eye     Geometry and appearance, for example from DrawLaserTraits.
/// @param random  Seeds textures, speckle, noise and capture times: equal seeds, equal bytes.
/// Errors (kInput): the folder exists already, cannot be written, the plan has no such pattern, or
/// its lines are too short to be scanned. Cost: about 0.7 ms a frame at 160 x 120, 15 ms at full
/// size.
[[nodiscard]] Result<void> RecordScan(const Bed& bed, const Plan& plan, const Condition& condition,
                                      const LaserTraits& optics, const ScanOptions& options,
                                      const Random& random, const std::filesystem::path& folder);

/// Writes truth.json (docs/reference/formats.md) into a recording's folder.
[[nodiscard]] Result<void> WriteTruth(const std::filesystem::path& folder, const PrintTruth& truth,
                                      std::uint64_t seed, const std::string& condition);

/// Does the same with any file name.
[[nodiscard]] Result<void> WriteTruthFile(const std::filesystem::path& path,
                                          const PrintTruth& truth, std::uint64_t seed,
                                          const std::string& condition);

}  // namespace trammel::sim
