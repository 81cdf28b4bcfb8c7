// Report of a part's pose, as JSON and as text for a terminal.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "document/interval_text.h"
#include "part_alignment/pose/measurement.h"
#include "part_alignment/pose/pose_uncertainty.h"
#include "part_alignment/pose/solve.h"

namespace trammel::report {

struct AlignmentOutput {
  part_alignment::Measurement measurement;
  std::vector<std::string> unknowns;  ///< names as in files
  part_alignment::Unknowns solved;
  std::set<std::string> numeric_ids;  ///< targets whose ids are numbers in JSON
  part_alignment::Alignment alignment;
  std::optional<part_alignment::MonteCarloUncertainty> simulated = {};  ///< beside its covariance
  std::vector<part_alignment::Contribution> contributions = {};         ///< for text output only
};

/// Solved parameter, named as in Alignment::parameters.
struct SolvedParameter {
  std::string name;
  double value = 0;  ///< mm or rad, as the name ends
  double sigma = 0;  ///< k = 1; NaN where the alignment has no covariance of it

  [[nodiscard]] Interval interval95() const { return NormalInterval95(value, sigma); }
  [[nodiscard]] const IntervalStyle& style() const {
    return name.ends_with("_rad") ? kPerMille : kMillimetres;
  }
};

/// Returns the pose (six of them), then the unknowns of the clamping and the camera.
[[nodiscard]] std::vector<SolvedParameter> SolvedParameters(const AlignmentOutput& output);

/// "clamp_angle_rad" -> "clamp angle".
[[nodiscard]] std::string NameOf(std::string parameter);

/// Returns one object (docs/reference/formats.md). Values and covariance are null unless the
/// verdict is good; so are parameters that were not unknown.
[[nodiscard]] nlohmann::ordered_json JsonOf(const AlignmentOutput& output);

/// Returns several lines: the pose with its uncertainty, the clamping, the observability, the
/// residuals.
[[nodiscard]] std::string AlignmentText(const AlignmentOutput& output);

/// Returns one to three lines: what the views determine, and what they do not unless `reason`
/// contains it already. Empty if observability was not requested.
[[nodiscard]] std::string ObservabilityText(const part_alignment::Observability& told,
                                            const std::string& reason);

}  // namespace trammel::report
