// trammel pa apply
#include "pressure_advance/commands/apply_command.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "app/applied_result.h"
#include "app/commands.h"
#include "app/interrupt.h"
#include "app/printer_session.h"
#include "app/provenance.h"
#include "app/stated_settings.h"
#include "document/interval_text.h"
#include "measurement/outcome_file.h"
#include "measurement/remark.h"
#include "pressure_advance/commands/analysis_run.h"
#include "pressure_advance/commands/kept_result.h"
#include "pressure_advance/commands/pattern_options.h"
#include "pressure_advance/commands/pressure_advance_commands.h"
#include "pressure_advance/procedure/calibrate.h"
#include "pressure_advance/procedure/filament_memory.h"
#include "service/job_record.h"
#include "session/crash_recovery.h"
#include "session/print_needs.h"
#include "session/run_journal.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;

struct ApplyArguments {
  PrinterOptions printer;
  std::string value;
  std::string filament;
  bool spoolman = false;
  bool undo = false;
  bool force = false;
  bool dry_run = false;
};

/// Returns the recording of a stored result: the folder that contains it, or the one that it names.
fs::path RecordingOf(const fs::path& path, const measurement::Outcome& outcome) {
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) return path;
  if (path.filename() == files::kResultFile) {
    return path.has_parent_path() ? path.parent_path() : fs::path(".");
  }
  const auto& sources = outcome.provenance.sources;
  const fs::path source = sources.empty() ? fs::path() : fs::path(sources.front());
  return fs::exists(source / "scan.json", ignored) ? source : fs::path();
}

Result<ChosenValue> Kept(const fs::path& path) {
  auto kept = KeptPressureAdvance(path);
  if (!kept) return tl::unexpected(kept.error());
  fmt::print(stderr, "  the answer kept in {}\n", path.string());
  kept->folder = RecordingOf(path, *kept->result);
  return kept;
}

/// Returns a file of the recording that is newer than its result.
std::optional<fs::path> ChangedSince(const fs::path& result, const fs::path& folder) {
  std::error_code ignored;
  const auto kept = fs::last_write_time(result, ignored);
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    const fs::path name = entry.path().filename();
    const bool ours = name == files::kResultFile || name == files::kRemarkFile ||
                      name == "report.html" || name == service::kAnswerPicture;
    if (!ours && entry.is_regular_file(ignored) && entry.last_write_time(ignored) > kept) {
      return entry.path();
    }
  }
  return std::nullopt;
}

Result<ChosenValue> Answer(const fs::path& folder) {
  std::error_code ignored;
  const fs::path result = folder / files::kResultFile;
  std::string again;
  if (fs::exists(result, ignored)) {
    const auto newer = ChangedSince(result, folder);
    if (!newer) return Kept(result);
    again = fmt::format("{} is newer than {}: analysing again", newer->string(), result.string());
    fmt::print(stderr, "  {}\n", again);
  }
  if (!fs::exists(folder / "scan.json", ignored)) {
    return Fail(fmt::format("{}: is no recording: there is neither {} nor scan.json in it",
                            folder.string(), files::kResultFile));
  }
  const auto run = TRY(AnalyseRecording(folder));
  const Measured& measured = run.analysis.pressure_advance;
  if (measured.good()) {
    ResultFile found = ResultOf(run.analysis, folder.string());
    found.outcome.subject = SubjectIn(folder);
    if (!again.empty()) found.outcome.notices.push_back("for pa apply: " + again);
    return ChosenValue{measured.quantity().value, measured.quantity(), found.outcome, folder,
                       std::move(found)};
  }
  const bool kept = KeptPressureAdvance(result).has_value();
  return Fail(
      fmt::format("{}: it gives no value, because the verdict is {}: {}{}", folder.string(),
                  VerdictText(measured.verdict()), measured.reason(),
                  kept ? fmt::format("; the answer that was kept before is good: name {} to "
                                     "take that one",
                                     result.string())
                       : ""),
      ErrorKind::kMeasurement);
}

Result<ChosenValue> ParseValue(const std::string& text) {
  const auto values = ParsePressureAdvances(text);
  if (values && values->size() == 1) return ChosenValue{values->front() + 0.0};  // no -0
  return Fail(fmt::format(
      "{}: is neither one pressure advance in 0 ... 10 s, nor a recording's folder, nor a kept "
      "result that is there",
      text));
}

