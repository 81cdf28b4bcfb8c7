#include "sim/print/gcode_words.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>

#include "base/text.h"

namespace trammel::sim {
namespace {

bool IsSpace(char c) { return std::isspace(static_cast<unsigned char>(c)) != 0; }
bool IsAlpha(char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0; }
bool IsDigit(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }

// Text for a message: short and without control characters.
std::string Quotable(std::string_view text) {
  std::string shown;
  for (const char c : text.substr(0, 40)) {
    shown += std::isprint(static_cast<unsigned char>(c)) != 0 ? c : '?';
  }
  return text.size() > 40 ? shown + "..." : shown;
}

std::string_view WithoutLineNumber(std::string_view text) {
  if (text.size() < 2 || (text[0] != 'N' && text[0] != 'n') || !IsDigit(text[1])) {
    return text;
  }
  std::size_t end = 1;
  while (end < text.size() && IsDigit(text[end])) ++end;
  return Trimmed(text.substr(end));
}

// KEY=VALUE words; a value may stand in double quotes.
void ParseLongParameters(std::string_view text, Command& command) {
  while (!(text = Trimmed(text)).empty()) {
    const std::size_t equals = text.find('=');
    if (equals == std::string_view::npos) {
      return;
    }
    std::string_view key = Trimmed(text.substr(0, equals));
    const std::size_t last_space = key.find_last_of(" \t");
    if (last_space != std::string_view::npos) {
      key = key.substr(last_space + 1);
    }
    text = Trimmed(text.substr(equals + 1));
    const bool quoted = !text.empty() && text.front() == '"';
    if (quoted) {
      text.remove_prefix(1);
    }
    std::size_t end = 0;
    while (end < text.size() && (quoted ? text[end] != '"' : !IsSpace(text[end]))) ++end;
    command.parameters[UpperCase(key)] = std::string(text.substr(0, end));
    text.remove_prefix(std::min(text.size(), end + (quoted ? 1 : 0)));
  }
}

// Letters with numbers. A value runs to the next letter or space, so that "X1e" keeps its fault.
void ParseLetters(std::string_view text, Command& command) {
  std::size_t i = 0;
  while (i < text.size()) {
    if (!IsAlpha(text[i])) {
      ++i;
      continue;
    }
    const std::string key = UpperCase(text.substr(i, 1));
    std::size_t end = i + 1;
    while (end < text.size() && !IsSpace(text[end])) {
      const bool next_word = IsAlpha(text[end]) && end > i + 1 &&
                             (IsDigit(text[end - 1]) || text[end - 1] == '.') && text[end] != 'e';
      if (next_word) {
        break;
      }
      ++end;
    }
    command.parameters[key] = std::string(text.substr(i + 1, end - i - 1));
    i = end;
  }
}

}  // namespace

Command ParseCommand(std::string_view line, int line_number) {
  Command command;
  command.line = line_number;
  std::string_view text = Trimmed(line.substr(0, std::min(line.size(), line.find(';'))));
  text = WithoutLineNumber(text);
  if (text.empty()) {
    return command;
  }
  const bool classic = IsAlpha(text[0]) && text.size() > 1 && IsDigit(text[1]);
  std::size_t end = 1;
  if (classic) {
    text = Trimmed(text.substr(0, std::min(text.size(), text.find('*'))));
    while (end < text.size() && (IsDigit(text[end]) || text[end] == '.')) ++end;
  } else {
    while (end < text.size() && !IsSpace(text[end])) ++end;
  }
  command.name = UpperCase(text.substr(0, end));
  const std::string_view rest = text.substr(end);
  if (classic && command.name != "M117" && command.name != "M118") {
    ParseLetters(rest, command);
  } else if (!classic) {
    ParseLongParameters(rest, command);
  }
  return command;
}

Result<std::optional<double>> NumberOf(const Command& command, const std::string& key,
                                       const Bound& bound) {
  const auto found = command.parameters.find(key);
  if (found == command.parameters.end()) {
    return std::optional<double>{};
  }
  std::string_view text = found->second;
  if (!text.empty() && text.front() == '+') {
    text.remove_prefix(1);
  }
  double value = 0;
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (fault != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) {
    return Fail(fmt::format("G-code line {}: {} {}: '{}' is not a finite number", command.line,
                            Quotable(command.name), key, Quotable(found->second)));
  }
  if (value < bound.lo || value > bound.hi) {
    return Fail(fmt::format("G-code line {}: {} {} is {}; it must lie within {} … {}", command.line,
                            Quotable(command.name), key, value, bound.lo, bound.hi));
  }
  return std::optional<double>{value};
}

}  // namespace trammel::sim
