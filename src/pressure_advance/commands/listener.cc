#include "pressure_advance/commands/listener.h"

#include <fmt/format.h>

#include <cstdio>
#include <nlohmann/json.hpp>
#include <utility>

#include "app/applied_result.h"
#include "app/new_folder.h"
#include "app/provenance.h"
#include "base/bug_note.h"
#include "base/url_secrets.h"
#include "document/interval_text.h"
#include "pressure_advance/commands/analysis_output.h"
#include "pressure_advance/commands/analysis_run.h"
#include "pressure_advance/commands/calibration_run.h"
#include "pressure_advance/procedure/apply_pressure_advance.h"
#include "pressure_advance/procedure/filament_memory.h"
#include "settings/material.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;

constexpr double kCommand_s = 30;
// A button that somebody leans on; more calls than this are the same call.
constexpr std::size_t kMostCalls = 8;

// The name that a macro hands over; empty where it names none.
std::string FilamentOf(const nlohmann::json& arguments) {
  if (!arguments.is_object()) return {};
  const auto found = arguments.find("filament");
  return found == arguments.end() || !found->is_string() ? "" : found->get<std::string>();
}

}  // namespace

Listener::Listener(machine::Printer& printer, PrinterOptions options, fs::path recordings,
                   bool keep_full, std::stop_token stop)
    : printer_(printer),
      options_(std::move(options)),
      recordings_(std::move(recordings)),
      keep_full_(keep_full),
      stop_(std::move(stop)),
      screen_(printer) {}

Result<void> Listener::Register() {
  for (const auto& [name, method] : {std::pair{"trammel_offer", Method::kOffer},
                                     std::pair{"trammel_pressure_advance", Method::kCalibrate},
                                     std::pair{"trammel_apply", Method::kApply},
                                     std::pair{"trammel_dismiss", Method::kDismiss}}) {
    auto registered = printer_.RegisterRemoteMethod(
        name,
        [inbox = inbox_, method = method](const nlohmann::json& arguments) {
          const std::lock_guard lock(inbox->mutex);
          if (inbox->calls.size() < kMostCalls) {
            inbox->calls.push_back({method, FilamentOf(arguments)});
          }
          inbox->called.notify_all();
        },
        {kCommand_s, stop_});
    if (!registered) return registered;
  }
  return {};
}

bool Listener::Serve() {
  for (;;) {
    std::unique_lock lock(inbox_->mutex);
    inbox_->called.wait(lock, stop_,
                        [this] { return !inbox_->calls.empty() || !inbox_->words.empty(); });
    if (stop_.stop_requested()) break;
    std::optional<Call> call;
    if (!inbox_->calls.empty()) {
      call = inbox_->calls.front();
      inbox_->calls.pop_front();
    }
    lock.unlock();
    ShowAll();
    if (call) Answer(*call);
  }
  std::unique_lock lock(mutex_);
  const bool was_working = working_;
  lock.unlock();
  if (worker_.joinable()) worker_.join();
  ShowAll();
  return was_working;
}

void Listener::Answer(const Call& call) {
  std::unique_lock lock(mutex_);
  if (working_) {
    lock.unlock();
    const bool about_answer = call.method == Method::kApply || call.method == Method::kDismiss;
    return Show({about_answer ? "still calibrating: apply when there is an answer"
                              : "already at work: one calibration at a time"});
  }
  working_ = call.method == Method::kCalibrate;
  lock.unlock();
  if (call.method == Method::kApply) return Show({Apply()});
  if (call.method == Method::kDismiss) return Show({Dismiss()});
  if (call.method == Method::kOffer) return Show(Offer(call.filament));
  if (worker_.joinable()) worker_.join();  // of the last calibration, which has ended
  worker_ = std::jthread([this, filament = call.filament] {
    const auto bug = NoteBug([&] { Calibrate(filament); });
    if (!bug) return;
    (void)NoteBug([&] { Tell({"no calibration: this is a bug in trammel: " + *bug}); });
    const std::lock_guard done(mutex_);
    working_ = false;
  });
}

Listener::Words Listener::Offer(const std::string& filament) const {
  const auto config = LoadSettings(options_);
  if (!config) return {"no calibration: " + config.error().message, procedure::Buttons::kClose};
  if (auto told = settings::ValidateTemperatures(config->pattern); !told) {
    return {"no calibration: " + told.error().message, procedure::Buttons::kClose};
  }
  std::string key;
  if (!filament.empty()) {
    const auto made = procedure::FilamentKey(filament);
    if (!made) return {"no calibration: " + made.error().message, procedure::Buttons::kClose};
    key = *made;
  }
  return {fmt::format("Is the bed empty? It is heated, a pattern is printed and scanned ({}){}",
                      settings::DescribeTemperatures(config->pattern),
                      key.empty() ? "" : ", for filament " + key),
          procedure::Buttons::kStart, key};
}

void Listener::Calibrate(const std::string& filament) {
  // The macro that asked waits for a word, and says that nobody answered where none comes.
  Tell({"at work"});
  procedure::RecordingCutter cutter;
  Tell(RunCalibration(filament, keep_full_ ? nullptr : &cutter));
  {
    const std::lock_guard lock(mutex_);
    working_ = false;  // the answer can be applied from now on
  }
  FinishCutting(cutter, stop_);
}

