#include "pressure_advance/commands/listener.h"

#include <fmt/format.h>

#include <cstdio>
#include <nlohmann/json.hpp>
#include <utility>

#include "app/applied_result.h"
#include "app/new_folder.h"
#include "app/provenance.h"
#include "base/bug_note.h"
#include "document/interval_text.h"
#include "pressure_advance/commands/analysis_output.h"
#include "pressure_advance/commands/analysis_run.h"
#include "pressure_advance/commands/calibration_run.h"
#include "pressure_advance/procedure/apply_pressure_advance.h"
#include "settings/material.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;

constexpr double kCommand_s = 30;
// A button that somebody leans on; more calls than this are the same call.
constexpr std::size_t kMostCalls = 8;

}  // namespace

Listener::Listener(machine::Printer& printer, PrinterOptions options, fs::path recordings,
                   std::stop_token stop)
    : printer_(printer),
      options_(std::move(options)),
      recordings_(std::move(recordings)),
      stop_(std::move(stop)),
      screen_(printer) {}

Result<void> Listener::Register() {
  for (const auto& [name, call] : {std::pair{"trammel_pressure_advance", Call::kCalibrate},
                                   std::pair{"trammel_apply", Call::kApply}}) {
    auto registered =
        printer_.RegisterRemoteMethod(name,
                                      [inbox = inbox_, call = call](const nlohmann::json&) {
                                        const std::lock_guard lock(inbox->mutex);
                                        if (inbox->calls.size() < kMostCalls)
                                          inbox->calls.push_back(call);
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

void Listener::Answer(Call call) {
  std::unique_lock lock(mutex_);
  if (working_) {
    lock.unlock();
    return Show(call == Call::kApply ? "still calibrating: apply when there is an answer"
                                     : "already at work: one calibration at a time");
  }
  working_ = call == Call::kCalibrate;
  lock.unlock();
  if (call == Call::kApply) return Show(Apply());
  if (worker_.joinable()) worker_.join();  // of the last calibration, which has ended
  worker_ = std::jthread([this] {
    const auto bug = NoteBug([this] { Calibrate(); });
    if (!bug) return;
    (void)NoteBug([&] { Tell("no calibration: this is a bug in trammel: " + *bug); });
    const std::lock_guard done(mutex_);
    working_ = false;
  });
}

void Listener::Calibrate() {
  // The macro that asked waits for a word, and says that nobody answered where none comes.
  Tell("at work");
  Tell(RunCalibration());
  const std::lock_guard lock(mutex_);
  working_ = false;
}

std::string Listener::RunCalibration() {
  auto config = LoadSettings(options_);
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
          Tell(progress.remaining_s
                   ? fmt::format("{}, about {:.0f} s", progress.text, *progress.remaining_s)
                   : progress.text);
        }};
    run = CalibrateInto(session, RequestFor(*config, folder->path()));
  } else {
    run.done = tl::unexpected(folder.error());
  }
  if (!run.done) {
    fmt::print(stderr, "trammel: {}\n", run.done.error().message);
    return "no calibration: " + run.done.error().message;
  }
  Tell("analysing");
  return Propose(folder->path());
}

std::string Listener::Propose(const fs::path& folder) {
  const auto run = AnalyseRecording(folder, pressure_advance::Method::kResponse);
  if (!run) return "no answer: " + run.error().message;
  AnalysisOutput output;
  output.files.report = (folder / "report.html").string();
  output.keep_in_recording = true;
  ResultFile result = ResultOf(run->analysis, folder.string());
  (void)PrintAnalysis(*run, result, output);  // for the log; a failed file says so there
  std::fflush(stdout);
  const Measured& measured = run->analysis.pressure_advance;
  if (!measured.good()) {
    return fmt::format("no answer ({}): {}", VerdictWords(measured.verdict()), measured.reason());
  }
  const Quantity& quantity = measured.quantity();
  {
    const std::lock_guard lock(mutex_);
    proposal_ = KeptAnswer{quantity, std::move(result.outcome)};
  }
  const auto now_s = printer_.LastState().pressure_advance_s;
  return fmt::format("pressure advance {}{}. Nothing applied: TRAMMEL_APPLY sets it",
                     report::WithInterval(quantity, report::kSeconds),
                     now_s ? fmt::format(", now {:.4f} s", *now_s) : "");
}

std::string Listener::Apply() {
  std::optional<KeptAnswer> answer;
  {
    const std::lock_guard lock(mutex_);
    answer = proposal_;
  }
  if (!answer) return "nothing to apply: there is no good answer yet, calibrate first";
  const auto config = LoadSettings(options_);
  if (!config) return "not applied: " + config.error().message;
  const procedure::Session session{printer_, stop_, {}};
  procedure::ApplyOptions options;
  options.limit_s = procedure::ApplyLimit_s(config->pattern);
  const double value_s = answer->pressure_advance_s.value;
  const auto change = procedure::ApplyPressureAdvance(session, value_s, options);
  if (!change) return "not applied: " + change.error().message;
  NoteApplied(answer->outcome, config->scan.address);
  return fmt::format(
      "pressure advance {}{:.4f} until the next restart. To keep it: pressure_advance: {:.4f} in "
      "[extruder] of printer.cfg",
      change->before_s ? fmt::format("{:.4f} -> ", *change->before_s) : "", value_s, value_s);
}

void Listener::Tell(std::string text) {
  constexpr std::size_t kMostWords = 100;  // while the printer cannot hear them
  fmt::print(stderr, "  {}\n", text);
  if (text.starts_with(' ')) return;  // how far a wait has come: for the log
  const std::lock_guard lock(inbox_->mutex);
  if (inbox_->words.size() == kMostWords) inbox_->words.pop_front();
  inbox_->words.push_back(std::move(text));
  inbox_->called.notify_all();
}

void Listener::ShowAll() {
  for (;;) {
    std::unique_lock lock(inbox_->mutex);
    if (inbox_->words.empty()) return;
    const std::string text = std::move(inbox_->words.front());
    inbox_->words.pop_front();
    lock.unlock();
    Show(text);
  }
}

void Listener::Show(std::string_view text) {
  // Words wait behind whatever the printer is at, homing for example. They are not ended by the
  // stop: the last word of a stopped calibration is worth saying, too.
  constexpr double kPatience_s = 300;
  if (auto shown = screen_.Show(text, {kPatience_s}); !shown) {
    fmt::print(stderr, "trammel: not shown on the printer: {}\n", shown.error().message);
  }
}

}  // namespace trammel::app
