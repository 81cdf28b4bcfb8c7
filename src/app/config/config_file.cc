#include "app/config/config_file.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cstddef>
#include <functional>
#include <utility>
#include <vector>

#include "app/config/config_value.h"
#include "base/url_secrets.h"
#include "files/json_object.h"
#include "pressure_advance/pattern/pattern_config.h"
#include "pressure_advance/pattern/pattern_geometry.h"
#include "settings/scan_settings.h"

namespace trammel::files {
namespace {

std::string At(const std::string& file, const toml::source_region& source) {
  return source.begin.line > 0 ? fmt::format("{}:{}", file, source.begin.line) : file;
}

using Settings = std::vector<ConfigSetting>;

constexpr std::string_view kPatternSection = "pressure_advance_pattern";
constexpr std::string_view kPreset = "preset";

std::vector<std::string_view> SectionNames(const Settings& settings) {
  std::vector<std::string_view> names;
  for (const ConfigSetting& setting : settings) {
    if (names.empty() || names.back() != setting.section) names.push_back(setting.section);
  }
  return names;
}

std::vector<std::string_view> KeysOf(const Settings& settings, std::string_view section) {
  std::vector<std::string_view> keys;
  for (const ConfigSetting& setting : settings) {
    if (section.empty() || setting.section == section) keys.push_back(setting.key);
  }
  return keys;
}

/// Finds a setting; an empty section matches the first that has the key.
const ConfigSetting* Find(const Settings& settings, std::string_view section,
                          std::string_view key) {
  for (const ConfigSetting& setting : settings) {
    if ((section.empty() || setting.section == section) && setting.key == key) return &setting;
  }
  return nullptr;
}

std::string Suggest(std::string_view word, const std::vector<std::string_view>& known) {
  if (const auto nearest = Nearest(word, known)) return fmt::format("; did you mean {}?", *nearest);
  return "; trammel config keys lists what there is";
}

std::string UnknownKey(const Settings& settings, std::string_view section, std::string_view key) {
  std::string hint;
  if (const ConfigSetting* elsewhere = Find(settings, "", key)) {
    hint = fmt::format("; it belongs in [{}]", elsewhere->section);
  } else {
    hint = Suggest(key, KeysOf(settings, section));
  }
  return fmt::format("[{}] has no key {}{}", section, key, hint);
}

Result<toml::table> ParseToml(std::string_view text, const std::string& file) {
  try {
    return toml::parse(text);
  } catch (const toml::parse_error& error) {
    return Fail(fmt::format("{}: is not TOML: {}", At(file, error.source()), error.description()));
  }
}

Result<void> ReadSection(std::string_view section, const toml::table& table,
                         const std::string& file, const Settings& settings, Config& config) {
  for (const auto& [key, value] : table) {
    const ConfigSetting* setting = Find(settings, section, key.str());
    if (setting == nullptr) {
      return Fail(
          fmt::format("{}: {}", At(file, key.source()), UnknownKey(settings, section, key.str())));
    }
    if (const auto fault = SetSetting(*setting, value)) {
      return Fail(
          fmt::format("{}: [{}] {}: {}", At(file, key.source()), section, key.str(), *fault));
    }
    config.keys.insert(fmt::format("{}.{}", section, key.str()));
  }
  return {};
}

Result<pressure_advance::PatternPreset> PresetNamed(std::string_view name) {
  if (const auto preset = pressure_advance::ParsePatternPreset(name)) return *preset;
  return Fail(fmt::format("[{}] {}: \"{}\" is none of quick, paper and photo", kPatternSection,
                          kPreset, name));
}

// Applies the file's preset, below all that the file sets.
Result<void> ReadPreset(const toml::table& root, const std::string& file, Config& config) {
  const toml::node_view<const toml::node> named = root[kPatternSection][kPreset];
  const auto name = named.value_exact<std::string>();
  if (!name) return {};  // wrong type: reported where the keys are read
  const auto preset = PresetNamed(*name);
  if (!preset) {
    return Fail(fmt::format("{}: {}", At(file, named.node()->source()), preset.error().message));
  }
  ApplyPreset(*preset, config.pattern, config.scan);
  return {};
}

}  // namespace

Config DefaultConfig() {
  Config config;
  ApplyPreset(pressure_advance::kDefaultPreset, config.pattern, config.scan);
  return config;
}

void FollowFirmware(Config& config) {
  const gcode::FirmwareWords& words = gcode::WordsOf(config.pattern.dialect);
  if (!config.IsSet("printer.start_gcode")) config.pattern.start_gcode = words.start_gcode;
  if (!config.IsSet("printer.end_gcode")) config.pattern.end_gcode = words.end_gcode;
}

void FollowNozzle(Config& config) {
  constexpr double kHighest = 0.625;  // in nozzle diameters: ratio of the default layer
  pressure_advance::PatternConfig& pattern = config.pattern;
  pressure_advance::PatternConfig usual = DefaultConfig().pattern;
  if (const auto preset = pressure_advance::ParsePatternPreset(pattern.preset)) {
    ApplyPreset(*preset, usual);
  }
  if (!config.IsSet("pressure_advance_pattern.line_width")) {
    pattern.line_width_mm =
        usual.line_width_mm * (pattern.nozzle_diameter_mm / usual.nozzle_diameter_mm);
  }
  if (!config.IsSet("pressure_advance_pattern.layer_height")) {
    pattern.layer_height_mm =
        std::min(usual.layer_height_mm, kHighest * pattern.nozzle_diameter_mm);
  }
  // A gap remains between beads so wide, and one so narrow is not crossed.
  if (!config.IsSet("pressure_advance_pattern.frame_overlap")) {
    pattern.frame_overlap_mm =
        usual.frame_overlap_mm * std::min(1.0, pattern.line_width_mm / usual.line_width_mm);
  }
  if (!config.IsSet("pressure_advance_pattern.line_spacing")) {
    pattern.line_spacing_mm = std::max(usual.line_spacing_mm, 2 * pattern.line_width_mm);
  }
  if (!config.IsSet("pressure_advance_pattern.frame_margin") && pattern.frame_margin_mm) {
    if (pattern.corner_mark) {
      pattern.frame_margin_mm.reset();  // default: space for the mark
    } else if (usual.frame_margin_mm) {
      pattern.frame_margin_mm = std::max(*usual.frame_margin_mm, 1.5 * pattern.line_width_mm);
    }
  }
}

Result<Config> ParseConfig(std::string_view text, const std::string& file) {
  const toml::table root = TRY(ParseToml(text, file));
  Config config = DefaultConfig();
  TRY(ReadPreset(root, file, config));
  const Settings settings = SettingsOf(config);
  const std::vector<std::string_view> sections = SectionNames(settings);
  for (const auto& [name, value] : root) {
    const std::string where = At(file, name.source());
    if (std::find(sections.begin(), sections.end(), name.str()) == sections.end()) {
      if (const ConfigSetting* setting = Find(settings, "", name.str())) {
        return Fail(fmt::format("{}: {} belongs in [{}]", where, name.str(), setting->section));
      }
      return Fail(fmt::format("{}: there is no section [{}]{}", where, name.str(),
                              Suggest(name.str(), sections)));
    }
    if (!value.is_table()) {
      return Fail(fmt::format("{}: {} is a section; write [{}]", where, name.str(), name.str()));
    }
    TRY(ReadSection(name.str(), *value.as_table(), file, settings, config));
  }
  FollowNozzle(config);
  FollowFirmware(config);
  return config;
}

Result<void> ValidateConfig(const Config& config, std::string_view text, const std::string& file) {
  auto problem = FindProblem(config.pattern);
  if (!problem) problem = FindProblem(config.scan);
  if (!problem) return {};
  return tl::unexpected(LocateProblem(*problem, config, text, file));
}

Error LocateProblem(const settings::SettingProblem& problem, const Config& config,
                    std::string_view text, const std::string& file) {
  const auto said = [&problem](const std::string& where, const std::string& more) {
    return Error{ErrorKind::kInput,
                 fmt::format("{}{}[{}] {}: {}{}", where, where.empty() ? "" : ": ", problem.section,
                             problem.key, problem.message, more)};
  };
  const auto option = config.options.find(problem.section + "." + problem.key);
  if (option != config.options.end()) return said(option->second, "");
  std::string others;
  for (const auto& [key, name] : config.options) {
    others += fmt::format("{}{}", others.empty() ? "; it goes with " : ", ", name);
  }
  std::string where = file;
  if (const Result<toml::table> root = ParseToml(text, file)) {
    if (const toml::node* node = root->at_path(problem.section + "." + problem.key).node()) {
      where = At(file, node->source());
    }
  }
  return said(where, others);
}

tool_offset::SheetSettings SheetOf(const Config& config) {
  tool_offset::SheetSettings sheet = config.sheet;
  const settings::PrinterSettings& printer = config.pattern;
  const settings::FilamentSettings& filament = config.pattern;
  sheet.printer = printer;
  sheet.filament = filament;
  return sheet;
}

Result<void> OverrideConfig(std::string_view assignment, Config& config,
                            std::string_view own_section) {
  const std::size_t equals = assignment.find('=');
  if (equals == std::string_view::npos) {
    return Fail(fmt::format("--set {}: must be key=value or section.key=value",
                            WithoutSecrets(assignment)));
  }
  std::string_view key = assignment.substr(0, equals);
  const std::string_view value = assignment.substr(equals + 1);
  const std::string name(key);  // message without the value, which may be a secret
  std::string_view section;
  if (const std::size_t dot = key.find('.'); dot != std::string_view::npos) {
    section = key.substr(0, dot);
    key = key.substr(dot + 1);
  }
  const Settings settings = SettingsOf(config);
  const ConfigSetting* setting =
      section.empty() && !own_section.empty() ? Find(settings, own_section, key) : nullptr;
  if (setting == nullptr) setting = Find(settings, section, key);
  if (setting == nullptr) {
    return Fail(
        fmt::format("--set {}: there is no such key{}", name, Suggest(key, KeysOf(settings, ""))));
  }
  if (IsSecret(*setting) || WithoutSecrets(value) != value) {
    return Fail(fmt::format(
        "--set {}: everybody on this computer can read the words of a command, and this is a "
        "secret; write it into trammel.toml, which only you can read then (chmod 600){}",
        name, IsSecret(*setting) ? ", or name a file: --set api_key_file=FILE" : ""));
  }
  toml::table table;
  if (IsText(*setting) && !value.starts_with('"') && !value.starts_with('\'')) {
    table.insert("value", std::string(value));
  } else {
    Result<toml::table> parsed = ParseToml(fmt::format("value = {}", value), "--set");
    if (!parsed) return Fail(fmt::format("--set {}: {}", name, parsed.error().message));
    table = std::move(*parsed);
  }
  if (table.size() != 1) {
    return Fail(fmt::format("--set {}: more than one value", name));
  }
  const std::string preset_before = config.pattern.preset;
  if (const auto fault = SetSetting(*setting, *table.get("value"))) {
    return Fail(fmt::format("--set {}: [{}] {}: {}", name, setting->section, key, *fault));
  }
  if (setting->section == kPatternSection && setting->key == kPreset) {
    const auto preset = PresetNamed(std::exchange(config.pattern.preset, preset_before));
    if (!preset) return Fail(fmt::format("--set {}: {}", name, preset.error().message));
    ApplyPreset(*preset, config.pattern, config.scan);
  }
  config.options[fmt::format("{}.{}", setting->section, setting->key)] = "--set " + name;
  FollowNozzle(config);
  FollowFirmware(config);
  return {};
}

namespace {

/// Returns sections with the documentation and the value of each `wanted` setting, by index.
std::string Describe(const Settings& settings, const std::function<bool(std::size_t)>& wanted) {
  std::string out;
  std::string_view section;
  for (std::size_t i = 0; i < settings.size(); ++i) {
    const ConfigSetting& setting = settings[i];
    if (!wanted(i)) continue;
    if (setting.section != section) {
      section = setting.section;
      out += fmt::format("\n[{}]\n", section);
    }
    std::string range;
    if (setting.range.lo < setting.range.hi) {
      const std::string_view unit = setting.range.unit;
      range = fmt::format(" ({}{}{:.10g} … {:.10g})", unit, unit.empty() ? "" : ", ",
                          setting.range.lo, setting.range.hi);
    }
    const auto value = FormatSetting(setting);
    out += fmt::format("# {}{}\n", setting.doc, range);
    out += value ? fmt::format("{} = {}\n", setting.key, *value)
                 : fmt::format("# {} =\n", setting.key);
  }
  return out;
}

}  // namespace

std::string DescribeConfigKeys() {
  Config defaults = DefaultConfig();
  return "# trammel.toml: every key with its default. Keep what differs; a key that is left out "
         "has\n"
         "# its default. Keys that stand behind '#' have none.\n" +
         Describe(SettingsOf(defaults), [](std::size_t) { return true; });
}

std::string DescribeChanges(Config config) {
  Config defaults = DefaultConfig();
  Config following = DefaultConfig();  // derived from other settings
  following.pattern.nozzle_diameter_mm = config.pattern.nozzle_diameter_mm;
  following.pattern.dialect = config.pattern.dialect;
  FollowNozzle(following);
  FollowFirmware(following);
  following.pattern.nozzle_diameter_mm = defaults.pattern.nozzle_diameter_mm;
  following.pattern.dialect = defaults.pattern.dialect;
  const Settings ours = SettingsOf(config);
  const Settings usual = SettingsOf(defaults);
  const Settings followed = SettingsOf(following);
  return Describe(ours, [&](std::size_t i) {
    const auto value = FormatSetting(ours[i]);
    return value && value != FormatSetting(usual[i]) && value != FormatSetting(followed[i]);
  });
}

}  // namespace trammel::files
