#include "part_alignment/files/board_file.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>
#include <utility>

#include "base/json_text.h"
#include "files/json_object.h"
#include "geometry/euler.h"
#include "part_alignment/files/camera_file.h"
#include "part_alignment/files/target_file.h"

namespace trammel::files {
namespace {

using part_alignment::BoardMeasurement;
using part_alignment::BoardTouch;
using part_alignment::BoardView;

constexpr std::size_t kMaxBytes = 20'000'000;
constexpr std::size_t kMaxViews = 2000;
constexpr std::size_t kMaxTouches = 1000;
constexpr double kMax_mm = 1e6;
constexpr double kMaxSigma_mm = 1000;

Eigen::Matrix3d ReadSpindle(JsonObject& view) {
  const auto c_deg = view.OptionalNumber("c_deg", {-720, 720});
  if (c_deg && view.has("spindle_rotation")) {
    view.Fault("c_deg", "stands beside spindle_rotation; leave out one of them");
  }
  if (c_deg) return geometry::RotationFromAngles({0, 0, *c_deg * std::numbers::pi / 180});
  return ReadRotation(view, "spindle_rotation");
}

Result<void> ReadViews(JsonObject& root, BoardMeasurement& measurement) {
  std::set<std::string> names;
  for (const nlohmann::json& entry : root.List("views", 1, kMaxViews)) {
    JsonObject object = root.Inner(entry, fmt::format("views[{}]", measurement.views.size()));
    BoardView view;
    view.picture = object.Text("picture");
    view.spindle_mm = ReadThree(object, "spindle_mm", {-kMax_mm, kMax_mm});
    view.spindle_rotation = ReadSpindle(object);
    if (!object.failed() && (view.picture.empty() || !names.insert(view.picture).second)) {
      object.Fault("picture", "must be the name of a file, and of another one in each view");
    }
    TRY(object.Finish());
    measurement.views.push_back(std::move(view));
  }
  return root.Faults();
}

Result<void> ReadTouches(JsonObject& root, BoardMeasurement& measurement) {
  const nlohmann::json* list = root.OptionalList("touches", 0, kMaxTouches);
  if (list == nullptr) return root.Faults();
  for (const nlohmann::json& entry : *list) {
    JsonObject object = root.Inner(entry, fmt::format("touches[{}]", measurement.touches.size()));
    BoardTouch touch;
    touch.mark = ReadTargetId(object, "mark", nullptr);
    touch.spindle_mm = ReadThree(object, "spindle_mm", {-kMax_mm, kMax_mm});
    touch.tool_length_mm = object.Number("tool_length_mm", {-10'000, 10'000});
    const double sigma_mm = object.Number("sigma_mm", {1e-6, kMaxSigma_mm});
    const std::string axes = object.Text("axes");
    TRY(object.Finish());
    touch.sigma_mm.setConstant(std::numeric_limits<double>::infinity());
    for (const char axis : axes) {
      if (axis < 'x' || axis > 'z') {
        object.Fault("axes", fmt::format("is {}; it must be made of x, y and z",
                                         Show(nlohmann::json(axes))));
        return object.Faults();
      }
      touch.sigma_mm[axis - 'x'] = sigma_mm;
    }
    measurement.touches.push_back(std::move(touch));
  }
  return root.Faults();
}

Result<void> ReadOptional(JsonObject& root, BoardMeasurement& measurement) {
  measurement.tool_length_sigma_mm =
      root.Number("tool_length_sigma_mm", {0, 10}, measurement.tool_length_sigma_mm);
  if (const nlohmann::json* value = root.Find("machine")) {
    JsonObject object = root.Inner(*value, "machine");
    auto& machine = measurement.machine;
    machine.scale = object.Number("scale", {0, 0.01}, machine.scale);
    machine.squareness_rad = object.Number("squareness_rad", {0, 0.01}, machine.squareness_rad);
    machine.lean_rad = object.Number("lean_rad", {0, 0.1}, machine.lean_rad);
    machine.index_rad = object.Number("index_rad", {0, 0.1}, machine.index_rad);
    machine.repeatability_mm =
        object.Number("repeatability_mm", {1e-6, 1}, machine.repeatability_mm);
    TRY(object.Finish());
  }
  if (const nlohmann::json* value = root.Find("place")) {
    JsonObject object = root.Inner(*value, "place");
    part_alignment::CameraPlacePrior place;
    place.at_mm = ReadThree(object, "at_mm", {-10'000, 10'000});
    place.sigma_mm = ReadThree(object, "sigma_mm", {1e-6, kMaxSigma_mm});
    TRY(object.Finish());
    measurement.place = place;
  }
  return root.Faults();
}

// Reads the output of `align targets --layout`; ignores other keys.
Result<void> ReadSheet(const std::filesystem::path& path, BoardFile& file) {
  const auto json = TRY(ReadJsonFile(path, kMaxBytes));
  JsonObject root(json, path.string());
  root.Integer("format", {1, 1});
  file.bits = root.Integer("bits", {12, 20});
  file.measurement.disc_radius_mm = root.Number("radius_mm", {0.1, 100});
  constexpr std::size_t kMaxMarks = 5000;
  std::set<int> pages;
  for (const nlohmann::json& entry : root.List("targets", 1, kMaxMarks)) {
    JsonObject object =
        root.Inner(entry, fmt::format("targets[{}]", file.measurement.layout.size()));
    const nlohmann::json* number = object.Find("number");
    const int page = object.Integer("page", {1, 10'000});
    const double x_mm = object.Number("x_mm", {0, 10'000});
    const double y_mm = object.Number("y_mm", {0, 10'000});
    TRY(object.Faults());
    if (number == nullptr || !number->is_number_integer()) continue;  // a plain disc
    pages.insert(page);
    file.measurement.layout.push_back({std::to_string(number->get<long long>()), {x_mm, -y_mm}});
  }
  // The relative position of pages on the table is unknown.
  if (pages.size() > 1) file.measurement.layout.clear();
  return root.Faults();
}

}  // namespace

Result<BoardFile> ReadBoardFile(const std::filesystem::path& path) {
  const auto json = TRY(ReadJsonFile(path, kMaxBytes));
  JsonObject root(json, path.string());
  root.Integer("format", {1, 1});
  BoardFile file;
  file.date = ReadDate(root);
  const nlohmann::json* camera = root.Find("camera");
  if (camera == nullptr) root.Fault("camera", "is missing");
  TRY(root.Faults());
  JsonObject frame = root.Inner(*camera, "camera");
  file.measurement.lens_focal_length_mm = frame.Number("lens_focal_length_mm", {0, 10'000}, 0);
  ReadCameraFrame(frame, file.measurement.camera);
  TRY(frame.Finish());
  const std::string sheet = root.has("sheet") ? root.Text("sheet") : std::string();
  TRY(ReadViews(root, file.measurement));
  TRY(ReadTouches(root, file.measurement));
  TRY(ReadOptional(root, file.measurement));
  TRY(root.Finish());
  if (sheet.empty()) return file;
  TRY(ReadSheet(path.parent_path() / sheet, file));
  return file;
}

Result<BoardFile> ReadBoardSheet(const std::filesystem::path& path) {
  BoardFile file;
  TRY(ReadSheet(path, file));
  return file;
}

std::string BoardFileText(const BoardFile& board, const std::string& sheet) {
  using Json = nlohmann::ordered_json;
  const auto three = [](const Eigen::Vector3d& v) { return Json::array({v.x(), v.y(), v.z()}); };
  const BoardMeasurement& measurement = board.measurement;
  const Json whole = CameraJson(measurement.camera);
  Json camera = Json::object();
  for (const char* key : {"model", "image_px", "pixel_pitch_mm", "looks_along"}) {
    camera[key] = whole.at(key);
  }
  camera["lens_focal_length_mm"] = measurement.lens_focal_length_mm;
  Json json = {{"format", 1}, {"date", board.date}, {"camera", camera}};
  if (!sheet.empty()) json["sheet"] = sheet;
  json["views"] = Json::array();
  for (const BoardView& view : measurement.views) {
    Json rows = Json::array();
    for (int i = 0; i < 3; ++i) rows.push_back(three(view.spindle_rotation.row(i)));
    json["views"].push_back({{"picture", view.picture},
                             {"spindle_mm", three(view.spindle_mm)},
                             {"spindle_rotation", rows}});
  }
  json["touches"] = Json::array();
  for (const BoardTouch& touch : measurement.touches) {
    std::string axes;
    double sigma_mm = 0;
    for (int axis = 0; axis < 3; ++axis) {
      if (!std::isfinite(touch.sigma_mm[axis])) continue;
      axes += "xyz"[axis];
      sigma_mm = touch.sigma_mm[axis];
    }
    json["touches"].push_back({{"mark", touch.mark},
                               {"spindle_mm", three(touch.spindle_mm)},
                               {"tool_length_mm", touch.tool_length_mm},
                               {"axes", axes},
                               {"sigma_mm", sigma_mm}});
  }
  json["tool_length_sigma_mm"] = measurement.tool_length_sigma_mm;
  if (measurement.place) {
    json["place"] = {{"at_mm", three(measurement.place->at_mm)},
                     {"sigma_mm", three(measurement.place->sigma_mm)}};
  }
  const part_alignment::BoardMachineErrors& machine = measurement.machine;
  json["machine"] = {{"scale", machine.scale},
                     {"squareness_rad", machine.squareness_rad},
                     {"lean_rad", machine.lean_rad},
                     {"index_rad", machine.index_rad},
                     {"repeatability_mm", machine.repeatability_mm}};
  return JsonText(json);
}

std::string CalibratedCameraText(const part_alignment::BoardCalibration& calibration,
                                 const std::string& date) {
  const part_alignment::CalibrationRecord record{date, calibration.nearest_mm,
                                                 calibration.farthest_mm, calibration.covariance};
  return CalibratedCameraText({calibration.camera, record}, calibration.residual_rms_px);
}

}  // namespace trammel::files
