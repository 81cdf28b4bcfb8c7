#include "tool_offset/original/original_script.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <string>
#include <variant>

#include "base/utf8.h"

namespace trammel::tool_offset {
namespace {

constexpr std::string_view kPrint = "full_interlocked_print";
constexpr std::size_t kMostLines = 1000;
constexpr std::size_t kMostLine = 1000;
constexpr std::size_t kMostNumbers = 100;
constexpr std::size_t kMostSheets = 20;

/// A number, a list of numbers, or a text that does not matter.
struct Value {
  std::vector<double> numbers;
  bool list = false;
  bool text = false;
};

/// Of the pattern: what decides where lines are, and its only value that is read.
struct Geometry {
  std::string_view key;
  double published;
};
constexpr std::array<Geometry, 9> kGeometry{{{"width", 8},
                                             {"sigref_only", 2},
                                             {"length", 70},
                                             {"interlocked_period", 4},
                                             {"interlocked_pitch", 0.75},
                                             {"spacing", 3},
                                             {"spacing_to_square", 5},
                                             {"square_lines", 3},
                                             {"pitch", 1}}};
/// Of the machine: what a scan is not read with.
constexpr std::array<std::string_view, 13> kMachine{
    "tools",    "nozzle_diameters",    "extrusion_multiplier", "layer_height", "z_offset",
    "z_hop",    "retraction_distance", "retraction_speed",     "print_speed",  "x_center",
    "y_center", "insert_pause",        "travel_speed"};

/// Calls after which no setting is known.
constexpr std::array<std::string_view, 4> kSetters{"setattr", "exec", "eval", "update"};

std::string_view Trimmed(std::string_view text) {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  return text;
}

/// Up to a # that stands in no text.
std::string_view WithoutComment(std::string_view line) {
  char quote = 0;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (quote != 0) {
      quote = c == quote ? '\0' : quote;
    } else if (c == '"' || c == '\'') {
      quote = c;
    } else if (c == '#') {
      return line.substr(0, i);
    }
  }
  return line;
}

bool IsName(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
  }) && !(text[0] >= '0' && text[0] <= '9');
}

/// Names with dots between them.
bool IsTarget(std::string_view text) {
  for (std::size_t dot = text.find('.'); dot != std::string_view::npos; dot = text.find('.')) {
    if (!IsName(text.substr(0, dot))) return false;
    text.remove_prefix(dot + 1);
  }
  return IsName(text);
}

std::string Quoted(std::string_view text) {
  constexpr std::size_t kMost = 60;
  return "\"" + Utf8OrReplaced(text, kMost) + "\"";
}

std::optional<double> NumberOf(std::string_view text) {
  if (text == "True" || text == "False") return text == "True" ? 1 : 0;
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  constexpr double kMost = 1e6;
  if (text.empty() || error != std::errc{} || end != text.data() + text.size() ||
      !(std::abs(value) <= kMost)) {
    return std::nullopt;
  }
  return value;
}

/// Splits at commas outside of brackets and texts.
std::vector<std::string_view> Split(std::string_view text) {
  std::vector<std::string_view> parts;
  int depth = 0;
  char quote = 0;
  std::size_t from = 0;
  for (std::size_t i = 0; i <= text.size(); ++i) {
    const char c = i < text.size() ? text[i] : ',';
    if (quote != 0) {
      if (i < text.size()) {
        quote = c == quote ? '\0' : quote;
        continue;
      }
    } else if (c == '"' || c == '\'') {
      quote = c;
    } else if (c == '[' || c == '(') {
      ++depth;
    } else if (c == ']' || c == ')') {
      --depth;
    }
    if (i == text.size() || (c == ',' && depth == 0 && quote == 0)) {
      parts.push_back(Trimmed(text.substr(from, i - from)));
      from = i + 1;
    }
  }
  return parts;
}

