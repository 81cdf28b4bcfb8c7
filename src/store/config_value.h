// One setting to and from TOML, whichever of the tables of settings it stands in.
#pragma once

#include <toml++/toml.h>

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pressure_advance/setting.h"
#include "store/config_file.h"

namespace trammel::store {

/// An entry of a table of settings, tied to where its value lives.
struct ConfigSetting {
  std::string_view section;
  std::string_view key;
  pressure_advance::SettingRange range;
  std::string_view doc;
  pressure_advance::SettingPointer<pressure_advance::SettingAddress> value;
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

/// Whether the setting is written between quotes.
[[nodiscard]] bool IsText(const ConfigSetting& setting);

}  // namespace trammel::store