procedure::ApplyOptions OptionsOf(const ApplyArguments& arguments, const files::Config& config) {
  procedure::ApplyOptions options;
  options.limit_s = procedure::ApplyLimit_s(config.pattern);
  options.force = arguments.force;
  options.dry_run = arguments.dry_run;
  return options;
}

constexpr auto kInstrument = measurement::Instrument::kPressureAdvance;

// Checks that the last application's value is still in force: else somebody set another since.
Result<void> CheckInForce(const Undoing& undoing, std::optional<double> now_s, bool force) {
  constexpr double kRounding_s = 0.0001;  // four decimals are sent
  if (force || !undoing.value || !now_s) return {};
  if (std::abs(*now_s - *undoing.value) <= kRounding_s) return {};
  if (undoing.undone) {
    return Fail(fmt::format("the value of {:.4f} s was taken back {} already: name the one to set",
                            *undoing.value, undoing.utc));
  }
  return Fail(
      fmt::format("{:.4f} s is in force, and not the {:.4f} s that were applied {}: "
                  "somebody set another value since, or the printer was restarted; --force sets "
                  "{:.4f} s all the same",
                  *now_s, *undoing.value, undoing.utc, undoing.before),
      ErrorKind::kSafety);
}

constexpr double kAsk_s = 10;
constexpr const char* kWho = "trammel pa apply";

// Locks the printer, unless nothing is set.
Result<std::optional<files::FileLock>> TakeTurnFor(const ApplyArguments& arguments,
                                                   const procedure::Session& session,
                                                   const files::Config& config) {
  if (arguments.dry_run) return std::nullopt;
  const auto state = TRY(files::StateFolder());
  auto turn = TRY(procedure::TakeTurn(session, config.scan, state, kWho));
  return std::optional(std::move(turn));
}

// Reports the open state of a run that died while it set a value.
Result<void> Settle(const ApplyArguments& arguments, const procedure::Session& session,
                    const std::string& address, std::optional<double> now_s) {
  const auto left = TRY(SettleUnfinished(kInstrument, address, now_s, !arguments.dry_run));
  if (!left.empty()) session.Report(left);
  return {};
}

// Resolves the state after a failure between the record and the printer's answer.
void SettleFailure(const ApplyArguments& arguments, const procedure::Session& session,
                   const std::string& address) {
  if (arguments.dry_run) return;
  const auto state = session.printer.State({kAsk_s});  // also where somebody stops the program
  if (!state) return;                                  // it stays open, and the next one looks
  const auto left = SettleUnfinished(kInstrument, address, machine::ActiveAdvance_s(*state), true);
  if (left && !left->empty()) session.Report(*left);
}

// Formats the value before, or each motor's if there are several.
std::string BeforeText(const Undoing& undoing) {
  if (undoing.before_each.empty()) return fmt::format("{:.4f} s", undoing.before);
  std::vector<std::string> each;
  for (const auto& [motor, before_s] : undoing.before_each) {
    each.push_back(fmt::format("{:.4f} s on {}", before_s, motor));
  }
  return fmt::format("{}", fmt::join(each, ", "));
}

Result<int> RunUndo(const ApplyArguments& arguments) {
  const Interrupt interrupt;
  const auto config = TRY(LoadSettings(arguments.printer));
  const auto printer = TRY(Connect(config.scan, interrupt.token()));
  const procedure::Session session{*printer, interrupt.token(), ShowProgress};
  const auto turn = TRY(TakeTurnFor(arguments, session, config));
  const auto state = TRY(session.printer.State(session.Within(kAsk_s)));
  TRY(Settle(arguments, session, config.scan.address, machine::ActiveAdvance_s(state)));
  const auto undoing =
      TRY(LastToUndo(kInstrument, config.scan.address, machine::ActiveAdvance_s(state)));
  procedure::ApplyOptions options = OptionsOf(arguments, config);
  options.own_s = undoing.before_each;
  options.before_setting = [&](const procedure::PressureAdvanceChange& change) -> Result<void> {
    TRY(CheckInForce(undoing, change.before_s, arguments.force));
    return NoteUndoing(kInstrument, config.scan.address, undoing);
  };
  fmt::print("in force until    {}: {}\n", undoing.utc, BeforeText(undoing));
  const auto done = Apply(session, undoing.before, options, false);
  if (!done) {
    SettleFailure(arguments, session, config.scan.address);
    return tl::unexpected(done.error());
  }
  if (!options.dry_run) {
    NoteUndone(kInstrument, config.scan.address, undoing);
    fmt::print(
        "what was kept     for a filament (TRAMMEL_FILAMENT, Spoolman) stays there: pa apply "
        "{:.4f} --filament NAME --spoolman keeps this one\n",
        undoing.before);
  }
  return kExitGood;
}

