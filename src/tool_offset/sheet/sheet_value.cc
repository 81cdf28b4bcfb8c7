#include "tool_offset/sheet/sheet_value.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

namespace trammel::tool_offset {
namespace {

using Fault = std::optional<std::string>;

std::string Shown(std::string_view text) {
  constexpr std::size_t kLongest = 40;
  return std::string(text.substr(0, kLongest)) + (text.size() > kLongest ? "..." : "");
}

template <class Number>
Fault ParseNumber(std::string_view text, Number& number, const char* kind) {
  const char* end = text.data() + text.size();
  const auto [last, error] = std::from_chars(text.data(), end, number);
  if (error != std::errc() || last != end) {
    return fmt::format("must be {}, is {}", kind, Shown(text));
  }
  return std::nullopt;
}

/// A text between quotes; line breaks, tabs, quotes and backslashes stand behind a backslash.
std::string Quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    switch (c) {
      case '\n':
        out += "\\n";
        break;
      case '\r':
        out += "\\r";
        break;
      case '\t':
        out += "\\t";
        break;
      case '"':
      case '\\':
        out += '\\';
        out += c;
        break;
      default:
        out += c;
    }
  }
  return out + '"';
}

Fault Unquote(std::string_view text, std::string& out) {
  if (text.size() < 2 || text.front() != '"' || text.back() != '"') {
    return fmt::format("must be a text in quotes, is {}", Shown(text));
  }
  text = text.substr(1, text.size() - 2);
  out.clear();
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '"') return Fault("a quote within the text has no backslash");
    if (text[i] != '\\') {
      out += text[i];
      continue;
    }
    constexpr std::string_view kCodes = "nrt\"\\";
    constexpr std::string_view kMeant = "\n\r\t\"\\";
    const std::size_t code =
        i + 1 < text.size() ? kCodes.find(text[i + 1]) : std::string_view::npos;
    if (code == std::string_view::npos) return Fault("a backslash stands before nothing known");
    out += kMeant[code];
    ++i;
  }
  return std::nullopt;
}

/// Reads a text into a setting of each type.
struct Parser {
  std::string_view text;

  Fault operator()(double* out) const { return ParseNumber(text, *out, "a number"); }
  Fault operator()(std::optional<double>* out) const { return (*this)(&out->emplace()); }
  Fault operator()(int* out) const { return ParseNumber(text, *out, "a whole number"); }
  Fault operator()(bool* out) const {
    if (text != "true" && text != "false") {
      return fmt::format("must be true or false, is {}", Shown(text));
    }
    *out = text == "true";
    return std::nullopt;
  }
  Fault operator()(std::string* out) const { return Unquote(text, *out); }
  template <class Number>
  Fault operator()(std::vector<Number>* out) const {
    constexpr std::size_t kMost = 64;
    if (!text.starts_with('[') || !text.ends_with(']') || text.size() < 2) {
      return fmt::format("must be a list in brackets, is {}", Shown(text));
    }
    std::string_view rest = text.substr(1, text.size() - 2);
    out->clear();
    while (!rest.empty()) {
      if (out->size() == kMost) return fmt::format("has more than {} values", kMost);
      const std::size_t end = std::min(rest.find(", "), rest.size());
      if (Fault fault = Parser{rest.substr(0, end)}(&out->emplace_back())) return fault;
      rest.remove_prefix(std::min(end + 2, rest.size()));
    }
    return std::nullopt;
  }
  Fault operator()(gcode::Dialect* out) const { return Choose(gcode::ParseDialect(text), out); }
  Fault operator()(settings::BedShape* out) const {
    return Choose(settings::ParseBedShape(text), out);
  }

 private:
  template <class Choice>
  Fault Choose(const std::optional<Choice>& choice, Choice* out) const {
    if (!choice) return fmt::format("there is no {}", Shown(text));
    *out = *choice;
    return std::nullopt;
  }
};

/// Writes a setting of each type.
struct Formatter {
  std::optional<std::string> operator()(double value) const { return fmt::format("{}", value); }
  std::optional<std::string> operator()(const std::optional<double>& value) const {
    if (!value) return std::nullopt;
    return fmt::format("{}", *value);
  }
  std::optional<std::string> operator()(int value) const { return fmt::format("{}", value); }
  std::optional<std::string> operator()(bool value) const { return value ? "true" : "false"; }
  std::optional<std::string> operator()(const std::string& value) const { return Quoted(value); }
  template <class Number>
  std::optional<std::string> operator()(const std::vector<Number>& values) const {
    return fmt::format("[{}]", fmt::join(values, ", "));
  }
  template <class Choice>
  std::optional<std::string> operator()(const Choice& value) const {
    return std::string(ToString(value));
  }
};

}  // namespace

std::optional<std::string> FormatSheetValue(const SheetValue& value) {
  return std::visit([](const auto* v) { return Formatter{}(*v); }, value);
}

std::optional<std::string> ParseSheetValue(std::string_view text,
                                           const settings::SettingRange& range,
                                           const SheetValue& value) {
  if (Fault fault = std::visit(Parser{text}, value)) return fault;
  return std::visit([&](const auto* out) { return settings::FindValueProblem(range, *out); },
                    value);
}

}  // namespace trammel::tool_offset
