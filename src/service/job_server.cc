#include "service/job_server.h"

#include <fmt/format.h>
#include <malloc.h>

#include <algorithm>
#include <utility>

#include "base/bug_note.h"
#include "files/new_file.h"
#include "files/whole_file.h"
#include "measurement/history.h"
#include "measurement/outcome_file.h"
#include "service/job_process.h"
#include "service/job_record.h"
#include "session/crash_recovery.h"
#include "session/run_journal.h"

namespace trammel::service {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// Converts a line of an answer's table to a sentence: "pressure advance 0.0300 -> 0.0290 s".
std::string WithoutColumns(const std::string& line) {
  std::string text;
  for (const char c : line) {
    if (c != ' ' || !text.ends_with(' ')) text += c;
  }
  return text;
}

// True if a value was set since, whatever failed afterwards.
bool WasSet(const std::vector<files::Application>& before,
            const std::vector<files::Application>& now) {
  using Step = files::Application::Step;
  if (now.empty() || now.back().step != Step::kApplied) return false;
  return before.empty() || now.size() != before.size() || before.back().step != Step::kApplied ||
         before.back().utc != now.back().utc;
}

// Adds one word, so that a value cannot pass for an option.
void AddOption(const std::string& name, const std::string& value, std::vector<std::string>& words) {
  if (!value.empty()) words.push_back(fmt::format("--{}={}", name, value));
}

}  // namespace

std::vector<std::string> OptionText(const PrinterPlace& place) {
  std::vector<std::string> words;
  AddOption("config", place.config, words);
  for (const std::string& set : place.set) AddOption("set", set, words);
  AddOption("printer", place.address, words);
  return words;
}

Arguments Completed(Arguments given, const Offer& offer) {
  given.insert(offer.start.begin(), offer.start.end());  // existing ones take precedence
  return given;
}

JobServer::JobServer(JobServerOptions options)
    : options_(std::move(options)),
      state_path_(KeptStatePath(options_.state_folder, procedure::PlainAddress(options_.address))),
      lock_path_(
          files::LockPath(options_.state_folder, procedure::PlainAddress(options_.address))) {
  auto kept = ReadKeptState(state_path_);
  if (!kept) {
    options_.log("trammel: what was kept of the last run is left out: " + kept.error().message);
    return;
  }
  run_ = std::move(kept->run);
  if (FindWaiting(kept->proposal)) proposal_ = std::move(kept->proposal);
}

std::optional<JobServer::Waiting> JobServer::FindWaiting(std::optional<Proposal> proposal) const {
  const JobKind* const kind = proposal ? FindJob(proposal->job) : nullptr;
  if (kind == nullptr || !kind->answer) return std::nullopt;
  auto answer = kind->answer(proposal->folder);
  if (!answer || answer->verdict != Verdict::kGood) return std::nullopt;
  return Waiting{std::move(*proposal), kind, std::move(*answer)};
}

std::optional<JobServer::Waiting> JobServer::FindWaiting() const {
  std::optional<Proposal> proposal;
  {
    const std::lock_guard lock(mutex_);
    proposal = proposal_;
  }
  return FindWaiting(std::move(proposal));
}

const JobKind* JobServer::FindJob(const std::string& name) const {
  const auto found = std::find_if(options_.jobs.begin(), options_.jobs.end(),
                                  [&name](const JobKind& kind) { return kind.name == name; });
  return found == options_.jobs.end() ? nullptr : &*found;
}

std::string JobServer::WhoHasThePrinter() const {
  std::error_code ignored;
  if (!fs::exists(lock_path_, ignored)) return {};
  const auto lock = files::FileLock::Take(lock_path_, "trammel serve looks whether it is free");
  return lock ? "" : lock.error().message;
}

std::string JobServer::NewRunId(const std::string& job) const {
  const std::string name = fmt::format("{}-{}", job, CompactUtc(options_.utc_now()));
  std::string id = name;
  std::error_code ignored;
  for (int number = 2; fs::exists(options_.recordings / id, ignored) || (run_ && run_->id == id);
       ++number) {
    id = fmt::format("{}-{}", name, number);
  }
  return id;
}

