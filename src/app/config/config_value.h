// Converts one setting to and from TOML, for every table of settings.
#pragma once

#include <toml++/toml.h>

#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "app/config/config_file.h"
#include "pressure_advance/pattern/pattern_config.h"
#include "settings/scan_settings.h"
#include "settings/setting.h"

namespace trammel::files {

/// Address of a setting, of any type in the tables.
using SettingAddress =
    std::variant<double*, std::optional<double>*, int*, bool*, std::string*, std::vector<double>*,
                 std::vector<int>*, std::vector<pressure_advance::Segment>*, gcode::Dialect*,
                 settings::BedShape*, pressure_advance::Finish*, AxisDirection*>;

/// Entry of a table of settings, bound to its value.
struct ConfigSetting {
  std::string_view section;
  std::string_view key;
  settings::SettingRange range;
  std::string_view doc;
  SettingAddress value;
};

/// Returns every setting of every table, in the documentation's order; sections are contiguous. The
/// entries point into `config`, which must outlive them.
[[nodiscard]] std::vector<ConfigSetting> SettingsOf(Config& config);

/// Sets the value from TOML.
/// @returns the problem (its type, its range); absent: none.
[[nodiscard]] std::optional<std::string> SetSetting(const ConfigSetting& setting,
                                                    const toml::node& value);

/// Returns the value as TOML; absent if an optional setting has none.
[[nodiscard]] std::optional<std::string> FormatSetting(const ConfigSetting& setting);

/// True if the value is secret: messages omit it.
[[nodiscard]] bool IsSecret(const ConfigSetting& setting);

/// True if the setting is written in quotes.
[[nodiscard]] bool IsText(const ConfigSetting& setting);

}  // namespace trammel::files
