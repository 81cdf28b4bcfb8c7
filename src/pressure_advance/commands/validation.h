// Shows what a calibrated pressure advance is worth: lines without it beside lines with it.
#pragma once

#include <filesystem>

#include "base/result.h"
#include "pressure_advance/procedure/calibrate.h"
#include "pressure_advance/response/improvement.h"
#include "session/session.h"

namespace trammel::app {

/// Compares the lines of a recorded comparison and writes `folder`/validation.json.
/// Errors: those of MeasureRecording, also where it could not be measured (kMeasurement).
[[nodiscard]] Result<pressure_advance::Improvement> EvaluateComparison(
    const std::filesystem::path& folder);

/// Prints and scans `request`, then compares. Errors: those of the run and of EvaluateComparison.
[[nodiscard]] Result<pressure_advance::Improvement> RunComparison(
    const procedure::Session& session, const procedure::CalibrationRequest& request);

/// Says it on standard output. @returns the exit code of its verdict.
int PrintImprovement(const pressure_advance::Improvement& improvement,
                     const std::filesystem::path& folder, bool json);

/// Whether the lines became better, or at least not worse as far as could be measured.
[[nodiscard]] bool WorthApplying(const pressure_advance::Improvement& improvement);

}  // namespace trammel::app
