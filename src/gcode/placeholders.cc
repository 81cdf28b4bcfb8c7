#include "gcode/placeholders.h"

#include <fmt/format.h>

#include <algorithm>

namespace trammel::gcode {
namespace {

long LineOf(std::string_view text, std::size_t position) {
  return 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(position), '\n');
}

tl::unexpected<Error> FailUnknown(std::string_view name, long line,
                                  std::span<const Placeholder> known) {
  std::string names;
  for (const Placeholder& placeholder : known) {
    names += fmt::format("{}{{{}}}", names.empty() ? "" : " ", placeholder.name);
  }
  return Fail(
      fmt::format("line {}: unknown placeholder {{{}}}; known are {} (write {{{{ and }}}} "
                  "for braces)",
                  line, name, names));
}

}  // namespace

Result<std::string> ExpandPlaceholders(std::string_view text, std::span<const Placeholder> known) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c != '{' && c != '}') {
      out += c;
      continue;
    }
    if (i + 1 < text.size() && text[i + 1] == c) {
      out += c;
      ++i;
      continue;
    }
    const std::size_t end = c == '{' ? text.find_first_of("{}\n", i + 1) : std::string_view::npos;
    if (end == std::string_view::npos || text[end] != '}') {
      return Fail(
          fmt::format("line {}: a brace '{}' without its partner; write it twice where "
                      "the brace itself is meant",
                      LineOf(text, i), c));
    }
    const std::string_view name = text.substr(i + 1, end - i - 1);
    const auto found = std::find_if(known.begin(), known.end(),
                                    [&](const Placeholder& p) { return p.name == name; });
    if (found == known.end()) return FailUnknown(name, LineOf(text, i), known);
    out += found->value;
    i = end;
  }
  return out;
}

}  // namespace trammel::gcode
