#include "sim/klipper/command_line.h"

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

// Runs of letters and underscores are keys, what stands between them are values: "YQ" is one key
// without a value, which is why Klipper takes "G1 X50 YQ" without complaint.
void ParseLetters(std::string_view text, CommandLine& line) {
  std::size_t i = 0;
  while (i < text.size()) {
    if (!IsAlpha(text[i]) && text[i] != '_') {
      ++i;
      continue;
    }
    std::size_t key_end = i;
    while (key_end < text.size() && (IsAlpha(text[key_end]) || text[key_end] == '_')) ++key_end;
    std::size_t value_end = key_end;
    while (value_end < text.size() && !IsAlpha(text[value_end]) && text[value_end] != '_' &&
           text[value_end] != '*') {
      ++value_end;
    }
    line.parameters[UpperCase(text.substr(i, key_end - i))] =
        std::string(Trimmed(text.substr(key_end, value_end - key_end)));
    i = value_end;
  }
}

// KEY=VALUE words; quotes hold blanks together.
void ParseLong(std::string_view text, CommandLine& line) {
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
      line.fault = fmt::format("Malformed command '{}'", line.text);
      return;
    }
    line.parameters[UpperCase(word.substr(0, equals))] = word.substr(equals + 1);
  }
}

}  // namespace

std::string PythonNumber(double value) {
  return value == std::floor(value) && std::abs(value) < 1e15 ? fmt::format("{:.1f}", value)
                                                              : fmt::format("{}", value);
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

CommandLine ParseCommandLine(std::string_view raw) {
  CommandLine line;
  std::string_view text = Trimmed(raw.substr(0, std::min(raw.size(), raw.find(';'))));
  if (text.size() > 1 && (text[0] == 'N' || text[0] == 'n') && IsDigit(text[1])) {
    std::size_t end = 1;
    while (end < text.size() && IsDigit(text[end])) ++end;
    text = Trimmed(text.substr(end));
  }
  if (text.empty()) return line;
  line.text = std::string(text);
  const bool classic = IsAlpha(text[0]) && text.size() > 1 && IsDigit(text[1]);
  std::size_t end = 1;
  if (classic) {
    while (end < text.size() && (IsDigit(text[end]) || text[end] == '.')) ++end;
  } else {
    while (end < text.size() && !IsSpace(text[end])) ++end;
  }
  line.name = UpperCase(text.substr(0, end));
  line.rest = std::string(Trimmed(text.substr(end)));
  if (line.name == "M117" || line.name == "M118") return line;
  if (classic) {
    ParseLetters(line.rest, line);
  } else {
    ParseLong(line.rest.substr(0, line.rest.find('#')), line);
  }
  return line;
}

Result<std::optional<double>> FloatOf(const CommandLine& line, const std::string& key,
                                      const NumberRule& rule) {
  const auto found = line.parameters.find(key);
  if (found == line.parameters.end()) return std::optional<double>{};
  const std::optional<double> value = ToNumber(found->second);
  if (!value) {
    return Fail(fmt::format("Error on '{}': unable to parse {}", line.text, found->second));
  }
  if (rule.minimum && *value < *rule.minimum) {
    return Fail(fmt::format("Error on '{}': {} must have minimum of {}", line.text, key,
                            PythonNumber(*rule.minimum)));
  }
  if (rule.above && *value <= *rule.above) {
    return Fail(fmt::format("Error on '{}': {} must be above {}", line.text, key,
                            PythonNumber(*rule.above)));
  }
  if (rule.maximum && *value > *rule.maximum) {
    return Fail(fmt::format("Error on '{}': {} must have maximum of {}", line.text, key,
                            PythonNumber(*rule.maximum)));
  }
  return value;
}

Result<double> RequiredFloat(const CommandLine& line, const std::string& key,
                             const NumberRule& rule) {
  const auto value = TRY(FloatOf(line, key, rule));
  if (!value) return Fail(fmt::format("Error on '{}': missing {}", line.text, key));
  return *value;
}

Result<std::string> RequiredText(const CommandLine& line, const std::string& key) {
  const auto found = line.parameters.find(key);
  if (found == line.parameters.end()) {
    return Fail(fmt::format("Error on '{}': missing {}", line.text, key));
  }
  return found->second;
}

}  // namespace trammel::sim
