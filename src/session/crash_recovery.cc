#include "session/crash_recovery.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <system_error>
#include <utility>
#include <vector>

#include "base/text.h"
#include "base/url_secrets.h"
#include "files/new_file.h"
#include "machine/moonraker/link/address.h"
#include "session/printer_settings.h"
#include "session/run_journal.h"

namespace trammel::procedure {
namespace {

namespace fs = std::filesystem;
using files::RunJournal;

constexpr double kScript_s = 60;
constexpr double kAsk_s = 10;

struct DeadRun {
  fs::path path;
  RunJournal journal;
};

// Describes the end of a run: crashed, or ended alive.
std::string WhatBecameOf(const RunJournal& journal) {
  if (journal.ended.empty()) return fmt::format("the run of {} died here", journal.started);
  return fmt::format("the run of {} could not bring back what it had changed, as {}",
                     journal.started, journal.ended);
}

Result<void> Remove(const fs::path& path) {
  std::error_code error;
  fs::remove(path, error);
  if (!error) return {};
  return Fail(fmt::format("{}: cannot be removed: {}", path.string(), error.message()));
}

// Returns the run's part of OwnerAtPrinter's result.
std::string RunOf(const std::string& owner) { return owner.substr(owner.rfind('.') + 1); }

Result<void> RunAll(const Session& session, const std::vector<std::string>& lines) {
  for (const std::string& line : lines) {
    if (line.empty()) continue;
    TRY(session.printer.Run(line, session.Within(kScript_s)));
  }
  return {};
}

Result<void> HeatersOff(const Session& session, const std::string& why) {
  const auto state = TRY(session.printer.State(session.Within(kAsk_s)));
  const std::string on = HeatersOn(state);
  if (on.empty()) return {};
  std::vector<std::string> lines;
  for (const auto& [name, heater] : state.heaters) {
    if (heater.target_c > 0) lines.push_back(TargetLine(name, 0));
  }
  auto off = RunAll(session, lines);
  if (off) session.Report(fmt::format("switched off what {} left on: {}", why, on));
  return off;
}

// Klipper reports the last print's figures until the next one begins, or until the file is closed.
bool PrintedSince(const RunJournal& journal, const machine::PrinterState& now) {
  if (now.print_file.empty() || now.print_file == journal.upload) return false;
  return now.print_file != journal.last_print ||
         !SameValue(now.print_total_s, journal.last_print_s);
}

/// Values that differ from those before a run, by their treatment.
struct Remains {
  files::SettingValues back;      ///< still what the run gave them: as they were before it
  files::SettingValues off;       ///< heaters that are on, and that the run heated to that: off
  std::vector<std::string> ours;  ///< both, in words
  std::vector<std::string> left;  ///< values changed by others since, as text
  std::string print;              ///< print started since: nothing is changed then
};

Remains RemainsOf(const RunJournal& journal, const machine::PrinterState& now) {
  Remains remains;
  if (PrintedSince(journal, now)) remains.print = now.print_file;
  for (const auto& [name, is] : SettingsOf(now)) {
    const auto before = journal.before.find(name);
    const double was = before == journal.before.end() ? 0 : before->second;
    const bool another_tools = journal.changes_tools && name.starts_with("offset ");
    if (IsTarget(name) ? is <= 0 : before == journal.before.end() || SameValue(is, was)) continue;
    if (another_tools) continue;
    if (!remains.print.empty() || !GaveIt(journal, name, is)) {
      // Skips a heater that the run did not change.
      if (IsTarget(name) && SameValue(is, was)) continue;
      remains.left.push_back(
          fmt::format("{} (before that run {:.4g})", DescribeSetting(name, is), was));
    } else if (IsTarget(name)) {
      remains.off[name] = 0;
      remains.ours.push_back(fmt::format("{} -> off", DescribeSetting(name, is)));
    } else {
      remains.back[name] = was;
      remains.ours.push_back(fmt::format("{} -> {:.4g}", DescribeSetting(name, is), was));
    }
  }
  return remains;
}

// "brought back …; left as they are …", in either tense.
std::string Describe(const Remains& remains, const char* bring_back, const char* leave) {
  std::string text =
      remains.ours.empty() ? "nothing to bring back" : bring_back + Joined(remains.ours);
  if (!remains.left.empty()) {
    text += fmt::format("; {}, {}: {}", leave,
                        remains.print.empty()
                            ? "because that run did not set them so"
                            : fmt::format("because {} was printed since", remains.print),
                        Joined(remains.left));
  }
  return text;
}

// Restores the G-code state as a whole: values that the run did not set, or that have changed
// since, are set to their present ones, G-code's offset and origin always.
std::string GcodeStateScript(const RunJournal& journal, const machine::PrinterState& now,
                             const files::SettingValues& back) {
  files::SettingValues modes;
  for (const auto& [name, is] : SettingsOf(now)) {
    if (IsOfGcodeState(name)) modes[name] = back.contains(name) ? back.at(name) : is;
  }
  std::string script =
      fmt::format("RESTORE_GCODE_STATE NAME={} MOVE=0", GcodeStateName(journal.run));
  for (const std::string& line : SettingLines(modes)) script += "\n" + line;
  const auto& offset_mm = now.gcode.homing_origin_mm;
  const auto& at = now.gcode.gcode_position_mm;
  return script + fmt::format(
                      "\nSET_GCODE_OFFSET X={:.6f} Y={:.6f} Z={:.6f}"
                      "\nG92 X{:.6f} Y{:.6f} Z{:.6f} E{:.6f}",
                      offset_mm[0], offset_mm[1], offset_mm[2], at[0], at[1], at[2], at[3]);
}

// @returns whether the run's session of Klipper still lasts.
Result<bool> BringBack(const Session& session, const settings::ScanSettings& settings,
                       const RunJournal& journal) {
  const auto now = TRY(session.printer.State(session.Within(kAsk_s)));
  const Remains remains = RemainsOf(journal, now);
  const std::string script = GcodeStateScript(journal, now, remains.back);
  const auto restored = session.printer.Run(script, session.Within(kScript_s));
  if (!restored && IsUnknownState(restored.error().message, journal.run)) return false;
  if (!restored) return tl::unexpected(restored.error());
  std::vector<std::string> lines;
  if (!journal.without_laser && remains.print.empty()) {
    lines = {settings.laser_off_gcode, settings.lights_on_gcode};
  }
  files::SettingValues back = remains.back;
  std::erase_if(back, [](const auto& value) { return IsOfGcodeState(value.first); });
  back.insert(remains.off.begin(), remains.off.end());
  for (std::string& line : SettingLines(back)) lines.push_back(std::move(line));
  TRY(RunAll(session, lines));
  session.Report(fmt::format("{}: {}", WhatBecameOf(journal),
                             Describe(remains, "brought back ", "left as they are")));
  return true;
}

Result<void> Finish(const Session& session, const settings::ScanSettings& settings,
                    const DeadRun& dead, const std::string& owner) {
  const RunJournal& journal = dead.journal;
  const auto brought = BringBack(session, settings, journal);
  if (!brought) {
    return Fail(fmt::format("{}, and what it left on the printer could not be brought back now: {}",
                            WhatBecameOf(journal), brought.error().message),
                brought.error().kind);
  }
  if (!*brought) {
    session.Report(
        fmt::format("{}, and nothing of it is left on the printer", WhatBecameOf(journal)));
  }
  // A print that had ended by itself leaves its file; there may be none.
  if (!journal.upload.empty()) {
    (void)session.printer.DeleteFile(journal.upload, session.Within(kAsk_s));
  }
  if (!owner.empty() && RunOf(owner) == journal.run) {
    const std::string release = fmt::format("{} OWNER={}", kRelease, owner);
    TRY(session.printer.Run(release, session.Within(kScript_s)));
  }
  return Remove(dead.path);
}

// Without a readable journal the run's changes are unknown: the heaters are switched off to be
// safe.
Result<void> GiveUp(const Session& session, const fs::path& path, const Error& error) {
  session.Report(
      fmt::format("a run died here, and what has to come back cannot be read: look whether "
                  "pressure advance and limits are right ({})",
                  error.message));
  TRY(HeatersOff(session, "it or somebody else"));
  return Remove(path);
}

// Finds a run by the name on the printer, if this printer's address was written differently.
std::optional<DeadRun> RunNamed(const fs::path& state_folder, const std::string& run) {
  for (auto& [path, journal] : files::ReadAllJournals(state_folder)) {
    if (journal.run == run) return DeadRun{path, std::move(journal)};
  }
  return {};
}

Error Taken(const std::string& owner) {
  return {
      ErrorKind::kMachine,
      fmt::format("another trammel has this printer: {} (computer.run); wait for its end. Where "
                  "it is dead, look to laser and heaters, then call {} in the printer's "
                  "console; its limit ends by itself, too",
                  owner, kReleaseByHand)};
}

void ReportPrintInProgress(const Session& session, const fs::path& path) {
  const auto journal = files::ReadJournal(path);
  const auto now = session.printer.State(session.Within(kAsk_s));
  if (!journal || !*journal || !now || now->print_file != (*journal)->upload) return;
  if (OthersJob(*now, "").empty()) return;
  session.Report(
      fmt::format("{}, and its print is still under way: cancel it, or let it end. Heaters that it "
                  "leaves on go off by the printer's own limit, or with the next run",
                  WhatBecameOf(**journal)));
}

// Normalises an address: one name for this computer, and hosts in lower case.
std::optional<machine::MoonrakerAddress> ParsePlain(const std::string& address) {
  auto parsed = machine::ParseMoonrakerAddress(address);
  if (!parsed) return std::nullopt;
  parsed->host = LowerCase(parsed->host);
  if (parsed->host == "127.0.0.1" || parsed->host == "::1") parsed->host = "localhost";
  return *parsed;
}

}  // namespace

std::string PlainAddress(const std::string& address) {
  const auto plain = ParsePlain(address);
  return plain ? plain->WebSocketUrl() : address;
}

std::string PrinterName(const std::string& address) {
  // Moonraker's own ports, and those of the web server in front (Mainsail, Fluidd), which forwards
  // to the first.
  constexpr std::array<std::uint16_t, 4> kSameMoonraker = {7125, 7130, 80, 443};
  auto plain = ParsePlain(address);
  if (!plain || plain->transport == machine::Transport::kUnix) return WithoutSecrets(address);
  if (plain->path_prefix.empty() &&
      std::ranges::find(kSameMoonraker, plain->port) != kSameMoonraker.end()) {
    plain->port = kSameMoonraker.front();
  }
  return plain->Authority() + plain->path_prefix;
}

std::string GcodeStateName(const std::string& run) { return "trammel_" + run; }

Result<void> RestoreGcodeState(const Session& session, const RunJournal& journal) {
  std::string script =
      fmt::format("RESTORE_GCODE_STATE NAME={} MOVE=0", GcodeStateName(journal.run));
  if (journal.changes_tools) {
    const auto now = TRY(session.printer.State(session.Within(kAsk_s)));
    const auto& offset_mm = now.gcode.homing_origin_mm;
    script += fmt::format("\nSET_GCODE_OFFSET X={:.6f} Y={:.6f} Z={:.6f}", offset_mm[0],
                          offset_mm[1], offset_mm[2]);
  }
  return session.printer.Run(script, session.Within(kScript_s));
}

bool IsUnknownState(const std::string& message, const std::string& run) {
  return message.find("Unknown g-code state: " + GcodeStateName(run)) != std::string::npos;
}

Result<std::string> OwnerAtPrinter(const Session& session) {
  constexpr std::size_t kMax = 200;
  const auto status =
      TRY(session.printer.Query({{"gcode_macro _TRAMMEL_RUN", {"owner"}}}, session.Within(kAsk_s)));
  const auto macro = status.find("gcode_macro _TRAMMEL_RUN");
  if (macro == status.end() || !macro->is_object()) return std::string();
  const auto owner = macro->find("owner");
  if (owner == macro->end() || !owner->is_string()) return std::string();
  std::string text = owner->get<std::string>().substr(0, kMax);
  // Sanitised, since it is sent to the printer and the terminal.
  std::erase_if(text, [](char c) { return c <= ' ' || c > '~' || c == ';' || c == '#'; });
  return text;
}

Result<void> FinishDeadRuns(const Session& session, const settings::ScanSettings& settings,
                            const fs::path& state_folder, const std::string& address) {
  const auto owner = TRY(OwnerAtPrinter(session));
  const fs::path path = files::JournalPath(state_folder, address);
  const auto journal = files::ReadJournal(path);
  const bool ours = journal && *journal && RunOf(owner) == (*journal)->run;
  // Checks the printer's owner first: while another run has it, nothing of an older one is
  // restored.
  if (!owner.empty() && !ours) {
    const auto other = RunNamed(state_folder, RunOf(owner));
    if (!other || other->path == path) return tl::unexpected(Taken(owner));
    const auto lock = files::FileLock::Take(files::LockPath(state_folder, other->journal.address),
                                            "a look whether it is alive");
    if (!lock) return tl::unexpected(Taken(owner));
    TRY(Finish(session, settings, *other, owner));
  }
  if (!journal) return GiveUp(session, path, journal.error());
  if (!*journal) return {};
  return Finish(session, settings, {path, **journal}, owner);
}

void FinishDeadRunsWhereFree(const Session& session, const settings::ScanSettings& settings,
                             const fs::path& state_folder) {
  const std::string address = PlainAddress(settings.address);
  const fs::path path = files::JournalPath(state_folder, address);
  std::error_code ignored;
  if (!fs::exists(path, ignored)) return;
  const auto lock = files::FileLock::Take(files::LockPath(state_folder, address), "a start");
  if (!lock) return;
  if (!CheckStillFree(session)) return ReportPrintInProgress(session, path);
  const auto finished = FinishDeadRuns(session, settings, state_folder, address);
  if (!finished) session.Report(finished.error().message);
}

Result<void> EndDeadPrint(const Session& session, const fs::path& state_folder,
                          const std::string& address, const ParkPlace& park) {
  const std::string plain = PlainAddress(address);
  const auto lock = files::FileLock::Take(files::LockPath(state_folder, plain), "a start");
  const auto journal = files::ReadJournal(files::JournalPath(state_folder, plain));
  if (!lock || !journal || !*journal || (*journal)->upload.empty()) return {};
  const auto now = TRY(session.printer.State(session.Within(kAsk_s)));
  Session dead = session;
  dead.own_file = (*journal)->upload;
  if (now.print_file != dead.own_file || OthersJob(now, "").empty()) return {};
  session.Report(fmt::format("{}, and its print is still under way", WhatBecameOf(**journal)));
  const EndedPrint ended = EndOwnPrint(dead, now, park);
  for (const std::string& left : ended.lost) session.Report(left);
  if (ended.failed.empty()) return {};
  return Fail(ended.failed.front(), ErrorKind::kMachine);
}

std::string DescribeDeadRun(const Session& session, const fs::path& state_folder,
                            const std::string& address) {
  const auto owner = OwnerAtPrinter(session);
  const auto journal = files::ReadJournal(files::JournalPath(state_folder, address));
  if (!journal || *journal) {
    const auto lock = files::FileLock::Take(files::LockPath(state_folder, address), "doctor");
    if (!lock) return "another trammel is at work with it: " + lock.error().message;
  }
  if (!journal)
    return "a run died here, and its journal cannot be read: " + journal.error().message;
  if (*journal) {
    const Remains remains = RemainsOf(**journal, session.printer.LastState());
    return fmt::format("{}: {}", WhatBecameOf(**journal),
                       Describe(remains, "the next run brings back ", "it leaves as they are"));
  }
  return owner && !owner->empty() ? Taken(*owner).message : "";
}

Result<files::FileLock> TakePrinterLock(const fs::path& state_folder, const std::string& address,
                                        const std::string& holder, double wait_s,
                                        const std::stop_token& stop) {
  auto lock =
      files::FileLock::TakeWithin(files::LockPath(state_folder, address), holder, wait_s, stop);
  if (lock || lock.error().kind != ErrorKind::kMachine) return lock;
  return Fail("another trammel on this computer is at work with this printer; wait for its end: " +
                  lock.error().message,
              ErrorKind::kMachine);
}

Result<files::FileLock> TakeTurn(const Session& session, const settings::ScanSettings& settings,
                                 const fs::path& state_folder, const std::string& who) {
  constexpr double kPatience_s = 10;  // another one that sets something takes a second
  const std::string address = PlainAddress(settings.address);
  auto lock = TRY(TakePrinterLock(
      state_folder, address, fmt::format("{}, process {},", who, static_cast<long>(::getpid())),
      kPatience_s, session.stop));
  std::error_code ignored;
  if (fs::exists(files::JournalPath(state_folder, address), ignored) && CheckStillFree(session)) {
    TRY(FinishDeadRuns(session, settings, state_folder, address));
  }
  return lock;
}

}  // namespace trammel::procedure
