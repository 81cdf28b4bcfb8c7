// Camera files of part alignment, and the camera object in observations.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "base/result.h"
#include "files/json_object.h"
#include "part_alignment/camera/calibrate.h"
#include "part_alignment/camera/calibration_record.h"
#include "part_alignment/camera/camera.h"

namespace trammel::files {

struct CameraFile {
  part_alignment::Camera camera;
  std::optional<part_alignment::CalibrationRecord> calibration;
};

/// `{"format": 1, "camera": {…}, "calibration": {…}}` (docs/reference/formats.md). Errors (kInput):
/// not there, not JSON, a key that is missing, unknown or out of its range.
[[nodiscard]] Result<CameraFile> ReadCameraFile(const std::filesystem::path& path);

/// Writes a camera file as text with a final newline; ReadCameraFile reads every number back to the
/// last bit.
[[nodiscard]] std::string CameraFileText(const CameraFile& file);

/// Writes the file of a new calibration. The residuals' root mean square is a key of its own beside
/// the record.
[[nodiscard]] std::string CalibratedCameraText(const CameraFile& file, double residual_rms_px);

/// Reads the keys of a camera object. `object` records a fault, and unknown keys.
[[nodiscard]] part_alignment::Camera ReadCamera(JsonObject& object);

/// Reads the camera keys known before calibration: model, image_px, pixel_pitch_mm and looks_along.
/// Records faults and unknown keys in `object`.
void ReadCameraFrame(JsonObject& object, part_alignment::Camera& camera);

/// Reads the key `date`, YYYY-MM-DD; anything else is a fault of `object`.
[[nodiscard]] std::string ReadDate(JsonObject& object);

[[nodiscard]] nlohmann::ordered_json CameraJson(const part_alignment::Camera& camera);

/// Reads the calibration of a camera file, which must be the whole object.
/// Errors (kInput): a key that is missing, unknown or out of its range.
[[nodiscard]] Result<part_alignment::CalibrationRecord> ReadCalibration(JsonObject object);

[[nodiscard]] nlohmann::ordered_json CalibrationJson(
    const part_alignment::CalibrationRecord& calibration);

struct CalibrationGridFile {
  part_alignment::GridMeasurement grid;
  std::string date;  ///< YYYY-MM-DD
};

/// Reads GRID.json (docs/reference/formats.md). Errors (kInput) name file and place: not JSON, a
/// key that is missing, unknown or out of its range.
[[nodiscard]] Result<CalibrationGridFile> ReadCalibrationGrid(const std::filesystem::path& path);

/// Writes the camera file of a good calibration, readable as any other, with the covariance.
[[nodiscard]] std::string CalibratedCameraText(const part_alignment::CameraCalibration& calibration,
                                               const std::string& date);

}  // namespace trammel::files
