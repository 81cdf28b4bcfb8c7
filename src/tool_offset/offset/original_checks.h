// What an original sheet shows of the file that it was printed from.
#pragma once

#include <optional>
#include <string>

#include "tool_offset/reading/sheet_result.h"

namespace trammel::tool_offset {

/// Refuses what contradicts the plan by more than a method's bias can be.
///
/// A tool against itself has the offset that the file gives it, and nothing else: where a control
/// or a self-test reads another one, the sheet was not printed from this file, and no tool's value
/// counts. A tool that is listed several times has one offset: where its pairs differ, its own
/// value does not count. On a tool that is listed once another offset on purpose cannot be seen: it
/// looks like the tool's own.
/// @param result  with all its answers.
/// @returns why the sheet is not the file's; nothing where it may be.
[[nodiscard]] std::optional<std::string> CheckAgainstFile(const SheetPlan& plan,
                                                          SheetResult& result);

}  // namespace trammel::tool_offset
