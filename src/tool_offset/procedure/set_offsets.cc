#include "tool_offset/procedure/set_offsets.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "session/crash_recovery.h"
#include "tool_offset/procedure/tool_offsets.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::procedure {
namespace {

using files::OffsetChange;
using files::OffsetStage;
using tool_offset::KeptOffset;

/// True if a measurement was applied before and not lost since, as by a restart. It may only be
/// applied to the offset under which the sheet was printed.
bool IsDone(const OffsetChange& before, const OffsetCorrection& change) {
  if (before.stage == OffsetStage::kUndone || before.tool != change.tool ||
      before.dx_mm != change.measured.dx_mm || before.dy_mm != change.measured.dy_mm) {
    return false;
  }
  // Begun and interrupted: set if the printer has the new offset.
  if (before.stage == OffsetStage::kBegun) return SameOffset(before.new_offset, change.now);
  return !SameOffset(before.old_offset, change.now);
}

// Refuses a second application, which would move the tool again.
Result<void> RefuseTwice(const std::vector<OffsetCorrection>& corrections,
                         const SetOffsetsOptions& options) {
  if (options.force) return {};
  const auto history = TRY(files::ReadOffsetChanges(options.history));
  for (const OffsetCorrection& change : corrections) {
    for (const OffsetChange& before : history) {
      if (!IsDone(before, change)) continue;
      return Fail(
          fmt::format("taking it out twice would move tool {} by as much again: {} was applied at "
                      "{} on {}, from {}. Print and scan another sheet, or say --force",
                      change.tool, options.source, before.time, before.printer, before.source),
          ErrorKind::kSafety);
    }
  }
  return {};
}

// Refuses offsets beyond a sheet's range: such a file was made by something else, or by hand.
Result<void> RefuseTooFar(const std::vector<OffsetCorrection>& corrections,
                          const SetOffsetsOptions& options) {
  if (options.force) return {};
  for (const OffsetCorrection& change : corrections) {
    const double max_mm =
        std::max(std::abs(change.measured.dx_mm), std::abs(change.measured.dy_mm));
    if (max_mm <= tool_offset::kCoarseReach_mm) continue;
    return Fail(
        fmt::format("{}: tool {} would be moved by {:.3f} mm, and a sheet shows {:.4g} mm at "
                    "most: is it the right file? --force sets it all the same",
                    options.source, change.tool, max_mm, tool_offset::kCoarseReach_mm),
        ErrorKind::kSafety);
  }
  return {};
}

// A measurement holds only for the offset beside which it was made: two scans of one sheet would be
// applied twice.
Result<void> RefuseChanged(const std::vector<OffsetCorrection>& corrections,
                           const SetOffsetsOptions& options) {
  for (const OffsetCorrection& change : corrections) {
    if (options.force || !change.when_printed) continue;
    TRY(CheckSameOffset(change.tool, *change.when_printed, change.now));
  }
  return {};
}

Result<void> Note(const SetOffsetsOptions& options, const OffsetCorrection& change,
                  OffsetStage stage) {
  return files::AppendToHistory(
      options.history, {stage, options.time(), options.printer, options.source, change.tool,
                        change.measured.dx_mm, change.measured.dy_mm, change.now, change.next});
}

void Report(const SetOffsetsOptions& options, const std::string& line) {
  if (options.say) options.say(line);
}

std::map<int, KeptOffset> NextOf(const std::vector<OffsetCorrection>& corrections) {
  std::map<int, KeptOffset> next;
  for (const OffsetCorrection& change : corrections) next[change.tool] = change.next;
  return next;
}

/// Returns the last application's changes on this printer, the last line of each tool.
Result<std::map<int, OffsetChange>> LastApplication(const SetOffsetsOptions& options) {
  auto history = TRY(files::ReadOffsetChanges(options.history));
  const std::string printer = PrinterName(options.printer);
  std::erase_if(history,
                [&](const OffsetChange& change) { return PrinterName(change.printer) != printer; });
  if (history.empty()) {
    return Fail(
        fmt::format("{} notes no offset that was set on {}", options.history.string(), printer));
  }
  std::map<int, OffsetChange> last;
  const std::string source = history.back().source;
  for (auto at = history.rbegin(); at != history.rend() && at->source == source; ++at) {
    last.try_emplace(at->tool, *at);
  }
  return last;
}

}  // namespace

