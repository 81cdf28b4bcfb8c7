#include "app/verdict_colour.h"

#include <algorithm>
#include <array>
#include <utility>

namespace trammel::app {
namespace {

constexpr std::string_view kKey = "verdict ";
constexpr std::string_view kPlain = "\x1b[0m";
// Select Graphic Rendition (ECMA-48), by the words of VerdictWords().
constexpr std::array<std::pair<std::string_view, std::string_view>, 3> kColours{
    {{"good", "\x1b[32m"}, {"cannot tell", "\x1b[33m"}, {"refused", "\x1b[31m"}}};

/// The line with its word coloured where it is a verdict.
std::string Coloured(std::string_view line) {
  const std::size_t at = line.starts_with(kKey) ? line.find_first_not_of(' ', kKey.size()) : 0;
  if (at == 0 || at == std::string_view::npos) return std::string(line);
  for (const auto& [word, colour] : kColours) {
    const std::string_view rest = line.substr(at);
    if (!rest.starts_with(word)) continue;
    const std::string_view behind = rest.substr(word.size());
    if (!behind.empty() && behind.front() != ':' && behind.front() != '\n') continue;
    std::string text(line.substr(0, at));
    return text.append(colour).append(word).append(kPlain).append(behind);
  }
  return std::string(line);
}

}  // namespace

std::string WithColouredVerdicts(std::string_view text, bool at_line_start) {
  std::string coloured;
  while (!text.empty()) {
    const std::string_view line = text.substr(0, std::min(text.size(), text.find('\n')) + 1);
    coloured += at_line_start ? Coloured(line) : std::string(line);
    at_line_start = true;
    text.remove_prefix(line.size());
  }
  return coloured;
}

}  // namespace trammel::app
