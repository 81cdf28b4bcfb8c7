// Where a part is, as JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "part_alignment/pose/contributions.h"
#include "part_alignment/pose/measurement.h"
#include "part_alignment/pose/pose_uncertainty.h"
#include "part_alignment/pose/solve.h"

namespace trammel::report {

struct AlignmentOutput {
  part_alignment::Measurement measurement;
  std::vector<std::string> unknowns;  ///< by their names in files
  part_alignment::Unknowns solved;
  std::set<std::string> numeric_ids;  ///< targets whose ids are numbers in JSON
  part_alignment::Alignment alignment;
  std::optional<part_alignment::MonteCarloUncertainty> simulated = {};  ///< beside its covariance
  std::vector<part_alignment::Contribution> contributions = {};         ///< for people alone
};

/// One object (docs/formats.md). Values and covariance are null unless the
/// verdict is good; so is what was not an unknown.
[[nodiscard]] nlohmann::ordered_json JsonOf(const AlignmentOutput& output);

}  // namespace trammel::report
