// What an uncertainty budget of part alignment reads.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "base/result.h"
#include "part_alignment/budget/budget.h"

namespace trammel::files {

struct BudgetFile {
  part_alignment::BudgetScene scene;
  std::optional<std::pair<double, double>> tolerance_mm;  ///< lower and upper limit
  std::vector<part_alignment::MeasuredLength> lengths;
};

/// SCENE.json (docs/formats.md). Errors (kInput) name file and place.
[[nodiscard]] Result<BudgetFile> ReadBudgetFile(const std::filesystem::path& path);

}  // namespace trammel::files
