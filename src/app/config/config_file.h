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
  /// What the command line set, by "section.key": the option, without its value.
  std::map<std::string, std::string> options = {};

  /// Whether file or command line gave it, as "section.key".
  [[nodiscard]] bool IsSet(const std::string& key) const {
    return keys.contains(key) || options.contains(key);
  }
};

/// Gives the pattern's lines the width and height that the nozzle lays, where they are not set.
void FollowNozzle(Config& config);

/// What a file that sets nothing gives: the default preset's pattern and scan.
[[nodiscard]] Config DefaultConfig();

/// The largest configuration that is read.
inline constexpr std::size_t kMaxConfigBytes = 1u << 20;

/// Reads the text of a trammel.toml; what it leaves out keeps its default. Checks types and each
/// key's own range, not yet how they fit together: settings may still be overridden.
/// Errors begin with `file`:line and name the section, the key, the value and the bound; an unknown
/// section or key is one, with the nearest that exists.
[[nodiscard]] Result<Config> ParseConfig(std::string_view text, const std::string& file);

/// FindProblem of the pattern and the scan as LocateProblem tells it. `text` and `file` are those
/// given to ParseConfig. The sheet is not judged: a bed that is
/// too small for it still prints a pattern.
[[nodiscard]] Result<void> ValidateConfig(const Config& config, std::string_view text,
                                          const std::string& file);

/// A problem as an error that says where the setting comes from: the option of the command line
/// that set it, or its place in the file. Where neither did and the command line set others, these
/// are named, too.
[[nodiscard]] Error LocateProblem(const settings::SettingProblem& problem, const Config& config,
                                  std::string_view text, const std::string& file);

/// Sets one key from `key=value` or `section.key=value`, the value as in TOML; quotes round a text
/// may be left out. Notes it in `options`. Without its section, a key that stands in several is
/// that of `own_section`, where it has it, or of the first of them. Errors as ParseConfig,
/// beginning with --set.
[[nodiscard]] Result<void> OverrideConfig(std::string_view assignment, Config& config,
                                          std::string_view own_section = {});

/// The sheet's settings together with the printer and the filament of the same file. Not validated.
[[nodiscard]] tool_offset::SheetSettings SheetOf(const Config& config);

/// Every section and key with its documentation, unit, range and default: itself a valid
/// trammel.toml that changes nothing.
[[nodiscard]] std::string DescribeConfigKeys();

/// The same of the settings alone that differ from their defaults, but for those that follow from
/// others (FollowNozzle); empty where none does.
[[nodiscard]] std::string DescribeChanges(Config config);

}  // namespace trammel::files
