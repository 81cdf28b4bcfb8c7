#include "pressure_advance/commands/validation.h"

#include <fmt/format.h>

#include <cstdio>
#include <string>

#include "app/commands.h"
#include "document/interval_text.h"
#include "files/new_file.h"
#include "pressure_advance/commands/calibration_run.h"
#include "pressure_advance/commands/laser_recording.h"
#include "pressure_advance/report/improvement_json.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;
using pressure_advance::ComparedGroup;
using pressure_advance::Improvement;

std::string LinesOf(const ComparedGroup& group) {
  return group.used == group.lines ? fmt::format("{} lines", group.lines)
                                   : fmt::format("{} of {} lines", group.used, group.lines);
}

std::string Percent(const Measured& measured) {
  if (!measured.good()) {
    return fmt::format("{}: {}", VerdictWords(measured.verdict()), measured.reason());
  }
  const report::IntervalStyle percent{.unit = "%", .scale = 100, .least_decimals = 1};
  return report::WithInterval(measured.quantity(), percent);
}

void PrintText(const Improvement& improvement, const fs::path& folder) {
  fmt::print("validation        {} without pressure advance, {} at {:.4f} s\n",
             LinesOf(improvement.control), LinesOf(improvement.calibrated),
             improvement.calibrated.pressure_advance_s);
  if (improvement.control.deviation_px && improvement.calibrated.deviation_px) {
    fmt::print("  deviation       {:.1f} px without, {:.1f} px with\n",
               *improvement.control.deviation_px, *improvement.calibrated.deviation_px);
  }
  fmt::print("  improvement     {}\n", Percent(improvement.deviation));
  fmt::print("  surplus left    after the acceleration {}\n",
             Percent(improvement.acceleration_left));
  fmt::print("                  after the deceleration {}\n",
             Percent(improvement.deceleration_left));
  fmt::print("  recording       {}\n", folder.string());
}

}  // namespace

Result<Improvement> EvaluateComparison(const fs::path& folder) {
  const auto measured = MeasureRecording(folder);
  if (!measured) return tl::unexpected(measured.error());
  Improvement improvement =
      CompareWithControl(measured->profiles, measured->deviation.score_px, measured->scan.motion);
  // What the same recording said before is said anew.
  auto written = files::WriteWholeFile(folder / "validation.json", report::ToJson(improvement),
                                       files::IfThere::kReplace);
  if (!written) return tl::unexpected(written.error());
  return improvement;
}

Result<Improvement> RunComparison(const procedure::Session& session,
                                  const procedure::CalibrationRequest& request) {
  const CalibrationRun run = CalibrateInto(session, request);
  if (!run.done) return tl::unexpected(run.done.error());
  return EvaluateComparison(request.folder);
}

int PrintImprovement(const Improvement& improvement, const fs::path& folder, bool json) {
  if (json) {
    std::fputs(report::ToJson(improvement).c_str(), stdout);
  } else {
    PrintText(improvement, folder);
  }
  return improvement.deviation.good() ? kExitGood : kExitNotTrusted;
}

bool WorthApplying(const Improvement& improvement) {
  return improvement.deviation.good() && improvement.deviation.quantity().interval95.hi > 0;
}

}  // namespace trammel::app
