// Writes and reads the settings of a sheet as comments of its G-code.
#pragma once

#include <string>
#include <string_view>

#include "base/result.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::tool_offset {

/// Format version of the comments below; rises whenever an older trammel would misread them.
inline constexpr int kSheetFormat = 3;

/// Returns comment lines `; trammel sheet: key = value` with the format, the sheet's number and
/// every setting, lossless, framed by the first and the last of them.
[[nodiscard]] std::string FormatSheetComments(const SheetPlan& plan);

/// Reads the settings of a pattern file; PlanSheet makes the same plan of them. Skips the text
/// around the comments. Errors, naming the line: no comments of a sheet, another format, a key that
/// is unknown, missing, repeated or of another type, a setting that FindProblem refuses, a drawing
/// that is not the one with the number in the file.
[[nodiscard]] Result<SheetSettings> ReadSheetFile(std::string_view gcode);

}  // namespace trammel::tool_offset
