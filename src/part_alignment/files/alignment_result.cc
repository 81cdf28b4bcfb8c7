#include "part_alignment/files/alignment_result.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <numbers>

#include "files/json_object.h"
#include "measurement/outcome_file.h"
#include "part_alignment/files/target_file.h"

namespace trammel::files {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxBytes = 100'000'000;
constexpr double kMax_mm = 1e6;
constexpr double kMax_rad = 2 * std::numbers::pi;

std::optional<Eigen::Vector3d> OptionalThree(JsonObject& object, const char* key, double most) {
  if (object.Find(key) == nullptr) return std::nullopt;
  return ReadThree(object, key, {-most, most});
}

void ReadUncertainty(JsonObject& root, AlignmentResult& result) {
  const json* value = root.Find("standard_uncertainty");
  if (value == nullptr || value->is_null()) return;
  JsonObject object = root.Inner(*value, "standard_uncertainty");
  constexpr std::array kNames = {"x_mm", "y_mm", "z_mm", "alpha_rad", "beta_rad", "gamma_rad"};
  Eigen::Matrix<double, 6, 1> sigma;
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    sigma(static_cast<Eigen::Index>(i)) = object.Number(kNames[i], {0, kMax_mm});
  }
  if (const auto read = object.Faults(); !read) root.Adopt(read.error());
  result.standard_uncertainty = sigma;
}

Error NotGood(const std::string& file, std::string_view verdict, const std::string& reason) {
  return {ErrorKind::kMeasurement,
          fmt::format("{}: nothing is corrected by a result whose verdict is {}: {}", file, verdict,
                      reason)};
}

Result<std::vector<part_alignment::PartTarget>> ReadTargets(JsonObject& owner) {
  std::vector<part_alignment::PartTarget> targets;
  const json* list = owner.OptionalList("targets", 0, 10'000);
  TRY(owner.Faults());
  for (const json& entry : list != nullptr ? *list : json::array()) {
    JsonObject object = owner.Inner(entry, fmt::format("targets[{}]", targets.size()));
    part_alignment::PartTarget target{ReadTargetId(object, "id", nullptr),
                                      ReadThree(object, "ideal_mm", {-kMax_mm, kMax_mm})};
    TRY(object.Faults());
    targets.push_back(std::move(target));
  }
  return targets;
}

/// Reads the pose from the answers; of the details only the targets, which are no answer.
Result<AlignmentResult> FromKept(const measurement::Outcome& outcome, JsonObject& root,
                                 const std::string& file) {
  if (outcome.verdict() != Verdict::kGood) {
    return tl::unexpected(NotGood(file, ToString(outcome.verdict()), outcome.reason()));
  }
  Eigen::Matrix<double, 6, 1> pose;
  Eigen::Matrix<double, 6, 1> sigma;
  for (std::size_t i = 0; i < kPoseAnswers.size(); ++i) {
    const bool angle = i >= 3;
    const std::string_view unit = angle ? "rad" : "mm";
    const double most = angle ? kMax_rad : kMax_mm;
    const measurement::Answer* const answer = outcome.Find(kPoseAnswers.at(i));
    if (answer == nullptr || answer->unit != unit) {
      return Fail(fmt::format("{}: holds no {} in {}", file, kPoseAnswers.at(i), unit));
    }
    const Quantity& quantity = answer->value.quantity();
    if (std::abs(quantity.value) > most) {
      return Fail(fmt::format("{}: {} is {} {}; it must be within +-{}", file, answer->name,
                              quantity.value, unit, most));
    }
    pose(static_cast<Eigen::Index>(i)) = quantity.value;
    sigma(static_cast<Eigen::Index>(i)) = quantity.standard_uncertainty;
  }
  AlignmentResult result;
  result.machine_from_part = {pose.head<3>(), pose.tail<3>()};
  result.standard_uncertainty = sigma;
  result.notices = outcome.notices;
  result.result = outcome;
  if (const json* const found = root.Find("details"); found != nullptr) {
    JsonObject details = root.Inner(*found, "details");
    result.targets = TRY(ReadTargets(details));
  }
  return result;
}

/// Reads the printed output of `align solve`.
Result<AlignmentResult> FromPrinted(JsonObject& root, const std::string& file) {
  root.Integer("format", {1, 1});
  const std::string verdict = root.Choice("verdict", {"good", "cannot_tell", "refused"});
  TRY(root.Faults());
  if (verdict != "good") {
    const json* reason = root.Find("reason");
    const bool said = reason != nullptr && reason->is_string();
    return tl::unexpected(
        NotGood(file, verdict, said ? reason->get<std::string>() : "no reason given"));
  }
  AlignmentResult result;
  result.machine_from_part = {ReadThree(root, "part_mm", {-kMax_mm, kMax_mm}),
                              ReadThree(root, "part_angles_rad", {-kMax_rad, kMax_rad})};
  ReadUncertainty(root, result);
  const json* notices = root.OptionalList("notices", 0, 10'000);
  for (const json& notice : notices != nullptr ? *notices : json::array()) {
    if (notice.is_string()) result.notices.push_back(notice.get<std::string>());
  }
  result.targets = TRY(ReadTargets(root));
  return result;
}

}  // namespace

Result<AlignmentResult> ReadAlignmentResult(const std::filesystem::path& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) return ReadAlignmentResult(path / kResultFile);
  const auto parsed = TRY(ReadJsonFile(path, kMaxBytes));
  JsonObject root(parsed, path.string());
  if (!root.has("instrument")) return FromPrinted(root, path.string());
  const auto outcome = TRY(ReadOutcome(path, measurement::Instrument::kPartAlignment));
  return FromKept(outcome, root, path.string());
}

Result<SupportsFile> ReadSupportsFile(const std::filesystem::path& path) {
  const auto parsed = TRY(ReadJsonFile(path, kMaxBytes));
  JsonObject root(parsed, path.string());
  root.Integer("format", {1, 1});
  SupportsFile file;
  constexpr std::size_t kMaxSupports = 100;
  for (const json& entry : root.List("supports", 1, kMaxSupports)) {
    JsonObject object = root.Inner(entry, fmt::format("supports[{}]", file.supports.size()));
    part_alignment::Support support;
    support.id = ReadTargetId(object, "id", nullptr);
    support.part_mm = ReadThree(object, "part_mm", {-kMax_mm, kMax_mm});
    support.direction_machine = ReadThree(object, "direction", {-kMax_mm, kMax_mm});
    const double length = support.direction_machine.norm();
    constexpr double kMinLength = 1e-6;
    if (length < kMinLength) object.Fault("direction", "has no length; give three numbers");
    TRY(object.Finish());
    support.direction_machine /= length;
    file.supports.push_back(std::move(support));
  }
  if (const json* value = root.Find("ideal"); value != nullptr) {
    JsonObject ideal = root.Inner(*value, "ideal");
    file.ideal_angles_rad = OptionalThree(ideal, "angles_rad", kMax_rad);
    file.ideal_translation_mm = OptionalThree(ideal, "translation_mm", kMax_mm);
    TRY(ideal.Finish());
  }
  TRY(root.Finish());
  return file;
}

}  // namespace trammel::files
