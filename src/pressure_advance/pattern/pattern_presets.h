// Patterns by name: what one key of trammel.toml stands for.
#pragma once

#include <optional>
#include <span>
#include <string_view>

#include "pressure_advance/pattern/pattern_config.h"
#include "settings/scan_settings.h"

namespace trammel::pressure_advance {

/// A pattern and the scan that goes with it.
enum class PatternPreset {
  kQuick,  ///< short lines, printed and swept to and fro without a stop: a third of the paper's
           ///< time
  kPaper,  ///< the published pattern and scan: what PatternConfig and ScanSettings default to
};

inline constexpr PatternPreset kDefaultPreset = PatternPreset::kQuick;

/// As trammel.toml spells them.
[[nodiscard]] std::string_view ToString(PatternPreset preset);
[[nodiscard]] std::optional<PatternPreset> ParsePatternPreset(std::string_view name);

/// Names the preset and its fields: every one that is still as the preset before has it becomes the
/// new one's, all others stay. An empty PatternConfig::preset is the paper's.
void ApplyPreset(PatternPreset preset, PatternConfig& pattern, settings::ScanSettings& scan);
/// The same of the pattern alone.
void ApplyPreset(PatternPreset preset, PatternConfig& pattern);

}  // namespace trammel::pressure_advance