Listener::Words Listener::RunCalibration(const std::string& filament,
                                         procedure::RecordingCutter* cutter) {
  auto config = LoadSettings(options_);
  if (config && !filament.empty()) {
    if (auto key = procedure::FilamentKey(filament); !key) config = tl::unexpected(key.error());
  }
  if (config) {
    if (auto told = settings::ValidateTemperatures(config->pattern); !told) {
      config = tl::unexpected(told.error());
    }
  }
  const auto folder =
      config
          ? NewFolder::Make(recordings_ / RecordingName(measurement::Instrument::kPressureAdvance))
          : Result<NewFolder>(tl::unexpected(config.error()));
  CalibrationRun run;
  if (folder) {
    const procedure::Session session{
        printer_, stop_, [this](const procedure::Progress& progress) {
          Tell({progress.remaining_s
                    ? fmt::format("{}, about {:.0f} s", progress.text, *progress.remaining_s)
                    : progress.text});
        }};
    auto request = RequestFor(*config, folder->path());
    request.cutter = cutter;
    run = CalibrateInto(session, request);
  } else {
    run.done = tl::unexpected(folder.error());
  }
  if (!run.done) {
    fmt::print(stderr, "trammel: {}\n", run.done.error().message);
    return {"no calibration: " + run.done.error().message, procedure::Buttons::kClose};
  }
  Tell({"analysing"});
  return Propose(folder->path(), filament);
}

Listener::Words Listener::Propose(const fs::path& folder, const std::string& filament) {
  const auto run = AnalyseRecording(folder, pressure_advance::Method::kResponse);
  if (!run) return {"no answer: " + run.error().message, procedure::Buttons::kClose};
  AnalysisOutput output;
  output.files.report = (folder / "report.html").string();
  output.keep_in_recording = true;
  ResultFile result = ResultOf(run->analysis, folder.string());
  const auto config = LoadSettings(options_);
  if (config) {
    result.outcome.subject = {WithoutSecrets(config->scan.address),
                              fmt::format("{:.2f}", config->pattern.nozzle_diameter_mm), filament};
  }
  (void)PrintAnalysis(*run, result, output);  // for the log; a failed file says so there
  std::fflush(stdout);
  const Measured& measured = run->analysis.pressure_advance;
  if (!measured.good()) {
    return {fmt::format("{}: {}", VerdictWords(measured.verdict()), measured.reason()),
            procedure::Buttons::kClose};
  }
  const Quantity& quantity = measured.quantity();
  {
    const std::lock_guard lock(mutex_);
    proposal_ = Proposal{KeptAnswer{quantity, std::move(result.outcome)}, filament};
  }
  const auto now_s = printer_.LastState().pressure_advance_s;
  return {fmt::format("pressure_advance = {}{}. Nothing applied: TRAMMEL_APPLY sets it",
                      report::WithInterval(quantity, report::kSeconds),
                      now_s ? fmt::format(", now {:.4f} s", *now_s) : ""),
          procedure::Buttons::kUse};
}

std::string Listener::Apply() {
  std::optional<Proposal> proposal;
  {
    const std::lock_guard lock(mutex_);
    proposal = proposal_;
  }
  if (!proposal) return "nothing to apply: there is no good answer yet, calibrate first";
  const auto config = LoadSettings(options_);
  if (!config) return "not applied: " + config.error().message;
  const procedure::Session session{printer_, stop_, {}};
  procedure::ApplyOptions options;
  options.limit_s = procedure::ApplyLimit_s(config->pattern);
  const double value_s = proposal->answer.pressure_advance_s.value;
  const auto change = procedure::ApplyPressureAdvance(session, value_s, options);
  if (!change) return "not applied: " + change.error().message;
  NoteApplied(proposal->answer.outcome, config->scan.address);
  const std::string set =
      fmt::format("pressure advance {}{:.4f} until the next restart",
                  change->before_s ? fmt::format("{:.4f} -> ", *change->before_s) : "", value_s);
  if (proposal->filament.empty()) {
    return fmt::format("{}. To keep it: pressure_advance: {:.4f} in [extruder] of printer.cfg", set,
                       value_s);
  }
  const auto kept = procedure::KeepForFilament(session, proposal->filament, value_s);
  if (!kept) return fmt::format("{}. Not kept for the filament: {}", set, kept.error().message);
  return fmt::format("{}, and kept for {} on {}: TRAMMEL_FILAMENT sets it", set, kept->filament,
                     kept->nozzle);
}

std::string Listener::Dismiss() {
  const std::lock_guard lock(mutex_);
  const bool had = proposal_.has_value();
  proposal_.reset();
  return had ? "nothing applied: the old pressure advance stays" : "nothing to drop";
}

void Listener::Tell(Words words) {
  constexpr std::size_t kMostWords = 100;  // while the printer cannot hear them
  fmt::print(stderr, "  {}\n", words.text);
  if (words.text.starts_with(' ')) return;  // how far a wait has come: for the log
  const std::lock_guard lock(inbox_->mutex);
  if (inbox_->words.size() == kMostWords) inbox_->words.pop_front();
  inbox_->words.push_back(std::move(words));
  inbox_->called.notify_all();
}

void Listener::ShowAll() {
  for (;;) {
    std::unique_lock lock(inbox_->mutex);
    if (inbox_->words.empty()) return;
    const Words words = std::move(inbox_->words.front());
    inbox_->words.pop_front();
    lock.unlock();
    Show(words);
  }
}

void Listener::Show(const Words& words) {
  // Words wait behind whatever the printer is at, homing for example. They are not ended by the
  // stop: the last word of a stopped calibration is worth saying, too.
  constexpr double kPatience_s = 300;
  auto shown = screen_.Show(words.text, {kPatience_s});
  if (shown && words.buttons) {
    shown = screen_.Ask(words.text, *words.buttons, words.filament, {kPatience_s});
  }
  if (!shown) {
    fmt::print(stderr, "trammel: not shown on the printer: {}\n", shown.error().message);
  }
}

}  // namespace trammel::app
