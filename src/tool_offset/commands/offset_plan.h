// Which sheet a scan is read as.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "tool_offset/sheet/sheet_plan.h"

namespace trammel::app {

/// What the command line says of the sheet.
struct SheetChoice {
  std::string pattern;       ///< a file: ours, the original generator's G-code, or its settings
  int print = 0;             ///< which of a settings file's prints, from 1; 0: the only one
  std::string original;      ///< instead of a file: the original generator's list, "1,2,3"
  int reference_tool = -1;   ///< with such a list
  double rotation_deg = 15;  ///< with such a list
};

/// Errors (kInput) name the option or the file, and what is wrong with it.
[[nodiscard]] Result<tool_offset::SheetPlan> PlanOf(const SheetChoice& choice);

/// "1,2,3", at most 100 of them; nothing where it is no such list.
[[nodiscard]] std::optional<std::vector<int>> ParseToolList(std::string_view text);

}  // namespace trammel::app