// Prints the value in Spoolman and its new value.
void PrintSpoolPlace(const procedure::SpoolPlace& place, double value_s) {
  fmt::print("Spoolman          filament {} ({}) pressure_advance {} -> {:.4f}\n",
             place.filament_id, place.filament,
             place.before_s ? fmt::format("{:.4f}", *place.before_s) : "(none)", value_s);
  fmt::print("                  spool {} pressure_advance_matrix {} -> \"{}\": {:.4f}\n",
             place.spool_id, place.matrix_before.empty() ? "(none)" : place.matrix_before,
             place.nozzle, value_s);
  if (place.new_fields) fmt::print("                  fields that it lacks are added\n");
  if (place.archived) {
    fmt::print(
        "notice            spool {} is archived in Spoolman: is it the one on the printer?\n",
        place.spool_id);
  }
}

// Checks that a result may be stored for a filament.
Result<void> CheckSameFilament(const measurement::Subject& subject, const std::string& filament,
                               bool force) {
  if (force || MayBeSameFilament(subject.filament, filament)) return {};
  return Fail(
      fmt::format("the result is of the filament '{}', and would be kept for '{}': name "
                  "that one, or --force",
                  subject.filament, filament));
}

// Checks that a result may be stored on the printer's spool.
Result<void> CheckSameSpool(const measurement::Subject& subject, int spool_id, bool force) {
  if (force || subject.spool.empty() || subject.spool == std::to_string(spool_id)) return {};
  return Fail(
      fmt::format("the result is of spool {}, and Spoolman has spool {} on this printer: "
                  "choose that one in Mainsail or Fluidd, or --force",
                  subject.spool, spool_id));
}

// Checks that a result may be set on the active toolhead: Klipper sets it there.
Result<void> CheckSameToolhead(const measurement::Subject& subject,
                               const procedure::Session& session, bool force) {
  if (force || subject.toolhead.empty()) return {};
  const auto state = TRY(session.printer.State(session.Within(kAsk_s)));
  if (state.active_extruder.empty() || state.active_extruder == subject.toolhead) return {};
  return Fail(
      fmt::format("the result is of the toolhead '{}', and '{}' is active, on which it would "
                  "be set: select the other one, or --force",
                  subject.toolhead, state.active_extruder));
}

// Place of a value in Spoolman, or the reason why there is none; neither if nobody requested it.
struct SpoolChoice {
  std::optional<procedure::SpoolPlace> place = {};
  std::string why_not = {};
};

// Finds the value's place in Spoolman. Failure of the settings' general request (`always`) does not
// stop setting the printer; failure of this value's own does.
Result<SpoolChoice> SpoolFor(const ApplyArguments& arguments, bool always,
                             const procedure::Session& session,
                             const measurement::Subject& subject) {
  if (!arguments.spoolman && !always) return SpoolChoice{};
  auto place = procedure::FindSpoolPlace(session);
  if (place) {
    auto same = CheckSameFilament(subject, place->filament, arguments.force);
    if (same) same = CheckSameSpool(subject, place->spool_id, arguments.force);
    if (!same) place = tl::unexpected(same.error());
  }
  if (place) return SpoolChoice{std::move(*place)};
  if (arguments.spoolman) return tl::unexpected(place.error());
  return SpoolChoice{{}, place.error().message};
}

