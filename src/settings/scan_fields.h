// The one table of the scan's settings: [moonraker], [camera] and [scan] of trammel.toml.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "settings/scan_settings.h"
#include "settings/setting.h"

namespace trammel::settings {

using ScanField = SettingField<ScanSettings, double, std::optional<double>, int, bool, std::string,
                               std::vector<double>, AxisDirection>;

/// All settings, in the order in which `trammel config keys` shows them; sections are contiguous.
[[nodiscard]] std::span<const ScanField> ScanFields();

/// The first thing that cannot be, if any. Whether what is there suffices for a scan (commands for
/// the laser, lines longer than what is skipped of them) is for the procedure to say: a printer
/// without a laser has the same file.
[[nodiscard]] std::optional<SettingProblem> FindProblem(const ScanSettings& settings);

}  // namespace trammel::settings
