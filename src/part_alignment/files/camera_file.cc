#include "part_alignment/files/camera_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numbers>
#include <vector>

#include "base/json_text.h"
#include "files/json_object.h"
#include "files/whole_file.h"
#include "part_alignment/files/target_file.h"

namespace trammel::files {
namespace {

using Json = nlohmann::ordered_json;
using part_alignment::CalibrationRecord;
using part_alignment::Camera;
using part_alignment::CameraConvention;
using part_alignment::CameraCovariance;
using part_alignment::GridMeasurement;
using part_alignment::LooksAlong;

constexpr const char* kMeasuredToIdeal = "brown_measured_to_ideal";
constexpr const char* kIdealToDistorted = "brown_ideal_to_distorted";
constexpr double kMaxPixels = 100'000;  // along one side
constexpr double kMaxTaper_mm = 10'000;
// Upper limit that mostly excludes an angle in degrees by mistake.
constexpr double kMaxAngle_rad = 2 * std::numbers::pi;
constexpr double kMaxDistance_mm = 1e6;

void ReadTaper(JsonObject& object, Camera& camera) {
  const nlohmann::json* value = object.Find("taper_from_camera");
  if (value == nullptr) {
    object.Fault("taper_from_camera", "is missing");
    return;
  }
  JsonObject taper = object.Inner(*value, "taper_from_camera");
  const auto mm = taper.Numbers("translation_mm", 3, 3, {-kMaxTaper_mm, kMaxTaper_mm});
  const auto rad = taper.Numbers("angles_rad", 3, 3, {-kMaxAngle_rad, kMaxAngle_rad});
  if (const auto read = taper.Finish(); !read) {
    object.Adopt(read.error());
    return;
  }
  camera.taper_from_camera.translation_mm = {mm[0], mm[1], mm[2]};
  camera.taper_from_camera.angles_rad = {rad[0], rad[1], rad[2]};
}

// Reads width and height, as whole numbers. REQUIRES two of them.
void ReadWholePixels(const std::vector<double>& image_px, JsonObject& object, Camera& camera) {
  for (const double side_px : image_px) {
    if (side_px != static_cast<int>(side_px)) {
      object.Fault("image_px", fmt::format("has {}; it must be whole numbers of pixels", side_px));
    }
  }
  camera.width_px = static_cast<int>(image_px[0]);
  camera.height_px = static_cast<int>(image_px[1]);
}

bool IsDate(const std::string& text) {
  constexpr std::string_view kShape = "0000-00-00";
  return text.size() == kShape.size() &&
         std::equal(text.begin(), text.end(), kShape.begin(), [](char c, char shape) {
           return shape == '0' ? c >= '0' && c <= '9' : c == shape;
         });
}

// Reads the covariance; absent if the file has none, and after a fault.
std::optional<CameraCovariance> ReadCovariance(JsonObject& object) {
  constexpr std::size_t kSize = part_alignment::kCameraParameters;
  const nlohmann::json* names = object.OptionalList("parameters", kSize, kSize);
  const nlohmann::json* rows = object.OptionalList("covariance", kSize, kSize);
  if (names == nullptr || rows == nullptr) {
    if ((names == nullptr) != (rows == nullptr) && !object.failed()) {
      object.Fault(names == nullptr ? "parameters" : "covariance",
                   "is missing; parameters and covariance come together");
    }
    return std::nullopt;
  }
  CameraCovariance covariance;
  for (std::size_t i = 0; i < kSize; ++i) {
    if ((*names)[i] != part_alignment::kCameraParameterNames[i]) {
      object.Fault("parameters", fmt::format("has {} in place {}; it must be {}", Show((*names)[i]),
                                             i, part_alignment::kCameraParameterNames[i]));
      return std::nullopt;
    }
    const nlohmann::json& row = (*rows)[i];
    const bool numbers =
        row.is_array() && row.size() == kSize &&
        std::all_of(row.begin(), row.end(), [](const auto& entry) { return entry.is_number(); });
    if (!numbers) {
      object.Fault("covariance", fmt::format("has no {} numbers in row {}", kSize, i));
      return std::nullopt;
    }
    for (std::size_t k = 0; k < kSize; ++k) {
      covariance(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)) = row[k].get<double>();
    }
  }
  if (const auto valid = part_alignment::Validate(covariance); !valid) {
    object.Fault("covariance", "is none: " + valid.error().message);
    return std::nullopt;
  }
  return covariance;
}

Json List(const Eigen::Vector3d& v) { return Json::array({v.x(), v.y(), v.z()}); }

Json FileJson(const CameraFile& file) {
  Json json = {{"format", 1}, {"camera", CameraJson(file.camera)}};
  if (file.calibration) json["calibration"] = CalibrationJson(*file.calibration);
  return json;
}

constexpr double kMax_mm = 1e6;
constexpr double kMaxSigma_mm = 100;
constexpr double kMaxSigma_rad = 0.1;

// Reads an object within an object: `read` fills it, the outer one records its faults.
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
    grid.cmm_from_taper.translation_mm = ReadThree(o, "translation_mm", {-kMax_mm, kMax_mm});
    constexpr double kTurn = 2 * std::numbers::pi;  // degrees by mistake are mostly beyond
    grid.cmm_from_taper.angles_rad = ReadThree(o, "angles_rad", {-kTurn, kTurn});
    grid.taper_sigma << ReadThree(o, "sigma_mm", {0, kMaxSigma_mm}),
        ReadThree(o, "sigma_rad", {0, kMaxSigma_rad});
  });
  if (!read) return read;
  return Within(root, "target_from_tip", [&](JsonObject& o) {
    grid.target_from_tip_mm = ReadThree(o, "offset_mm", {-1000, 1000});
    grid.target_from_tip_sigma_mm = ReadThree(o, "sigma_mm", {0, kMaxSigma_mm});
  });
}

}  // namespace

