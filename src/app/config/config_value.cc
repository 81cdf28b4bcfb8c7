#include "app/config/config_value.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <span>
#include <sstream>
#include <type_traits>
#include <utility>

#include "pressure_advance/pattern/pattern_config.h"
#include "settings/scan_settings.h"
#include "tool_offset/sheet/sheet_settings.h"

namespace trammel::files {
namespace {

using pressure_advance::Finish;
using pressure_advance::Segment;
using settings::BedShape;
using Fault = std::optional<std::string>;

/// Returns the value and its type, short enough for a message.
std::string Describe(const toml::node& value) {
  constexpr std::size_t kLongest = 40;
  std::ostringstream text;
  value.visit([&](const auto& node) { text << node; });
  std::string shown = text.str();
  if (shown.size() > kLongest) shown = shown.substr(0, kLongest) + "...";
  std::ostringstream type;
  type << value.type();
  return fmt::format("{} ({})", shown, type.str());
}

Fault WrongType(const char* expected, const toml::node& value) {
  return fmt::format("must be {}, is {}", expected, Describe(value));
}

Fault ReadNumber(const toml::node& value, double& out) {
  if (!value.is_number()) return WrongType("a number", value);
  // A whole number that no double equals would be absent if read as a double.
  const auto whole = value.value_exact<std::int64_t>();
  out = whole ? static_cast<double>(*whole) : *value.value_exact<double>();
  return std::nullopt;
}

Fault ReadSegment(const toml::node& value, Segment& segment) {
  const toml::table* table = value.as_table();
  if (table == nullptr) return WrongType("a list of {fraction = ..., speed = ...}", value);
  for (const auto& [key, entry] : *table) {
    double* target = key.str() == "fraction" ? &segment.fraction
                     : key.str() == "speed"  ? &segment.speed_mm_s
                                             : nullptr;
    if (target == nullptr) {
      return fmt::format("a segment has fraction and speed, not \"{}\"", key.str());
    }
    if (Fault fault = ReadNumber(entry, *target)) return fault;
  }
  if (table->size() != 2) return Fault("a segment needs both fraction and speed");
  return std::nullopt;
}

/// Reads a TOML value into a setting of each type.
struct Setter {
  const toml::node& value;

  Fault operator()(double* out) const { return ReadNumber(value, *out); }
  Fault operator()(std::optional<double>* out) const { return ReadNumber(value, out->emplace()); }
  Fault operator()(int* out) const {
    const auto number = value.value_exact<std::int64_t>();
    if (!number) return WrongType("a whole number", value);
    if (!std::in_range<int>(*number)) return fmt::format("{} is far too large", *number);
    *out = static_cast<int>(*number);
    return std::nullopt;
  }
  Fault operator()(bool* out) const {
    const auto flag = value.value_exact<bool>();
    if (!flag) return WrongType("true or false", value);
    *out = *flag;
    return std::nullopt;
  }
  Fault operator()(std::string* out) const {
    const auto text = value.value_exact<std::string>();
    if (!text) return WrongType("a text in quotes", value);
    *out = *text;
    return std::nullopt;
  }
  Fault operator()(std::vector<double>* out) const {
    const toml::array* list = value.as_array();
    if (list == nullptr) return WrongType("a list of numbers", value);
    out->clear();
    for (const toml::node& entry : *list) {
      if (Fault fault = ReadNumber(entry, out->emplace_back())) return fault;
    }
    return std::nullopt;
  }
  Fault operator()(std::vector<int>* out) const {
    const toml::array* list = value.as_array();
    if (list == nullptr) return WrongType("a list of whole numbers", value);
    out->clear();
    for (const toml::node& entry : *list) {
      if (Fault fault = Setter{entry}(&out->emplace_back())) return fault;
    }
    return std::nullopt;
  }
  Fault operator()(std::vector<Segment>* out) const {
    const toml::array* list = value.as_array();
    if (list == nullptr) return WrongType("a list of {fraction = ..., speed = ...}", value);
    out->clear();
    for (const toml::node& entry : *list) {
      if (Fault fault = ReadSegment(entry, out->emplace_back())) return fault;
    }
    return std::nullopt;
  }
  Fault operator()(gcode::Dialect* out) const {
    return Choose(gcode::ParseDialect, out, gcode::DialectNames("\"").c_str());
  }
  Fault operator()(BedShape* out) const {
    return Choose(settings::ParseBedShape, out, "\"rectangle\" or \"ellipse\"");
  }
  Fault operator()(Finish* out) const {
    return Choose(pressure_advance::ParseFinish, out, "\"end\" or \"idle\"");
  }
  Fault operator()(AxisDirection* out) const {
    return Choose(ParseAxisDirection, out, "\"+x\", \"-x\", \"+y\" or \"-y\"");
  }

