#include "tool_offset/procedure/guided_offsets.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <cstdlib>
#include <utility>

#include "session/printer_turn.h"
#include "tool_offset/procedure/scan_folder.h"
#include "tool_offset/procedure/tool_offsets.h"

namespace trammel::procedure {
namespace {

namespace fs = std::filesystem;

constexpr const char* kWho = "trammel offset start";

/// Reads one file. @returns whether it answers; what is wrong with it is said.
Result<bool> Try(const ScanWait& wait, const fs::path& path) {
  auto read = wait.read(path);
  if (read || read.error().kind == ErrorKind::kInterrupted) return read;
  wait.say(read.error().message + "; waiting for another");
  return false;
}

/// What somebody typed: a file to read, or a folder to watch from now on.
Result<bool> TakeTyped(const ScanWait& wait, const std::string& line, ScanFolder& folder,
                       fs::path& doubted) {
  const fs::path path = TypedPath(line);
  if (path.empty()) return false;
  std::error_code error;
  const auto kind = fs::status(path, error).type();
  if (kind == fs::file_type::directory) {
    folder = ScanFolder(path, wait.since_s);
    wait.say("watching " + path.string());
    return false;
  }
  if (kind == fs::file_type::regular && path != doubted && IsOlder(path, wait.since_s)) {
    doubted = path;
    wait.say(
        fmt::format("{} was written before the sheet was printed, and an earlier print of the "
                    "same sheet has the same number: where it is the scan of this print all "
                    "the same, type it again",
                    path.string()));
    return false;
  }
  if (kind == fs::file_type::regular) return Try(wait, path);
  wait.say(fmt::format(
      "{}: {}; type the path of a scan, or of a folder to watch", path.string(),
      kind == fs::file_type::not_found ? "is not there" : "is neither a file nor a folder"));
  return false;
}

/// The offsets under which the sheet was printed are to be those that are taken out.
Result<void> CheckUnchanged(const Session& session, const files::StartRecord& record) {
  for (const files::StartedTool& tool : record.tools) {
    if (!tool.kept) continue;
    const auto now = ReadToolOffset(session, tool.tool);
    if (!now) return tl::unexpected(now.error());
    if (auto same = CheckSameOffset(tool.tool, *tool.kept, *now); !same) return same;
  }
  return {};
}

/// Nothing where nobody can be asked.
Result<bool> AskIfPossible(Person& person, const Question& question) {
  if (!person.CheckCanAnswer(question.name)) return false;
  return person.Confirm(question, {});
}

std::string ToolsOf(const std::vector<OffsetCorrection>& corrections) {
  std::string text;
  for (const OffsetCorrection& change : corrections) {
    text += fmt::format("{}T{}", text.empty() ? "" : ", ", change.tool);
  }
  return text;
}

}  // namespace

bool IsOlder(const fs::path& path, std::int64_t since_s) {
  struct stat found {};
  return ::stat(path.c_str(), &found) == 0 && found.st_mtim.tv_sec < since_s;
}

fs::path TypedPath(const std::string& line) {
  constexpr const char* kBlanks = " \t\r\n";
  const std::size_t first = line.find_first_not_of(kBlanks);
  if (first == std::string::npos) return {};
  std::string text = line.substr(first, line.find_last_not_of(kBlanks) - first + 1);
  const char quote = text.front();
  if (text.size() >= 2 && (quote == '\'' || quote == '"') && text.back() == quote) {
    return text.substr(1, text.size() - 2);
  }
  std::string plain;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '\\' && i + 1 < text.size()) ++i;
    plain += text[i];
  }
  constexpr std::string_view kFile = "file://";
  if (plain.starts_with(kFile)) plain.erase(0, kFile.size());
  const char* const home = std::getenv("HOME");
  if (plain.starts_with("~/") && home != nullptr) plain.replace(0, 1, home);
  return plain;
}

Result<void> WaitForScan(Person& person, const ScanWait& wait) {
  constexpr double kLook_s = 1;
  ScanFolder folder(wait.folder, wait.since_s);
  fs::path doubted;
  for (;;) {
    const ScanFolder::Look look = folder.Next();
    for (const fs::path& path : look.growing) wait.say(path.string() + " is still being written");
    for (const fs::path& path : look.ready) {
      const auto answered = Try(wait, path);
      if (!answered) return tl::unexpected(answered.error());
      if (*answered) return {};
    }
    const auto line = person.LineWithin(kLook_s);
    if (!line) return tl::unexpected(line.error());
    if (!*line) continue;
    const auto answered = TakeTyped(wait, **line, folder, doubted);
    if (!answered) return tl::unexpected(answered.error());
    if (*answered) return {};
  }
}

std::vector<OffsetCorrection> CorrectionsOf(const files::StartRecord& record,
                                            const files::OffsetFile& measured) {
  std::vector<OffsetCorrection> corrections;
  for (const files::MeasuredOffset& offset : measured.good) {
    for (const files::StartedTool& tool : record.tools) {
      if (tool.tool != offset.tool || !tool.kept) continue;
      corrections.push_back({tool.tool, offset, *tool.kept,
                             Corrected(tool_offset::OffsetFirmware::kKlipperTool, *tool.kept,
                                       offset.dx_mm, offset.dy_mm)});
    }
  }
  return corrections;
}

Result<bool> SetWhereWanted(const Session& session, const OffsetSettling& settling,
                            Person& person) {
  const auto& corrections = settling.corrections;
  if (auto same = CheckUnchanged(session, settling.record); !same) {
    return tl::unexpected(same.error());
  }
  const auto set = AskIfPossible(
      person, {kApplyQuestion, fmt::format("set the new offsets of {} on {}", ToolsOf(corrections),
                                           settling.record.printer)});
  if (!set || !*set) return set;
  // What is read, noted and set belongs together.
  const auto turn = TakeTurn(session, *settling.settings, settling.state_folder, kWho);
  if (!turn) return tl::unexpected(turn.error());
  auto done = CheckUnchanged(session, settling.record);
  if (done) done = SetOffsets(session, corrections, settling.setting);
  if (!done) return tl::unexpected(done.error());
  return true;
}

Result<bool> KeepWhereWanted(const Session& session, const OffsetSettling& settling,
                             Person& person) {
  const auto keep = AskIfPossible(
      person, {kKeepQuestion,
               "keep them beyond a restart (SAVE_CONFIG writes printer.cfg and restarts Klipper: "
               "nothing is homed or hot then)"});
  if (!keep || !*keep) return keep;
  const auto turn = TakeTurn(session, *settling.settings, settling.state_folder, kWho);
  if (!turn) return tl::unexpected(turn.error());
  auto kept = KeepOffsets(session, settling.corrections, settling.setting);
  if (!kept) return tl::unexpected(kept.error());
  return true;
}

Result<bool> WasPrinted(const Session& session, const std::string& run) {
  constexpr double kAsk_s = 10;
  const auto state = session.printer.State(session.Within(kAsk_s));
  if (!state) return tl::unexpected(state.error());
  return state->print_file == fmt::format("trammel_{}.gcode", run) &&
         state->print_state == "complete";
}

}  // namespace trammel::procedure
