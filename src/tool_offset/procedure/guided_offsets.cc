#include "tool_offset/procedure/guided_offsets.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <optional>
#include <string_view>
#include <utility>

#include "session/crash_recovery.h"
#include "tool_offset/procedure/tool_offsets.h"

namespace trammel::procedure {
namespace {

namespace fs = std::filesystem;

bool IsUnfinishedName(const std::string& name) {
  constexpr std::array<std::string_view, 6> kEndings = {".part",     ".tmp",      ".crdownload",
                                                        ".filepart", ".download", "~"};
  return name.empty() || name.front() == '.' ||
         std::any_of(kEndings.begin(), kEndings.end(),
                     [&](std::string_view ending) { return name.ends_with(ending); });
}

/// Returns the status of an ordinary file.
std::optional<struct stat> StatOf(const fs::path& path) {
  struct stat found {};
  if (::stat(path.c_str(), &found) != 0 || !S_ISREG(found.st_mode)) return std::nullopt;
  return found;
}

}  // namespace

ScanFolder::ScanFolder(fs::path folder, std::int64_t since_s)
    : folder_(std::move(folder)), since_s_(since_s) {}

ScanFolder::Look ScanFolder::Next() {
  Look look;
  std::vector<std::pair<std::int64_t, fs::path>> ready;
  std::map<fs::path, Known> now;
  std::error_code error;
  for (fs::directory_iterator at(folder_, error), end; !error && at != end; at.increment(error)) {
    if (now.size() >= kMaxFiles) break;
    const fs::path path = at->path();
    if (IsUnfinishedName(path.filename().string())) continue;
    const auto found = StatOf(path);
    if (!found) continue;
    constexpr std::int64_t kNanoseconds = 1'000'000'000;
    const Mark mark{static_cast<std::uintmax_t>(found->st_size),
                    found->st_mtim.tv_sec * kNanoseconds + found->st_mtim.tv_nsec};
    const auto before = known_.find(path);
    Known known{mark};
    if (before == known_.end()) {
      known.told = first_ && found->st_mtim.tv_sec < since_s_;
    } else if (before->second.mark != mark || mark.bytes == 0) {
      known.growing = true;
      if (!before->second.growing) look.growing.push_back(path);
    } else {
      known = before->second;
      if (!known.told) ready.emplace_back(mark.modified_ns, path);
      known.told = true;
      known.growing = false;
    }
    now[path] = known;
  }
  known_ = std::move(now);
  first_ = false;
  std::sort(ready.begin(), ready.end());
  for (auto& [time, path] : ready) look.ready.push_back(std::move(path));
  return look;
}

namespace {

constexpr const char* kWho = "trammel offset start";

/// Reads one file, and reports its fault. @returns true if it yields a result.
Result<bool> Try(const ScanWait& wait, const fs::path& path) {
  auto read = wait.read(path);
  if (read || read.error().kind == ErrorKind::kInterrupted) return read;
  wait.say(read.error().message + "; waiting for another");
  return false;
}

/// Checks that the present offsets are those under which the sheet was printed.
Result<void> CheckUnchanged(const Session& session, const files::StartRecord& record) {
  for (const files::StartedTool& tool : record.tools) {
    if (!tool.kept) continue;
    const auto now = TRY(ReadToolOffset(session, tool.tool));
    TRY(CheckSameOffset(tool.tool, *tool.kept, now));
  }
  return {};
}

/// Asks the question; false if there is no person.
Result<bool> AskIfPossible(Operator& person, const Question& question) {
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

Result<void> WaitForScan(Operator& person, const ScanWait& wait) {
  constexpr double kLook_s = 1;
  ScanFolder folder(wait.folder, wait.since_s);
  for (;;) {
    const ScanFolder::Look look = folder.Next();
    for (const fs::path& path : look.growing) wait.say(path.string() + " is still being written");
    for (const fs::path& path : look.ready) {
      const auto answered = TRY(Try(wait, path));
      if (answered) return {};
    }
    // Ends when the terminal closes.
    TRY(person.LineWithin(kLook_s));
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
                            Operator& person) {
  const auto& corrections = settling.corrections;
  TRY(CheckUnchanged(session, settling.record));
  const auto set = AskIfPossible(
      person, {kApplyQuestion, fmt::format("set the new offsets of {} on {}", ToolsOf(corrections),
                                           settling.record.printer)});
  if (!set || !*set) return set;
  // Takes a turn, because read, note and set belong together.
  TRY(TakeTurn(session, *settling.settings, settling.state_folder, kWho));
  auto done = CheckUnchanged(session, settling.record);
  if (done) done = SetOffsets(session, corrections, settling.setting);
  if (!done) return tl::unexpected(done.error());
  return true;
}

Result<bool> KeepWhereWanted(const Session& session, const OffsetSettling& settling,
                             Operator& person) {
  const auto keep = AskIfPossible(
      person, {kKeepQuestion,
               "keep them beyond a restart (SAVE_CONFIG writes printer.cfg and restarts Klipper: "
               "nothing is homed or hot then)"});
  if (!keep || !*keep) return keep;
  TRY(TakeTurn(session, *settling.settings, settling.state_folder, kWho));
  TRY(KeepOffsets(session, settling.corrections, settling.setting));
  return true;
}

Result<bool> WasPrinted(const Session& session, const std::string& run) {
  constexpr double kAsk_s = 10;
  const auto state = TRY(session.printer.State(session.Within(kAsk_s)));
  return state.print_file == fmt::format("trammel_{}.gcode", run) &&
         state.print_state == "complete";
}

}  // namespace trammel::procedure
