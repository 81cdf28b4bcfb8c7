#include "part_alignment/files/survey_file.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "base/json_text.h"
#include "files/json_object.h"
#include "part_alignment/files/part_fit_file.h"
#include "part_alignment/files/target_file.h"

namespace trammel::files {
namespace {

using part_alignment::ImageEllipse;
using part_alignment::Observation;
using part_alignment::PlainPoint;
using part_alignment::SurveyPicture;

constexpr std::size_t kMaxBytes = 100'000'000;
constexpr std::size_t kMaxPictures = 10'000;
constexpr std::size_t kMaxObservations = 10'000;  // per picture
constexpr double kMax_px = 1e6;
constexpr double kMaxTurn = 7;  // rad: a full one and a little

// Reads the outline of a disc about this centre, if there is one.
std::optional<ImageEllipse> ReadDisc(JsonObject& object, double column_px, double row_px) {
  if (!object.has("disc_px")) return std::nullopt;
  const auto axes = object.Numbers("disc_px", 2, 2, {0, kMax_px});
  const double angle_rad = object.Number("disc_angle_rad", {-kMaxTurn, kMaxTurn});
  if (axes.size() != 2) return std::nullopt;
  return ImageEllipse{column_px, row_px, axes[0], axes[1], angle_rad};
}

Result<std::vector<PlainPoint>> ReadPlainPoints(JsonObject& picture) {
  std::vector<PlainPoint> points;
  if (!picture.has("plain_points")) return points;
  for (const nlohmann::json& entry : picture.List("plain_points", 0, kMaxObservations)) {
    JsonObject inner = picture.Inner(entry, fmt::format("plain_points[{}]", points.size()));
    PlainPoint point;
    point.column_px = inner.Number("column_px", {-kMax_px, kMax_px});
    point.row_px = inner.Number("row_px", {-kMax_px, kMax_px});
    point.sigma_px = inner.Number("sigma_px", {1e-6, 1e3});
    point.disc = ReadDisc(inner, point.column_px, point.row_px);
    TRY(inner.Finish());
    points.push_back(point);
  }
  return points;
}

void AddDisc(const ImageEllipse& disc, nlohmann::ordered_json& entry) {
  entry["disc_px"] = {disc.semi_major_px, disc.semi_minor_px};
  entry["disc_angle_rad"] = disc.angle_rad;
}

Result<SurveyPicture> ReadPicture(JsonObject object) {
  SurveyPicture picture;
  picture.name = object.Text("name");
  const auto size = object.Numbers("image_px", 2, 2, {2, 100'000});
  if (size.size() == 2) {
    picture.width_px = static_cast<int>(size[0]);
    picture.height_px = static_cast<int>(size[1]);
  }
  for (const nlohmann::json& entry : object.List("observations", 0, kMaxObservations)) {
    JsonObject inner =
        object.Inner(entry, fmt::format("observations[{}]", picture.observations.size()));
    Observation observation;
    observation.target = ReadTargetId(inner, "target", nullptr);
    observation.column_px = inner.Number("column_px", {-kMax_px, kMax_px});
    observation.row_px = inner.Number("row_px", {-kMax_px, kMax_px});
    observation.sigma_px = inner.Number("sigma_px", {1e-6, 1e3});
    if (const auto disc = ReadDisc(inner, observation.column_px, observation.row_px)) {
      picture.discs.push_back(*disc);
    }
    TRY(inner.Finish());
    picture.observations.push_back(std::move(observation));
  }
  picture.plain = TRY(ReadPlainPoints(object));
  TRY(object.Finish());
  return picture;
}

}  // namespace

Result<std::vector<SurveyPicture>> ReadSurveyFile(const std::filesystem::path& path) {
  const auto json = TRY(ReadJsonFile(path, kMaxBytes));
  JsonObject root(json, path.string());
  root.Integer("format", {1, 1});
  std::vector<SurveyPicture> pictures;
  for (const nlohmann::json& entry : root.List("pictures", 1, kMaxPictures)) {
    pictures.push_back(
        TRY(ReadPicture(root.Inner(entry, fmt::format("pictures[{}]", pictures.size())))));
  }
  TRY(root.Finish());
  return pictures;
}

std::string SurveyFileText(const std::vector<SurveyPicture>& pictures) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const SurveyPicture& picture : pictures) {
    nlohmann::ordered_json observations = nlohmann::ordered_json::array();
    for (std::size_t i = 0; i < picture.observations.size(); ++i) {
      const Observation& observation = picture.observations[i];
      nlohmann::ordered_json entry = {{"target", observation.target},
                                      {"column_px", observation.column_px},
                                      {"row_px", observation.row_px},
                                      {"sigma_px", observation.sigma_px}};
      if (i < picture.discs.size()) AddDisc(picture.discs[i], entry);
      observations.push_back(std::move(entry));
    }
    list.push_back({{"name", picture.name},
                    {"image_px", {picture.width_px, picture.height_px}},
                    {"observations", std::move(observations)}});
    if (picture.plain.empty()) continue;
    nlohmann::ordered_json plain = nlohmann::ordered_json::array();
    for (const PlainPoint& point : picture.plain) {
      nlohmann::ordered_json entry = {
          {"column_px", point.column_px}, {"row_px", point.row_px}, {"sigma_px", point.sigma_px}};
      if (point.disc) AddDisc(*point.disc, entry);
      plain.push_back(std::move(entry));
    }
    list.back()["plain_points"] = std::move(plain);
  }
  return JsonText({{"format", 1}, {"pictures", std::move(list)}});
}

Result<std::vector<part_alignment::ScaleBar>> ReadScaleBarFile(const std::filesystem::path& path) {
  const auto json = TRY(ReadJsonFile(path, kMaxBytes));
  JsonObject root(json, path.string());
  root.Integer("format", {1, 1});
  if (!root.has("scale_bars")) root.Fault("scale_bars", "is missing");
  return ReadScaleBars(root);
}

}  // namespace trammel::files