Result<RunRecord> JobServer::Begin(Plan plan) {
  if (plan.folder.empty()) {
    TRY(MakeRoomForRun(options_.recordings, options_.utc_now(), plan.job));
  }
  if (const std::string holder = WhoHasThePrinter(); !holder.empty()) {
    const std::lock_guard lock(mutex_);
    if (!process_) return Fail("the printer is taken: " + holder, ErrorKind::kMachine);
  }
  std::jthread last;  // joined when the lock is free again: its last words need it
  const std::lock_guard lock(mutex_);
  if (process_) {
    return Fail(fmt::format("already at work on {}: one job at a time", run_->id),
                ErrorKind::kMachine);
  }
  if (ending_ || printer_ == nullptr) {
    return Fail(ending_ ? "trammel serve is ending" : "the printer is not connected yet",
                ErrorKind::kMachine);
  }
  last = std::move(worker_);
  RunRecord run;
  run.id = NewRunId(plan.job);
  run.job = plan.job;
  run.arguments = plan.arguments;
  run.looks = plan.kind->looks && !plan.applies;
  run.started = options_.utc_now();
  if (plan.folder.empty()) plan.folder = (options_.recordings / run.id).string();
  run.folder = plan.folder;
  hold_ = options_.in_use->Use(plan.folder);
  if (hold_ == nullptr) return Fail("that recording is being deleted", ErrorKind::kMachine);
  run_ = run;
  ++begun_;
  process_ = std::make_shared<JobProcess>();
  Keep();
  worker_ = std::jthread([this, run, plan = std::move(plan), process = process_] {
    const auto bug = NoteBug([&] { RunJob(run, plan, *process); });
    if (!bug) return;
    const std::string words = "this is a bug in trammel: " + *bug;
    (void)NoteBug([&] {
      RunRecord failed = run;
      failed.end = RunEnd::kFailed;
      failed.message = words;
      EndRun(std::move(failed), {}, {words, procedure::Buttons::kClose});
    });
  });
  return run;
}

void JobServer::RunJob(const RunRecord& run, const Plan& plan, JobProcess& process) {
  SendRunEvent(run);
  // The calling macro waits for a message, and reports if there is none.
  Announce({plan.applies ? "applying" : "at work"});
  std::vector<std::string> words = {options_.program, "--progress", "json"};
  const std::vector<std::string> own = plan.undoes ? plan.kind->undo
                                       : plan.applies
                                           ? plan.kind->apply(plan.folder, plan.arguments)
                                           : plan.kind->command;
  words.insert(words.end(), own.begin(), own.end());
  const std::vector<std::string> places = OptionText(options_.place);
  words.insert(words.end(), places.begin(), places.end());
  if (!plan.applies) {
    if (plan.kind->looks) AddOption("camera", options_.place.camera, words);
    if (!plan.arguments.contains("material")) {
      AddOption("material", options_.place.material, words);
    }
    for (const auto& [name, value] : plan.arguments) {
      const bool is_setting = name == kTemperatureArgument && !value.empty();
      AddOption(is_setting ? "set" : name,
                is_setting ? fmt::format("{}={}", kTemperatureSetting, value) : value, words);
    }
    AddOption("out", plan.folder, words);
  }
  const auto before = plan.applies ? NotedOf(plan.folder) : std::vector<files::Application>();
  const JobEnd end = process.Run(
      words, [this](const procedure::Progress& progress) { OnProgress(progress); }, options_.log);
  if (end.killed) BringBackWhatItLeft();
  Conclude(plan, end, before);
}

std::vector<files::Application> JobServer::NotedOf(const std::string& folder) const {
  const auto outcome = files::ReadOutcome(fs::path(folder) / files::kResultFile);
  if (!outcome) return {};
  const std::string result = files::Fingerprint(*outcome);
  auto noted = files::AllApplications(options_.state_folder / files::kAppliedFile);
  return noted ? std::move((*noted)[result]) : std::vector<files::Application>();
}

void JobServer::OnProgress(const procedure::Progress& progress) {
  RunRecord run;
  {
    const std::lock_guard lock(mutex_);
    if (!progress.phase.empty() && run_->phase != "stopping") {
      run_->phase = progress.phase;
      run_->progress.reset();
    }
    if (progress.done) run_->progress = progress.done;
    run_->remaining_s = progress.remaining_s;
    run_->message =
        progress.text.substr(std::min(progress.text.find_first_not_of(' '), progress.text.size()));
    run = *run_;
  }
  SendRunEvent(run);
  Announce({progress.remaining_s
                ? fmt::format("{}, about {:.0f} s", progress.text, *progress.remaining_s)
                : progress.text});
}

