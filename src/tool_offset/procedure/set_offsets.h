// Sets measured offsets on a printer and takes them back, each old value on the disk first.
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

/// A tool's offset, as it is and as it is to be.
struct OffsetCorrection {
  int tool = 0;
  files::MeasuredOffset measured;
  tool_offset::KeptOffset now;
  tool_offset::KeptOffset next;
  /// While the sheet was printed; absent: not known. What was measured is of this one alone.
  std::optional<tool_offset::KeptOffset> when_printed = {};
};

struct SetOffsetsOptions {
  std::filesystem::path history;  ///< JSON lines (files::kOffsetHistoryFile)
  std::string printer;            ///< address, as it is noted
  std::string source;             ///< the file with the measurement, from the root
  bool save = false;              ///< keep them beyond a restart, too: SAVE_CONFIG restarts
  /// Also twice, beyond what a sheet can show, and over another offset than it was printed with.
  bool force = false;
  std::function<std::string()> time;            ///< REQUIRED: now, ISO 8601
  std::function<void(const std::string&)> say;  ///< one line for each thing that is done
};

/// Sets each tool's offset and reads it back. Errors: kSafety where the measurement was taken out
/// before and is there still, moves a tool by more than a sheet can show, or is of another offset
/// than the tool has now; kInput where it cannot be noted: nothing is set then; kMachine.
[[nodiscard]] Result<void> SetOffsets(const Session& session,
                                      const std::vector<OffsetCorrection>& corrections,
                                      const SetOffsetsOptions& options);

/// Writes what was set into the printer's configuration, and notes it.
[[nodiscard]] Result<void> KeepOffsets(const Session& session,
                                       const std::vector<OffsetCorrection>& corrections,
                                       const SetOffsetsOptions& options);

/// The last application on a printer, to be taken back.
struct OffsetUndo {
  std::string source;                     ///< what was applied
  std::vector<OffsetCorrection> changes;  ///< `next` as before it; `measured` was taken out
  bool was_kept = false;                  ///< beyond a restart
};

/// What undoing the last application on this printer would set. Errors (kInput): none is noted, or
/// it was taken back already; kSafety where another offset is in force than was set, unless
/// `force`; kMachine.
[[nodiscard]] Result<OffsetUndo> PlanUndo(const Session& session, const SetOffsetsOptions& options);

/// Sets what PlanUndo found, and notes it. Errors: as SetOffsets.
[[nodiscard]] Result<void> UndoOffsets(const Session& session, const OffsetUndo& undo,
                                       const SetOffsetsOptions& options);

/// That a tool still has the offset with which its sheet was printed. Errors: kSafety.
[[nodiscard]] Result<void> CheckSameOffset(int tool, const tool_offset::KeptOffset& when_printed,
                                           const tool_offset::KeptOffset& now);

}  // namespace trammel::procedure
