#include "machine/moonraker/client/script_watch.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/text.h"

namespace trammel::machine {
namespace {

constexpr std::size_t kQuoted = 120;

struct Line {
  int number = 0;  ///< from 1
  std::string_view text;
};

/// Returns the lines with a command, without comments.
std::vector<Line> LinesOf(std::string_view script) {
  std::vector<Line> lines;
  for (int number = 1; !script.empty(); ++number) {
    const std::size_t end = std::min(script.find('\n'), script.size());
    const std::string_view text = script.substr(0, end);
    if (const std::string_view code = Trimmed(text.substr(0, text.find(';'))); !code.empty()) {
      lines.push_back({number, code});
    }
    script.remove_prefix(std::min(end + 1, script.size()));
  }
  return lines;
}

std::string FirstWord(std::string_view line) {
  return UpperCase(line.substr(0, line.find_first_of(" \t")));
}

/// "Error on 'G1 X…': …" quotes the line itself.
const Line* QuotedLine(const std::vector<Line>& lines, std::string_view complaint) {
  const std::size_t open = complaint.find('\'');
  const std::size_t close = complaint.find("':", open == std::string_view::npos ? 0 : open + 1);
  if (open == std::string_view::npos || close == std::string_view::npos) return nullptr;
  const std::string quoted = UpperCase(Trimmed(complaint.substr(open + 1, close - open - 1)));
  for (const Line& line : lines) {
    if (UpperCase(line.text) == quoted) return &line;
  }
  return nullptr;
}

std::string Remedy(std::string_view complaint) {
  const auto says = [&complaint](std::string_view words) {
    return complaint.find(words) != std::string_view::npos;
  };
  if (says("Must home")) return "home the printer first (G28)";
  if (says("out of range")) return "move the pattern or correct the bed's size in the settings";
  if (says("Extrude below")) return "heat the nozzle first";
  if (says("hutdown") || says("not ready")) {
    return "see what the printer's screen says, remove the cause, then FIRMWARE_RESTART";
  }
  return "correct the line, or the macro that it calls, in the settings or in printer.cfg";
}

}  // namespace

std::vector<std::string> CommandsOf(std::string_view script) {
  std::vector<std::string> commands;
  for (const Line& line : LinesOf(script)) commands.push_back(FirstWord(line.text));
  return commands;
}

std::string BlamedLine(std::string_view script, std::string_view complaint) {
  const std::vector<Line> lines = LinesOf(script);
  if (lines.empty()) return "a script without commands";
  const Line* line = lines.size() == 1 ? &lines.front() : QuotedLine(lines, complaint);
  if (line != nullptr) {
    return fmt::format("line {}, '{}'", line->number, line->text.substr(0, kQuoted));
  }
  return fmt::format("one of its {} lines, from '{}' to '{}'", lines.size(),
                     lines.front().text.substr(0, kQuoted), lines.back().text.substr(0, kQuoted));
}

ScriptWatch::ScriptWatch(std::string script, std::optional<std::set<std::string>> macros)
    : script_(std::move(script)), commands_(CommandsOf(script_)) {
  if (macros) {
    calls_macros_ = std::any_of(commands_.begin(), commands_.end(),
                                [&](const std::string& name) { return macros->contains(name); });
  }
}

void ScriptWatch::OnResponse(std::string_view response) {
  constexpr std::string_view kUnknown = "// Unknown command:";
  if (response.starts_with("!!")) {
    if (complaint_.empty()) {
      complaint_ = Trimmed(response.substr(2));
      if (complaint_.empty()) complaint_ = "an error without words";
    }
  } else if (response.starts_with(kUnknown)) {
    std::string_view name = Trimmed(response.substr(kUnknown.size()));
    name = name.substr(0, name.find('\n'));
    if (name.size() >= 2 && name.front() == '"') name = name.substr(1, name.rfind('"') - 1);
    OnUnknownCommand(name);
  }
}

void ScriptWatch::OnUnknownCommand(std::string_view name) {
  if (!unknown_.empty() || name.empty()) return;
  const std::string upper = FirstWord(name);
  for (const Line& line : LinesOf(script_)) {
    // A line that the firmware cannot parse is quoted from its beginning.
    if (FirstWord(line.text) == upper || UpperCase(line.text).starts_with(upper)) {
      unknown_ = fmt::format(
          "the printer does not know '{}' (line {}, '{}') and went on without it; add the macro to "
          "printer.cfg or correct the name in the settings",
          name.substr(0, kQuoted), line.number, line.text.substr(0, kQuoted));
      return;
    }
  }
  if (calls_macros_) {
    unknown_ = fmt::format(
        "the printer does not know '{}', which a macro called by this script uses (or another "
        "client sent at the same moment), and went on without it; correct the macro in printer.cfg",
        name.substr(0, kQuoted));
  }
}

std::string ScriptWatch::Verdict() const {
  if (!complaint_.empty()) {
    return fmt::format("the printer refused {}: {}; {}", BlamedLine(script_, complaint_),
                       complaint_, Remedy(complaint_));
  }
  return unknown_;
}

}  // namespace trammel::machine
