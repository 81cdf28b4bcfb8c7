// Prints a sheet on paper that the operator tapes to the cold bed.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "session/guarded_steps.h"
#include "session/operator.h"
#include "session/session.h"
#include "settings/scan_settings.h"
#include "tool_offset/files/offset_files.h"
#include "tool_offset/procedure/tool_offsets.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::procedure {

/// Names of the questions before a print.
inline constexpr const char* kMoveQuestion = "move";
inline constexpr const char* kPaperQuestion = "paper";

/// G-code of the sheet in the folder, required to read the scan.
inline constexpr const char* kSheetGcodeName = "pattern.gcode";

struct SheetPrint {
  tool_offset::SheetPlan plan;
  const settings::ScanSettings* settings = nullptr;  ///< REQUIRED; not owned
  PrinterTools tools;                                ///< those of the plan among them
  std::filesystem::path folder;                      ///< receives the G-code and start.json
  std::filesystem::path state_folder;                ///< empty: files::StateFolder()
  files::StartRecord record;                         ///< its run and its date form the run's name
};

/// Checks all that needs no move: the printer, the commands of the sheet, each tool's heater and
/// temperatures, and that all places are within reach.
[[nodiscard]] Result<void> CheckSheetPrint(const Session& session, const SheetPrint& print);

/// Asks, homes, picks up the reference tool, parks out of the way, waits until bed and nozzles are
/// cold, asks for the paper and monitors the printer meanwhile, heats beside the sheet, prints.
/// Nothing moves or heats before the first answer, nothing at all between the question for the
/// paper and its answer. In any case all heaters are off in the end, whatever they were at before,
/// and the rest is restored (PrinterStateGuard); a tool that was picked up stays on the head.
/// `record` of the print is on the disk with its stage before and after.
/// Errors: kInterrupted if the answer is no, too; kSafety if the bed is warm with the paper on it;
/// kMachine; kInput.
[[nodiscard]] GuardedOutcome PrintSheet(Session& session, SheetPrint& print, Operator& person);

}  // namespace trammel::procedure
