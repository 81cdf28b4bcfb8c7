#include "app/study/study_scan.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <system_error>

#include "base/json_text.h"
#include "files/json_object.h"
#include "files/whole_file.h"

namespace trammel::app {
namespace {

using nlohmann::ordered_json;

constexpr std::size_t kMostBytes = 1'000'000;
constexpr std::size_t kMostLines = 200;  // as many as a pattern may have
constexpr int kMostSeed = 1'000'000'000;
constexpr files::NumberRange kAdvance{0, 10};       // s
constexpr files::NumberRange kDeviation{0, 1e6};    // px
constexpr files::NumberRange kAnswer{-10, 20};      // s; an interval may reach below 0
constexpr files::NumberRange kUncertainty{0, 100};  // s

ordered_json Nullable(const std::vector<std::optional<double>>& values) {
  ordered_json list = ordered_json::array();
  for (const auto& value : values) list.push_back(value ? ordered_json(*value) : ordered_json());
  return list;
}

sim::Condition ConditionOf(files::JsonObject& object) {
  const Result<sim::Condition> condition = sim::ParseCondition(object.Text("condition"));
  if (condition) return *condition;
  object.Fault("condition", "is unknown: " + condition.error().message);
  return {};
}

std::optional<Quantity> ResponseOf(files::JsonObject& object) {
  const nlohmann::json* found = object.Find("response_s");
  if (found == nullptr || found->is_null()) return std::nullopt;
  Quantity quantity;
  quantity.value = object.Number("response_s", kAnswer);
  quantity.standard_uncertainty = object.Number("standard_uncertainty_s", kUncertainty);
  const std::vector<double> interval = object.Numbers("interval95_s", 2, 2, kAnswer);
  if (interval.size() == 2) quantity.interval95 = {interval[0], interval[1]};
  if (!(quantity.interval95.lo <= quantity.value && quantity.value <= quantity.interval95.hi)) {
    object.Fault("interval95_s", "does not hold response_s");
  }
  return quantity;
}

Result<std::optional<std::string>> TextOf(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::exists(path, error) && !error) return std::optional<std::string>();
  auto text = files::ReadNamedFile(path, kMostBytes);
  if (!text) return tl::unexpected<Error>(text.error());
  return std::optional<std::string>(*std::move(text));
}

Result<void> CheckSame(const std::filesystem::path& path, bool same) {
  if (same) return {};
  return Fail(fmt::format(
      "{} belongs to a study with another seed, or was renamed: choose another folder with --out",
      path.string()));
}

}  // namespace

std::string ScanFileName(const sim::Condition& condition, int pattern) {
  return fmt::format("scan-{}-{:03}.json", sim::ToString(condition), pattern);
}

std::string ValidationFileName(const sim::Condition& condition) {
  return fmt::format("validation-{}.json", sim::ToString(condition));
}

std::string FormatStudyScan(const StudyScan& scan) {
  ordered_json json;
  json["format"] = 1;
  json["seed"] = scan.seed;
  json["condition"] = sim::ToString(scan.condition);
  json["pattern"] = scan.pattern;
  json["truth_s"] = scan.truth_s;
  json["pressure_advances_s"] = scan.pressure_advances_s;
  json["score_px"] = Nullable(scan.score_px);
  json["excess_s"] = Nullable(scan.excess_s);
  const auto& response = scan.response;
  json["response_s"] = response ? ordered_json(response->value) : ordered_json();
  json["standard_uncertainty_s"] =
      response ? ordered_json(response->standard_uncertainty) : ordered_json();
  json["interval95_s"] =
      response ? ordered_json({response->interval95.lo, response->interval95.hi}) : ordered_json();
  json["reason"] = scan.reason;
  return JsonText(json);
}

std::string FormatStudyValidation(const StudyValidation& validation) {
  ordered_json json;
  json["format"] = 1;
  json["seed"] = validation.seed;
  json["condition"] = sim::ToString(validation.condition);
  json["pressure_advance_s"] = validation.pressure_advance_s;
  json["control_px"] = validation.control_px;
  json["calibrated_px"] = validation.calibrated_px;
  return JsonText(json);
}

