#include "app/verdict_colour.h"

#include <algorithm>
#include <array>
#include <utility>

namespace trammel::app {
namespace {

constexpr std::string_view kKey = "verdict ";
constexpr std::string_view kGap = "  ";  // between the columns of a line
constexpr std::string_view kPlain = "\x1b[0m";
// Select Graphic Rendition (ECMA-48), by the words of VerdictWords().
constexpr std::array<std::pair<std::string_view, std::string_view>, 3> kColours{
    {{"good", "\x1b[32m"}, {"cannot tell", "\x1b[33m"}, {"refused", "\x1b[31m"}}};

bool EndsColumn(std::string_view behind) {
  return behind.empty() || behind.front() == ':' || behind.front() == '\n' ||
         behind.starts_with(kGap);
}

/// The line with its first column coloured that is a verdict.
std::string Coloured(std::string_view line) {
  std::size_t gap = line.starts_with(kKey) ? kKey.size() - 1 : line.find(kGap);
  while (gap != std::string_view::npos) {
    const std::size_t column = line.find_first_not_of(' ', gap);
    if (column == std::string_view::npos) break;
    for (const auto& [word, colour] : kColours) {
      if (!line.substr(column).starts_with(word)) continue;
      const std::string_view behind = line.substr(column + word.size());
      if (!EndsColumn(behind)) continue;
      return std::string(line.substr(0, column))
          .append(colour)
          .append(word)
          .append(kPlain)
          .append(behind);
    }
    gap = line.find(kGap, column);
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
