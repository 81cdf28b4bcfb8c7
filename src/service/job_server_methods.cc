// Answers of a server to requests about its jobs and its printer.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "base/url_secrets.h"
#include "files/new_file.h"
#include "machine/moonraker/printer_facts.h"
#include "machine/net/json_field.h"
#include "measurement/outcome_file.h"
#include "service/job_server.h"
#include "service/printer_setup.h"
#include "service/request_params.h"
#include "session/session.h"
#include "session/uploads.h"

namespace trammel::service {
namespace {

namespace fs = std::filesystem;
using machine::RpcAnswer;
using nlohmann::json;

Result<Arguments> ArgumentsOf(const json& params, const JobKind& kind) {
  Arguments arguments;
  const auto found = params.find("arguments");
  if (found == params.end() || found->is_null()) return arguments;
  if (!found->is_object()) return Fail("'arguments' must be an object");
  for (const auto& [key, value] : found->items()) {
    if (std::find(kind.arguments.begin(), kind.arguments.end(), key) == kind.arguments.end()) {
      return Fail(fmt::format("{} takes no '{}'", kind.name, key.substr(0, kMaxArgument)));
    }
    auto text = TRY(TextOf(*found, key.c_str()));
    if (!text.empty()) arguments[key] = std::move(text);
  }
  return arguments;
}

}  // namespace

RpcAnswer JobServer::Answer(const std::string& method, const json& params) {
  const auto with = [&params](std::initializer_list<const char*> known, const auto& answer) {
    const auto wrong = CheckKeys(params, known);
    return wrong ? *wrong : answer();
  };
  if (method == "status") return with({}, [&] { return Status(); });
  if (method == "start") return with({"job", "arguments"}, [&] { return StartAsked(params); });
  if (method == "stop") return with({"run"}, [&] { return StopAsked(params); });
  if (method == "result") return with({"run"}, [&] { return ResultAsked(params); });
  if (method == "history") {
    return with({"last", "instrument", "filament", "nozzle"}, [&] { return HistoryAsked(params); });
  }
  if (method == "compare") {
    return with({"before", "after"}, [&] { return CompareAsked(params); });
  }
  if (method == "due") return with({}, [&] { return DueAsked(); });
  if (method == "annotate") {
    return with({"run", "note", "pinned"}, [&] { return AnnotateAsked(params); });
  }
  if (method == "delete") return with({"run"}, [&] { return DeleteAsked(params); });
  if (method == "use") return with({"run", "filament"}, [&] { return UseAsked(params); });
  if (method == "undo") return with({"instrument", "run"}, [&] { return UndoAsked(params); });
  if (method == "taps") return with({"last"}, [&] { return TapsAsked(params); });
  if (method == "tap") return with({"tap"}, [&] { return TapAsked(params); });
  if (method == "dismiss") return with({}, [&] { return Ok({{"dismissed", Dismiss()}}); });
  if (method == "new_nozzle") return with({}, [&] { return NewNozzleAsked(); });
  return RpcAnswer::UnknownMethod(method);
}

json JobServer::PrinterNow() const {
  json printer = {{"address", WithoutSecrets(options_.address)},
                  {"readiness", "disconnected"},
                  {"message", ""}};
  const std::lock_guard lock(mutex_);
  if (printer_ != nullptr) {
    const machine::PrinterState state = printer_->LastState();
    printer["readiness"] = machine::ToString(state.readiness);
    printer["message"] = state.message;
  }
  return printer;
}

json JobServer::ProposalNow() const {
  const auto waiting = FindWaiting();
  if (!waiting) return nullptr;
  return {{"run", waiting->proposal.run},
          {"job", waiting->proposal.job},
          {"folder", waiting->proposal.folder},
          {"arguments", waiting->proposal.arguments},
          {"answer", waiting->answer.words}};
}

std::string JobServer::BlockerOf(const JobKind& kind) const {
  {
    const std::lock_guard lock(mutex_);
    if (process_) return fmt::format("at work on {}", run_->id);
    if (printer_ == nullptr) return "the printer is not connected";
    const machine::PrinterState state = printer_->LastState();
    if (state.readiness != machine::PrinterReadiness::kReady) {
      return fmt::format("the printer is \"{}\"", machine::ToString(state.readiness));
    }
    if (std::string job = procedure::OthersJob(state, {}); !job.empty()) return job;
  }
  const auto offer = kind.check(options_.place, {}, nullptr);
  return offer ? "" : offer.error().message;
}

RpcAnswer JobServer::Status() const {
  json jobs = json::array();
  for (const JobKind& kind : options_.jobs) {
    const std::string blocker = BlockerOf(kind);
    jobs.push_back({{"job", kind.name},
                    {"arguments", kind.arguments},
                    {"blocker", blocker.empty() ? json() : json(blocker)}});
  }
  json run, in_force;
  bool busy = false;
  {
    const std::lock_guard lock(mutex_);
    if (run_) run = service::JsonOf(*run_);
    busy = process_ != nullptr;
  }
  for (const JobKind& kind : options_.jobs) {
    if (const std::string now = InForce(kind); !now.empty()) in_force = now;
  }
  return Ok({{"api_version", kApiVersion},
             {"version", options_.version},
             {"printer", PrinterNow()},
             {"jobs", std::move(jobs)},
             {"busy", busy},
             {"run", std::move(run)},
             {"proposal", ProposalNow()},
             {"in_force", std::move(in_force)}});
}

RpcAnswer JobServer::StartAsked(const json& params) {
  const auto job = TextOf(params, "job");
  if (!job) return Invalid(job.error().message);
  Plan plan{*job, {}};
  if (*job == kApply) {
    auto apply = PlanApply();
    if (!apply) return RpcAnswer::Refused(kNothing, apply.error().message);
    const json* const given = machine::Member(params, "arguments");
    const auto run = given != nullptr ? RunOf(*given) : Result<std::string>();
    if (!run) return Invalid(run.error().message);
    if (!run->empty() && *run != fs::path(apply->folder).filename()) {
      return RpcAnswer::Refused(kNothing, fmt::format("the answer of {} waits no more", *run));
    }
    plan = std::move(*apply);
  } else {
    plan.kind = FindJob(*job);
    if (plan.kind == nullptr) {
      std::string known;
      for (const JobKind& kind : options_.jobs) known += kind.name + ", ";
      return Invalid(fmt::format("there is no job '{}'; there are: {}{}", *job, known, kApply));
    }
    auto arguments = ArgumentsOf(params, *plan.kind);
    if (!arguments) return Invalid(arguments.error().message);
    plan.arguments = std::move(*arguments);
    const auto offer = plan.kind->check(options_.place, plan.arguments, nullptr);
    if (!offer) return RpcAnswer::Refused(kRefused, offer.error().message);
    plan.arguments = Completed(std::move(plan.arguments), *offer);
  }
  return BeginAsRequested(std::move(plan));
}

RpcAnswer JobServer::BeginAsRequested(Plan plan) {
  const auto run = Begin(std::move(plan));
  if (run) return Ok({{"run", run->id}});
  const bool busy = run.error().kind == ErrorKind::kMachine;
  return RpcAnswer::Refused(busy ? kBusy : kRefused, run.error().message);
}

machine::Printer* JobServer::PrinterInUse() const {
  const std::lock_guard lock(mutex_);
  return printer_;
}

RpcAnswer JobServer::EmergencyStop() {
  constexpr double kPatience_s = 10;
  if (stopping_.exchange(true)) {
    return RpcAnswer::Refused(kBusy, "an emergency stop is being sent already");
  }
  const std::shared_ptr<void> done(nullptr, [this](void*) { stopping_ = false; });
  const std::shared_lock use(using_printer_);
  machine::Printer* const printer = PrinterInUse();
  if (printer == nullptr) return RpcAnswer::Refused(kRefused, "the printer is not connected");
  const auto stopped = printer->EmergencyStop({kPatience_s});
  return stopped ? Ok(json::object()) : RpcAnswer::Refused(kRefused, stopped.error().message);
}

// Returns why the firmware may not be restarted now; empty: it may.
std::string JobServer::RestartBlocker(const machine::PrinterState& state) const {
  {
    const std::lock_guard lock(mutex_);
    if (process_) return fmt::format("at work on {}", run_->id);
  }
  if (std::string job = procedure::OthersJob(state, {}); !job.empty()) return job;
  for (const auto& [name, heater] : state.heaters) {
    if (heater.target_c > 0)
      return fmt::format("{} is on, and a restart would switch it off", name);
  }
  return {};
}

RpcAnswer JobServer::SetUp(const std::string& method, const std::stop_token& stop) {
  constexpr double kPatience_s = 10;
  const std::shared_lock use(using_printer_);
  machine::Printer* const printer = PrinterInUse();
  if (printer == nullptr) return RpcAnswer::Refused(kRefused, "the printer is not connected");
  const fs::path note =
      options_.state_folder /
      fmt::format("setup-{}", state_path_.stem().string());  // by the address, as the state
  const auto refused = [](const Error& error) {
    return RpcAnswer::Refused(kRefused, error.message);
  };
  const auto blocker = [&] { return RestartBlocker(printer->LastState()); };
  if (method != "setup") {
    if (const std::string why = blocker(); !why.empty()) return RpcAnswer::Refused(kBusy, why);
    const auto lock = files::FileLock::Take(lock_path_, "trammel serve sets up the printer");
    if (!lock) return RpcAnswer::Refused(kBusy, lock.error().message);
    const auto done = method == "set_up" ? SetUpPrinter(*printer, note, blocker, stop)
                                         : UndoSetUp(*printer, note, blocker, stop);
    if (!done) return refused(done.error());
  }
  const auto setup = LookAtSetup(*printer, note, {kPatience_s, stop});
  return setup ? Ok(service::JsonOf(*setup)) : refused(setup.error());
}

RpcAnswer JobServer::OfferAsked(const json& params) {
  if (const auto wrong = CheckKeys(params, {"job", "arguments"})) return *wrong;
  const auto job = TextOf(params, "job");
  const JobKind* const kind = job ? FindJob(*job) : nullptr;
  if (kind == nullptr) return Invalid("there is no such job");
  const auto arguments = ArgumentsOf(params, *kind);
  if (!arguments) return Invalid(arguments.error().message);
  const std::shared_lock use(using_printer_);
  const auto offer = kind->check(options_.place, *arguments, PrinterInUse());
  if (!offer) return RpcAnswer::Refused(kRefused, offer.error().message);
  return Ok({{"question", offer->question}});
}

Result<std::string> JobServer::StoreScan(const std::string& ending, std::string_view bytes,
                                         const std::stop_token& stop) {
  constexpr double kPatience_s = 120;  // 64 MB over a slow network
  constexpr std::size_t kDay = std::string_view("2026-01-02").size();
  const std::shared_lock use(using_printer_);
  machine::Printer* const printer = PrinterInUse();
  if (printer == nullptr) return Fail("the printer is not connected", ErrorKind::kMachine);
  const std::string utc = options_.utc_now();
  const std::lock_guard one_at_a_time(storing_);
  if (std::exchange(stored_day_, utc.substr(0, kDay)) != utc.substr(0, kDay)) stored_ = 0;
  if (++stored_ > kMaxScansADay) {
    return Fail(
        fmt::format("{} scans were stored on the printer today: go on tomorrow", kMaxScansADay),
        ErrorKind::kMeasurement);
  }
  // No dash: that would be the name of a result's picture.
  const std::string name = fmt::format("scan_{}_{}{}", CompactUtc(utc), stored_, ending);
  TRY(printer->UploadConfig(fmt::format("{}/{}", procedure::kUploadFolder, name), bytes,
                            {kPatience_s, stop}));
  return name;
}

std::string JobServer::Nozzle(const machine::WaitLimit& limit) {
  const std::shared_lock use(using_printer_);
  machine::Printer* const printer = PrinterInUse();
  if (printer == nullptr) return {};
  const machine::PrinterState state = printer->LastState();
  if (state.readiness != machine::PrinterReadiness::kReady) return {};
  const auto status = printer->Query({{"configfile", {"settings"}}}, limit);
  const auto nozzle_mm =
      status ? machine::FactsOf(*status, state).nozzle_diameter_mm : std::optional<double>();
  return nozzle_mm ? fmt::format("{:.2f}", *nozzle_mm) : std::string();
}

RpcAnswer JobServer::StopAsked(const json& params) {
  const auto id = RunOf(params);
  if (!id) return Invalid(id.error().message);
  RunRecord run;
  {
    const std::lock_guard lock(mutex_);
    if (!process_) return RpcAnswer::Refused(kNothing, "nothing is at work");
    if (!id->empty() && *id != run_->id) {
      return RpcAnswer::Refused(kNothing, fmt::format("{} is not at work", *id));
    }
    process_->Stop();
    run_->phase = "stopping";
    run_->progress.reset();
    run = *run_;
  }
  SendRunEvent(run);
  return Ok({{"run", run.id}});
}

RpcAnswer JobServer::NewNozzleAsked() {
  auto noted = NoteNewNozzle();
  if (!noted) {
    const bool busy = noted.error().kind == ErrorKind::kMachine;
    return RpcAnswer::Refused(busy ? kBusy : kRefused, noted.error().message);
  }
  return Ok({{"message", std::move(*noted)}});
}

RpcAnswer JobServer::ResultAsked(const json& params) const {
  const auto asked = RunOf(params);
  if (!asked) return Invalid(asked.error().message);
  std::string id = *asked;
  std::string folder = (options_.recordings / id).string();
  json run;
  {
    const std::lock_guard lock(mutex_);
    if (run_ && (id.empty() || id == run_->id)) {
      id = run_->id;
      folder = run_->folder;
      run = service::JsonOf(*run_);
    }
  }
  if (id.empty()) return RpcAnswer::Refused(kNothing, "there was no run yet");
  const auto outcome = files::ReadOutcome(fs::path(folder) / files::kResultFile);
  if (!outcome && run.is_null()) {
    return RpcAnswer::Refused(
        kNothing, fmt::format("there is no result of {}: {}", id, outcome.error().message));
  }
  return Ok({{"run", std::move(run)},
             {"folder", folder},
             {"result", outcome ? json(files::JsonOf(*outcome)) : json()}});
}

}  // namespace trammel::service