Result<StudyScan> ParseStudyScan(std::string_view text, const std::string& file) {
  const auto json = files::ParseJson(text, file);
  if (!json) return tl::unexpected<Error>(json.error());
  files::JsonObject object(*json, file);
  StudyScan scan;
  object.Integer("format", {1, 1});
  scan.seed = object.Integer("seed", {0, kMostSeed});
  scan.condition = ConditionOf(object);
  scan.pattern = object.Integer("pattern", {0, 999});
  scan.truth_s = object.Number("truth_s", kAdvance);
  scan.pressure_advances_s = object.Numbers("pressure_advances_s", 0, kMostLines, kAdvance);
  scan.score_px = object.OptionalNumbers("score_px", 0, kMostLines);
  scan.excess_s = object.OptionalNumbers("excess_s", 0, kMostLines);
  for (const char* key : {"score_px", "excess_s"}) {
    const auto& list = key[0] == 's' ? scan.score_px : scan.excess_s;
    if (list.size() != scan.pressure_advances_s.size()) {
      object.Fault(key, fmt::format("has {} values for {} lines", list.size(),
                                    scan.pressure_advances_s.size()));
    }
  }
  scan.response = ResponseOf(object);
  object.Find("standard_uncertainty_s");
  object.Find("interval95_s");
  scan.reason = object.Text("reason");
  if (auto done = object.Finish(); !done) return tl::unexpected<Error>(done.error());
  return scan;
}

Result<StudyValidation> ParseStudyValidation(std::string_view text, const std::string& file) {
  const auto json = files::ParseJson(text, file);
  if (!json) return tl::unexpected<Error>(json.error());
  files::JsonObject object(*json, file);
  StudyValidation validation;
  object.Integer("format", {1, 1});
  validation.seed = object.Integer("seed", {0, kMostSeed});
  validation.condition = ConditionOf(object);
  validation.pressure_advance_s = object.Number("pressure_advance_s", kAdvance);
  validation.control_px = object.Number("control_px", kDeviation);
  validation.calibrated_px = object.Number("calibrated_px", kDeviation);
  if (auto done = object.Finish(); !done) return tl::unexpected<Error>(done.error());
  return validation;
}

Result<std::optional<StudyScan>> ReadStudyScan(const std::filesystem::path& folder, int seed,
                                               const sim::Condition& condition, int pattern) {
  const std::filesystem::path path = folder / ScanFileName(condition, pattern);
  const auto text = TextOf(path);
  if (!text) return tl::unexpected<Error>(text.error());
  if (!*text) return std::optional<StudyScan>();
  auto scan = ParseStudyScan(**text, path.string());
  if (!scan) return tl::unexpected<Error>(scan.error());
  const bool same = scan->seed == seed && scan->pattern == pattern &&
                    sim::ToString(scan->condition) == sim::ToString(condition);
  if (auto checked = CheckSame(path, same); !checked) return tl::unexpected(checked.error());
  return std::optional<StudyScan>(*std::move(scan));
}

Result<std::optional<StudyValidation>> ReadStudyValidation(const std::filesystem::path& folder,
                                                           int seed,
                                                           const sim::Condition& condition) {
  const std::filesystem::path path = folder / ValidationFileName(condition);
  const auto text = TextOf(path);
  if (!text) return tl::unexpected<Error>(text.error());
  if (!*text) return std::optional<StudyValidation>();
  auto validation = ParseStudyValidation(**text, path.string());
  if (!validation) return tl::unexpected<Error>(validation.error());
  const bool same =
      validation->seed == seed && sim::ToString(validation->condition) == sim::ToString(condition);
  if (auto checked = CheckSame(path, same); !checked) return tl::unexpected(checked.error());
  return std::optional<StudyValidation>(*std::move(validation));
}

}  // namespace trammel::app
