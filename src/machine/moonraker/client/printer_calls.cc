// Blocking calls of MoonrakerPrinter: scripts, states, webcams.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "base/check.h"
#include "machine/moonraker/client/moonraker_printer.h"
#include "machine/moonraker/webcam_list.h"
#include "machine/net/host_clock.h"

namespace trammel::machine {

using nlohmann::json;

namespace {

constexpr double kErrorAnswer_s = 2;  // an error answer follows its `!!` within milliseconds
constexpr std::size_t kQuoted = 80;

std::string Quoted(std::string_view script) {
  const std::string_view first = script.substr(0, std::min(script.find('\n'), kQuoted));
  const auto lines = std::count(script.begin(), script.end(), '\n');
  return lines > 0 ? fmt::format("'{}' (and {} more lines)", first, lines)
                   : fmt::format("'{}'", first);
}

}  // namespace

Error MoonrakerPrinter::WaitError(std::string_view what, const WaitLimit& limit) const {
  if (limit.stop.stop_requested()) {
    return {ErrorKind::kInterrupted, fmt::format("stopped while waiting for {}", what)};
  }
  return {ErrorKind::kMachine, fmt::format("waited {:.4g} s in vain for {}{}", limit.time_limit_s,
                                           what, moonraker_.LastMessages())};
}

tl::unexpected<Error> MoonrakerPrinter::ScriptError(const std::string& text) const {
  return Fail(text + moonraker_.LastMessages(), ErrorKind::kMachine);
}

Result<void> MoonrakerPrinter::Run(std::string_view script, const WaitLimit& limit) {
  moonraker_.CheckMayWait();
  std::shared_ptr<Script> running;
  {
    const std::lock_guard lock(mutex_);
    running = std::make_shared<Script>(
        Script{ScriptWatch(std::string(script), macros_), std::nullopt, "", false});
    scripts_.push_back(running);
  }
  const double began_s = HostNow();
  moonraker_.CallLater("printer.gcode.script", {{"script", script}},
                       [this, running](const RpcAnswer& answer) {
                         const std::lock_guard lock(mutex_);
                         running->answer = answer;
                         abandoned_scripts_ -= running->abandoned ? 1 : 0;
                         ++updates_;
                         changed_.notify_all();
                       });
  Result<void> result = AwaitScript(running, limit);
  if (result) {
    // Inside Moonraker a complaint takes another path than the answer, which may overtake it; one
    // more request and answer lets it catch up.
    const Result<json> fence = moonraker_.Call("server.info", nullptr, Rest(limit, began_s));
    result = fence ? JudgeScript(running) : tl::unexpected(fence.error());
  }
  const std::lock_guard lock(mutex_);
  std::erase(scripts_, running);
  return result;
}

Result<void> MoonrakerPrinter::AwaitScript(const std::shared_ptr<Script>& script,
                                           const WaitLimit& limit) {
  std::unique_lock lock(mutex_);
  const auto settled = [&script] { return script->answer || !script->broke.empty(); };
  const double began_s = HostNow();
  WaitFor(lock, limit, [&] { return settled() || script->watch.complained(); });
  if (!settled() && script->watch.complained()) {
    WaitLimit grace = Rest(limit, began_s);
    grace.time_limit_s = std::min(grace.time_limit_s, kErrorAnswer_s);
    WaitFor(lock, grace, settled);
  }
  if (script->answer && script->broke.empty()) {
    lock.unlock();
    return JudgeScript(script);
  }
  if (!script->answer) {
    script->abandoned = true;
    ++abandoned_scripts_;
  }
  const std::string broke = script->broke;
  const std::string verdict = script->watch.Verdict();
  lock.unlock();
  const std::string name = Quoted(script->watch.script());
  if (!broke.empty()) {
    return ScriptError(
        fmt::format("the script {} was cut off: {}; find the cause, then "
                    "FIRMWARE_RESTART and home again",
                    name, broke));
  }
  constexpr std::string_view kStillRuns =
      "it is still running on the printer: wait for it, or stop it with an emergency stop";
  if (!verdict.empty()) return ScriptError(fmt::format("{}, and {}", verdict, kStillRuns));
  if (limit.stop.stop_requested()) {
    // The restoration of the printer waits for the script: no reason for an emergency stop.
    return Fail(fmt::format("stopped while the printer ran {}, which it runs to its end", name),
                ErrorKind::kInterrupted);
  }
  return ScriptError(
      fmt::format("the printer did not finish {} within {} s (printer.gcode.script "
                  "has no answer); {}",
                  name, limit.time_limit_s, kStillRuns));
}

Result<void> MoonrakerPrinter::JudgeScript(const std::shared_ptr<Script>& script) {
  std::string verdict;
  {
    const std::lock_guard lock(mutex_);
    const RpcAnswer& answer = *script->answer;
    const bool refused = answer.kind == RpcAnswer::Kind::kError && answer.code == 400;
    if (answer.kind != RpcAnswer::Kind::kResult && !refused) {
      const std::string why = moonraker_.ToError("printer.gcode.script", answer).message;
      return Fail(fmt::format("the script {} failed{}: {}", Quoted(script->watch.script()),
                              answer.kind == RpcAnswer::Kind::kLost
                                  ? ", and what the printer has taken of it goes on running"
                                  : "",
                              why),
                  ErrorKind::kMachine);
    }
    if (refused) script->watch.OnResponse("!! " + answer.message);
    verdict = script->watch.Verdict();
    if (verdict.empty() && !script->broke.empty()) {
      verdict = fmt::format("the script {} was cut off: {}", Quoted(script->watch.script()),
                            script->broke);
    }
  }
  return verdict.empty() ? Result<void>() : ScriptError(verdict);
}

Result<void> MoonrakerPrinter::FinishMoves(const WaitLimit& limit) { return Run("M400", limit); }

Result<void> MoonrakerPrinter::EmergencyStop(const WaitLimit& limit) {
  const double began_s = HostNow();
  TRY(moonraker_.Call("printer.emergency_stop", nullptr, limit));
  std::unique_lock lock(mutex_);
  if (!WaitFor(lock, Rest(limit, began_s),
               [this] { return readiness_ != PrinterReadiness::kReady; })) {
    return tl::unexpected(WaitError("the printer to say that it is shut down", limit));
  }
  return {};
}

Result<void> MoonrakerPrinter::WaitUntilReady(const WaitLimit& limit) {
  moonraker_.CheckMayWait();
  std::unique_lock lock(mutex_);
  if (!WaitFor(lock, limit,
               [this] { return readiness_ == PrinterReadiness::kReady && restarts_ > 0; })) {
    return tl::unexpected(
        WaitError(fmt::format("the printer to be ready (it is '{}': {})", ToString(readiness_),
                              FirstLine(readiness_message_)),
                  limit));
  }
  return {};
}

Result<PrinterState> MoonrakerPrinter::WaitUntil(
    const std::function<bool(const PrinterState&)>& done, std::string_view what,
    const WaitLimit& limit) {
  const double began_s = HostNow();
  // The known state may be older than the caller's last command.
  TRY(Refresh(limit));
  std::unique_lock lock(mutex_);
  for (;;) {
    // Counted together with the state, so that no update is missed between check and wait.
    const std::uint64_t seen = updates_;
    if (auto fault = StatusFault()) return tl::unexpected(*std::move(fault));
    PrinterState state = StateLocked();
    lock.unlock();
    if (done(state)) return state;
    if (state.readiness != PrinterReadiness::kReady) {
      const bool away = state.readiness == PrinterReadiness::kDisconnected;
      return Fail(fmt::format("the printer is '{}' ({}) while waiting for {}; {}{}",
                              ToString(state.readiness), FirstLine(state.message), what,
                              away ? "begin again when Moonraker and Klipper are back"
                                   : "find the cause, then FIRMWARE_RESTART",
                              moonraker_.LastMessages()),
                  ErrorKind::kMachine);
    }
    const WaitLimit rest = Rest(limit, began_s);
    lock.lock();
    const bool changed = WaitFor(lock, rest, [this, seen] { return updates_ != seen; });
    if (!changed || rest.time_limit_s <= 0.001) return tl::unexpected(WaitError(what, limit));
  }
}

Result<std::vector<Webcam>> MoonrakerPrinter::Webcams(const WaitLimit& limit) {
  return ReadWebcams(TRY(moonraker_.Call("server.webcams.list", nullptr, limit)),
                     moonraker_.address());
}

Result<json> MoonrakerPrinter::CallServer(const std::string& method, json params,
                                          const WaitLimit& limit) {
  return moonraker_.Call(method, std::move(params), limit);
}

Result<void> MoonrakerPrinter::RegisterRemoteMethod(const std::string& name,
                                                    std::function<void(const json&)> callback,
                                                    const WaitLimit& limit) {
  {
    const std::lock_guard lock(mutex_);
    TRAMMEL_CHECK(!remote_methods_.contains(name), "remote method '{}' is registered twice", name);
    remote_methods_[name] = std::move(callback);
  }
  Result<void> registered = moonraker_.RegisterRemoteMethod(name, limit);
  if (!registered) {
    const std::lock_guard lock(mutex_);
    remote_methods_.erase(name);
  }
  return registered;
}

void MoonrakerPrinter::OnRequest(RequestHandler callback) {
  const std::lock_guard lock(mutex_);
  on_request_ = std::move(callback);
}

RpcAnswer MoonrakerPrinter::AnswerRequest(const std::string& method, const json& params) {
  RequestHandler handler;
  {
    const std::lock_guard lock(mutex_);
    handler = on_request_;
  }
  return handler ? handler(method, params) : RpcAnswer::UnknownMethod(method);
}

void MoonrakerPrinter::SendEvent(const std::string& event, json data) {
  moonraker_.SendEvent(event, std::move(data));
}

}  // namespace trammel::machine
