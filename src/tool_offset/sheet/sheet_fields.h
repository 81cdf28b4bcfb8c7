// The table of the sheet's own settings: [tool_offset_pattern] of trammel.toml.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "settings/setting.h"
#include "tool_offset/sheet/sheet_settings.h"

namespace trammel::tool_offset {

inline constexpr std::string_view kSheetSection = "tool_offset_pattern";

using SheetField = settings::SettingField<SheetSettings, double, std::optional<double>, int, bool,
                                          std::string, std::vector<double>, std::vector<int>>;

/// All settings but the printer's and the filament's, in the order in which `trammel config keys`
/// shows them.
[[nodiscard]] std::span<const SheetField> SheetFields();

}  // namespace trammel::tool_offset
