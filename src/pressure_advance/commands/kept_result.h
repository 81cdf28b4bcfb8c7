// The answer of an analysis as result.json, and what it comes to when it is applied.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/measured.h"
#include "base/result.h"
#include "measurement/outcome.h"
#include "pressure_advance/profile/analysis.h"

namespace trammel::app {

/// The analysis as an outcome of this program, now.
[[nodiscard]] measurement::Outcome OutcomeOf(const pressure_advance::Analysis& analysis,
                                             std::vector<std::string> sources);

/// Writes result.json into the recording's folder, and adds a line to history.jsonl beside the
/// folder. Errors name the file.
[[nodiscard]] Result<void> KeepResult(const pressure_advance::Analysis& analysis,
                                      const std::filesystem::path& folder);

/// The pressure advance of a kept result, a file or a folder's. Errors: those of
/// files::ReadOutcome; it holds no pressure advance; kMeasurement where the verdict is not good.
[[nodiscard]] Result<Quantity> KeptPressureAdvance(const std::filesystem::path& path);

}  // namespace trammel::app
