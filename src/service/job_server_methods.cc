// Answers of a server to requests.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "base/url_secrets.h"
#include "files/new_file.h"
#include "measurement/history.h"
#include "measurement/outcome_file.h"
#include "service/job_server.h"
#include "service/printer_setup.h"
#include "session/session.h"

namespace trammel::service {
namespace {

namespace fs = std::filesystem;
using machine::RpcAnswer;
using nlohmann::json;

constexpr std::size_t kMaxText = 200;
constexpr std::int64_t kMaxHistory = 1000;

RpcAnswer Ok(json result) { return {.result = std::move(result)}; }

RpcAnswer Invalid(const std::string& message) {
  return RpcAnswer::Refused(kInvalidParameters, message);
}

RpcAnswer Begun(const Result<RunRecord>& run) {
  if (run) return Ok({{"run", run->id}});
  const bool busy = run.error().kind == ErrorKind::kMachine;
  return RpcAnswer::Refused(busy ? kBusy : kRefused, run.error().message);
}

// Rejects parameters with a key unknown to the method.
std::optional<RpcAnswer> CheckKeys(const json& params, std::initializer_list<const char*> known) {
  if (!params.is_object()) return Invalid("the arguments must be an object");
  for (const auto& [key, value] : params.items()) {
    if (std::find(known.begin(), known.end(), key) == known.end()) {
      return Invalid(fmt::format("there is no argument '{}'", key.substr(0, kMaxText)));
    }
  }
  return std::nullopt;
}

// Returns a text among the parameters, empty if absent. Error: it has another type, or is too long.
Result<std::string> TextOf(const json& params, const char* key) {
  const auto found = params.find(key);
  if (found == params.end() || found->is_null()) return std::string();
  if (!found->is_string() || found->get_ref<const std::string&>().size() > kMaxText) {
    return Fail(fmt::format("'{}' must be a text of at most {} bytes", key, kMaxText));
  }
  return found->get<std::string>();
}

// Returns a run's id among the parameters, empty if absent.
Result<std::string> RunOf(const json& params) {
  auto id = TextOf(params, "run");
  if (id && !id->empty() && !IsRunId(*id)) return Fail("'run' is no run's name");
  return id;
}

Result<Arguments> ArgumentsOf(const json& params, const JobKind& kind) {
  Arguments arguments;
  const auto found = params.find("arguments");
  if (found == params.end() || found->is_null()) return arguments;
  if (!found->is_object()) return Fail("'arguments' must be an object");
  for (const auto& [key, value] : found->items()) {
    if (std::find(kind.arguments.begin(), kind.arguments.end(), key) == kind.arguments.end()) {
      return Fail(fmt::format("{} takes no '{}'", kind.name, key.substr(0, kMaxText)));
    }
    auto text = TRY(TextOf(*found, key.c_str()));
    if (text.find('\0') != std::string::npos) return Fail(fmt::format("'{}' holds a zero", key));
    if (!text.empty()) arguments[key] = std::move(text);
  }
  return arguments;
}

Result<files::HistoryQuery> QueryOf(const json& params) {
  files::HistoryQuery query;
  if (const auto last = params.find("last"); last != params.end()) {
    const bool good = last->is_number_integer() && last->get<std::int64_t>() >= 1 &&
                      last->get<std::int64_t>() <= kMaxHistory;
    if (!good) {
      return Fail(fmt::format("'last' must be a whole number, 1 ... {}", kMaxHistory));
    }
    query.last = last->get<std::size_t>();
  }
  const auto instrument = TRY(TextOf(params, "instrument"));
  if (!instrument.empty()) {
    query.instrument = measurement::InstrumentNamed(instrument);
    if (!query.instrument) return Fail(fmt::format("there is no instrument '{}'", instrument));
  }
  for (const auto& [key, text] : {std::pair{"filament", &query.subject.filament},
                                  std::pair{"nozzle", &query.subject.nozzle}}) {
    *text = TRY(TextOf(params, key));
  }
  return query;
}

json JsonOf(const files::HistoryEntry& entry) {
  json result = files::JsonOf(entry.outcome);
  result["folder"] = entry.folder;
  result["applied"] = json::array();
  for (const files::Application& applied : entry.applied) {
    result["applied"].push_back(json(files::JsonOf(applied)));
  }
  return result;
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
  return Begun(Begin(std::move(plan)));
}

RpcAnswer JobServer::Use(Proposal proposal) {
  const auto waiting = FindWaiting(proposal);
  if (!waiting) return RpcAnswer::Refused(kNothing, "there is no good answer that could be used");
  if (!waiting->answer.why_not_set.empty()) {
    return RpcAnswer::Refused(kRefused, waiting->answer.why_not_set);
  }
  Plan plan{kApply, proposal.arguments, proposal.folder, waiting->kind, true};
  plan.proposal = std::move(proposal);
  return Begun(Begin(std::move(plan)));
}

RpcAnswer JobServer::EmergencyStop() {
  constexpr double kPatience_s = 10;
  if (stopping_.exchange(true)) {
    return RpcAnswer::Refused(kBusy, "an emergency stop is being sent already");
  }
  const std::shared_ptr<void> done(nullptr, [this](void*) { stopping_ = false; });
  const std::shared_lock use(using_printer_);
  machine::Printer* printer = nullptr;
  {
    const std::lock_guard lock(mutex_);
    printer = printer_;
  }
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
  machine::Printer* printer = nullptr;
  {
    const std::lock_guard lock(mutex_);
    printer = printer_;
  }
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

RpcAnswer JobServer::HistoryAsked(const json& params) const {
  const auto query = QueryOf(params);
  if (!query) return Invalid(query.error().message);
  json results = json::array();
  std::error_code ignored;
  if (!fs::exists(options_.recordings, ignored)) {
    return Ok({{"results", std::move(results)}});  // nothing was measured yet
  }
  auto history = ReadHistoryByPrinter(options_.recordings, *query);
  if (history) {
    const auto added =
        files::AddApplications(options_.state_folder / files::kAppliedFile, *history);
    if (!added) history = tl::unexpected(added.error());
  }
  if (!history) return RpcAnswer::Refused(kRefused, history.error().message);
  for (const files::HistoryEntry& entry : history->entries) results.push_back(JsonOf(entry));
  return Ok({{"results", std::move(results)}});
}

}  // namespace trammel::service
