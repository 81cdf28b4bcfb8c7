#include "app/applied_result.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <vector>

#include "app/provenance.h"
#include "base/url_secrets.h"
#include "measurement/applied.h"
#include "session/crash_recovery.h"
#include "session/run_journal.h"

namespace trammel::app {

namespace {

using files::Application;
using measurement::Instrument;

Result<std::filesystem::path> AppliedFile() {
  auto folder = TRY(files::StateFolder());
  return folder / files::kAppliedFile;
}

Result<void> Note(const AppliedValue& applied, Application::Step step, std::optional<double> before,
                  const std::map<std::string, double>& before_each) {
  const auto path = TRY(AppliedFile());
  const Application application{
      UtcNow(), WithoutSecrets(applied.machine), step, before, applied.value, before_each};
  if (applied.result) return files::NoteApplication(path, *applied.result, application);
  return files::NoteApplication(path, applied.instrument, "", application);
}

Result<void> OrNothingSet(const Result<void>& noted) {
  if (noted) return {};
  return Fail(fmt::format("nothing was set, as it cannot be noted for trammel history: {}",
                          noted.error().message),
              noted.error().kind);
}

void SayNotNoted(const char* done, const Error& error) {
  fmt::print(stderr, "trammel: {}, but not noted for trammel history: {}\n", done, error.message);
}

}  // namespace

Result<void> NoteBegun(const AppliedValue& applied, std::optional<double> before,
                       const std::map<std::string, double>& before_each) {
  return OrNothingSet(Note(applied, Application::Step::kBegun, before, before_each));
}

void NoteApplied(const AppliedValue& applied) {
  const auto noted = Note(applied, Application::Step::kApplied, {}, {});
  if (!noted) SayNotNoted("set", noted.error());
}

namespace {

using Step = Application::Step;

constexpr double kSame = 0.0001;  // values are sent with four decimals

bool AreSame(const std::optional<double>& a, const std::optional<double>& b) {
  return a && b && std::abs(*a - *b) <= kSame;
}

/// Reads a machine's noted applications, the oldest first.
Result<std::vector<files::NotedApplication>> NotedOf(Instrument instrument,
                                                     const std::string& machine) {
  const auto path = TRY(AppliedFile());
  const std::string name = procedure::PrinterName(machine);
  return files::Applications(path, instrument, [&name](const std::string& address) {
    return procedure::PrinterName(address) == name;
  });
}

std::string ValueText(const std::optional<double>& value) {
  return value ? fmt::format("{:.4f} s", *value) : "a value";
}

/// Finds the outcome, as far as the value in force shows it.
Step FoundStep(const Application& open, double now) {
  if (AreSame(open.value, now)) return Step::kApplied;
  return open.step == Step::kUndoing && AreSame(open.before, now) ? Step::kUndone
                                                                  : Step::kNotInForce;
}

std::string SettledText(const Application& open, Step found, double now) {
  const bool undo = open.step == Step::kUndoing;
  const std::string run = fmt::format(
      "pa apply{} of {} ended before it noted what it did: ", undo ? " --undo" : "", open.utc);
  const std::string in_force = fmt::format("{} is in force", ValueText(now));
  if (found == Step::kUndone) return run + in_force + ", as before: it was taken back";
  if (found == Step::kApplied && undo) {
    return run + in_force + " still: call pa apply --undo again to take it back";
  }
  if (found == Step::kApplied) {
    return run + in_force +
           ", as it was told; where it was to be kept for a filament or in Spoolman, apply it "
           "again";
  }
  return run + in_force +
         (AreSame(open.before, now)
              ? fmt::format(", as before, and not {}: apply that again where it is wanted",
                            ValueText(open.value))
              : fmt::format(", which is neither {} nor {} as before: somebody set it since, or the "
                            "printer was restarted; apply again what is wanted",
                            ValueText(open.value), ValueText(open.before)));
}

}  // namespace

Result<std::string> SettleUnfinished(Instrument instrument, const std::string& machine,
                                     std::optional<double> now, bool note) {
  const auto noted = TRY(NotedOf(instrument, machine));
  if (noted.empty() || !files::IsUnfinished(noted.back().application)) return std::string();
  const Application& open = noted.back().application;
  if (!now) {
    return fmt::format(
        "pa apply of {} ended before it noted what it did, and the printer does not tell what is "
        "in force: apply again what is wanted",
        open.utc);
  }
  const Step found = FoundStep(open, *now);
  if (note) {
    const auto path = TRY(AppliedFile());
    auto kept = files::NoteApplication(
        path, instrument, noted.back().fingerprint,
        {UtcNow(), WithoutSecrets(machine), found, open.before, open.value, open.before_each});
    TRY(OrNothingSet(kept));
  }
  return SettledText(open, found, *now);
}

Result<Undoing> LastToUndo(Instrument instrument, const std::string& machine,
                           std::optional<double> now) {
  auto noted = TRY(NotedOf(instrument, machine));
  while (!noted.empty()) {
    const Application& last = noted.back().application;
    const bool never_set =
        last.step == Step::kNotInForce ||
        (last.step == Step::kBegun && AreSame(last.before, now) && !AreSame(last.value, now));
    if (!never_set) break;
    noted.pop_back();
  }
  const std::string name = procedure::PrinterName(machine);
  if (noted.empty()) {
    const auto path = AppliedFile();
    return Fail(fmt::format("{} notes no value that was set on {}: name the one to set",
                            path ? path->string() : "nothing", name));
  }
  const Application& application = noted.back().application;
  if (!application.before) {
    return Fail(fmt::format("what was in force on {} before {} was not told: name the value to set",
                            name, application.utc));
  }
  const bool undone = application.step == Step::kUndone ||
                      (application.step == Step::kUndoing && AreSame(application.before, now));
  return Undoing{*application.before,      application.value,      application.utc, undone,
                 noted.back().fingerprint, application.before_each};
}

namespace {

Result<void> NoteUndo(Instrument instrument, const std::string& machine, const Undoing& undoing,
                      Step step) {
  const auto path = TRY(AppliedFile());
  return files::NoteApplication(path, instrument, undoing.fingerprint,
                                {UtcNow(), WithoutSecrets(machine), step, undoing.before,
                                 undoing.value, undoing.before_each});
}

}  // namespace

Result<void> NoteUndoing(Instrument instrument, const std::string& machine,
                         const Undoing& undoing) {
  return OrNothingSet(NoteUndo(instrument, machine, undoing, Step::kUndoing));
}

void NoteUndone(Instrument instrument, const std::string& machine, const Undoing& undoing) {
  const auto noted = NoteUndo(instrument, machine, undoing, Step::kUndone);
  if (!noted) SayNotNoted("taken back", noted.error());
}

void NoteLastUndone(Instrument instrument, const std::string& machine) {
  const auto note = [&]() -> Result<void> {
    const auto noted = TRY(NotedOf(instrument, machine));
    // Offsets set from the output of --json have no result, and are in no history.
    if (noted.empty() || noted.back().fingerprint.empty()) return {};
    const auto path = TRY(AppliedFile());
    return files::NoteApplication(path, instrument, noted.back().fingerprint,
                                  {UtcNow(), WithoutSecrets(machine), Step::kUndone, {}, {}});
  };
  if (const auto noted = note(); !noted) SayNotNoted("taken back", noted.error());
}

}  // namespace trammel::app
