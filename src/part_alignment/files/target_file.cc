#include "part_alignment/files/target_file.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <utility>

#include "part_alignment/pose/pose_problem.h"

namespace trammel::files {
namespace {

using part_alignment::PartTarget;

constexpr std::size_t kMaxBytes = 100'000'000;
constexpr std::size_t kMaxTargets = 10'000;
constexpr std::size_t kMaxUncertain = 900;  // rows: 300 targets
constexpr double kMaxPlace_mm = 1e6;
constexpr const char* kCovariance = "targets_covariance_mm2";

bool ReadRow(const nlohmann::json& row, Eigen::Index i, Eigen::MatrixXd& covariance) {
  if (!row.is_array() || row.size() != static_cast<std::size_t>(covariance.cols())) return false;
  for (std::size_t k = 0; k < row.size(); ++k) {
    if (!row[k].is_number()) return false;
    covariance(i, static_cast<Eigen::Index>(k)) = row[k].get<double>();
  }
  return true;
}

void ReadCovariance(JsonObject& object, TargetList& list) {
  const nlohmann::json* rows = object.OptionalList(kCovariance, 3, kMaxUncertain);
  if (rows == nullptr) return;
  const auto size = static_cast<Eigen::Index>(rows->size());
  Eigen::MatrixXd covariance(size, size);
  for (std::size_t i = 0; i < rows->size(); ++i) {
    if (!ReadRow((*rows)[i], static_cast<Eigen::Index>(i), covariance)) {
      object.Fault(kCovariance, fmt::format("has no {} numbers in row {}", size, i));
      return;
    }
  }
  if (const auto valid = part_alignment::ValidateTargetCovariance(covariance, list.targets.size());
      !valid) {
    object.Fault(kCovariance, "is none: " + valid.error().message);
    return;
  }
  list.covariance = std::move(covariance);
}

void ReadBarEnds(JsonObject& object, TargetList& list) {
  const nlohmann::json* ends = object.OptionalList("bar_ends", 0, kMaxTargets);
  for (const nlohmann::json& end : ends != nullptr ? *ends : nlohmann::json::array()) {
    if (!end.is_string()) {
      object.Fault("bar_ends", fmt::format("has {}; it must be the id of a target", Show(end)));
      return;
    }
    list.bar_ends.insert(end.get<std::string>());
  }
}

}  // namespace

std::string ReadTargetId(JsonObject& object, const char* key, std::set<std::string>* numeric) {
  constexpr std::size_t kLongest = 100;
  const nlohmann::json* value = object.Find(key);
  if (value == nullptr) {
    object.Fault(key, "is missing");
    return {};
  }
  if (value->is_number_integer()) {
    std::string id = value->dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
    if (numeric != nullptr) numeric->insert(id);
    return id;
  }
  if (value->is_string() && !value->get_ref<const std::string&>().empty() &&
      value->get_ref<const std::string&>().size() <= kLongest) {
    return value->get<std::string>();
  }
  object.Fault(key, fmt::format("is {}; it must be a whole number or a text of 1 … {} bytes",
                                Show(*value), kLongest));
  return {};
}

Result<TargetList> ReadTargetList(JsonObject& object) {
  TargetList list;
  std::set<std::string> ids;
  for (const nlohmann::json& entry : object.List("targets", 1, kMaxTargets)) {
    JsonObject inner = object.Inner(entry, fmt::format("targets[{}]", list.targets.size()));
    PartTarget target;
    target.id = ReadTargetId(inner, "id", &list.numeric_ids);
    const auto mm = inner.Numbers("ideal_mm", 3, 3, {-kMaxPlace_mm, kMaxPlace_mm});
    if (!inner.failed() && !ids.insert(target.id).second) {
      inner.Fault("id", fmt::format("is {}, which another target has already", target.id));
    }
    TRY(inner.Finish());
    target.ideal_mm = {mm[0], mm[1], mm[2]};
    list.targets.push_back(std::move(target));
  }
  if (!object.failed()) ReadCovariance(object, list);
  ReadBarEnds(object, list);
  TRY(object.Faults());
  return list;
}

Result<TargetList> ReadTargetFile(const std::filesystem::path& path) {
  const auto json = TRY(ReadJsonFile(path, kMaxBytes));
  JsonObject root(json, path.string());
  root.Integer("format", {1, 1});
  const auto verdict = root.OptionalChoice("verdict", {"good", "cannot_tell", "refused"});
  TRY(root.Faults());
  if (verdict && *verdict != "good") {
    return Fail(
        fmt::format("{}: no targets are taken from an answer that is {}; run align fit anew",
                    path.string(), *verdict),
        ErrorKind::kMeasurement);
  }
  return ReadTargetList(root);
}

void DropBarEnds(const std::set<std::string>& kept, TargetList& list) {
  std::vector<PartTarget> targets;
  std::vector<Eigen::Index> rows;
  for (std::size_t i = 0; i < list.targets.size(); ++i) {
    const std::string& id = list.targets[i].id;
    if (list.bar_ends.contains(id) && !kept.contains(id)) continue;
    for (int axis = 0; axis < 3; ++axis) rows.push_back(3 * static_cast<Eigen::Index>(i) + axis);
    targets.push_back(list.targets[i]);
  }
  if (list.covariance) list.covariance = Eigen::MatrixXd((*list.covariance)(rows, rows));
  list.targets = std::move(targets);
}

nlohmann::ordered_json TargetCovarianceJson(const Eigen::MatrixXd& covariance) {
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (const auto& row : covariance.rowwise()) {
    rows.push_back(std::vector<double>(row.begin(), row.end()));
  }
  return rows;
}

Eigen::Matrix3d ReadRotation(JsonObject& object, const char* key) {
  const nlohmann::json* rows = object.OptionalList(key, 3, 3);
  if (rows == nullptr) return Eigen::Matrix3d::Identity();
  Eigen::MatrixXd rotation(3, 3);
  for (std::size_t i = 0; i < 3; ++i) {
    if (ReadRow((*rows)[i], static_cast<Eigen::Index>(i), rotation)) continue;
    object.Fault(key, fmt::format("has the row {}; it must have three numbers", Show((*rows)[i])));
    return Eigen::Matrix3d::Identity();
  }
  const Eigen::Matrix3d r = rotation;
  const double skew = (r.transpose() * r - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  constexpr double kTolerance = 1e-5;
  if (!(skew <= kTolerance) || r.determinant() < 0) {
    object.Fault(key, fmt::format("is no rotation: its columns are {:.3g} away from right-angled "
                                  "unit vectors, its determinant is {:.6g}",
                                  skew, r.determinant()));
  }
  return r;
}

}  // namespace trammel::files
