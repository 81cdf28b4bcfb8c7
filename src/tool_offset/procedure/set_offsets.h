// Sets measured offsets on a printer and restores the old ones, each old value synced to the disk
// first.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "session/session.h"
#include "tool_offset/files/offset_files.h"
#include "tool_offset/offset/correction.h"

namespace trammel::procedure {

/// Present and next offset of a tool.
struct OffsetCorrection {
  int tool = 0;
  files::MeasuredOffset measured;
  tool_offset::KeptOffset now;
  tool_offset::KeptOffset next;
  /// Offset while the sheet was printed; absent: unknown. The measurement is valid for this one
  /// alone.
  std::optional<tool_offset::KeptOffset> when_printed = {};
};

struct SetOffsetsOptions {
  std::filesystem::path history;  ///< JSON lines (files::kOffsetHistoryFile)
  std::string printer;            ///< address, as it is noted
  std::string source;             ///< the file with the measurement, from the root
  bool save = false;              ///< keep them beyond a restart, too: SAVE_CONFIG restarts
  /// Allows to set twice, beyond what a sheet can show, and over another offset than the sheet was
  /// printed with.
  bool force = false;
  std::function<std::string()> time;            ///< REQUIRED: now, ISO 8601
  std::function<void(const std::string&)> say;  ///< one line for each thing that is done
};

/// Sets each tool's offset and reads it back. Errors: kSafety if the measurement was applied before
/// and still is, moves a tool by more than a sheet can show, or is of another offset than the tool
/// has now; kInput if it cannot be noted: nothing is set then; kMachine.
[[nodiscard]] Result<void> SetOffsets(const Session& session,
                                      const std::vector<OffsetCorrection>& corrections,
                                      const SetOffsetsOptions& options);

/// Writes the set offsets into the printer's configuration, and notes it.
[[nodiscard]] Result<void> KeepOffsets(const Session& session,
                                       const std::vector<OffsetCorrection>& corrections,
                                       const SetOffsetsOptions& options);

/// Last application on a printer, for its undo.
struct OffsetUndo {
  std::string source;                     ///< source of applied values
  std::vector<OffsetCorrection> changes;  ///< `next` as before it; `measured` was taken out
  bool was_kept = false;                  ///< beyond a restart
};

/// Plans the undoing of the last application on this printer. Errors (kInput): none is recorded, or
/// it was undone already; kSafety if another offset than the one set is in force, unless `force`;
/// kMachine.
[[nodiscard]] Result<OffsetUndo> PlanUndo(const Session& session, const SetOffsetsOptions& options);

/// Sets the offsets of PlanUndo, and notes them. Errors: as SetOffsets.
[[nodiscard]] Result<void> UndoOffsets(const Session& session, const OffsetUndo& undo,
                                       const SetOffsetsOptions& options);

/// Checks that a tool still has the offset with which its sheet was printed. Errors: kSafety.
[[nodiscard]] Result<void> CheckSameOffset(int tool, const tool_offset::KeptOffset& when_printed,
                                           const tool_offset::KeptOffset& now);

}  // namespace trammel::procedure