 private:
  template <class Choice>
  Fault Choose(std::optional<Choice> (*parse)(std::string_view), Choice* out,
               const char* choices) const {
    const auto name = value.value_exact<std::string_view>();
    const std::optional<Choice> choice = name ? parse(*name) : std::nullopt;
    if (!choice) return WrongType(choices, value);
    *out = *choice;
    return std::nullopt;
  }
};

std::string Quoted(const std::string& text) {
  std::ostringstream out;
  out << toml::value<std::string>(text);
  return out.str();
}

template <class Number>
std::string FormatList(const std::vector<Number>& values) {
  return fmt::format("[{}]", fmt::join(values, ", "));
}

/// Writes a setting of each type as TOML.
struct Formatter {
  std::optional<std::string> operator()(double value) const { return fmt::format("{}", value); }
  std::optional<std::string> operator()(const std::optional<double>& value) const {
    if (!value) return std::nullopt;
    return fmt::format("{}", *value);
  }
  std::optional<std::string> operator()(int value) const { return fmt::format("{}", value); }
  std::optional<std::string> operator()(bool value) const { return value ? "true" : "false"; }
  std::optional<std::string> operator()(const std::string& value) const { return Quoted(value); }
  std::optional<std::string> operator()(const std::vector<double>& values) const {
    return FormatList(values);
  }
  std::optional<std::string> operator()(const std::vector<int>& values) const {
    return FormatList(values);
  }
  std::optional<std::string> operator()(const std::vector<Segment>& segments) const {
    std::string list;
    for (const Segment& segment : segments) {
      list += fmt::format("{}{{fraction = {}, speed = {}}}", list.empty() ? "" : ", ",
                          segment.fraction, segment.speed_mm_s);
    }
    return "[" + list + "]";
  }
  template <class Choice>
  std::optional<std::string> operator()(const Choice& value) const {
    return fmt::format("\"{}\"", ToString(value));
  }
};

template <class Fields, class Owner>
void Bind(const Fields& fields, Owner& owner, std::vector<ConfigSetting>& settings) {
  for (const auto& field : fields) {
    std::visit(
        [&](auto member) {
          settings.push_back(
              {field.section, field.key, field.range(), field.doc, &(owner.*member)});
        },
        field.member);
  }
}

}  // namespace

std::vector<ConfigSetting> SettingsOf(Config& config) {
  std::vector<ConfigSetting> settings;
  Bind(settings::PrinterFields(), config.pattern, settings);
  Bind(pressure_advance::PatternFields(), config.pattern, settings);
  Bind(settings::FilamentFields(), config.pattern, settings);
  Bind(tool_offset::SheetFields(), config.sheet, settings);
  Bind(settings::ScanFields(), config.scan, settings);
  // A calibration may add its own keys to a shared section.
  constexpr std::array<std::string_view, 2> kShared{"printer", "filament"};
  std::stable_sort(settings.begin(), settings.end(), [&](const auto& a, const auto& b) {
    const auto rank = [&](const ConfigSetting& setting) {
      return std::find(kShared.begin(), kShared.end(), setting.section);
    };
    return rank(a) < rank(b);
  });
  return settings;
}

std::optional<std::string> SetSetting(const ConfigSetting& setting, const toml::node& value) {
  if (Fault fault = std::visit(Setter{value}, setting.value)) {
    return IsSecret(setting) ? "must be a text in quotes" : fault;
  }
  return std::visit(
      [&](const auto* out) { return settings::FindValueProblem(setting.range, *out); },
      setting.value);
}

std::optional<std::string> FormatSetting(const ConfigSetting& setting) {
  return std::visit([](const auto* value) { return Formatter{}(*value); }, setting.value);
}

bool IsSecret(const ConfigSetting& setting) { return setting.key == "api_key"; }

bool IsText(const ConfigSetting& setting) {
  return std::holds_alternative<std::string*>(setting.value) ||
         std::holds_alternative<gcode::Dialect*>(setting.value) ||
         std::holds_alternative<BedShape*>(setting.value) ||
         std::holds_alternative<Finish*>(setting.value) ||
         std::holds_alternative<AxisDirection*>(setting.value);
}

}  // namespace trammel::files