Result<void> CheckSameOffset(int tool, const KeptOffset& when_printed, const KeptOffset& now) {
  if (SameOffset(now, when_printed)) return {};
  return Fail(
      fmt::format("tool {} had an offset of {:.3f}, {:.3f} mm when the sheet was printed, and has "
                  "{:.3f}, {:.3f} mm now: what was measured is not of that one. Print another "
                  "sheet, or set the old one again",
                  tool, when_printed.x_mm, when_printed.y_mm, now.x_mm, now.y_mm),
      ErrorKind::kSafety);
}

Result<void> SetOffsets(const Session& session, const std::vector<OffsetCorrection>& corrections,
                        const SetOffsetsOptions& options) {
  TRY(RefuseTooFar(corrections, options));
  TRY(RefuseTwice(corrections, options));
  TRY(RefuseChanged(corrections, options));
  for (const OffsetCorrection& change : corrections) {
    TRY(Note(options, change, OffsetStage::kBegun));
    TRY(SetToolOffset(session, change.tool, change.next));
    Report(options, fmt::format("applied   tool {}: read back from the printer", change.tool));
    TRY(Note(options, change, OffsetStage::kApplied));
  }
  return options.save ? KeepOffsets(session, corrections, options) : Result<void>();
}

Result<void> KeepOffsets(const Session& session, const std::vector<OffsetCorrection>& corrections,
                         const SetOffsetsOptions& options) {
  TRY(KeepToolOffsets(session, NextOf(corrections)));
  Report(options, "kept      in the printer's configuration, and read back after its restart");
  for (const OffsetCorrection& change : corrections) {
    TRY(Note(options, change, OffsetStage::kKept));
  }
  return {};
}

Result<OffsetUndo> PlanUndo(const Session& session, const SetOffsetsOptions& options) {
  const auto last = TRY(LastApplication(options));
  OffsetUndo undo;
  undo.source = last.begin()->second.source;
  std::string undone;  // time of undo
  for (const auto& [tool, change] : last) {
    // A change undone until the next restart may be undone for good.
    const bool taken_back = change.stage == OffsetStage::kUndone;
    if (taken_back) undone = change.time;
    if (taken_back && !options.save) continue;
    const auto now = TRY(ReadToolOffset(session, tool));
    const KeptOffset& before = taken_back ? change.new_offset : change.old_offset;
    const KeptOffset& set = taken_back ? change.old_offset : change.new_offset;
    if (SameOffset(now, before) && !taken_back) continue;  // never set, or lost by a restart
    if (!SameOffset(now, before) && !SameOffset(now, set) && !options.force) {
      return Fail(fmt::format("tool {} has an offset of {:.3f}, {:.3f} mm, and not the {:.3f}, "
                              "{:.3f} mm that were set at {}: somebody set another since; --force "
                              "sets {:.3f}, {:.3f} mm all the same",
                              tool, now.x_mm, now.y_mm, set.x_mm, set.y_mm, change.time,
                              before.x_mm, before.y_mm),
                  ErrorKind::kSafety);
    }
    OffsetCorrection back{tool, {}, now, before};
    back.measured.tool = tool;
    back.measured.dx_mm = change.dx_mm;
    back.measured.dy_mm = change.dy_mm;
    undo.was_kept = undo.was_kept || change.stage == OffsetStage::kKept;
    undo.changes.push_back(back);
  }
  if (!undo.changes.empty()) return undo;
  return Fail(undone.empty()
                  ? fmt::format("the tools have the offsets from before {} already", undo.source)
                  : fmt::format("{} was taken back at {} already", undo.source, undone));
}

Result<void> UndoOffsets(const Session& session, const OffsetUndo& undo,
                         const SetOffsetsOptions& given) {
  SetOffsetsOptions options = given;
  options.source = undo.source;
  for (const OffsetCorrection& change : undo.changes) {
    TRY(SetToolOffset(session, change.tool, change.next));
    TRY(Note(options, change, OffsetStage::kUndone));
    Report(options, fmt::format("undone    tool {}: read back from the printer", change.tool));
  }
  if (!options.save) return {};
  TRY(KeepToolOffsets(session, NextOf(undo.changes)));
  Report(options, "kept      in the printer's configuration, and read back after its restart");
  return {};
}

}  // namespace trammel::procedure
