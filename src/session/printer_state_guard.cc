#include "session/printer_state_guard.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <system_error>
#include <thread>
#include <utility>

#include "base/bug_note.h"
#include "base/check.h"
#include "base/utf8.h"
#include "session/crash_recovery.h"
#include "session/guarded_steps.h"
#include "session/printer_settings.h"

namespace trammel::procedure {
namespace {

constexpr double kAsk_s = 10;
constexpr double kOthers_s = 5;  // wait of a script queued behind another's job
constexpr std::chrono::milliseconds kAgain{500};

using files::SettingValues;
using Clock = std::chrono::steady_clock;

// True if the printer may recover from this state by itself.
bool IsAway(machine::PrinterReadiness readiness) {
  return readiness == machine::PrinterReadiness::kDisconnected ||
         readiness == machine::PrinterReadiness::kStartup;
}

// Queries again: the printer's last report may be older than the failure.
machine::PrinterReadiness ReadinessNow(machine::Printer& printer) {
  const auto state = printer.State({kAsk_s});
  return state ? state->readiness : machine::PrinterReadiness::kDisconnected;
}

std::string ComputerName() {
  std::array<char, 256> name{};
  if (::gethostname(name.data(), name.size() - 1) != 0) return "unnamed";
  std::string plain(name.data());
  std::erase_if(plain,
                [](unsigned char c) { return c >= 0x80 || (std::isalnum(c) == 0 && c != '-'); });
  return plain.empty() ? "unnamed" : plain.substr(0, 60);
}

bool IsHomed(const machine::PrinterState& state) {
  constexpr std::string_view kAxes = "xyz";
  return std::all_of(kAxes.begin(), kAxes.end(),
                     [&](char axis) { return state.homed_axes.find(axis) != std::string::npos; });
}

}  // namespace

Result<PrinterStateGuard> PrinterStateGuard::Take(Session& session,
                                                  const settings::ScanSettings& settings,
                                                  const RunIdentity& identity) {
  TRAMMEL_CHECK(files::IsRunName(identity.run), "run '{}' has no name that can be used",
                identity.run);
  const std::string address = PlainAddress(identity.address);
  auto lock = TRY(TakePrinterLock(
      identity.state_folder, address,
      fmt::format("process {}, since {},", static_cast<long>(::getpid()), identity.started)));
  TRY(CheckStillFree(session));
  TRY(FinishDeadRuns(session, settings, identity.state_folder, address));
  session.owner = fmt::format("{}.{}", ComputerName(), identity.run);
  session.own_file = fmt::format("trammel_{}.gcode", identity.run);
  session.has_limit = TRY(session.printer.HasCommand(kKeepAlive, session.Within(kAsk_s)));
  PrinterStateGuard guard(session, settings, identity, std::move(lock));
  session.note = [journal = guard.journal_, &printer = session.printer](std::string_view gcode) {
    return NoteGiven(*journal, printer, gcode);
  };
  Result<void> taken = guard.Note(session);
  if (taken) taken = guard.Claim(session);
  if (taken) return guard;
  guard.printer_ = nullptr;  // nothing was changed, and it may be another's
  return tl::unexpected(taken.error());
}

PrinterStateGuard::PrinterStateGuard(const Session& session, const settings::ScanSettings& settings,
                                     const RunIdentity& identity, files::FileLock lock)
    : printer_(&session.printer),
      tell_(session.tell),
      laser_off_gcode_(settings.laser_off_gcode),
      lights_on_gcode_(identity.without_laser ? "" : settings.lights_on_gcode),
      owner_(session.owner),
      own_file_(session.own_file),
      has_limit_(session.has_limit),
      identity_(identity),
      journal_(std::make_shared<Journal>()),
      lock_(std::move(lock)) {
  files::RunJournal& journal = journal_->run;
  journal.run = identity.run;
  journal.address = PlainAddress(identity.address);
  journal.started = identity.started;
  journal.without_laser = identity_.without_laser;
  journal.changes_tools = identity.changes_tools;
  if (identity_.prints) journal.upload = own_file_;
  journal_->path = files::JournalPath(identity.state_folder, journal.address);
}

PrinterStateGuard::~PrinterStateGuard() {
  if (printer_ == nullptr) return;
  // An exception here would end the process.
  (void)NoteBug([this] {
    for (const std::string& failure : Restore()) Report(failure, 0);
  });
}

void PrinterStateGuard::Report(std::string text, double remaining_s) const {
  if (!tell_) return;
  // Output that fails must not stop the restoration.
  (void)NoteBug([&] {
    tell_({std::move(text), remaining_s > 0 ? std::optional(remaining_s) : std::nullopt});
  });
}

// Called before any change: the next run knows only values already on disk.
Result<void> PrinterStateGuard::Note(const Session& session) {
  before_ = TRY(session.printer.State(session.Within(kAsk_s)));
  files::RunJournal& journal = journal_->run;
  journal.before = SettingsOf(before_);
  journal.last_print = before_.print_file;
  journal.last_print_s = before_.print_total_s;
  if (identity_.heaters_end_off) {
    for (auto& [name, value] : journal.before) value = IsTarget(name) ? 0 : value;
  }
  TRY(files::WriteJournal(journal_->path, journal));
  const auto read = files::ReadJournal(journal_->path);
  if (read && *read) return {};
  std::error_code ignored;
  std::filesystem::remove(journal_->path, ignored);
  return Fail(fmt::format("what the printer tells of itself cannot be brought back later: {}",
                          read ? "the note is gone" : read.error().message),
              ErrorKind::kMachine);
}

Result<void> PrinterStateGuard::NoteGiven(Journal& journal, const machine::Printer& printer,
                                          std::string_view gcode) {
  if (journal.closed) return {};
  bool more = false;
  for (const auto& [name, values] : SettingsIn(gcode, printer.LastState())) {
    for (const double value : values) more |= journal.run.given[name].insert(value).second;
  }
  return more ? files::WriteJournal(journal.path, journal.run) : Result<void>();
}

Result<void> PrinterStateGuard::Claim(const Session& session) {
  auto claimed = KeepAlive(session);
  if (claimed) return {};
  // If only the answer was lost, the printer will be ours; this does not release another's.
  if (has_limit_ && printer_->LastState().abandoned_scripts > 0)
    (void)printer_->Run(fmt::format("{} OWNER={}", kRelease, owner_), {kScript_s});
  std::error_code ignored;
  std::filesystem::remove(journal_->path, ignored);
  return Fail("the printer cannot be taken for this run: " + claimed.error().message,
              claimed.error().kind);
}

Result<void> PrinterStateGuard::Begin(const Session& session) {
  auto state = TRY(session.printer.State(session.Within(kAsk_s)));
  before_.homed_axes = state.homed_axes;
  before_.gcode = state.gcode;
  for (const auto& [name, value] : SettingsOf(state)) {
    if (IsOfGcodeState(name)) journal_->run.before[name] = value;
  }
  TRY(files::WriteJournal(journal_->path, journal_->run));
  begun_ = true;  // the state may be saved even if the answer is lost
  return session.printer.Run("SAVE_GCODE_STATE NAME=" + GcodeStateName(journal_->run.run),
                             session.Within(kScript_s));
}

bool PrinterStateGuard::RunOne(const std::string& line, double time_limit_s) {
  const auto done = printer_->Run(line, {time_limit_s});
  if (!done) failed_.push_back(fmt::format("{} failed: {}", line, done.error().message));
  return done.has_value();
}

// Leaves its heaters, its pressure advance and its limits to that job, even after it has ended.
void PrinterStateGuard::LeaveToOthers(const std::string& job) {
  left_ = true;
  const auto now = printer_->State({kAsk_s});
  const auto differences =
      now ? Differences(SettingsOf(before_), SettingsOf(*now)) : std::vector<std::string>();
  lost_.push_back(
      fmt::format("somebody else's job has the printer now ({}): nothing of it was "
                  "touched, and the rest is left to it{}{}",
                  job, differences.empty() ? "" : ": ", Joined(differences)));
}

// Switches heaters off by their names at the beginning, if the printer does not report them.
// @returns those that had been on, in words.
std::string PrinterStateGuard::HeatersOff() {
  std::vector<std::string> on;
  for (const auto& [name, before_c] : journal_->run.before) {
    if (!IsTarget(name)) continue;
    (void)RunOne(SettingLines({{name, 0}}).front());
    if (before_c > 0) on.push_back(DescribeSetting(name, before_c));
  }
  return on.empty() ? "" : "; before, these were on: " + Joined(on);
}

// Handles a printer that was free of others' jobs a moment ago, which is unknown now: sets nothing,
// and switches the heaters off.
void PrinterStateGuard::LeaveInDoubt(const std::string& why) {
  if (!lights_on_gcode_.empty()) (void)RunOne(lights_on_gcode_);
  const std::string were_on = HeatersOff();
  std::vector<std::string> noted;
  for (const auto& [name, value] : journal_->run.before) {
    if (!IsTarget(name) && !IsOfGcodeState(name)) noted.push_back(DescribeSetting(name, value));
  }
  failed_.push_back(
      fmt::format("whose the printer is now cannot be asked: in doubt its heaters were switched "
                  "off{}; nothing else was brought back ({}), which the next run does: {}",
                  were_on, Joined(noted), why));
}

void PrinterStateGuard::BringBackSettings() {
  if (!lights_on_gcode_.empty()) (void)RunOne(lights_on_gcode_);
  const auto now = printer_->State({kAsk_s});
  const SettingValues is = now ? SettingsOf(*now) : SettingValues();
  SettingValues back;
  for (const auto& [name, value] : journal_->run.before) {
    if (IsTarget(name) || IsOfGcodeState(name)) continue;
    const auto found = is.find(name);
    const bool changed = found == is.end() || !SameValue(value, found->second);
    if (changed || journal_->run.given.contains(name)) back[name] = value;
  }
  const auto accel = journal_->run.before.find("max_accel");
  if (back.contains("minimum_cruise_ratio") && accel != journal_->run.before.end()) {
    back.insert(*accel);  // an older Klipper has the ratio as an acceleration
  }
  for (const std::string& line : SettingLines(back)) (void)RunOne(line);
}

// @param in_doubt  whether this is still the session of Klipper in which they were set is not known
void PrinterStateGuard::BringBackHeaters(bool in_doubt) {
  const auto now = printer_->State({kAsk_s});
  if (!now) {
    const std::string were_on = HeatersOff();
    return failed_.push_back(
        fmt::format("the heaters cannot be looked at, and were switched off in doubt{}: {}",
                    were_on, now.error().message));
  }
  if (const std::string job = OthersJob(*now, own_file_); !job.empty()) return LeaveToOthers(job);
  std::vector<std::string> left_on, left_off, switched_off;
  for (const auto& [name, heater] : now->heaters) {
    const auto noted = journal_->run.before.find("target " + name);
    const double before_c = noted == journal_->run.before.end() ? 0 : noted->second;
    const std::string figure = fmt::format("{} {:.0f} degC", name, before_c);
    if (!in_doubt && before_c > 0 && heater.target_c <= 0 &&
        !GaveIt(journal_->run, "target " + name, 0)) {
      switched_off.push_back(figure);
      continue;
    }
    if (before_c > 0) (in_doubt ? left_off : left_on).push_back(figure);
    if (!RunOne(TargetLine(name, in_doubt ? 0 : before_c)) && before_c > 0) {
      (void)RunOne(TargetLine(name, 0));
    }
  }
  if (!left_on.empty())
    Report("these heaters are left on, as they were before: " + Joined(left_on), 0);
  if (!switched_off.empty()) {
    lost_.push_back(
        "somebody, a macro or the idle time-out switched heaters off meanwhile, and they stay off; "
        "before, these were on: " +
        Joined(switched_off));
  }
  if (restarted_) {
    lost_.push_back(fmt::format(
        "the printer was restarted meanwhile: it is not homed, its G-code state is as after a "
        "start, and its heaters stay off{}{}",
        left_off.empty() ? "" : "; before, these were on: ", Joined(left_off)));
  } else if (!left_off.empty()) {
    lost_.push_back("in doubt these heaters were switched off: " + Joined(left_off));
  } else if (!identity_.may_unhome && IsHomed(before_) && !IsHomed(*now)) {
    lost_.push_back(
        "the axes are no longer homed: somebody switched the motors off meanwhile; home before "
        "anything moves");
  }
}

void PrinterStateGuard::DeleteUpload() {
  if (!identity_.prints) return;
  const auto now = printer_->LastState();
  auto deleted = printer_->DeleteFile(own_file_, {kAsk_s});
  // Without a print there is no file.
  if (!deleted && now.print_file == own_file_) {
    Report(
        fmt::format("{} stays among the printer's files: {}", own_file_, deleted.error().message),
        0);
  }
}

// Returns a session without a stop: a begun step is completed despite any stop request.
Session PrinterStateGuard::AsSession() const {
  const auto tell = [this](const Progress& progress) {
    Report(progress.text, progress.remaining_s.value_or(0));
  };
  return {*printer_, {}, tell, has_limit_, owner_, own_file_};
}

// Returns another run that took over: the limit clears the owner of a run that was away for long.
std::string PrinterStateGuard::AnotherOwner() const {
  if (!has_limit_) return "";
  const auto owner = OwnerAtPrinter(AsSession());
  return owner && *owner != owner_ ? *owner : "";
}

void PrinterStateGuard::Release() {
  if (!has_limit_) return;
  if (left_) {
    // Runs once that job allows it, even if no longer waited for.
    (void)RunOne(fmt::format("{} OWNER={}", kRelease, owner_), kOthers_s);
  } else if (failed_.empty()) {
    (void)RunOne(fmt::format("{} OWNER={}", kRelease, owner_));
  } else {
    Report("the printer's own limit for laser and heaters stays armed", 0);
  }
}

// @param job  receives another's job that began meanwhile, where there is one
// @returns whether the printer is free of the run's own print
bool PrinterStateGuard::EndPrint(const machine::PrinterState& now, std::string& job) {
  EndedPrint ended = EndOwnPrint(AsSession(), now, park_);
  failed_ = std::move(ended.failed);
  lost_ = std::move(ended.lost);
  const auto then = printer_->State({kAsk_s});
  if (!then) {
    LeaveInDoubt(then.error().message);
    return false;
  }
  job = OthersJob(*then, own_file_);
  was_free_ = job.empty();
  // Limits and pressure advance restored now would affect the lines still being printed.
  return OthersJob(*then, "").empty() || !job.empty();
}

void PrinterStateGuard::BringBackAll() {
  // A laser that this run never lit can wait for the print's end, behind which its command is
  // queued.
  if (laser_lit_) failed_ = SwitchLaserOff(AsSession(), laser_off_gcode_, true);
  if (!failed_.empty()) return;
  const auto now = printer_->State({kAsk_s});
  if (!now && was_free_) return LeaveInDoubt(now.error().message);
  if (!now) {
    return failed_.push_back("whose the printer is now cannot be asked: " + now.error().message);
  }
  std::string job = OthersJob(*now, own_file_);
  was_free_ = job.empty();
  if (job.empty() && !EndPrint(*now, job)) return;
  if (!job.empty()) {
    LeaveToOthers(job);
    if (!lights_on_gcode_.empty()) (void)RunOne(lights_on_gcode_, kOthers_s);
  } else {
    if (!identity_.without_laser && !laser_lit_) {
      // Fails on a printer that is gone or shut down, which accepts no other command either.
      const auto off = SwitchLaserOff(AsSession(), laser_off_gcode_, false);
      failed_.insert(failed_.end(), off.begin(), off.end());
      if (!off.empty()) return;
    }
    const auto restored = RestoreGcodeState(AsSession(), journal_->run);
    restarted_ = !restored && IsUnknownState(restored.error().message, journal_->run.run);
    if (!restored && !restarted_) {
      failed_.push_back("bringing the G-code state back failed: " + restored.error().message);
    }
    BringBackSettings();
    BringBackHeaters(!restored);
  }
  DeleteUpload();
  Release();
}

void PrinterStateGuard::BringBack() {
  failed_.clear();
  lost_.clear();
  if (!begun_) return Release();
  if (const std::string owner = AnotherOwner(); !owner.empty()) {
    LeaveToOthers("trammel, as " + owner);
  } else {
    BringBackAll();
  }
  if (!left_) return;
  // The next run must restore none of it: it would undo that job's settings.
  lost_.insert(lost_.end(), failed_.begin(), failed_.end());
  failed_.clear();
}

// Notes the end; without it the next run would assume a crash.
void PrinterStateGuard::NoteEnd() {
  constexpr std::size_t kMaxBytes = 300;
  const auto now = printer_->State({kAsk_s});
  const bool stopped = now && now->readiness == machine::PrinterReadiness::kShutdown;
  const std::string& why = stopped ? now->message : failed_.front();
  // Keeps the cause: messages of Klipper, and ours, continue with the remedy in further lines.
  const std::size_t end = stopped ? why.find('\n') : why.find(": ");
  const std::string first = Utf8OrReplaced(why.substr(0, end), kMaxBytes);
  journal_->run.ended = stopped ? fmt::format("the printer was shut down ({})", first) : first;
  (void)files::WriteJournal(journal_->path, journal_->run);
}

std::vector<std::string> PrinterStateGuard::Restore() {
  if (printer_ == nullptr) return {};
  const auto until = Clock::now() + std::chrono::duration<double>(kReturn_s);
  for (bool away = IsAway(printer_->LastState().readiness);;) {
    const double left_s = std::chrono::duration<double>(until - Clock::now()).count();
    if (away) {
      Report("waiting for the printer to come back, to leave it safe", left_s);
      if (auto ready = printer_->WaitUntilReady({left_s}); !ready) {
        lost_.clear();
        failed_ = {
            fmt::format("the printer did not come back within {} s: make sure that laser "
                        "and heaters are off; the next run brings the rest back: {}",
                        kReturn_s, ready.error().message)};
        break;
      }
    }
    BringBack();
    if (failed_.empty() || Clock::now() >= until) break;
    away = IsAway(ReadinessNow(*printer_));
    if (!away) break;
    std::this_thread::sleep_for(kAgain);  // it may be there, and tell nothing of itself
  }
  if (!failed_.empty()) NoteEnd();
  journal_->closed = true;
  printer_ = nullptr;
  std::vector<std::string> all = failed_;
  all.insert(all.end(), lost_.begin(), lost_.end());
  std::error_code error;
  if (failed_.empty()) std::filesystem::remove(journal_->path, error);
  if (error) {
    all.push_back(
        fmt::format("{}: cannot be removed: {}", journal_->path.string(), error.message()));
  }
  return all;
}

}  // namespace trammel::procedure
