#include "store/config_value.h"

#include <fmt/format.h>

#include <limits>
#include <sstream>
#include <type_traits>
#include <utility>

namespace trammel::store {
namespace {

using pressure_advance::BedShape;
using pressure_advance::Finish;
using pressure_advance::PatternConfig;
using pressure_advance::PatternField;
using pressure_advance::Segment;
using Fault = std::optional<std::string>;

/// The value and its type, short enough for a message.
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
  out = *value.value<double>();
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
  PatternConfig& config;

  Fault operator()(double PatternConfig::*member) const {
    return ReadNumber(value, config.*member);
  }
  Fault operator()(std::optional<double> PatternConfig::*member) const {
    return ReadNumber(value, (config.*member).emplace());
  }
  Fault operator()(int PatternConfig::*member) const {
    const auto number = value.value_exact<std::int64_t>();
    if (!number) return WrongType("a whole number", value);
    if (!std::in_range<int>(*number)) return fmt::format("{} is far too large", *number);
    config.*member = static_cast<int>(*number);
    return std::nullopt;
  }
  Fault operator()(bool PatternConfig::*member) const {
    const auto flag = value.value_exact<bool>();
    if (!flag) return WrongType("true or false", value);
    config.*member = *flag;
    return std::nullopt;
  }
  Fault operator()(std::string PatternConfig::*member) const {
    const auto text = value.value_exact<std::string>();
    if (!text) return WrongType("a text in quotes", value);
    config.*member = *text;
    return std::nullopt;
  }
  Fault operator()(std::vector<double> PatternConfig::*member) const {
    const toml::array* list = value.as_array();
    if (list == nullptr) return WrongType("a list of numbers", value);
    (config.*member).clear();
    for (const toml::node& entry : *list) {
      if (Fault fault = ReadNumber(entry, (config.*member).emplace_back())) return fault;
    }
    return std::nullopt;
  }
  Fault operator()(std::vector<Segment> PatternConfig::*member) const {
    const toml::array* list = value.as_array();
    if (list == nullptr) return WrongType("a list of {fraction = ..., speed = ...}", value);
    (config.*member).clear();
    for (const toml::node& entry : *list) {
      if (Fault fault = ReadSegment(entry, (config.*member).emplace_back())) return fault;
    }
    return std::nullopt;
  }
  Fault operator()(gcode::Dialect PatternConfig::*member) const {
    return Choose(gcode::ParseDialect, member, "\"klipper\", \"marlin\" or \"reprapfirmware\"");
  }
  Fault operator()(BedShape PatternConfig::*member) const {
    return Choose(pressure_advance::ParseBedShape, member, "\"rectangle\" or \"ellipse\"");
  }
  Fault operator()(Finish PatternConfig::*member) const {
    return Choose(pressure_advance::ParseFinish, member, "\"end\" or \"idle\"");
  }

 private:
  template <class Choice>
  Fault Choose(std::optional<Choice> (*parse)(std::string_view), Choice PatternConfig::*member,
               const char* choices) const {
    const auto name = value.value_exact<std::string_view>();
    const std::optional<Choice> choice = name ? parse(*name) : std::nullopt;
    if (!choice) return WrongType(choices, value);
    config.*member = *choice;
    return std::nullopt;
  }
};

std::string Quoted(const std::string& text) {
  std::ostringstream out;
  out << toml::value<std::string>(text);
  return out.str();
}

std::string FormatList(const std::vector<double>& values) {
  return fmt::format("[{}]", fmt::join(values, ", "));
}

/// Writes a setting of each type as TOML.
struct Formatter {
  const PatternConfig& config;

  std::optional<std::string> operator()(double PatternConfig::*member) const {
    return fmt::format("{}", config.*member);
  }
  std::optional<std::string> operator()(std::optional<double> PatternConfig::*member) const {
    if (!(config.*member)) return std::nullopt;
    return fmt::format("{}", *(config.*member));
  }
  std::optional<std::string> operator()(int PatternConfig::*member) const {
    return fmt::format("{}", config.*member);
  }
  std::optional<std::string> operator()(bool PatternConfig::*member) const {
    return config.*member ? "true" : "false";
  }
  std::optional<std::string> operator()(std::string PatternConfig::*member) const {
    return Quoted(config.*member);
  }
  std::optional<std::string> operator()(std::vector<double> PatternConfig::*member) const {
    return FormatList(config.*member);
  }
  std::optional<std::string> operator()(std::vector<Segment> PatternConfig::*member) const {
    std::string list;
    for (const Segment& segment : config.*member) {
      list += fmt::format("{}{{fraction = {}, speed = {}}}", list.empty() ? "" : ", ",
                          segment.fraction, segment.speed_mm_s);
    }
    return "[" + list + "]";
  }
  template <class Choice>
  std::optional<std::string> operator()(Choice PatternConfig::*member) const {
    return fmt::format("\"{}\"", ToString(config.*member));
  }
};

}  // namespace

std::optional<std::string> SetField(const PatternField& field, const toml::node& value,
                                    PatternConfig& config) {
  if (Fault fault = std::visit(Setter{value, config}, field.member)) return fault;
  return FindFieldProblem(config, field);
}

std::optional<std::string> FormatField(const PatternField& field, const PatternConfig& config) {
  return std::visit(Formatter{config}, field.member);
}

bool IsText(const PatternField& field) {
  return std::holds_alternative<std::string PatternConfig::*>(field.member) ||
         std::holds_alternative<gcode::Dialect PatternConfig::*>(field.member) ||
         std::holds_alternative<BedShape PatternConfig::*>(field.member) ||
         std::holds_alternative<Finish PatternConfig::*>(field.member);
}

}  // namespace trammel::store
