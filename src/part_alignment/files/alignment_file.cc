#include "part_alignment/files/alignment_file.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "base/json_text.h"
#include "part_alignment/files/target_file.h"

namespace trammel::files {
namespace {

using Json = nlohmann::ordered_json;
using part_alignment::Camera;
using part_alignment::InputUncertainty;
using part_alignment::kUncertainInputs;
using part_alignment::Observation;
using part_alignment::PartTarget;
using part_alignment::UncertainInput;
using part_alignment::Unknowns;
using part_alignment::View;

constexpr std::size_t kMaxBytes = 100'000'000;
constexpr std::size_t kMaxTargets = 10'000;  // seen in a view
constexpr std::size_t kMaxViews = 10'000;
constexpr double kMaxPlace_mm = 1e6;
constexpr double kMaxSigma_px = 1e3;
constexpr std::size_t kLongestName = 1000;  // of a picture's name

struct NamedUnknown {
  const char* name;
  bool Unknowns::*member;
};
constexpr std::array<NamedUnknown, 5> kUnknowns = {{
    {"clamp_angle", &Unknowns::clamp_angle},
    {"clamp_eccentricity", &Unknowns::clamp_eccentricity},
    {"clamp_tilt", &Unknowns::clamp_tilt},
    {"focal_length", &Unknowns::focal_length},
    {"camera_offset", &Unknowns::camera_offset},
}};
constexpr const char* kPose = "pose";

constexpr const char* kInputsKey = "input_uncertainty";

/// The file that a key names, from the folder of the one that names it.
Result<std::filesystem::path> NamedFile(JsonObject& root, const char* key,
                                        const nlohmann::json& value,
                                        const std::filesystem::path& path) {
  auto named = path.parent_path() / value.get<std::string>();
  std::error_code missing;  // said by the reader
  const auto status = std::filesystem::status(named, missing);
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {
    root.Fault(key, fmt::format("names {}, which is not a regular file", Show(value)));
    TRY(root.Faults());
  }
  return named;
}

// Reads the targets from the file or the one it names, without scale bar ends that no view shows.
Result<void> ReadTargets(JsonObject& root, const std::filesystem::path& path, TargetList& list) {
  const nlohmann::json* value = root.Find("targets");
  if (value == nullptr || !value->is_string()) {
    list = TRY(ReadTargetList(root));
    return {};
  }
  list = TRY(ReadTargetFile(TRY(NamedFile(root, "targets", *value, path))));
  return {};
}

void ReadObservation(JsonObject& object, const Camera& camera, const std::set<std::string>& known,
                     View& view) {
  Observation seen;
  seen.target = ReadTargetId(object, "target", nullptr);
  // The first pixel's centre is (0, 0), so the picture begins half a pixel before it.
  seen.column_px = object.Number("column_px", {-0.5, camera.width_px - 0.5});
  seen.row_px = object.Number("row_px", {-0.5, camera.height_px - 0.5});
  seen.sigma_px = object.Number("sigma_px", {1e-9, kMaxSigma_px});
  if (object.failed()) return;
  if (!known.contains(seen.target)) {
    object.Fault("target", fmt::format("is {}, which is none of the targets", seen.target));
  }
  for (const Observation& other : view.observations) {
    if (other.target == seen.target) {
      object.Fault("target", fmt::format("is {}, seen twice in this view", seen.target));
    }
  }
  view.observations.push_back(std::move(seen));
}

// Reads the name without checking the file; empty if there is none.
std::string ReadPictureName(JsonObject& object) {
  const nlohmann::json* name = object.Find("picture");
  if (name == nullptr || name->is_null()) return {};
  if (!name->is_string() || name->get_ref<const std::string&>().size() > kLongestName) {
    object.Fault("picture", fmt::format("is {}; it must be a file name of at most {} bytes",
                                        Show(*name), kLongestName));
    return {};
  }
  return name->get<std::string>();
}

Result<void> ReadViews(JsonObject& root, std::size_t least, AlignmentInput& input) {
  std::set<std::string> known;
  for (const PartTarget& target : input.measurement.targets) known.insert(target.id);
  if (least == 0 && !root.has("views")) return {};
  for (const nlohmann::json& entry : root.List("views", least, kMaxViews)) {
    auto& views = input.measurement.views;
    const std::string at = fmt::format("views[{}]", views.size());
    JsonObject object = root.Inner(entry, at);
    View view;
    const auto mm = object.Numbers("spindle_mm", 3, 3, {-kMaxPlace_mm, kMaxPlace_mm});
    view.spindle_rotation = ReadRotation(object, "spindle_rotation");
    input.pictures.push_back(ReadPictureName(object));
    static const nlohmann::json kNone = nlohmann::json::array();
    const nlohmann::json* seen_here = object.OptionalList("observations", 0, kMaxTargets);
    TRY(object.Finish());
    view.spindle_mm = {mm[0], mm[1], mm[2]};
    for (const nlohmann::json& seen : seen_here != nullptr ? *seen_here : kNone) {
      JsonObject inner =
          object.Inner(seen, fmt::format("observations[{}]", view.observations.size()));
      ReadObservation(inner, input.measurement.camera, known, view);
      TRY(inner.Finish());
    }
    views.push_back(std::move(view));
  }
  return root.Faults();
}

std::set<std::string> ObservedIn(const std::vector<View>& views) {
  std::set<std::string> ids;
  for (const View& view : views) {
    for (const Observation& seen : view.observations) ids.insert(seen.target);
  }
  return ids;
}

Result<void> ReadCameraOf(JsonObject& root, const std::filesystem::path& path,
                          AlignmentInput& input) {
  const nlohmann::json* value = root.Find("camera");
  if (value == nullptr) {
    root.Fault("camera", "is missing");
    return root.Faults();
  }
  if (value->is_string()) {
    const auto file = TRY(ReadCameraFile(TRY(NamedFile(root, "camera", *value, path))));
    input.measurement.camera = file.camera;
    input.calibration = file.calibration;
    return {};
  }
  JsonObject object = root.Inner(*value, "camera");
  input.measurement.camera = ReadCamera(object);
  TRY(object.Finish());
  const nlohmann::json* calibration = root.Find("calibration");
  if (calibration == nullptr) return {};
  input.calibration = TRY(ReadCalibration(root.Inner(*calibration, "calibration")));
  return {};
}

void ReadUnknowns(JsonObject& root, AlignmentInput& input) {
  const nlohmann::json* list = root.OptionalList("unknowns", 1, kUnknowns.size() + 1);
  if (list == nullptr) return;
  std::vector<std::string> names;
  for (const nlohmann::json& entry : *list) {
    names.push_back(entry.is_string() ? entry.get<std::string>() : Show(entry));
  }
  const auto unknowns = ParseUnknowns(names);
  if (!unknowns) {
    root.Fault("unknowns", unknowns.error().message);
    return;
  }
  input.unknowns = *unknowns;
}

Result<void> ReadInputs(JsonObject& root, InputUncertainty& inputs) {
  const nlohmann::json* value = root.Find(kInputsKey);
  if (value == nullptr) return {};
  constexpr NumberRange kRange{0, 1000};  // part_alignment::Validate's
  JsonObject object = root.Inner(*value, kInputsKey);
  for (const UncertainInput& input : kUncertainInputs) {
    inputs.*input.size = object.OptionalNumber(input.name, kRange);
  }
  return object.Finish();
}

Json IdJson(const std::string& id, const std::set<std::string>& numeric) {
  return numeric.contains(id) ? Json::parse(id) : Json(id);
}

Json ViewJson(const View& view, const std::set<std::string>& numeric, const std::string& picture) {
  Json rotation = Json::array();
  for (int i = 0; i < 3; ++i) {
    const auto row = view.spindle_rotation.row(i);
    rotation.push_back(Json::array({row(0), row(1), row(2)}));
  }
  Json observations = Json::array();
  for (const Observation& seen : view.observations) {
    observations.push_back({{"target", IdJson(seen.target, numeric)},
                            {"column_px", seen.column_px},
                            {"row_px", seen.row_px},
                            {"sigma_px", seen.sigma_px}});
  }
  const Eigen::Vector3d& at = view.spindle_mm;
  Json json = {{"spindle_mm", Json::array({at.x(), at.y(), at.z()})},
               {"spindle_rotation", std::move(rotation)},
               {"observations", std::move(observations)}};
  if (!picture.empty()) json["picture"] = picture;
  return json;
}

}  // namespace

Result<Unknowns> ParseUnknowns(const std::vector<std::string>& names) {
  Unknowns unknowns;
  for (const NamedUnknown& known : kUnknowns) unknowns.*known.member = false;
  std::set<std::string> seen;
  for (const std::string& name : names) {
    if (!seen.insert(name).second) return Fail(fmt::format("name {} twice", name));
    bool found = name == kPose;
    for (const NamedUnknown& known : kUnknowns) {
      if (name != known.name) continue;
      unknowns.*known.member = true;
      found = true;
    }
    if (!found) {
      return Fail(
          fmt::format("name {}; known are pose, clamp_angle, clamp_eccentricity, "
                      "clamp_tilt, focal_length and camera_offset",
                      name));
    }
  }
  if (!seen.contains(kPose)) return Fail("leave out pose, which is always unknown: name it");
  return unknowns;
}

std::vector<std::string> NamesOf(const Unknowns& unknowns) {
  std::vector<std::string> names = {kPose};
  for (const NamedUnknown& known : kUnknowns) {
    if (unknowns.*known.member) names.emplace_back(known.name);
  }
  return names;
}

Result<AlignmentInput> ReadAlignmentFile(const std::filesystem::path& path, std::size_t min_views) {
  const auto json = TRY(ReadJsonFile(path, kMaxBytes));
  JsonObject root(json, path.string());
  AlignmentInput input;
  root.Integer("format", {1, 1});
  TRY(root.Faults());
  TRY(ReadCameraOf(root, path, input));
  TargetList targets;
  TRY(ReadTargets(root, path, targets));
  input.measurement.targets = targets.targets;
  TRY(ReadViews(root, min_views, input));
  DropBarEnds(ObservedIn(input.measurement.views), targets);
  input.measurement.targets = std::move(targets.targets);
  input.target_covariance = std::move(targets.covariance);
  input.numeric_ids = std::move(targets.numeric_ids);
  TRY(ReadInputs(root, input.inputs));
  ReadUnknowns(root, input);
  TRY(root.Finish());
  return input;
}

std::string AlignmentFileText(const AlignmentInput& input) {
  Json json = {{"format", 1}, {"camera", CameraJson(input.measurement.camera)}};
  if (input.calibration) json["calibration"] = CalibrationJson(*input.calibration);
  json["targets"] = Json::array();
  for (const PartTarget& target : input.measurement.targets) {
    const Eigen::Vector3d& at = target.ideal_mm;
    json["targets"].push_back({{"id", IdJson(target.id, input.numeric_ids)},
                               {"ideal_mm", Json::array({at.x(), at.y(), at.z()})}});
  }
  if (input.target_covariance) {
    json["targets_covariance_mm2"] = TargetCovarianceJson(*input.target_covariance);
  }
  json["views"] = Json::array();
  const std::vector<View>& views = input.measurement.views;
  for (std::size_t i = 0; i < views.size(); ++i) {
    json["views"].push_back(
        ViewJson(views[i], input.numeric_ids, i < input.pictures.size() ? input.pictures[i] : ""));
  }
  json["unknowns"] = NamesOf(input.unknowns);
  for (const UncertainInput& named : kUncertainInputs) {
    const std::optional<double>& stated = input.inputs.*named.size;
    if (stated) json[kInputsKey][named.name] = *stated;
  }
  return JsonText(json);
}

}  // namespace trammel::files
