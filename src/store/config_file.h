// trammel.toml: the settings of a user's printer, read strictly.
#pragma once

#include <string>
#include <string_view>

#include "base/result.h"
#include "pressure_advance/pattern_config.h"
#include "pressure_advance/scan_settings.h"

namespace trammel::store {

struct Config {
  pressure_advance::PatternConfig pattern;  ///< [printer], [filament], [pressure_advance_pattern]
  pressure_advance::ScanSettings scan;      ///< [moonraker], [camera], [scan]
  int keys_set = 0;                         ///< how many keys the file gave
};

/// The largest configuration that is read.
inline constexpr std::size_t kMaxConfigBytes = 1u << 20;

/// Reads the text of a trammel.toml; what it leaves out keeps its default. Checks types and each
/// key's own range, not yet how they fit together: settings may still be overridden.
/// Errors begin with `file`:line and name the section, the key, the value and the bound; an unknown
/// section or key is one, with the nearest that exists.
[[nodiscard]] Result<Config> ParseConfig(std::string_view text, const std::string& file);

/// FindProblem as an error that says where in the file the setting stands. `text` and `file` are
/// those given to ParseConfig.
[[nodiscard]] Result<void> ValidateConfig(const Config& config, std::string_view text,
                                          const std::string& file);

/// Sets one key from `key=value` or `section.key=value`, the value as in TOML; quotes round a text
/// may be left out. Without its section, a key that stands in several is that of the first of them.
/// Errors as ParseConfig, beginning with --set.
[[nodiscard]] Result<void> OverrideConfig(std::string_view assignment, Config& config);

/// Every section and key with its documentation, unit, range and default: itself a valid
/// trammel.toml that changes nothing.
[[nodiscard]] std::string DescribeConfigKeys();

}  // namespace trammel::store
