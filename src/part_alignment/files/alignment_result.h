// Result of `trammel align solve` and supports of the fixture: the input of `align correct`.
#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "measurement/outcome.h"
#include "part_alignment/correction/part_correction.h"
#include "part_alignment/pose/measurement.h"

namespace trammel::files {

/// Names of the part's pose among the answers of a stored result: mm, mm, mm, rad, rad, rad.
inline constexpr std::array<std::string_view, 6> kPoseAnswers = {
    "part_x", "part_y", "part_z", "part_alpha", "part_beta", "part_gamma"};

struct AlignmentResult {
  geometry::Pose machine_from_part;
  std::vector<part_alignment::PartTarget> targets;
  /// Standard uncertainty, k = 1, of x, y, z (mm), alpha, beta, gamma (rad).
  std::optional<Eigen::Matrix<double, 6, 1>> standard_uncertainty;
  std::vector<std::string> notices;
  std::optional<measurement::Outcome> result = {};  ///< absent: what `align solve` printed
};

/// Reads a folder's result.json, a stored result, or the output of `align solve`. Errors: kInput as
/// for every file; kMeasurement if the verdict is not good, with its reason.
[[nodiscard]] Result<AlignmentResult> ReadAlignmentResult(const std::filesystem::path& path);

struct SupportsFile {
  std::vector<part_alignment::Support> supports;
  std::optional<Eigen::Vector3d> ideal_angles_rad;
  std::optional<Eigen::Vector3d> ideal_translation_mm;
};

/// `{"format": 1, "supports": [{"id", "part_mm", "direction"}], "ideal": {"angles_rad",
/// "translation_mm"}}`; directions of any length are made unit. Errors (kInput) name the place.
[[nodiscard]] Result<SupportsFile> ReadSupportsFile(const std::filesystem::path& path);

}  // namespace trammel::files
