// trammel.toml: the settings of a user's printer, read strictly.
#pragma once

#include <map>
#include <set>
#include <string>
#include <string_view>

#include "base/result.h"
#include "pressure_advance/pattern/pattern_config.h"
#include "settings/scan_settings.h"
#include "settings/setting.h"
#include "tool_offset/sheet/sheet_settings.h"

namespace trammel::files {

struct Config {
  pressure_advance::PatternConfig pattern;  ///< [printer], [filament], [pressure_advance_pattern]
  settings::ScanSettings scan;              ///< [moonraker], [camera], [scan]
  tool_offset::SheetSettings sheet;         ///< [tool_offset_pattern]; see SheetOf
  std::set<std::string> keys = {};          ///< that the file gave, as "section.key"
  /// Settings from the command line: "section.key" to option, without its value.
  std::map<std::string, std::string> options = {};

  /// True if the file or the command line sets "section.key".
  [[nodiscard]] bool IsSet(const std::string& key) const {
    return keys.contains(key) || options.contains(key);
  }
};

/// Sets the width and height of the pattern's lines to the nozzle's, where they are not set.
void FollowNozzle(Config& config);

/// Sets start and end G-code to the firmware's defaults, where they are not set.
void FollowFirmware(Config& config);

/// Returns the configuration of an empty file: the default preset's pattern and scan.
[[nodiscard]] Config DefaultConfig();

/// Maximum size of a configuration.
inline constexpr std::size_t kMaxConfigBytes = 1u << 20;

/// Parses the text of a trammel.toml; absent keys have their default. Checks types and each key's
/// own range, but not their combination, since settings may still be overridden. Errors begin with
/// `file`:line and name the section, the key, the value and the bound. An unknown section or key is
/// an error that names the nearest existing one.
[[nodiscard]] Result<Config> ParseConfig(std::string_view text, const std::string& file);

/// Returns FindProblem of the pattern and the scan, located by LocateProblem. `text` and `file` are
/// those given to ParseConfig. The sheet is not checked: a bed that is too small for it can still
/// print a pattern.
[[nodiscard]] Result<void> ValidateConfig(const Config& config, std::string_view text,
                                          const std::string& file);

/// Converts a problem to an error that names the setting's source: the command line's option, or
/// its place in the file. For a default, names the settings that the command line overrides, if
/// any.
[[nodiscard]] Error LocateProblem(const settings::SettingProblem& problem, const Config& config,
                                  std::string_view text, const std::string& file);

/// Sets one key from `key=value` or `section.key=value`, the value as in TOML; quotes around a text
/// may be omitted. Records it in `options`. Without its section, a key of several sections is that
/// of `own_section`, if it is there, else of the first. Errors as ParseConfig, beginning with
/// --set.
[[nodiscard]] Result<void> OverrideConfig(std::string_view assignment, Config& config,
                                          std::string_view own_section = {});

/// Combines the sheet's settings with the printer and the filament of the same file. Not validated.
[[nodiscard]] tool_offset::SheetSettings SheetOf(const Config& config);

/// Returns every section and key with its documentation, unit, range and default: itself a valid
/// trammel.toml that changes nothing.
[[nodiscard]] std::string DescribeConfigKeys();

/// Describes only the settings that differ from their defaults, except those derived from others
/// (FollowNozzle, FollowFirmware); empty if there are none.
[[nodiscard]] std::string DescribeChanges(Config config);

}  // namespace trammel::files
