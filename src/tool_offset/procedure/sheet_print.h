// Prints a sheet on paper that a person tapes to the cold bed.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "session/guarded_steps.h"
#include "session/person.h"
#include "session/session.h"
#include "settings/scan_settings.h"
#include "tool_offset/files/offset_files.h"
#include "tool_offset/procedure/tool_offsets.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::procedure {

/// The questions that lead to a print, by their names.
inline constexpr const char* kMoveQuestion = "move";
inline constexpr const char* kPaperQuestion = "paper";

/// The G-code of the sheet in the folder: the scan is read with it.
inline constexpr const char* kSheetGcodeName = "pattern.gcode";

struct SheetPrint {
  tool_offset::SheetPlan plan;
  const settings::ScanSettings* settings = nullptr;  ///< REQUIRED; not owned
  PrinterTools tools;                                ///< those of the plan among them
  std::filesystem::path folder;                      ///< receives the G-code and start.json
  std::filesystem::path state_folder;                ///< empty: files::StateFolder()
  files::StartRecord record;                         ///< its run and its date name the run
};

/// Everything that can be looked at without a move: the printer, the commands of the sheet, each
/// tool's heater and temperatures, and that all places lie within reach.
[[nodiscard]] Result<void> CheckSheetPrint(const Session& session, const SheetPrint& print);

/// Asks, homes, picks up the reference tool, parks out of the way, waits until bed and nozzles are
/// cold, asks for the paper and looks after the printer meanwhile, heats beside the sheet, prints.
/// Nothing moves or heats before the first answer, nothing at all between the question for the
/// paper and its answer. Whatever happens all heaters are off in the end, whatever they were at
/// before, and the rest is as it was (PrinterStateGuard); a tool that was picked up stays on the
/// head.
/// `record` of the print is on the disk with its stage before and after.
/// Errors: kInterrupted where the answer is no, too; kSafety where the bed is warm and the paper
/// lies there; kMachine; kInput.
[[nodiscard]] GuardedOutcome PrintSheet(Session& session, SheetPrint& print, Person& person);

}  // namespace trammel::procedure
