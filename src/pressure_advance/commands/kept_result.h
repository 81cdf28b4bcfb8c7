// The answer of an analysis as result.json, and what it comes to when it is applied.
#pragma once

#include <filesystem>
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

/// A pressure advance with the result that it stands in.
struct KeptAnswer {
  Quantity pressure_advance_s;
  measurement::Outcome outcome;
};

/// The pressure advance of a kept result, a file or a folder's. Errors: those of
/// files::ReadOutcome; it holds none, or one beyond what a printer takes; kMeasurement where the
/// verdict is not good.
[[nodiscard]] Result<KeptAnswer> KeptPressureAdvance(const std::filesystem::path& path);

}  // namespace trammel::app
