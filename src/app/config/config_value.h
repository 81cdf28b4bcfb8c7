// One setting to and from TOML, whichever of the tables of settings it stands in.
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

/// Where a setting of any type that the tables have lives.
using SettingAddress =
    std::variant<double*, std::optional<double>*, int*, bool*, std::string*, std::vector<double>*,
                 std::vector<int>*, std::vector<pressure_advance::Segment>*, gcode::Dialect*,
                 settings::BedShape*, pressure_advance::Finish*, AxisDirection*>;

/// An entry of a table of settings, tied to where its value lives.
struct ConfigSetting {
  std::string_view section;
  std::string_view key;
  settings::SettingRange range;
  std::string_view doc;
  SettingAddress value;
};

/// Every setting of every table, in the order of the documentation; sections are contiguous.
/// The entries point into `config`, which must outlive them.
[[nodiscard]] std::vector<ConfigSetting> SettingsOf(Config& config);

/// Sets the value from TOML.
/// @returns What is wrong with it (its type, its range), or nothing.
[[nodiscard]] std::optional<std::string> SetSetting(const ConfigSetting& setting,
                                                    const toml::node& value);

/// The value as TOML; absent where an optional setting has none.
[[nodiscard]] std::optional<std::string> FormatSetting(const ConfigSetting& setting);

/// Whether nobody else is to see the value: messages leave it out.
[[nodiscard]] bool IsSecret(const ConfigSetting& setting);

/// Whether the setting is written between quotes.
[[nodiscard]] bool IsText(const ConfigSetting& setting);

}  // namespace trammel::files
