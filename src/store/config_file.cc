#include "store/config_file.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <vector>

#include "pressure_advance/pattern_fields.h"
#include "store/config_value.h"
#include "store/suggest.h"

namespace trammel::store {
namespace {

using pressure_advance::PatternConfig;
using pressure_advance::PatternField;
using pressure_advance::PatternFields;

std::string At(const std::string& file, const toml::source_region& source) {
  return source.begin.line > 0 ? fmt::format("{}:{}", file, source.begin.line) : file;
}

std::vector<std::string_view> SectionNames() {
  std::vector<std::string_view> names;
  for (const PatternField& field : PatternFields()) {
    if (names.empty() || names.back() != field.section) names.push_back(field.section);
  }
  return names;
}

std::vector<std::string_view> KeysOf(std::string_view section) {
  std::vector<std::string_view> keys;
  for (const PatternField& field : PatternFields()) {
    if (section.empty() || field.section == section) keys.push_back(field.key);
  }
  return keys;
}

/// An empty section stands for any.
const PatternField* FindField(std::string_view section, std::string_view key) {
  for (const PatternField& field : PatternFields()) {
    if ((section.empty() || field.section == section) && field.key == key) return &field;
  }
  return nullptr;
}

std::string Suggest(std::string_view word, const std::vector<std::string_view>& known) {
  if (const auto nearest = Nearest(word, known)) return fmt::format("; did you mean {}?", *nearest);
  return "; trammel config keys lists what there is";
}

std::string UnknownKey(std::string_view section, std::string_view key) {
  std::string hint;
  if (const PatternField* elsewhere = FindField("", key)) {
    hint = fmt::format("; it belongs in [{}]", elsewhere->section);
  } else {
    hint = Suggest(key, KeysOf(section));
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
                         const std::string& file, Config& config) {
  for (const auto& [key, value] : table) {
    const PatternField* field = FindField(section, key.str());
    if (field == nullptr) {
      return Fail(fmt::format("{}: {}", At(file, key.source()), UnknownKey(section, key.str())));
    }
    if (const auto fault = SetField(*field, value, config.pattern)) {
      return Fail(
          fmt::format("{}: [{}] {}: {}", At(file, key.source()), section, key.str(), *fault));
    }
    ++config.keys_set;
  }
  return {};
}

}  // namespace

Result<Config> ParseConfig(std::string_view text, const std::string& file) {
  const Result<toml::table> root = ParseToml(text, file);
  if (!root) return tl::unexpected(root.error());
  Config config;
  const std::vector<std::string_view> sections = SectionNames();
  for (const auto& [name, value] : *root) {
    const std::string where = At(file, name.source());
    if (std::find(sections.begin(), sections.end(), name.str()) == sections.end()) {
      if (const PatternField* field = FindField("", name.str())) {
        return Fail(fmt::format("{}: {} belongs in [{}]", where, name.str(), field->section));
      }
      return Fail(fmt::format("{}: there is no section [{}]{}", where, name.str(),
                              Suggest(name.str(), sections)));
    }
    if (!value.is_table()) {
      return Fail(fmt::format("{}: {} is a section; write [{}]", where, name.str(), name.str()));
    }
    if (auto done = ReadSection(name.str(), *value.as_table(), file, config); !done) {
      return tl::unexpected(done.error());
    }
  }
  return config;
}

Result<void> ValidateConfig(const Config& config, std::string_view text, const std::string& file) {
  const auto problem = FindProblem(config.pattern);
  if (!problem) return {};
  std::string where = file;
  if (const Result<toml::table> root = ParseToml(text, file)) {
    if (const toml::node* node = root->at_path(problem->section + "." + problem->key).node()) {
      where = At(file, node->source());
    }
  }
  return Fail(fmt::format("{}{}[{}] {}: {}", where, where.empty() ? "" : ": ", problem->section,
                          problem->key, problem->message));
}

Result<void> OverrideConfig(std::string_view assignment, Config& config) {
  const std::size_t equals = assignment.find('=');
  if (equals == std::string_view::npos) {
    return Fail(fmt::format("--set {}: must be key=value or section.key=value", assignment));
  }
  std::string_view key = assignment.substr(0, equals);
  const std::string_view value = assignment.substr(equals + 1);
  std::string_view section;
  if (const std::size_t dot = key.find('.'); dot != std::string_view::npos) {
    section = key.substr(0, dot);
    key = key.substr(dot + 1);
  }
  const PatternField* field = FindField(section, key);
  if (field == nullptr) {
    return Fail(
        fmt::format("--set {}: there is no such key{}", assignment, Suggest(key, KeysOf(""))));
  }
  toml::table table;
  if (IsText(*field) && !value.starts_with('"') && !value.starts_with('\'')) {
    table.insert("value", std::string(value));
  } else {
    Result<toml::table> parsed = ParseToml(fmt::format("value = {}", value), "--set");
    if (!parsed) return Fail(fmt::format("--set {}: {}", assignment, parsed.error().message));
    table = std::move(*parsed);
  }
  if (table.size() != 1) {
    return Fail(fmt::format("--set {}: more than one value", assignment));
  }
  if (const auto fault = SetField(*field, *table.get("value"), config.pattern)) {
    return Fail(fmt::format("--set {}: [{}] {}: {}", assignment, field->section, key, *fault));
  }
  return {};
}

std::string DescribeConfigKeys() {
  const PatternConfig defaults;
  std::string out =
      "# trammel.toml: every key with its default. Keep what differs; a key that is left out has\n"
      "# its default. Keys that stand behind '#' have none.\n";
  std::string_view section;
  for (const PatternField& field : PatternFields()) {
    if (field.section != section) {
      section = field.section;
      out += fmt::format("\n[{}]\n", section);
    }
    std::string range;
    if (field.lo < field.hi) {
      range = fmt::format(" ({}{}{:.10g} … {:.10g})", field.unit, field.unit.empty() ? "" : ", ",
                          field.lo, field.hi);
    }
    const auto value = FormatField(field, defaults);
    out += fmt::format("# {}{}\n", field.doc, range);
    out += value ? fmt::format("{} = {}\n", field.key, *value) : fmt::format("# {} =\n", field.key);
  }
  return out;
}

}  // namespace trammel::store
