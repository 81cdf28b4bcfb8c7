#include "part_alignment/files/survey_file.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <utility>

#include "base/json_text.h"
#include "files/json_object.h"
#include "part_alignment/files/part_fit_file.h"
#include "part_alignment/files/target_file.h"

namespace trammel::files {
namespace {

using part_alignment::Observation;
using part_alignment::SurveyPicture;

constexpr std::size_t kMostBytes = 100'000'000;
constexpr std::size_t kMostPictures = 10'000;
constexpr std::size_t kMostObservations = 10'000;  // of a picture
constexpr double kMost_px = 1e6;
constexpr double kMostTurn = 7;  // rad: a full one and a little

Result<SurveyPicture> ReadPicture(JsonObject object) {
  SurveyPicture picture;
  picture.name = object.Text("name");
  const auto size = object.Numbers("image_px", 2, 2, {2, 100'000});
  if (size.size() == 2) {
    picture.width_px = static_cast<int>(size[0]);
    picture.height_px = static_cast<int>(size[1]);
  }
  for (const nlohmann::json& entry : object.List("observations", 0, kMostObservations)) {
    JsonObject inner =
        object.Inner(entry, fmt::format("observations[{}]", picture.observations.size()));
    Observation observation;
    observation.target = ReadTargetId(inner, "target", nullptr);
    observation.column_px = inner.Number("column_px", {-kMost_px, kMost_px});
    observation.row_px = inner.Number("row_px", {-kMost_px, kMost_px});
    observation.sigma_px = inner.Number("sigma_px", {1e-6, 1e3});
    if (inner.has("disc_px")) {
      const auto axes = inner.Numbers("disc_px", 2, 2, {0, kMost_px});
      const double angle_rad = inner.Number("disc_angle_rad", {-kMostTurn, kMostTurn});
      if (axes.size() == 2) {
        picture.discs.push_back(
            {observation.column_px, observation.row_px, axes[0], axes[1], angle_rad});
      }
    }
    if (auto read = inner.Finish(); !read) return tl::unexpected(read.error());
    picture.observations.push_back(std::move(observation));
  }
  if (auto read = object.Finish(); !read) return tl::unexpected(read.error());
  return picture;
}

}  // namespace

Result<std::vector<SurveyPicture>> ReadSurveyFile(const std::filesystem::path& path) {
  const auto json = ReadJsonFile(path, kMostBytes);
  if (!json) return tl::unexpected(json.error());
  JsonObject root(*json, path.string());
  root.Integer("format", {1, 1});
  std::vector<SurveyPicture> pictures;
  for (const nlohmann::json& entry : root.List("pictures", 1, kMostPictures)) {
    auto picture = ReadPicture(root.Inner(entry, fmt::format("pictures[{}]", pictures.size())));
    if (!picture) return tl::unexpected(picture.error());
    pictures.push_back(std::move(*picture));
  }
  if (auto read = root.Finish(); !read) return tl::unexpected(read.error());
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
      if (i < picture.discs.size()) {
        entry["disc_px"] = {picture.discs[i].semi_major_px, picture.discs[i].semi_minor_px};
        entry["disc_angle_rad"] = picture.discs[i].angle_rad;
      }
      observations.push_back(std::move(entry));
    }
    list.push_back({{"name", picture.name},
                    {"image_px", {picture.width_px, picture.height_px}},
                    {"observations", std::move(observations)}});
  }
  return JsonText({{"format", 1}, {"pictures", std::move(list)}});
}

Result<std::vector<part_alignment::ScaleBar>> ReadScaleBarFile(const std::filesystem::path& path) {
  const auto json = ReadJsonFile(path, kMostBytes);
  if (!json) return tl::unexpected(json.error());
  JsonObject root(*json, path.string());
  root.Integer("format", {1, 1});
  if (!root.has("scale_bars")) root.Fault("scale_bars", "is missing");
  return ReadScaleBars(root);
}

}  // namespace trammel::files