// A job killed, for example, for lack of memory relies on the printer's own limits for heaters and
// laser.
void JobServer::BringBackWhatItLeft() {
  machine::Printer* const printer = PrinterInUse();
  if (printer == nullptr || !options_.bring_back) return;
  options_.bring_back(*printer, [this](const std::string& text) { Announce({text}); });
}

void JobServer::Conclude(const Plan& plan, const JobEnd& end,
                         const std::vector<files::Application>& before) {
  constexpr int kGood = 0;
  constexpr int kNotTrusted = 2;  // CONVENTIONS.md
  for (const std::string& error : end.errors) {
    if (&error != &end.errors.back()) Announce({error});  // the last one ends the run's own message
  }
  RunRecord run;
  {
    const std::lock_guard lock(mutex_);
    run = *run_;
  }
  run.message.clear();
  const bool measured = end.exit_code == kGood || end.exit_code == kNotTrusted;
  if (measured && !plan.applies && plan.kind->answer) {
    return ConcludeResult(plan, run, end);
  }
  const bool is_set = plan.applies && WasSet(before, NotedOf(plan.folder));
  Announcement words;
  std::optional<Proposal> proposal;
  if (end.exit_code == kGood && !plan.applies) {
    run.end = RunEnd::kDone;
    run.message = plan.kind->done;
    const auto offer = plan.kind->check(options_.place, plan.arguments, nullptr);
    words = {run.message, plan.kind->done_buttons, {}, offer ? offer->start : Arguments()};
  } else if (end.exit_code == kGood) {
    run.end = RunEnd::kDone;
    for (const std::string& line : end.output) {
      if (!words.text.empty()) Announce(std::move(words));
      words = {WithoutColumns(line)};
      run.message += (run.message.empty() ? "" : "; ") + words.text;
    }
  } else {
    run.end = end.stopped ? RunEnd::kStopped : RunEnd::kFailed;
    run.message =
        end.errors.empty() ? fmt::format("exit code {}", end.exit_code) : end.errors.back();
    words.text = (is_set         ? "applied in part: "
                  : plan.undoes  ? "not set back: "
                  : plan.applies ? "not applied: "
                                 : "no calibration: ") +
                 run.message;
    if (is_set) run.message = words.text;
    if (plan.applies && !plan.undoes && end.killed && !is_set) {
      const std::string now = InForce(*plan.kind);
      run.message += fmt::format("; whether it was applied is not known{}{}: TRAMMEL_APPLY sets it",
                                 now.empty() ? "" : ", in force is ", now);
      words.text = run.message;
    }
    for (const std::string& error : end.errors) {
      if (&error != &end.errors.back()) run.message += "; " + error;
    }
  }
  if (!plan.applies && !words.buttons) words.buttons = procedure::Buttons::kClose;
  {
    const std::lock_guard lock(mutex_);
    // A value in force needs no further decision.
    const bool decided = plan.applies && !plan.undoes && run.end == RunEnd::kDone && proposal_ &&
                         proposal_->folder == plan.folder;
    if (!decided) proposal = proposal_;
  }
  EndRun(std::move(run), std::move(proposal), std::move(words));
}

void JobServer::ConcludeResult(const Plan& plan, RunRecord run, const JobEnd& end) {
  const auto answer = plan.kind->answer(plan.folder);
  run.end = answer ? RunEnd::kDone : RunEnd::kFailed;
  run.message = answer               ? answer->words
                : end.errors.empty() ? answer.error().message
                                     : end.errors.back();
  if (answer) run.verdict = ToString(answer->verdict);
  ShowPicture(run);
  if (answer) {
    for (const std::string& line : answer->lines) Announce({line});
  }
  if (!answer || answer->verdict != Verdict::kGood || !answer->why_not_set.empty()) {
    Announcement words{run.message, procedure::Buttons::kClose};
    if (answer && !answer->why_not_set.empty()) words.text += ". " + answer->why_not_set;
    return EndRun(std::move(run), {}, std::move(words));
  }
  const Proposal proposal{run.id, plan.job, plan.folder, plan.arguments};
  EndRun(std::move(run), proposal, ProposalText({proposal, plan.kind, *answer}));
}

std::string JobServer::InForce(const JobKind& kind) const {
  if (!kind.in_force) return {};
  const std::lock_guard lock(mutex_);
  return printer_ != nullptr ? kind.in_force(printer_->LastState()) : std::string();
}

