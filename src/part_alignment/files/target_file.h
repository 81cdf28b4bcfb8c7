// Targets of a part with the uncertainty of their coordinates: in observations, or a file of their
// own.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "base/result.h"
#include "files/json_object.h"
#include "part_alignment/pose/measurement.h"

namespace trammel::files {

struct TargetList {
  std::vector<part_alignment::PartTarget> targets;
  std::set<std::string> numeric_ids;  ///< those that stand in the file as numbers
  /// Covariance of all coordinates together, mm², x, y, z of each target in turn.
  std::optional<Eigen::MatrixXd> covariance;
  std::set<std::string> bar_ends;  ///< ends of scale bars, which need not be on the part
};

/// Reads a text or a whole number, as text; empty after a fault.
[[nodiscard]] std::string ReadTargetId(JsonObject& object, const char* key,
                                       std::set<std::string>* numeric);

/// Reads the keys `targets` (1 … 10000), `targets_covariance_mm2` and `bar_ends` of an object.
/// Errors (kInput) name the place: an id twice, an invalid covariance.
[[nodiscard]] Result<TargetList> ReadTargetList(JsonObject& object);

/// Reads the output of `trammel align fit`, or any file with those keys. Errors: as of
/// ReadTargetList; kMeasurement if its answer is not good.
[[nodiscard]] Result<TargetList> ReadTargetFile(const std::filesystem::path& path);

/// Removes the ends of scale bars, except those in `kept`.
void DropBarEnds(const std::set<std::string>& kept, TargetList& list);

[[nodiscard]] nlohmann::ordered_json TargetCovarianceJson(const Eigen::MatrixXd& covariance);

/// Reads three numbers under a key; zeros after a fault, which `object` records.
[[nodiscard]] inline Eigen::Vector3d ReadThree(JsonObject& object, const char* key,
                                               NumberRange range) {
  const auto numbers = object.Numbers(key, 3, 3, range);
  if (numbers.size() != 3) return Eigen::Vector3d::Zero();
  return {numbers[0], numbers[1], numbers[2]};
}

/// Reads three rows of three numbers under a key, accurate to 1e-5: a rotation written with six
/// digits is off by less. Returns the identity if the key is absent, and after a fault.
[[nodiscard]] Eigen::Matrix3d ReadRotation(JsonObject& object, const char* key);

}  // namespace trammel::files
