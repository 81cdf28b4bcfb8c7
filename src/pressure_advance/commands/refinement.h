// A second pattern beside the first, where that could not tell because of its range.
#pragma once

#include <filesystem>

#include "app/config/config_file.h"
#include "base/measured.h"
#include "base/result.h"
#include "pressure_advance/commands/analysis_run.h"
#include "pressure_advance/pattern/pattern_config.h"
#include "pressure_advance/procedure/sweep_plan.h"
#include "session/session.h"

namespace trammel::app {

/// That a second pattern has room beside the settings', whatever its range; before anything moves.
/// Errors: those of procedure::RefinedBeside.
[[nodiscard]] Result<void> CheckRoomToRefine(const files::Config& config,
                                             const procedure::Reach& reach);

struct Refined {
  AnalysisRun run;  ///< of the second pattern's lines alone
  std::filesystem::path folder;
  pressure_advance::PatternConfig pattern;  ///< the second one
};

/// Prints and scans a second pattern beside the settings', into a folder beside the first one's.
/// @param first    the first pattern's folder
/// @param range_s  that its analysis asks for. Errors: those of the run and of AnalyseRecording.
[[nodiscard]] Result<Refined> Refine(const procedure::Session& session, const files::Config& config,
                                     const std::filesystem::path& first, const Interval& range_s);

}  // namespace trammel::app
