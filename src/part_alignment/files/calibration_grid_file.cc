#include "part_alignment/files/calibration_grid_file.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <numbers>

#include "base/json_text.h"
#include "files/json_object.h"
#include "part_alignment/files/camera_file.h"

namespace trammel::files {
namespace {

using Json = nlohmann::ordered_json;
using part_alignment::GridMeasurement;

constexpr double kMost_mm = 1e6;
constexpr double kMostSigma_mm = 100;
constexpr double kMostSigma_rad = 0.1;

Eigen::Vector3d Three(JsonObject& object, const char* key, NumberRange range) {
  const auto numbers = object.Numbers(key, 3, 3, range);
  if (numbers.size() != 3) return Eigen::Vector3d::Zero();
  return {numbers[0], numbers[1], numbers[2]};
}

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

void ReadCameraFrame(JsonObject& object, part_alignment::Camera& camera) {
  const std::string model =
      object.Choice("model", {"brown_measured_to_ideal", "brown_ideal_to_distorted"});
  camera.convention = model == "brown_ideal_to_distorted"
                          ? part_alignment::CameraConvention::kBrownIdealToDistorted
                          : part_alignment::CameraConvention::kBrownMeasuredToIdeal;
  const auto image_px = object.Numbers("image_px", 2, 2, {16, 100'000});
  camera.pixel_pitch_mm = object.Number("pixel_pitch_mm", {1e-4, 1});
  camera.looks_along = object.Choice("looks_along", {"-z", "+z"}) == "+z"
                           ? part_alignment::LooksAlong::kPlusZ
                           : part_alignment::LooksAlong::kMinusZ;
  if (image_px.size() != 2) return;
  for (const double side : image_px) {
    if (side != static_cast<int>(side)) {
      object.Fault("image_px", fmt::format("has {}; it must be whole numbers of pixels", side));
    }
  }
  camera.width_px = static_cast<int>(image_px[0]);
  camera.height_px = static_cast<int>(image_px[1]);
}

Result<void> ReadSetUp(JsonObject& root, GridMeasurement& grid) {
  auto read = Within(root, "camera", [&](JsonObject& o) { ReadCameraFrame(o, grid.camera); });
  if (!read) return read;
  read = Within(root, "cmm_from_taper", [&](JsonObject& o) {
    grid.cmm_from_taper.translation_mm = Three(o, "translation_mm", {-kMost_mm, kMost_mm});
    constexpr double kTurn = 2 * std::numbers::pi;  // degrees by mistake are mostly beyond
    grid.cmm_from_taper.angles_rad = Three(o, "angles_rad", {-kTurn, kTurn});
    grid.taper_sigma << Three(o, "sigma_mm", {0, kMostSigma_mm}),
        Three(o, "sigma_rad", {0, kMostSigma_rad});
  });
  if (!read) return read;
  return Within(root, "target_from_tip", [&](JsonObject& o) {
    grid.target_from_tip_mm = Three(o, "offset_mm", {-1000, 1000});
    grid.target_from_tip_sigma_mm = Three(o, "sigma_mm", {0, kMostSigma_mm});
  });
}

bool LooksLikeDate(const std::string& date) {
  constexpr std::string_view kShape = "dddd-dd-dd";
  if (date.size() != kShape.size()) return false;
  for (std::size_t i = 0; i < date.size(); ++i) {
    const bool digit = date[i] >= '0' && date[i] <= '9';
    if (kShape[i] == 'd' ? !digit : date[i] != '-') return false;
  }
  return true;
}

}  // namespace

Result<CalibrationGridFile> ReadCalibrationGrid(const std::filesystem::path& path) {
  constexpr std::size_t kMostBytes = 100'000'000;
  constexpr std::size_t kMostViews = 20'000;
  const auto json = ReadJsonFile(path, kMostBytes);
  if (!json) return tl::unexpected(json.error());
  JsonObject root(*json, path.string());
  root.Integer("format", {1, 1});
  CalibrationGridFile file;
  file.date = root.Text("date");
  if (!root.failed() && !LooksLikeDate(file.date)) {
    root.Fault("date", "must be a date, such as \"2026-11-22\"");
  }
  if (auto read = ReadSetUp(root, file.grid); !read) return tl::unexpected(read.error());
  file.grid.position_sigma_mm = root.Number("position_sigma_mm", {0, kMostSigma_mm});
  for (const nlohmann::json& entry : root.List("views", 1, kMostViews)) {
    JsonObject view = root.Inner(entry, fmt::format("views[{}]", file.grid.views.size()));
    part_alignment::GridView seen;
    seen.tip_mm = Three(view, "tip_mm", {-kMost_mm, kMost_mm});
    const part_alignment::Camera& camera = file.grid.camera;
    seen.column_px = view.Number("column_px", {-0.5, camera.width_px - 0.5});
    seen.row_px = view.Number("row_px", {-0.5, camera.height_px - 0.5});
    seen.sigma_px = view.Number("sigma_px", {1e-9, 1e3});
    if (auto read = view.Finish(); !read) return tl::unexpected(read.error());
    file.grid.views.push_back(seen);
  }
  if (auto read = root.Finish(); !read) return tl::unexpected(read.error());
  return file;
}

std::string CalibratedCameraText(const part_alignment::CameraCalibration& calibration,
                                 const std::string& date) {
  CameraFile file;
  file.camera = calibration.camera;
  file.calibration = part_alignment::CalibrationRecord{
      date, calibration.nearest_mm, calibration.farthest_mm, calibration.covariance};
  Json json = Json::parse(CameraFileText(file));
  json["calibration"]["x_residual_rms_px"] = calibration.residual_rms_px;
  return JsonText(json);
}

}  // namespace trammel::files
