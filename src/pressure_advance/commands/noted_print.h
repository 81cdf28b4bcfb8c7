// The printed pattern that a photo or a scan is of: noted by whatever prints one, asked for by
// pa photo and pa scan.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "base/result.h"
#include "pressure_advance/commands/analysis_run.h"
#include "pressure_advance/files/pattern_prints.h"
#include "pressure_advance/pattern/pattern_plan.h"
#include "pressure_advance/procedure/calibrate.h"
#include "pressure_advance/procedure/pattern_photo.h"
#include "session/session.h"

namespace trammel::app {

/// How a notice begins where no print of the pattern is noted, which would tell whether a photo is
/// older. The printer's own screen says it with the answer.
inline constexpr const char* kNoPrintNoted = "No print of this pattern is noted";

/// Notes in the state folder that a run's print begins or, of one for a photo, has ended, by both
/// clocks. Errors: kInput of a begin, which is not written; of an end it is only said.
[[nodiscard]] Result<void> NotePrint(const procedure::Session& session,
                                     const procedure::CalibrationRequest& run, bool ended);

/// The last print of the pattern for a photo on a printer. Errors: kInput: the notes cannot be
/// read.
[[nodiscard]] Result<std::optional<files::PatternPrint>> LastNotedPrint(const std::string& address);

/// What it was printed with. Errors: kInput: its plan is not there any more.
[[nodiscard]] Result<PhotoPlan> PlanOfPrint(const files::PatternPrint& print);

/// The pattern that lies on a printer's bed, where nobody named its plan.
struct LyingPattern {
  files::PatternPrint print;
  pressure_advance::PatternPlan plan;
};

/// That of the last print on it, for a photo or a scan. Errors (kInput): none is noted; its plan is
/// not there any more.
[[nodiscard]] Result<LyingPattern> FindLyingPattern(const std::string& address);

/// A plan that nobody named.
struct FoundPlan {
  PhotoPlan plan;
  std::string notice;  ///< for the answer: which one it is
};

/// The plan that lies beside a photo; where none does, that of the last print that is noted. Errors
/// (kInput): there is none, or there are several with different values; the photo is older than the
/// print.
[[nodiscard]] Result<FoundPlan> FindPlanOf(const std::filesystem::path& photo);

/// The plan that was uploaded beside the printer's photos. Errors as those of FindPlanOf; kMachine.
[[nodiscard]] Result<FoundPlan> FindUploadedPlan(const procedure::Session& session);

/// Whether a photo that nobody named can be of the last print: it is not older by the clock of the
/// printer's server, and not for another filament.
/// @param print  absent: none is noted
/// @param filament  of the photo; empty: nobody named it
/// @returns a notice for the answer, where the times do not tell; empty: they do.
/// Errors: kInput: it cannot.
[[nodiscard]] Result<std::string> CheckPhotoIsOf(const procedure::PatternPhoto& photo,
                                                 const std::optional<files::PatternPrint>& print,
                                                 const std::string& filament);

}  // namespace trammel::app
