// Writes and reads the settings of a sheet as comments of its G-code.
#pragma once

#include <string>
#include <string_view>

#include "base/result.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::tool_offset {

/// Of the comments below; rises whenever an older trammel would misread them.
inline constexpr int kSheetFormat = 3;

/// Comment lines `; trammel sheet: key = value` with the format, the sheet's number and every
/// setting, lossless, framed by the first and the last of them.
[[nodiscard]] std::string FormatSheetComments(const SheetPlan& plan);

/// The settings that a pattern file was made with; PlanSheet makes the same plan of them. Whatever
/// stands around the comments is passed over.
/// Errors, naming the line: no comments of a sheet, another format, a key that is unknown, missing,
/// given twice or of another type, a setting that FindProblem refuses, a drawing that is not the
/// one with the number that the file states.
[[nodiscard]] Result<SheetSettings> ReadSheetFile(std::string_view gcode);

}  // namespace trammel::tool_offset