JobServer::Announcement JobServer::ProposalText(const Waiting& waiting) const {
  const auto& [proposal, kind, answer] = waiting;
  const std::string now = InForce(*kind);
  const std::string notice = answer.notice.empty() ? "" : ". " + answer.notice;
  // The console names the macro, the dialog has buttons. The part that may be cut is last.
  return {fmt::format("{}{}{}. Nothing applied: TRAMMEL_APPLY sets it{}", answer.words,
                      now.empty() ? "" : ", now ", now, notice),
          procedure::Buttons::kUse,
          fmt::format("{}.{} {}?{}", answer.words,
                      now.empty() ? "" : fmt::format(" In force now: {}.", now),
                      kind->use ? kind->use(options_.place, proposal.arguments) : "Use it",
                      answer.notice.empty() ? "" : " " + answer.notice)};
}

void JobServer::EndRun(RunRecord run, std::optional<Proposal> proposal, Announcement words) {
  run.phase = "ended";
  run.ended = options_.utc_now();
  run.progress.reset();
  run.remaining_s.reset();
  {
    const std::lock_guard lock(mutex_);
    run_ = run;
    proposal_ = std::move(proposal);
    process_.reset();
    hold_.reset();
    Keep();
  }
  SendRunEvent(run);
  Announce(std::move(words));
  malloc_trim(0);  // the service waits for days with what a run needed for a moment
}

Result<JobServer::Plan> JobServer::PlanApply() const {
  const std::lock_guard lock(mutex_);
  if (!proposal_) {
    return Fail("nothing to apply: there is no good answer yet, calibrate first",
                ErrorKind::kMeasurement);
  }
  const JobKind* const kind = FindJob(proposal_->job);
  if (kind == nullptr || !kind->apply) {
    return Fail(fmt::format("nothing to apply: {} has nothing that can be set", proposal_->job));
  }
  return Plan{kApply, proposal_->arguments, proposal_->folder, kind, true};
}

bool JobServer::Dismiss() {
  const std::lock_guard lock(mutex_);
  const bool had = proposal_.has_value();
  proposal_.reset();
  if (had) Keep();
  return had;
}

Result<std::string> JobServer::NoteNewNozzle() {
  {
    const std::lock_guard lock(mutex_);
    if (process_) {
      return Fail(fmt::format("at work on {}: change the nozzle when it has ended", run_->id),
                  ErrorKind::kMachine);
    }
  }
  std::error_code ignored;
  fs::create_directories(options_.recordings, ignored);  // before the first calibration
  TRY(files::NoteNozzleChange(options_.recordings, options_.utc_now(), subject()));
  return fmt::format("nozzle change noted{}. Calibrate each filament anew",
                     Dismiss() ? ", and the answer that waited is dropped" : "");
}

void JobServer::Keep() const {
  if (on_event_) on_event_("changed", json::object());
  if (auto kept = WriteKeptState(state_path_, {run_, proposal_}); !kept) {
    options_.log("trammel: not kept over a restart of the service: " + kept.error().message);
    // The old file is outdated: an answer that was applied or dropped since, or of the old nozzle.
    // It can be removed even on a full disk.
    std::error_code ignored;
    fs::remove(state_path_, ignored);
  }
}

void JobServer::ShowPicture(const RunRecord& run) {
  constexpr double kPatience_s = 30;
  const fs::path file = fs::path(run.folder) / kAnswerPicture;
  std::error_code ignored;
  if (!fs::exists(file, ignored)) return;  // an answer may have nothing to show
  machine::Printer* const printer = PrinterInUse();
  if (printer == nullptr) return;
  const auto png = files::ReadWholeFile(file, kMaxPictureBytes);
  const auto stored =
      png ? StorePicture(*printer, run.id, *png, {kPatience_s}) : tl::unexpected(png.error());
  options_.log(stored ? fmt::format("  picture: config/{}/{}.png", kPictureFolder, run.id)
                      : "trammel: no picture beside the configuration: " + stored.error().message);
}

void JobServer::SendRunEvent(const RunRecord& run) {
  const std::lock_guard lock(mutex_);
  if (printer_ != nullptr) printer_->SendEvent("run", JsonOf(run));
  if (on_event_) on_event_("run", JsonOf(run));
}

void JobServer::OnEvent(EventCallback callback) {
  const std::lock_guard lock(mutex_);
  on_event_ = std::move(callback);
}

}  // namespace trammel::service