class Script {
 public:
  /// An empty answer is none; otherwise the fault.
  std::string Take(std::string_view line) {
    line = Trimmed(line);
    if (line.empty() || line.starts_with("import ") || line.starts_with("from ")) return {};
    const std::size_t bracket = line.find('(');
    const std::size_t equals = line.find('=');
    const bool assigns = equals != std::string_view::npos && equals < bracket;
    const std::string_view target = assigns ? Trimmed(line.substr(0, equals)) : std::string_view();
    const std::string_view right = assigns ? Trimmed(line.substr(equals + 1)) : line;
    if (assigns && !IsTarget(target)) return Quoted(target) + " is no name";
    if (right.find('(') != std::string_view::npos) {
      if (const std::string fault = Forget(target); !fault.empty()) return fault;
      return Call(right);
    }
    if (!assigns) return Quoted(line) + " is no assignment and no call";
    const auto value = ValueOf(right);
    if (!value) return Quoted(right) + " is no number and no list of numbers";
    return Assign(target, *value);
  }

  std::vector<OriginalSheet> sheets;

 private:
  std::optional<Value> ValueOf(std::string_view text) const {
    Value value;
    if (text.size() >= 2 && (text.front() == '"' || text.front() == '\'') &&
        text.back() == text.front()) {
      value.text = true;
      return value;
    }
    if (text.starts_with('[') && text.ends_with(']')) {
      value.list = true;
      text = Trimmed(text.substr(1, text.size() - 2));
      if (text.empty()) return value;
      for (const std::string_view part : Split(text)) {
        const auto number = NumberOf(part);
        if (!number || value.numbers.size() >= kMostNumbers) return std::nullopt;
        value.numbers.push_back(*number);
      }
      return value;
    }
    if (const auto known = variables_.find(text); known != variables_.end()) return known->second;
    const auto number = NumberOf(text);
    if (!number) return std::nullopt;
    value.numbers.push_back(*number);
    return value;
  }

  /// What a call gives is not known: no setting may have it, and a variable no longer has a value.
  std::string Forget(std::string_view target) {
    const std::size_t dot = target.rfind('.');
    if (dot == std::string_view::npos) {
      if (const auto known = variables_.find(target); known != variables_.end()) {
        variables_.erase(known);
      }
      return {};
    }
    const std::string_view key = target.substr(dot + 1);
    if (key == "gen") return {};  // the machine itself
    return std::string(key) + " is to be a number or a list of numbers: nothing of the file is run";
  }

  std::string Assign(std::string_view target, const Value& value) {
    const std::size_t dot = target.rfind('.');
    if (dot == std::string_view::npos) {
      variables_.insert_or_assign(std::string(target), value);
      return {};
    }
    // The machine is a part of the pattern; it may have a name of its own.
    const std::string_view owner = target.substr(0, dot);
    const std::string_view key = target.substr(dot + 1);
    const bool machine = owner == "gen" || owner.ends_with(".gen");
    return machine ? AssignMachine(key, value) : AssignPattern(key, value);
  }

  std::string AssignPattern(std::string_view key, const Value& value) {
    const auto known = std::find_if(kGeometry.begin(), kGeometry.end(),
                                    [&](const Geometry& g) { return g.key == key; });
    if (known == kGeometry.end()) return Quoted(key) + " is no setting of the pattern";
    if (value.list || value.numbers.size() != 1) return std::string(key) + " is to be a number";
    geometry_[static_cast<std::size_t>(known - kGeometry.begin())] = value.numbers[0];
    return {};
  }

  std::string AssignMachine(std::string_view key, const Value& value) {
    if (key == "rotation") {
      if (value.list || value.numbers.size() != 1) return "rotation is to be a number";
      rotation_deg_ = value.numbers[0];
      return {};
    }
    if (key == "x_offsets" || key == "y_offsets") {
      if (!value.list) return std::string(key) + " is to be a list of numbers";
      (key == "x_offsets" ? x_offsets_ : y_offsets_) = value.numbers;
      return {};
    }
    if (std::find(kMachine.begin(), kMachine.end(), key) != kMachine.end()) return {};
    return Quoted(key) + " is no setting of the generator's machine";
  }

