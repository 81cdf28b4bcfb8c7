// Camera files of part alignment, and the camera object that observations carry.
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

/// The same as text, ended by a newline; ReadCameraFile gives every number back to the last bit.
[[nodiscard]] std::string CameraFileText(const CameraFile& file);

/// The file of a calibration that has just been made: its residuals' root mean square stands beside
/// the record, as a key of its own.
[[nodiscard]] std::string CalibratedCameraText(const CameraFile& file, double residual_rms_px);

/// The keys of a camera object; a fault is kept in `object`, and so are keys that nobody asked for.
[[nodiscard]] part_alignment::Camera ReadCamera(JsonObject& object);

/// What of a camera is given before it is calibrated: model, image_px, pixel_pitch_mm and
/// looks_along. A fault is kept in `object`, and so are keys that nobody asked for.
void ReadCameraFrame(JsonObject& object, part_alignment::Camera& camera);

/// The key `date`, YYYY-MM-DD; anything else is a fault of `object`.
[[nodiscard]] std::string ReadDate(JsonObject& object);

/// The camera object of a camera.
[[nodiscard]] nlohmann::ordered_json CameraJson(const part_alignment::Camera& camera);

/// What a camera file says of the calibration; the whole object is asked for.
/// Errors (kInput): a key that is missing, unknown or out of its range.
[[nodiscard]] Result<part_alignment::CalibrationRecord> ReadCalibration(JsonObject object);

[[nodiscard]] nlohmann::ordered_json CalibrationJson(
    const part_alignment::CalibrationRecord& calibration);

struct CalibrationGridFile {
  part_alignment::GridMeasurement grid;
  std::string date;  ///< YYYY-MM-DD
};

/// GRID.json (docs/reference/formats.md). Errors (kInput) name file and place: not JSON, a key that
/// is missing, unknown or out of its range.
[[nodiscard]] Result<CalibrationGridFile> ReadCalibrationGrid(const std::filesystem::path& path);

/// The camera file of a good calibration: readable as any other, with the covariance beside.
[[nodiscard]] std::string CalibratedCameraText(const part_alignment::CameraCalibration& calibration,
                                               const std::string& date);

}  // namespace trammel::files
