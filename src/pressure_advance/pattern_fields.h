// The one table of the pattern's settings: [printer], [filament] and [pressure_advance_pattern] of
// trammel.toml.
#pragma once

#include <optional>
#include <span>
#include <string_view>

#include "pressure_advance/pattern_config.h"
#include "pressure_advance/setting.h"

namespace trammel::pressure_advance {

using PatternField = SettingField<PatternConfig>;

/// All settings, in the order in which `trammel config keys` shows them; sections are contiguous.
[[nodiscard]] std::span<const PatternField> PatternFields();

/// A choice as trammel.toml spells it.
[[nodiscard]] std::string_view ToString(BedShape shape);
[[nodiscard]] std::string_view ToString(Finish finish);
[[nodiscard]] std::optional<BedShape> ParseBedShape(std::string_view name);
[[nodiscard]] std::optional<Finish> ParseFinish(std::string_view name);

}  // namespace trammel::pressure_advance
