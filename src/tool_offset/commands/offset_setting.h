// Describes offsets that are to be set on a printer, and finds their history.
#pragma once

#include <string>

#include "base/result.h"
#include "tool_offset/files/offset_files.h"
#include "tool_offset/offset/correction.h"
#include "tool_offset/procedure/set_offsets.h"

namespace trammel::app {

/// Formats where the tool lands, its old and new offset, and the lines that set it.
[[nodiscard]] std::string CorrectionText(const procedure::OffsetCorrection& change,
                                         tool_offset::OffsetFirmware firmware);

/// Formats where the tool lands, and the change of its offset.
[[nodiscard]] std::string StepText(const files::MeasuredOffset& measured,
                                   tool_offset::OffsetFirmware firmware);

/// Describes the tool's present and next offset, in one line.
[[nodiscard]] std::string BriefCorrection(const procedure::OffsetCorrection& change);

/// Describes the tool's present and previous offset.
[[nodiscard]] std::string UndoText(const procedure::OffsetCorrection& change);

/// Returns options that note each change in `history` and print it on standard output. Without a
/// source.
[[nodiscard]] procedure::SetOffsetsOptions OffsetSetting(const std::string& history,
                                                         const std::string& printer);

/// Returns offset-history.jsonl of the state folder. Errors: no such folder.
[[nodiscard]] Result<std::string> UsualOffsetHistory();

}  // namespace trammel::app
