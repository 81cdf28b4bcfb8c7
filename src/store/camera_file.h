// Camera files of part alignment, and the camera object that observations carry.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "base/result.h"
#include "part_alignment/camera.h"
#include "store/json_object.h"

namespace trammel::store {

/// What is known of how the camera was calibrated; what it lacks cannot be warned of.
struct CameraCalibration {
  std::string date;  ///< YYYY-MM-DD
  double nearest_mm =
      0;  ///< from the camera's origin along its axis, of the points it was fitted to
  double farthest_mm = 0;
};

struct CameraFile {
  part_alignment::Camera camera;
  std::optional<CameraCalibration> calibration;
};

/// `{"format": 1, "camera": {…}, "calibration": {…}}` (docs/formats.md). Errors (kInput): not
/// there, not JSON, a key that is missing, unknown or out of its range.
[[nodiscard]] Result<CameraFile> ReadCameraFile(const std::filesystem::path& path);

/// The same as text, ended by a newline; ReadCameraFile gives every number back to the last bit.
[[nodiscard]] std::string CameraFileText(const CameraFile& file);

/// The keys of a camera object; a fault is kept in `object`, and so are keys that nobody asked for.
[[nodiscard]] part_alignment::Camera ReadCamera(JsonObject& object);

/// The camera object of a camera.
[[nodiscard]] nlohmann::ordered_json CameraJson(const part_alignment::Camera& camera);

}  // namespace trammel::store