  std::string Call(std::string_view call) {
    const std::size_t bracket = call.find('(');
    if (!call.ends_with(')')) return "a call that does not end on its line";
    const std::string_view name = Trimmed(call.substr(0, bracket));
    const std::string_view function = name.substr(name.rfind('.') + 1);
    if (!IsName(function)) return Quoted(name) + " is no name of a function";
    if (std::find(kSetters.begin(), kSetters.end(), function) != kSetters.end()) {
      return std::string(function) + " may change settings: write them as assignments";
    }
    if (function != kPrint) return {};
    return PrintSheet(Split(call.substr(bracket + 1, call.size() - bracket - 2)));
  }

  std::string PrintSheet(const std::vector<std::string_view>& arguments) {
    if (sheets.size() >= kMostSheets) return fmt::format("more than {} sheets", kMostSheets);
    if (arguments.size() < 2) return fmt::format("{} needs tools and a reference tool", kPrint);
    for (std::size_t i = 0; i < kGeometry.size(); ++i) {
      if (geometry_[i] == kGeometry[i].published) continue;
      return fmt::format("{} is {}: only sheets with the published {} are read", kGeometry[i].key,
                         geometry_[i], kGeometry[i].published);
    }
    const auto tools = ValueOf(arguments[0]);
    const auto reference = ValueOf(arguments[1]);
    if (!tools || !tools->list) return "the first argument is to be a list of tools";
    if (!reference || reference->list || reference->numbers.size() != 1) {
      return "the second argument is to be the reference tool";
    }
    OriginalSheet sheet;
    sheet.tools.clear();
    const auto whole = [](double number) {
      return number == std::round(number) && std::abs(number) <= 2 * kHighestOriginalTool;
    };
    for (const double tool : tools->numbers) {
      if (!whole(tool)) return fmt::format("tool {} is no whole number", tool);
      sheet.tools.push_back(static_cast<int>(tool));
    }
    if (!whole(reference->numbers[0])) return "the reference tool is no whole number";
    sheet.reference_tool = static_cast<int>(reference->numbers[0]);
    sheet.rotation_deg = rotation_deg_;
    sheet.moved.assign(sheet.tools.size(), {});
    const auto any = [](const std::vector<double>& list) {
      return std::any_of(list.begin(), list.end(), [](double mm) { return mm != 0; });
    };
    sheet.offsets_not_printed = any(x_offsets_) || any(y_offsets_);
    if (const auto valid = Validate(sheet); !valid) return valid.error().message;
    sheets.push_back(std::move(sheet));
    return {};
  }

  std::map<std::string, Value, std::less<>> variables_;
  std::array<double, kGeometry.size()> geometry_ = [] {
    std::array<double, kGeometry.size()> published{};
    for (std::size_t i = 0; i < published.size(); ++i) published[i] = kGeometry[i].published;
    return published;
  }();
  double rotation_deg_ = 15;
  std::vector<double> x_offsets_;
  std::vector<double> y_offsets_;
};

}  // namespace

bool IsOriginalScript(std::string_view text) { return text.find(kPrint) != std::string_view::npos; }

Result<std::vector<OriginalSheet>> ReadOriginalScript(std::string_view text) {
  Script script;
  for (std::size_t line = 1; !text.empty(); ++line) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view here = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (line > kMostLines || here.size() > kMostLine) {
      return Fail(fmt::format("line {}: more than {} lines, or one of more than {} characters",
                              line, kMostLines, kMostLine));
    }
    if (const std::string fault = script.Take(WithoutComment(here)); !fault.empty()) {
      return Fail(fmt::format("line {}: {}", line, fault));
    }
  }
  if (script.sheets.empty()) {
    return Fail(fmt::format("has no call of {}: it prints no sheet", kPrint));
  }
  return std::move(script.sheets);
}

}  // namespace trammel::tool_offset
