#include "sim/gcode/command.h"

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
bool IsKey(char c) { return IsAlpha(c) || c == '_'; }

// Returns text for a message: short and without control characters.
std::string Quotable(std::string_view text) {
  std::string shown;
  for (const char c : text.substr(0, 40)) {
    shown += std::isprint(static_cast<unsigned char>(c)) != 0 ? c : '?';
  }
  return text.size() > 40 ? shown + "..." : shown;
}

// A value ends at the next letter or space, so that the fault in "X1e" is detected.
void ParseSingleLetters(std::string_view text, Command& command) {
  text = text.substr(0, text.find('*'));
  for (std::size_t i = 0; i < text.size();) {
    if (!IsAlpha(text[i])) {
      ++i;
      continue;
    }
    std::size_t end = i + 1;
    while (end < text.size() && !IsSpace(text[end])) {
      const bool next_word = IsAlpha(text[end]) && end > i + 1 &&
                             (IsDigit(text[end - 1]) || text[end - 1] == '.') && text[end] != 'e';
      if (next_word) break;
      ++end;
    }
    command.parameters[UpperCase(text.substr(i, 1))] = std::string(text.substr(i + 1, end - i - 1));
    i = end;
  }
}

// Runs of letters and underscores are keys, the text between them values.
void ParseRuns(std::string_view text, Command& command) {
  for (std::size_t i = 0; i < text.size();) {
    if (!IsKey(text[i])) {
      ++i;
      continue;
    }
    std::size_t key_end = i;
    while (key_end < text.size() && IsKey(text[key_end])) ++key_end;
    std::size_t end = key_end;
    while (end < text.size() && !IsKey(text[end]) && text[end] != '*') ++end;
    command.parameters[UpperCase(text.substr(i, key_end - i))] =
        std::string(Trimmed(text.substr(key_end, end - key_end)));
    i = end;
  }
}

// Parses KEY=VALUE words; quotes enclose blanks.
void ParseLong(std::string_view text, Command& command) {
  text = text.substr(0, text.find('#'));
  while (!(text = Trimmed(text)).empty()) {
    std::string word;
    char quote = 0;
    std::size_t i = 0;
    for (; i < text.size() && (quote != 0 || !IsSpace(text[i])); ++i) {
      if (quote == 0 && (text[i] == '"' || text[i] == '\'')) {
        quote = text[i];
      } else if (text[i] == quote) {
        quote = 0;
      } else {
        word += text[i];
      }
    }
    text.remove_prefix(i);
    const std::size_t equals = word.find('=');
    if (equals == std::string::npos || equals == 0 || quote != 0) {
      command.fault = fmt::format("Malformed command '{}'", command.text);
      return;
    }
    command.parameters[UpperCase(word.substr(0, equals))] = word.substr(equals + 1);
  }
}

}  // namespace

Command ParseCommand(std::string_view line, int line_number, Letters letters) {
  Command command;
  command.line = line_number;
  std::string_view text = Trimmed(line.substr(0, line.find(';')));
  if (text.size() > 1 && (text[0] == 'N' || text[0] == 'n') && IsDigit(text[1])) {
    std::size_t end = 1;
    while (end < text.size() && IsDigit(text[end])) ++end;
    text = Trimmed(text.substr(end));
  }
  if (text.empty()) return command;
  command.text = std::string(text);
  const bool classic = IsAlpha(text[0]) && text.size() > 1 && IsDigit(text[1]);
  std::size_t end = 1;
  while (end < text.size() &&
         (classic ? IsDigit(text[end]) || text[end] == '.' : !IsSpace(text[end]))) {
    ++end;
  }
  command.name = UpperCase(text.substr(0, end));
  command.rest = std::string(Trimmed(text.substr(end)));
  if (command.name == "M117" || command.name == "M118") return command;
  if (!classic) {
    ParseLong(command.rest, command);
  } else if (letters == Letters::kRuns) {
    ParseRuns(command.rest, command);
  } else {
    ParseSingleLetters(command.rest, command);
  }
  return command;
}

std::optional<double> ToNumber(std::string_view text) {
  text = Trimmed(text);
  if (!text.empty() && text.front() == '+') text.remove_prefix(1);
  double value = 0;
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (fault != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) {
    return std::nullopt;
  }
  return value;
}

Result<std::optional<double>> NumberOf(const Command& command, const std::string& key,
                                       const Bound& bound) {
  const auto found = command.parameters.find(key);
  if (found == command.parameters.end()) return std::optional<double>{};
  const std::optional<double> value = ToNumber(found->second);
  if (!value) {
    return Fail(fmt::format("G-code line {}: {} {}: '{}' is not a finite number", command.line,
                            Quotable(command.name), key, Quotable(found->second)));
  }
  if (*value < bound.lo || *value > bound.hi) {
    return Fail(fmt::format("G-code line {}: {} {} is {}; it must lie within {} … {}", command.line,
                            Quotable(command.name), key, *value, bound.lo, bound.hi));
  }
  return value;
}

}  // namespace trammel::sim
