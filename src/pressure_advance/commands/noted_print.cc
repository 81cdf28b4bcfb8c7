#include "pressure_advance/commands/noted_print.h"

#include <fmt/format.h>

#include <cstdio>

#include "app/provenance.h"
#include "pressure_advance/commands/measured_subject.h"
#include "pressure_advance/commands/photo_plan.h"
#include "session/dead_run.h"
#include "session/run_journal.h"

namespace trammel::app {

namespace fs = std::filesystem;

Result<void> NotePrint(const procedure::Session& session, const std::string& address,
                       const fs::path& run, const std::string& filament, bool ended) {
  const auto folder = files::StateFolder();
  const auto server_s = procedure::ServerTime_s(session);
  Result<void> noted;
  if (!folder) {
    noted = tl::unexpected(folder.error());
  } else if (ended && !server_s) {
    noted = Fail("the printer's server does not tell its time", ErrorKind::kMachine);
  } else {
    noted = files::NotePatternPrint(*folder / files::kPatternPrintsFile,
                                    {UtcNow(), procedure::PrinterName(address),
                                     fs::absolute(run).string(), filament, ended, server_s});
  }
  if (noted) return {};
  if (!ended) {
    return Fail(fmt::format("nothing is printed, as it cannot be noted when the pattern was, "
                            "which tells older photos apart: {}",
                            noted.error().message),
                noted.error().kind);
  }
  fmt::print(stderr, "  not noted when the print ended, only when it began: {}\n",
             noted.error().message);
  return {};
}

Result<std::optional<files::PatternPrint>> LastNotedPrint(const std::string& address) {
  const auto folder = files::StateFolder();
  if (!folder) return tl::unexpected(folder.error());
  return files::LastPatternPrint(*folder / files::kPatternPrintsFile,
                                 procedure::PrinterName(address));
}

Result<PhotoPlan> PlanOfPrint(const std::optional<files::PatternPrint>& print) {
  if (!print) return PlanOfPhotoPattern();
  auto plan = ReadPhotoPlan(fs::path(print->folder) / "pattern.plan.json");
  if (plan) return plan;
  return Fail(fmt::format("the plan of the pattern that was printed {} cannot be read, and without "
                          "it nobody knows its values: {}; print the pattern anew, or name the "
                          "plan with --plan",
                          print->utc, plan.error().message),
              plan.error().kind);
}

Result<std::string> CheckPhotoIsOf(const procedure::PatternPhoto& photo,
                                   const std::optional<files::PatternPrint>& print,
                                   const std::string& filament) {
  if (!print) {
    return fmt::format("{}: look whether {} is its photo", kNoPrintNoted, photo.name);
  }
  if (!MayBeSameFilament(print->filament, filament)) {
    return Fail(
        fmt::format("the pattern was printed for the filament '{}', and the photo {} would "
                    "be measured for '{}': say that filament, or name the photo (FILE=, "
                    "--file)",
                    print->filament, photo.name, filament));
  }
  if (!print->server_s || !photo.stored_s) {
    return fmt::format("{} by the clock of the printer's files: look whether {} is its photo",
                       kNoPrintNoted, photo.name);
  }
  if (*photo.stored_s >= *print->server_s) return std::string();
  return Fail(
      fmt::format("{}, the newest photo there, is of {}, and the pattern's print {} {} by "
                  "the same clock: upload a photo of this pattern, or name that one (FILE=, "
                  "--file)",
                  photo.name, UtcOf(*photo.stored_s), print->ended ? "ended" : "began",
                  UtcOf(*print->server_s)));
}

}  // namespace trammel::app
