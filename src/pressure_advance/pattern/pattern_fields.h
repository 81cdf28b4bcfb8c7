// The table of the settings that only this pattern has: [pressure_advance_pattern] of trammel.toml,
// and what [printer] says of how it ends.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "pressure_advance/pattern/pattern_config.h"
#include "settings/setting.h"

namespace trammel::pressure_advance {

using PatternField =
    settings::SettingField<PatternConfig, double, std::optional<double>, int, bool, std::string,
                           std::vector<double>, std::vector<Segment>, Finish>;

/// All settings, in the order in which `trammel config keys` shows them; sections are contiguous.
[[nodiscard]] std::span<const PatternField> PatternFields();

/// A choice as trammel.toml spells it.
[[nodiscard]] std::string_view ToString(Finish finish);
[[nodiscard]] std::optional<Finish> ParseFinish(std::string_view name);

}  // namespace trammel::pressure_advance
