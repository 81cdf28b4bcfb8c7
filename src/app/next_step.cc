#include "app/next_step.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

namespace trammel::app {

void SayNext(std::string_view label, const std::string& text, int column, std::FILE* where) {
  fmt::print(where, "{:<{}}{}\n", label, column, text);
}

std::string ShellQuoted(const std::string& word) {
  const bool plain = !word.empty() && std::all_of(word.begin(), word.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || std::string_view("-_./,:@=+").find(char(c)) != std::string::npos;
  });
  if (plain) return word;
  std::string quoted = "'";
  for (const char c : word) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

}  // namespace trammel::app