// Prints the conditions of the result that differ from those it is set for.
void PrintOtherSubject(const measurement::Subject& subject, const files::Config& config) {
  const std::string printer = procedure::PrinterName(config.scan.address);
  if (!subject.printer.empty() && procedure::PrinterName(subject.printer) != printer) {
    fmt::print("notice            it was measured on {}, and is set on {}\n", subject.printer,
               printer);
  }
  const std::string nozzle = fmt::format("{:.2f}", config.pattern.nozzle_diameter_mm);
  if (!subject.nozzle.empty() && subject.nozzle != nozzle) {
    fmt::print(
        "notice            it was measured with a nozzle of {} mm, and the settings say {}\n",
        subject.nozzle, nozzle);
  }
}

// Stores a new analysis in its recording.
Result<void> KeepResult(const ChosenValue& value) {
  if (!value.found_now) return {};
  auto kept = KeepInRecording(value.folder, *value.found_now);
  if (kept) return {};
  return Fail(
      fmt::format("nothing was set, as the new analysis cannot be kept: {}", kept.error().message),
      kept.error().kind);
}

std::string FirstLine(const std::string& text) { return text.substr(0, text.find('\n')); }

// Prints the reason with the answer, for people beside the printer: they get only the first line.
void PrintNotInSpoolman(const std::string& why) {
  fmt::print("not kept          in Spoolman: {}\n", FirstLine(why));
}

// Stores the value beyond the printer's next restart, where requested.
int KeepBeyond(const ApplyArguments& arguments, const procedure::Session& session,
               const SpoolChoice& spool, double value_s) {
  int code = kExitGood;
  if (!arguments.filament.empty()) {
    const auto kept = procedure::KeepForFilament(session, arguments.filament, value_s);
    if (kept) {
      fmt::print("kept for          {} on {}: TRAMMEL_FILAMENT FILAMENT={} sets it\n",
                 kept->filament, kept->nozzle, kept->filament);
    } else {
      fmt::print("kept for          nothing: the value is set, and not kept for the filament\n");
      code = PrintError(kept.error());
    }
  }
  if (!spool.why_not.empty()) PrintNotInSpoolman(spool.why_not);
  if (!spool.place) return code;
  const auto kept = procedure::KeepOnSpool(session, *spool.place, value_s);
  if (kept) {
    fmt::print("kept in           Spoolman: read back\n");
    return code;
  }
  // One of the two values may be stored: the message names them.
  fmt::print("in Spoolman       {}\n", FirstLine(kept.error().message));
  return arguments.spoolman ? PrintError(kept.error()) : code;
}

Result<int> RunApply(const ApplyArguments& arguments) {
  const Interrupt interrupt;
  auto config = TRY(LoadSettings(arguments.printer));
  TRY(CheckFilamentOption(arguments.filament));
  const auto value = TRY(ValueFrom(arguments.value));
  const auto printer = TRY(Connect(config.scan, interrupt.token()));
  const procedure::Session session{*printer, interrupt.token(), ShowProgress};
  const auto turn = TRY(TakeTurnFor(arguments, session, config));
  procedure::ApplyOptions options = OptionsOf(arguments, config);
  const AppliedValue applied{kInstrument, value.result, config.scan.address, value.value_s};
  options.before_setting = [&](const procedure::PressureAdvanceChange& change) -> Result<void> {
    TRY(Settle(arguments, session, config.scan.address, change.before_s));
    TRY(KeepResult(value));
    return NoteBegun(applied, change.before_s, procedure::BeforeEach(change));
  };
  const measurement::Subject subject =
      value.result ? value.result->subject : measurement::Subject{};
  TRY(CheckSameFilament(subject, arguments.filament, arguments.force));
  TRY(CheckSameToolhead(subject, session, arguments.force));
  const auto spool = TRY(SpoolFor(arguments, config.scan.keep_in_spoolman, session, subject));
  if (value.measured) {
    fmt::print("measured          {}\n", report::WithInterval(*value.measured, report::kSeconds));
  }
  if (value.result) {
    for (const std::string& notice : value.result->notices) {
      fmt::print("notice            {}\n", notice);
    }
  }
  const procedure::Session silent{*printer, interrupt.token(), {}};
  TRY(TakeStatedBy(silent, StatedFor::kPrinter, config));
  PrintOtherSubject(subject, config);
  if (spool.place) PrintSpoolPlace(*spool.place, value.value_s);
  const auto done = Apply(session, value.value_s, options, false);
  if (!done) {
    SettleFailure(arguments, session, config.scan.address);
    return tl::unexpected(done.error());
  }
  if (options.dry_run) {
    if (!spool.why_not.empty()) PrintNotInSpoolman(spool.why_not);
    return kExitGood;
  }
  NoteApplied(applied);
  const int code = KeepBeyond(arguments, session, spool, value.value_s);
  PrintHowToUndo(arguments.printer);
  return code;
}

}  // namespace