void ReadCameraFrame(JsonObject& object, Camera& camera) {
  constexpr double kFewestPixels = 16;
  const std::string model = object.Choice("model", {kMeasuredToIdeal, kIdealToDistorted});
  camera.convention = model == kIdealToDistorted ? CameraConvention::kBrownIdealToDistorted
                                                 : CameraConvention::kBrownMeasuredToIdeal;
  const auto image_px = object.Numbers("image_px", 2, 2, {kFewestPixels, kMaxPixels});
  camera.pixel_pitch_mm = object.Number("pixel_pitch_mm", {1e-4, 1});
  camera.looks_along =
      object.Choice("looks_along", {"-z", "+z"}) == "+z" ? LooksAlong::kPlusZ : LooksAlong::kMinusZ;
  if (image_px.size() == 2) ReadWholePixels(image_px, object, camera);
}

std::string ReadDate(JsonObject& object) {
  std::string date = object.Text("date");
  if (!object.failed() && !IsDate(date)) {
    object.Fault("date", fmt::format("is {}; it must be a date, such as \"2026-11-22\"",
                                     Show(nlohmann::json(date))));
  }
  return date;
}

Camera ReadCamera(JsonObject& object) {
  Camera camera;
  const std::string model = object.Choice("model", {kMeasuredToIdeal, kIdealToDistorted});
  camera.convention = model == kIdealToDistorted ? CameraConvention::kBrownIdealToDistorted
                                                 : CameraConvention::kBrownMeasuredToIdeal;
  const auto image_px = object.Numbers("image_px", 2, 2, {1, kMaxPixels});
  camera.pixel_pitch_mm = object.Number("pixel_pitch_mm", {1e-5, 1});
  camera.focal_length_mm = object.Number("focal_length_mm", {1e-3, 1e5});
  const auto offset_px =
      object.Numbers("principal_point_offset_px", 2, 2, {-kMaxPixels, kMaxPixels});
  camera.k1 = object.Number("k1", {-1e-3, 1e-3});
  camera.k2 = object.Number("k2", {-1e-6, 1e-6});
  camera.p1 = object.Number("p1", {-0.01, 0.01});
  camera.p2 = object.Number("p2", {-0.01, 0.01});
  ReadTaper(object, camera);
  camera.looks_along =
      object.Choice("looks_along", {"-z", "+z"}) == "+z" ? LooksAlong::kPlusZ : LooksAlong::kMinusZ;
  if (object.failed()) return camera;
  ReadWholePixels(image_px, object, camera);
  camera.principal_point_offset_px = {offset_px[0], offset_px[1]};
  return camera;
}

