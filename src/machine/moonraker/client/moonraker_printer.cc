#include "machine/moonraker/client/moonraker_printer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <chrono>

#include "base/check.h"
#include "base/text.h"
#include "machine/moonraker/client/status.h"
#include "machine/net/host_clock.h"
#include "machine/net/json_field.h"

namespace trammel::machine {

using nlohmann::json;

namespace {

constexpr std::string_view kMacroPrefix = "gcode_macro ";
constexpr int kUpdatesPerQuery = 2;
constexpr double kFarAhead_s = 60;  // no move is planned so long before it is made

std::vector<std::string> ObjectNames(const json& answer) {
  std::vector<std::string> names;
  const json* list = Member(answer, "objects");
  if (list != nullptr && list->is_array()) {
    for (const json& name : *list) {
      if (name.is_string()) names.push_back(name.get<std::string>());
    }
  }
  return names;
}

/// Checks that a setting's content cannot split a header or URL.
Result<void> CheckPrintable(std::string_view what, const std::string& text) {
  const bool fine =
      std::all_of(text.begin(), text.end(), [](unsigned char c) { return c > 0x20 && c < 0x7F; });
  if (!fine) {
    return Fail(
        fmt::format("the {} has a blank or a character that is not plain ASCII; copy it "
                    "again without line breaks",
                    what));
  }
  return {};
}

Result<void> CheckOptions(const MoonrakerOptions& options) {
  for (const auto& [what, text] :
       {std::pair<std::string_view, const std::string&>("API key", options.api_key),
        {"client name", options.client_name}}) {
    TRY(CheckPrintable(what, text));
  }
  if (options.client_name.empty()) return Fail("the client name is empty; Moonraker wants one");
  if (!(options.connect_time_limit_s >= 0.1 && options.connect_time_limit_s <= 600)) {
    return Fail(
        fmt::format("connect_time_limit_s = {} is not in 0.1 … 600", options.connect_time_limit_s));
  }
  return {};
}

double EventtimeOr(const json& answer, double otherwise_s) {
  const double time_s = NumberOr(answer, "eventtime", otherwise_s);
  return IsTime(time_s) ? time_s : otherwise_s;
}

std::string NoPrinters(const std::string& fault) {
  return fmt::format(
      "the server's status is no printer's: {}; nothing is done by such figures: see klippy.log "
      "and moonraker.log there, or is the address another program's?",
      fault);
}

}  // namespace

MoonrakerPrinter::MoonrakerPrinter(MoonrakerAddress address, MoonrakerOptions options)
    : options_(options),
      moonraker_(
          std::move(address), options,
          {.on_usable = [this](std::function<void()> done) { OnUsable(std::move(done)); },
           .on_notification =
               [this](const std::string& method, const json& params, double received_s) {
                 OnNotification(method, params, received_s);
               },
           .on_readiness = [this](PrinterReadiness readiness,
                                  const std::string& message) { OnReadiness(readiness, message); },
           .on_request = [this](const std::string& method,
                                const json& params) { return AnswerRequest(method, params); }}) {}

MoonrakerPrinter::~MoonrakerPrinter() {
  std::shared_ptr<KlippyStreams> stream;
  {
    const std::lock_guard lock(mutex_);
    stream = std::move(move_stream_);
  }
  // Destroyed here, without the mutex, for which its thread may wait.
}

void MoonrakerPrinter::OnUsable(std::function<void()> done) {
  moonraker_.CallLater(
      "printer.objects.list", nullptr, [this, done = std::move(done)](const RpcAnswer& answer) {
        const std::vector<std::string> objects = ObjectNames(answer.result);
        std::set<std::string> macros;
        for (const std::string& object : objects) {
          if (object.starts_with(kMacroPrefix)) {
            macros.insert(UpperCase(std::string_view(object).substr(kMacroPrefix.size())));
          }
        }
        {
          const std::lock_guard lock(mutex_);
          macros_ = objects.empty() ? std::nullopt : std::optional(std::move(macros));
          clock_.Reset();
          BeginSubscription(/*moves_ended=*/false);
        }
        Subscribe(objects, done);
      });
}

void MoonrakerPrinter::Subscribe(const std::vector<std::string>& objects,
                                 std::function<void()> done) {
  json wanted = WantedObjects(objects);
  {
    const std::lock_guard lock(mutex_);
    wanted_ = wanted;
  }
  const double sent_s = HostNow();
  moonraker_.CallLater("printer.objects.subscribe", {{"objects", std::move(wanted)}},
                       [this, sent_s, done = std::move(done)](const RpcAnswer& answer) {
                         if (answer.kind == RpcAnswer::Kind::kResult) {
                           const json& status = ObjectOr(answer.result, "status");
                           const std::lock_guard lock(mutex_);
                           eventtime_s_ = EventtimeOr(answer.result, eventtime_s_);
                           AddClockSample(sent_s, answer.received_s, status, eventtime_s_);
                           status_ = json::object();
                           MergeStatus(status_, status, wanted_);
                           // Klipper may have restarted while the link was down.
                           const auto print_s =
                               Number(ObjectOr(status_, "toolhead"), "estimated_print_time");
                           if (print_s && moves_.Reaches(*print_s + kFarAhead_s)) moves_.Clear();
                           ++restarts_;
                           ++updates_;
                           changed_.notify_all();
                         }
                         done();
                       });
}

void MoonrakerPrinter::OnReadiness(PrinterReadiness readiness, const std::string& message) {
  const std::lock_guard lock(mutex_);
  readiness_ = readiness;
  readiness_message_ = message;
  if (readiness != PrinterReadiness::kReady) {
    for (const std::shared_ptr<Script>& script : scripts_) {
      // A script whose answer was lost with the link continues: the firmware did not abort it.
      const bool unheard = script->answer && script->answer->kind == RpcAnswer::Kind::kLost;
      if (script->broke.empty() && !unheard) {
        // Keeps only the cause; the remedy is in further lines.
        script->broke = fmt::format("the printer went to '{}'{}{}", ToString(readiness),
                                    message.empty() ? "" : ": ", FirstLine(message));
      }
    }
  }
  ++updates_;
  changed_.notify_all();
}

void MoonrakerPrinter::OnNotification(const std::string& method, const json& params,
                                      double received_s) {
  if (method == "notify_status_update") {
    OnStatus(params, received_s);
  } else if (method == "notify_gcode_response") {
    if (params.is_array() && !params.empty() && params.front().is_string()) {
      OnResponse(params.front().get_ref<const std::string&>());
    }
  } else if (method == "notify_klippy_disconnected") {
    const std::lock_guard lock(mutex_);
    BeginSubscription(/*moves_ended=*/true);
  } else {
    std::function<void(const json&)> callback;
    {
      const std::lock_guard lock(mutex_);
      if (recording_moves_ && method == moves_method_) {
        TakeMoves(params);
        changed_.notify_all();
        return;
      }
      if (const auto found = remote_methods_.find(method); found != remote_methods_.end()) {
        callback = found->second;
      }
    }
    if (callback) callback(params);
  }
}

void MoonrakerPrinter::OnResponse(const std::string& response) {
  const std::lock_guard lock(mutex_);
  for (const std::shared_ptr<Script>& script : scripts_) script->watch.OnResponse(response);
  changed_.notify_all();
}

void MoonrakerPrinter::OnStatus(const json& params, double received_s) {
  if (!params.is_array() || params.size() < 2 || !params[1].is_number()) return;
  bool query = false;
  bool missing = false;
  {
    const std::lock_guard lock(mutex_);
    MergeStatus(status_, params[0], wanted_);
    if (IsTime(params[1].get<double>())) eventtime_s_ = params[1].get<double>();
    AddClockSample(std::nullopt, received_s, params[0], eventtime_s_);
    query = ++status_updates_ % kUpdatesPerQuery == 0;
    missing = MovesAreMissing();
    ++updates_;
    changed_.notify_all();
  }
  if (query) SampleClockBeforeNextUpdate();
  if (missing) AskForMoves();
}

PrinterState MoonrakerPrinter::StateLocked() const {
  std::string fault;
  PrinterState state = ReadStatus(status_, &fault);
  if (!fault.empty()) {
    state.readiness = PrinterReadiness::kError;
    state.message = NoPrinters(fault);
    state.abandoned_scripts = abandoned_scripts_;
    return state;
  }
  state.readiness = readiness_;
  if (!readiness_message_.empty() || readiness_ == PrinterReadiness::kDisconnected) {
    state.message = readiness_message_;
  }
  state.abandoned_scripts = abandoned_scripts_;
  return state;
}

PrinterState MoonrakerPrinter::LastState() const {
  const std::lock_guard lock(mutex_);
  return StateLocked();
}

Result<void> MoonrakerPrinter::Refresh(const WaitLimit& limit) {
  json wanted;
  {
    const std::lock_guard lock(mutex_);
    const bool usable =
        readiness_ != PrinterReadiness::kDisconnected && readiness_ != PrinterReadiness::kStartup;
    wanted = usable ? wanted_ : json::object();
  }
  if (wanted.empty()) {
    TRY(moonraker_.Call("server.info", nullptr, limit));
    return {};
  }
  const double sent_s = HostNow();
  const auto take = [this, sent_s](const RpcAnswer& answer) {
    // Merged on this thread, in the order of arrival: later, it would undo newer updates, and the
    // printer sends no change twice.
    if (answer.kind != RpcAnswer::Kind::kResult) return;
    const json& status = ObjectOr(answer.result, "status");
    const std::lock_guard lock(mutex_);
    eventtime_s_ = EventtimeOr(answer.result, eventtime_s_);
    MergeStatus(status_, status, wanted_);
    AddClockSample(sent_s, answer.received_s, status, eventtime_s_);
    ++updates_;
    changed_.notify_all();
  };
  TRY(moonraker_.Call("printer.objects.query", {{"objects", std::move(wanted)}}, limit, take));
  return {};
}

Result<PrinterState> MoonrakerPrinter::State(const WaitLimit& limit) {
  TRY(Refresh(limit));
  const std::lock_guard lock(mutex_);
  if (auto fault = StatusFault()) return tl::unexpected(*std::move(fault));
  return StateLocked();
}

std::optional<Error> MoonrakerPrinter::StatusFault() const {
  std::string fault;
  (void)ReadStatus(status_, &fault);
  if (fault.empty()) return std::nullopt;
  return Error{ErrorKind::kMachine, NoPrinters(fault)};
}

Result<json> MoonrakerPrinter::Query(const std::vector<ObjectFields>& objects,
                                     const WaitLimit& limit) {
  json wanted = json::object();
  for (const ObjectFields& object : objects) {
    wanted[object.object] = object.fields.empty() ? json() : json(object.fields);
  }
  const json answer =
      TRY(moonraker_.Call("printer.objects.query", {{"objects", std::move(wanted)}}, limit));
  return ObjectOr(answer, "status");
}

Result<bool> MoonrakerPrinter::HasCommand(std::string_view name, const WaitLimit& limit) {
  const std::string wanted = UpperCase(name);
  const json status = TRY(Query({{"gcode", {"commands"}}}, limit));
  const json& commands = ObjectOr(ObjectOr(status, "gcode"), "commands");
  if (!commands.empty()) return commands.contains(wanted);
  {
    const std::lock_guard lock(mutex_);
    if (macros_ && macros_->contains(wanted)) return true;
  }
  // Older firmware lists only the commands that have a help text.
  const json help = TRY(moonraker_.Call("printer.gcode.help", nullptr, limit));
  return help.is_object() && help.contains(wanted);
}

Result<std::unique_ptr<Printer>> ConnectToMoonraker(const MoonrakerOptions& options,
                                                    const WaitLimit& limit) {
  TRY(CheckOptions(options));
  auto printer =
      std::make_unique<MoonrakerPrinter>(TRY(ParseMoonrakerAddress(options.address)), options);
  TRY(printer->Start(limit));
  return printer;
}

namespace {

constexpr double kLongestLead_s = 0.5;  // of a query, if the next update seems far off

}  // namespace

void MoonrakerPrinter::AddClockSample(std::optional<double> sent_s, double received_s,
                                      const json& status, double eventtime_s) {
  const auto print_s = Number(ObjectOr(status, "toolhead"), "estimated_print_time");
  if (print_s && IsTime(*print_s) && IsTime(eventtime_s)) {
    clock_.Add({sent_s, received_s, eventtime_s, print_s});
  }
}

void MoonrakerPrinter::SampleClockBeforeNextUpdate() {
  std::optional<double> next_s;
  double lead_s = 0;
  {
    const std::lock_guard lock(mutex_);
    next_s = clock_query_out_ ? std::nullopt : clock_.NextUpdate();
    lead_s = kQueryLeads_s[clock_queries_ % kQueryLeads_s.size()];
    clock_queries_ += next_s ? 1 : 0;
    clock_query_out_ = clock_query_out_ || next_s;
  }
  if (!next_s) return;
  moonraker_.RunAfter(std::clamp(*next_s - lead_s - HostNow(), 0.0, kLongestLead_s), [this] {
    const double sent_s = HostNow();
    moonraker_.CallLater("printer.objects.query",
                         {{"objects", {{"toolhead", {"estimated_print_time"}}}}},
                         [this, sent_s](const RpcAnswer& answer) {
                           const std::lock_guard lock(mutex_);
                           clock_query_out_ = false;
                           if (const auto eventtime_s = Number(answer.result, "eventtime")) {
                             AddClockSample(sent_s, answer.received_s,
                                            ObjectOr(answer.result, "status"), *eventtime_s);
                             changed_.notify_all();
                           }
                         });
  });
}

Result<ClockRelation> MoonrakerPrinter::Clock(double wanted_uncertainty_s, const WaitLimit& limit) {
  moonraker_.CheckMayWait();
  std::unique_lock lock(mutex_);
  std::optional<ClockRelation> relation;
  WaitFor(lock, limit, [&] {
    relation = clock_.Relation();
    return relation && relation->PrintTimeBound(HostNow()) <= wanted_uncertainty_s;
  });
  if (limit.stop.stop_requested() || !relation) {
    return tl::unexpected(WaitError("a status update that tells the print time", limit));
  }
  return *relation;
}

}  // namespace trammel::machine