Result<ChosenValue> ValueFrom(const std::string& text) {
  std::error_code ignored;
  if (fs::is_directory(text, ignored)) return Answer(text);
  const bool file =
      fs::path(text).extension() == ".json" || fs::exists(fs::symlink_status(text, ignored));
  return file ? Kept(text) : ParseValue(text);
}

Result<void> Apply(const procedure::Session& session, double pressure_advance_s,
                   const procedure::ApplyOptions& options, bool quiet) {
  const auto change = TRY(procedure::ApplyPressureAdvance(session, pressure_advance_s, options));
  if (quiet) return {};
  const bool several = change.motors.size() > 1;
  for (const procedure::MotorChange& motor : change.motors) {
    fmt::print("pressure advance  {}  ->  {:.4f} s{}\n",
               motor.before_s ? fmt::format("{:.4f}", *motor.before_s) : "(not told)",
               motor.after_s, several ? " on " + motor.section : "");
  }
  if (options.dry_run) {
    fmt::print("nothing was changed\n");
    return {};
  }
  std::map<double, std::vector<std::string>> sections;
  for (const procedure::MotorChange& motor : change.motors) {
    fmt::print("applied           {}: read back from the printer; until the next restart\n",
               motor.command);
    sections[motor.after_s].push_back(motor.section);
  }
  for (const auto& [value_s, alike] : sections) ExplainKeeping(value_s, alike);
  return {};
}

void PrintHowToUndo(const PrinterOptions& printer) {
  PrintWrapped("to undo it", "trammel pa apply --undo" + PrinterOptionText(printer));
}

void ExplainKeeping(double pressure_advance_s, const std::vector<std::string>& sections) {
  fmt::print("to keep it        add to [{}] in printer.cfg:  pressure_advance: {:.4f}\n",
             fmt::join(sections, "] and ["), pressure_advance_s);
}

void ExplainKeeping(double pressure_advance_s, const procedure::Session& session) {
  const auto facts = procedure::ReadFacts(session);
  const bool told = facts && !facts->advance_motors.empty();
  ExplainKeeping(pressure_advance_s,
                 told ? facts->advance_motors
                      : std::vector<std::string>{facts ? facts->extruder : "extruder"});
}

void AddApplyCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command = parent.add_subcommand("apply", "set a pressure advance on the printer");
  const auto arguments = std::make_shared<ApplyArguments>();
  CLI::Option* const value = command->add_option("value", arguments->value,
                                                 "seconds, a recording's folder or a kept result");
  command
      ->add_flag("--undo", arguments->undo,
                 "instead of a value: what was in force before trammel set the last one")
      ->excludes(value);
  AddPrinterOptions(*command, arguments->printer);
  command
      ->add_option("--filament", arguments->filament,
                   "keep it for this filament, too, in the printer's [save_variables]")
      ->excludes("--undo");
  command
      ->add_flag("--spoolman", arguments->spoolman,
                 "keep it in Spoolman, too: on the active spool, and on its filament")
      ->excludes("--undo");
  command->add_flag("--force", arguments->force,
                    "set it beyond pressure_advance_limit, on another toolhead, or for another "
                    "filament or spool than it was measured with, too");
  command->add_flag("--dry-run", arguments->dry_run, "say what would change, and change nothing");
  command->callback([arguments, &exit_code] {
    if (!arguments->undo && arguments->value.empty()) throw CLI::RequiredError("value or --undo");
    exit_code = CodeOf(arguments->undo ? RunUndo(*arguments) : RunApply(*arguments));
  });
}

}  // namespace trammel::app
