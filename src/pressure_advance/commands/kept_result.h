// The answer of an analysis as result.json, and what it comes to when it is applied.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "app/result_file.h"
#include "base/measured.h"
#include "base/result.h"
#include "measurement/outcome.h"
#include "pressure_advance/profile/analysis.h"

namespace trammel::app {

/// The analysis of a recording or photo as a result of this program, now.
[[nodiscard]] ResultFile ResultOf(const pressure_advance::Analysis& analysis, std::string source);

/// What was measured in a recording's folder, by the result that it keeps; empty where it keeps
/// none.
[[nodiscard]] measurement::Subject SubjectIn(const std::filesystem::path& folder);

/// A value to be set, and what it was measured as where it comes from a result.
struct ChosenValue {
  double value_s = 0;
  std::optional<Quantity> measured = {};
  std::optional<measurement::Outcome> result = {};  ///< that it stands in
  std::filesystem::path folder = {};                ///< of the recording; empty: of none
  std::optional<ResultFile> found_now = {};         ///< by an analysis that nothing keeps yet
};

/// The pressure advance of a kept result, a file or a folder's. Errors: those of
/// files::ReadOutcome; it holds none, or one beyond what a printer takes; kMeasurement where the
/// verdict is not good.
[[nodiscard]] Result<ChosenValue> KeptPressureAdvance(const std::filesystem::path& path);

}  // namespace trammel::app