Json CameraJson(const Camera& camera) {
  const bool measured = camera.convention == CameraConvention::kBrownMeasuredToIdeal;
  const Eigen::Vector2d& offset_px = camera.principal_point_offset_px;
  return {{"model", measured ? kMeasuredToIdeal : kIdealToDistorted},
          {"image_px", Json::array({camera.width_px, camera.height_px})},
          {"pixel_pitch_mm", camera.pixel_pitch_mm},
          {"focal_length_mm", camera.focal_length_mm},
          {"principal_point_offset_px", Json::array({offset_px.x(), offset_px.y()})},
          {"k1", camera.k1},
          {"k2", camera.k2},
          {"p1", camera.p1},
          {"p2", camera.p2},
          {"taper_from_camera",
           {{"translation_mm", List(camera.taper_from_camera.translation_mm)},
            {"angles_rad", List(camera.taper_from_camera.angles_rad)}}},
          {"looks_along", camera.looks_along == LooksAlong::kPlusZ ? "+z" : "-z"}};
}

Result<CalibrationRecord> ReadCalibration(JsonObject object) {
  CalibrationRecord calibration;
  calibration.date = ReadDate(object);
  const auto range_mm = object.Numbers("distance_mm", 2, 2, {0, kMaxDistance_mm});
  if (!object.failed() && range_mm[0] >= range_mm[1]) {
    object.Fault("distance_mm", fmt::format("is [{}, {}]; it must be the nearest and the farthest",
                                            range_mm[0], range_mm[1]));
  }
  calibration.covariance = ReadCovariance(object);
  TRY(object.Finish());
  calibration.nearest_mm = range_mm[0];
  calibration.farthest_mm = range_mm[1];
  return calibration;
}

Json CalibrationJson(const CalibrationRecord& calibration) {
  Json json = {{"date", calibration.date},
               {"distance_mm", Json::array({calibration.nearest_mm, calibration.farthest_mm})}};
  if (!calibration.covariance) return json;
  json["parameters"] = part_alignment::kCameraParameterNames;
  json["covariance"] = Json::array();
  for (const auto& row : calibration.covariance->rowwise()) {
    json["covariance"].push_back(std::vector<double>(row.begin(), row.end()));
  }
  return json;
}

Result<CameraFile> ReadCameraFile(const std::filesystem::path& path) {
  constexpr std::size_t kMaxBytes = 1'000'000;
  // Many programs store a camera's parameters, each in a convention of its own.
  constexpr const char* kConvert =
      "cameras of OpenCV, ROS and mrcal become one by trammel align camera FILE --out camera.json";
  const auto text = TRY(ReadWholeFile(path, kMaxBytes));
  const auto json = ParseJson(text, path.string());
  if (!json) return Fail(fmt::format("{} ({})", json.error().message, kConvert));
  JsonObject root(*json, path.string());
  const nlohmann::json* value = root.Find("camera");
  if (value == nullptr) root.Fault("camera", fmt::format("is missing ({})", kConvert));
  root.Integer("format", {1, 1});
  const nlohmann::json* calibration = root.Find("calibration");
  TRY(root.Finish());
  CameraFile file;
  JsonObject object = root.Inner(*value, "camera");
  file.camera = ReadCamera(object);
  TRY(object.Finish());
  if (calibration != nullptr) {
    file.calibration = TRY(ReadCalibration(root.Inner(*calibration, "calibration")));
  }
  return file;
}

std::string CameraFileText(const CameraFile& file) { return JsonText(FileJson(file)); }

std::string CalibratedCameraText(const CameraFile& file, double residual_rms_px) {
  Json json = FileJson(file);
  json["calibration"]["x_residual_rms_px"] = residual_rms_px;
  return JsonText(json);
}

Result<CalibrationGridFile> ReadCalibrationGrid(const std::filesystem::path& path) {
  constexpr std::size_t kMaxBytes = 100'000'000;
  constexpr std::size_t kMaxViews = 20'000;
  const auto json = TRY(ReadJsonFile(path, kMaxBytes));
  JsonObject root(json, path.string());
  root.Integer("format", {1, 1});
  CalibrationGridFile file;
  file.date = ReadDate(root);
  TRY(ReadSetUp(root, file.grid));
  file.grid.position_sigma_mm = root.Number("position_sigma_mm", {0, kMaxSigma_mm});
  for (const nlohmann::json& entry : root.List("views", 1, kMaxViews)) {
    JsonObject view = root.Inner(entry, fmt::format("views[{}]", file.grid.views.size()));
    part_alignment::GridView seen;
    seen.tip_mm = ReadThree(view, "tip_mm", {-kMax_mm, kMax_mm});
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
