// Compares an original sheet with the file that it was printed from.
#pragma once

#include <optional>
#include <string>

#include "tool_offset/reading/sheet_result.h"

namespace trammel::tool_offset {

/// Compares the reference tool's own pairs with their programmed offset: they have no other one.
/// Another tool's programmed offset looks like the tool's own.
/// @returns why the sheet was not printed from this file; nothing where it may have been.
[[nodiscard]] std::optional<std::string> CheckAgainstFile(const SheetPlan& plan,
                                                          const SheetResult& result);

}  // namespace trammel::tool_offset
