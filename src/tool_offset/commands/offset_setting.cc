#include "tool_offset/commands/offset_setting.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "app/provenance.h"
#include "document/interval_text.h"
#include "session/run_journal.h"
#include "tool_offset/files/offset_files.h"

namespace trammel::app {
namespace {

// Rounds to micrometres, as sent to the firmware; never "-0.000".
double Micrometres(double value_mm) {
  constexpr double kPerMm = 1000;
  return std::round(value_mm * kPerMm) / kPerMm + 0.0;
}

std::string OldToNew(const procedure::OffsetCorrection& change) {
  return fmt::format(
      "          X offset  {:.3f}  ->  {:.3f} mm\n"
      "          Y offset  {:.3f}  ->  {:.3f} mm\n",
      Micrometres(change.now.x_mm), Micrometres(change.next.x_mm), Micrometres(change.now.y_mm),
      Micrometres(change.next.y_mm));
}

std::string LandsText(const files::MeasuredOffset& measured) {
  std::string text =
      fmt::format("tool {}    lands {:+.3f}, {:+.3f} mm beside the reference tool\n", measured.tool,
                  Micrometres(measured.dx_mm), Micrometres(measured.dy_mm));
  for (const auto& [axis, interval95_mm] :
       {std::pair{"dx", measured.dx95_mm}, std::pair{"dy", measured.dy95_mm}}) {
    text += fmt::format("          {} {}\n", axis,
                        report::IntervalText(interval95_mm, report::kOffsetMillimetres));
  }
  return text;
}

}  // namespace

std::string CorrectionText(const procedure::OffsetCorrection& change,
                           tool_offset::OffsetFirmware firmware) {
  std::string text = LandsText(change.measured);
  text += OldToNew(change);
  for (const std::string& line : SetCommands(firmware, change.tool, change.next)) {
    text += fmt::format("              {}\n", line);
  }
  for (const std::string& line : SaveCommands(firmware, change.tool)) {
    text += fmt::format("              {}\n", line);
  }
  const std::string advice = SaveAdvice(firmware, change.tool, change.next);
  if (!advice.empty()) text += fmt::format("          {}\n", advice);
  return text;
}

std::string StepText(const files::MeasuredOffset& measured, tool_offset::OffsetFirmware firmware) {
  const tool_offset::KeptOffset step = Corrected(firmware, {}, measured.dx_mm, measured.dy_mm);
  return LandsText(measured) +
         fmt::format("          its offset changes by X {:+.3f}, Y {:+.3f} mm\n",
                     Micrometres(step.x_mm), Micrometres(step.y_mm));
}

std::string BriefCorrection(const procedure::OffsetCorrection& change) {
  return fmt::format("tool {}    X offset {:.3f} -> {:.3f}, Y offset {:.3f} -> {:.3f} mm\n",
                     change.tool, Micrometres(change.now.x_mm), Micrometres(change.next.x_mm),
                     Micrometres(change.now.y_mm), Micrometres(change.next.y_mm));
}

std::string UndoText(const procedure::OffsetCorrection& change) {
  return fmt::format("tool {}    as before\n", change.tool) + OldToNew(change);
}

procedure::SetOffsetsOptions OffsetSetting(const std::string& history, const std::string& printer) {
  procedure::SetOffsetsOptions options;
  options.history = history;
  options.printer = printer;
  options.time = [] { return UtcNow(); };
  options.say = [](const std::string& line) { fmt::print("{}\n", line); };
  return options;
}

Result<std::string> UsualOffsetHistory() {
  const auto folder = TRY(files::StateFolder());
  return (folder / files::kOffsetHistoryFile).string();
}

}  // namespace trammel::app
