// Offsets that are about to be set on a printer: in words, and where it is noted.
#pragma once

#include <string>

#include "base/result.h"
#include "tool_offset/files/offset_files.h"
#include "tool_offset/offset/correction.h"
#include "tool_offset/procedure/set_offsets.h"

namespace trammel::app {

/// Where the tool lands, its offset as it is and as it is to be, and the lines that set it.
[[nodiscard]] std::string CorrectionText(const procedure::OffsetCorrection& change,
                                         tool_offset::OffsetFirmware firmware);

/// Where the tool lands, and by how much its offset is to change.
[[nodiscard]] std::string StepText(const files::MeasuredOffset& measured,
                                   tool_offset::OffsetFirmware firmware);

/// The tool's offset as it is and as it is to be, in one line.
[[nodiscard]] std::string BriefCorrection(const procedure::OffsetCorrection& change);

/// The tool's offset as it is, and as it was before.
[[nodiscard]] std::string UndoText(const procedure::OffsetCorrection& change);

/// Notes into `history` what is done on the printer, and says it on standard output. Without a
/// source.
[[nodiscard]] procedure::SetOffsetsOptions OffsetSetting(const std::string& history,
                                                         const std::string& printer);

/// offset-history.jsonl of the state folder. Errors: no such folder.
[[nodiscard]] Result<std::string> UsualOffsetHistory();

}  // namespace trammel::app
