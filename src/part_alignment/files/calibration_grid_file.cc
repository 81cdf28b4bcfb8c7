#include "part_alignment/files/calibration_grid_file.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <numbers>

#include "files/json_object.h"
#include "part_alignment/files/camera_file.h"
#include "part_alignment/files/three_numbers.h"

namespace trammel::files {
namespace {

using part_alignment::GridMeasurement;

constexpr double kMost_mm = 1e6;
constexpr double kMostSigma_mm = 100;
constexpr double kMostSigma_rad = 0.1;

// An object within an object: `read` fills it, its faults are the outer one's.
template <class Read>
Result<void> Within(JsonObject& outer, const char* key, const Read& read) {
  const nlohmann::json* value = outer.Find(key);
  if (value == nullptr) {
    outer.Fault(key, "is missing");
    return outer.Faults();
  }
  JsonObject inner = outer.Inner(*value, key);
  read(inner);
  return inner.Finish();
}

Result<void> ReadSetUp(JsonObject& root, GridMeasurement& grid) {
  auto read = Within(root, "camera", [&](JsonObject& o) { ReadCameraFrame(o, grid.camera); });
  if (!read) return read;
  read = Within(root, "cmm_from_taper", [&](JsonObject& o) {
    grid.cmm_from_taper.translation_mm = ReadThree(o, "translation_mm", {-kMost_mm, kMost_mm});
    constexpr double kTurn = 2 * std::numbers::pi;  // degrees by mistake are mostly beyond
    grid.cmm_from_taper.angles_rad = ReadThree(o, "angles_rad", {-kTurn, kTurn});
    grid.taper_sigma << ReadThree(o, "sigma_mm", {0, kMostSigma_mm}),
        ReadThree(o, "sigma_rad", {0, kMostSigma_rad});
  });
  if (!read) return read;
  return Within(root, "target_from_tip", [&](JsonObject& o) {
    grid.target_from_tip_mm = ReadThree(o, "offset_mm", {-1000, 1000});
    grid.target_from_tip_sigma_mm = ReadThree(o, "sigma_mm", {0, kMostSigma_mm});
  });
}

}  // namespace

Result<CalibrationGridFile> ReadCalibrationGrid(const std::filesystem::path& path) {
  constexpr std::size_t kMostBytes = 100'000'000;
  constexpr std::size_t kMostViews = 20'000;
  const auto json = TRY(ReadJsonFile(path, kMostBytes));
  JsonObject root(json, path.string());
  root.Integer("format", {1, 1});
  CalibrationGridFile file;
  file.date = ReadDate(root);
  TRY(ReadSetUp(root, file.grid));
  file.grid.position_sigma_mm = root.Number("position_sigma_mm", {0, kMostSigma_mm});
  for (const nlohmann::json& entry : root.List("views", 1, kMostViews)) {
    JsonObject view = root.Inner(entry, fmt::format("views[{}]", file.grid.views.size()));
    part_alignment::GridView seen;
    seen.tip_mm = ReadThree(view, "tip_mm", {-kMost_mm, kMost_mm});
    const part_alignment::Camera& camera = file.grid.camera;
    seen.column_px = view.Number("column_px", {-0.5, camera.width_px - 0.5});
    seen.row_px = view.Number("row_px", {-0.5, camera.height_px - 0.5});
    seen.sigma_px = view.Number("sigma_px", {1e-9, 1e3});
    TRY(view.Finish());
    file.grid.views.push_back(seen);
  }
  TRY(root.Finish());
  return file;
}

std::string CalibratedCameraText(const part_alignment::CameraCalibration& calibration,
                                 const std::string& date) {
  const part_alignment::CalibrationRecord record{date, calibration.nearest_mm,
                                                 calibration.farthest_mm, calibration.covariance};
  return CalibratedCameraText({calibration.camera, record}, calibration.residual_rms_px);
}

}  // namespace trammel::files
