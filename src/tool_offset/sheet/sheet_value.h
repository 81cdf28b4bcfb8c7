// One setting to and from a comment.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "settings/printer.h"
#include "settings/setting.h"

namespace trammel::tool_offset {

/// Where a setting of any type that a sheet has lives.
using SheetValue =
    std::variant<double*, std::optional<double>*, int*, bool*, std::string*, std::vector<double>*,
                 std::vector<int>*, gcode::Dialect*, settings::BedShape*>;

/// Numbers so that they read back as themselves, lists as [1, 2], texts in quotes on one line;
/// absent where an optional setting has no value.
[[nodiscard]] std::optional<std::string> FormatSheetValue(const SheetValue& value);

/// Sets the value.
/// @returns What is wrong with the text or its value, or nothing.
[[nodiscard]] std::optional<std::string> ParseSheetValue(std::string_view text,
                                                         const settings::SettingRange& range,
                                                         const SheetValue& value);

}  // namespace trammel::tool_offset
