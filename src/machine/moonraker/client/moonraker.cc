#include "machine/moonraker/client/moonraker.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <chrono>

#include "base/bounded_json.h"
#include "base/check.h"
#include "machine/moonraker/client/status.h"
#include "machine/net/host_clock.h"
#include "machine/net/json_field.h"

namespace trammel::machine {

using nlohmann::json;

namespace {

constexpr double kFirstPause_s = 0.5;
constexpr double kLongestPause_s = 10;
constexpr double kReadyPoll_s = 1;  // startup → error comes without a notification
constexpr double kRegisterAgain_s = 2;
constexpr int kMaxAgents = 9;
constexpr std::string_view kTaken = "already registered";
constexpr std::size_t kNone = std::string::npos;

}  // namespace

Moonraker::Moonraker(MoonrakerAddress address, const MoonrakerOptions& options,
                     MoonrakerHooks hooks)
    : options_(options),
      hooks_(std::move(hooks)),
      connection_(std::move(address), options,
                  {.on_open = [this] { OnOpen(); },
                   .on_message = [this](std::string_view text) { OnMessage(text); },
                   .on_down = [this](const Error& error) { OnDown(error); }}) {}

Result<void> Moonraker::Start(const WaitLimit& limit) {
  CheckMayWait();
  connection_.Connect();
  std::unique_lock lock(mutex_);
  const bool ended =
      changed_.wait_for(lock, limit.stop, std::chrono::duration<double>(limit.time_limit_s),
                        [this] { return started_; });
  if (!ended && limit.stop.stop_requested()) {
    return Fail("stopped while connecting to " + address().WebSocketUrl(), ErrorKind::kInterrupted);
  }
  if (!ended) {
    return Fail(fmt::format("no connection to {} within {} s{}", address().WebSocketUrl(),
                            limit.time_limit_s, LastMessages()),
                ErrorKind::kMachine);
  }
  if (start_error_) return tl::unexpected(*start_error_);
  return {};
}

void Moonraker::FinishStart(std::optional<Error> error) {
  const std::lock_guard lock(mutex_);
  if (!started_) {
    started_ = true;
    start_error_ = std::move(error);
    changed_.notify_all();
  }
}

void Moonraker::OnOpen() {
  const std::uint64_t link = ++link_number_;
  RunAfter(options_.connect_time_limit_s, [this, link] {
    if (link == link_number_ && !link_up_) {
      connection_.Drop(
          {ErrorKind::kMachine,
           fmt::format("{} took the connection but did not answer "
                       "server.connection.identify and server.info within {} s; is "
                       "it a Moonraker?{}",
                       address().WebSocketUrl(), options_.connect_time_limit_s, LastMessages())});
    }
  });
  const std::string name = agent_number_ == 1
                               ? options_.client_name
                               : fmt::format("{}-{}", options_.client_name, agent_number_);
  json params = {{"client_name", name},
                 {"version", options_.client_version},
                 {"type", "agent"},
                 {"url", "http://localhost"}};
  if (!options_.api_key.empty()) params["api_key"] = options_.api_key;
  CallLater("server.connection.identify", std::move(params),
            [this](const RpcAnswer& answer) { OnIdentified(answer); });
}

void Moonraker::OnIdentified(const RpcAnswer& answer) {
  if (answer.kind == RpcAnswer::Kind::kLost || answer.kind == RpcAnswer::Kind::kNotSent) return;
  if (answer.kind == RpcAnswer::Kind::kError) {
    // One agent per name: it belongs to another trammel, or to our own lost link that the server
    // still holds. The rejected connection counts as identified, so the next name needs a new one.
    if (options_.other_names && answer.message.find(kTaken) != kNone &&
        agent_number_ < kMaxAgents) {
      ++agent_number_;
      calls_.Lose("the connection had to be made anew");
      connection_.Connect();
      return;
    }
    connection_.Drop(ToError("server.connection.identify", answer));
    return;
  }
  std::vector<std::string> methods;
  {
    const std::lock_guard lock(mutex_);
    methods = remote_methods_;
  }
  for (const std::string& method : methods) RegisterAgain(method);
  AskServerInfo([this](const RpcAnswer& info) {
    if (info.kind == RpcAnswer::Kind::kError) {
      connection_.Drop(ToError("server.info", info));
    } else if (info.kind == RpcAnswer::Kind::kResult) {
      link_up_ = true;
      pause_s_ = 0;
      agent_number_ = 1;
      TakeServerInfo(info.result);
    }
  });
}

void Moonraker::RegisterAgain(const std::string& method) {
  CallLater("connection.register_remote_method", {{"method_name", method}},
            [this, method, link = link_number_](const RpcAnswer& answer) {
              // The server may still hold the lost link, which has the name.
              if (answer.kind == RpcAnswer::Kind::kError && answer.message.find(kTaken) != kNone) {
                RunAfter(kRegisterAgain_s, [this, method, link] {
                  if (link == link_number_) RegisterAgain(method);
                });
              }
            });
}

void Moonraker::AskServerInfo(std::function<void(const RpcAnswer&)> done) {
  CallLater("server.info", nullptr, std::move(done));
}

void Moonraker::TakeServerInfo(const json& info) {
  const std::string state = TextOr(info, "klippy_state", "disconnected");
  const bool connected = BoolOr(info, "klippy_connected", false);
  const PrinterReadiness readiness =
      connected ? ReadinessOf(state) : PrinterReadiness::kDisconnected;
  const bool was_usable =
      readiness_ != PrinterReadiness::kDisconnected && readiness_ != PrinterReadiness::kStartup;
  const bool usable =
      readiness != PrinterReadiness::kDisconnected && readiness != PrinterReadiness::kStartup;
  SetReadiness(readiness, readiness == readiness_ ? readiness_message_ : "");
  if (usable && !was_usable) {
    BecomeUsable([this] { FinishStart(std::nullopt); });
  } else if (!usable) {
    FinishStart(std::nullopt);
  }
  PollUntilReady();
}

void Moonraker::BecomeUsable(std::function<void()> done) {
  hooks_.on_usable([this, done = std::move(done)] {
    if (readiness_ == PrinterReadiness::kReady) {
      done();
      return;
    }
    // The user first needs the reason why it is not ready.
    CallLater("printer.info", nullptr, [this, done](const RpcAnswer& answer) {
      if (answer.kind == RpcAnswer::Kind::kResult) {
        SetReadiness(readiness_, TextOr(answer.result, "state_message", readiness_message_));
      }
      done();
    });
  });
}

void Moonraker::PollUntilReady() {
  if (polling_ || readiness_ == PrinterReadiness::kReady) return;
  polling_ = true;
  RunAfter(kReadyPoll_s, [this] {
    polling_ = false;
    if (link_up_ && readiness_ != PrinterReadiness::kReady) {
      AskServerInfo([this](const RpcAnswer& info) {
        if (info.kind == RpcAnswer::Kind::kResult) {
          TakeServerInfo(info.result);
          found_ready_ = found_ready_ || readiness_ == PrinterReadiness::kReady;
        } else {
          PollUntilReady();
        }
      });
    }
  });
}

void Moonraker::SetReadiness(PrinterReadiness readiness, const std::string& message) {
  if (readiness != readiness_ || message != readiness_message_) {
    readiness_ = readiness;
    readiness_message_ = message;
    hooks_.on_readiness(readiness, message);
  }
}

void Moonraker::OnDown(const Error& error) {
  ++link_number_;
  link_up_ = false;
  found_ready_ = false;
  calls_.Lose(error.message);
  SetReadiness(PrinterReadiness::kDisconnected, error.message);
  bool first = false;
  {
    const std::lock_guard lock(mutex_);
    first = !started_;
  }
  if (first) {
    FinishStart(error);
    return;
  }
  pause_s_ = std::clamp(2 * pause_s_, kFirstPause_s, kLongestPause_s);
  RunAfter(pause_s_, [this, link = link_number_] {
    if (link == link_number_) connection_.Connect();
  });
}

namespace {

// Replaces escapes of half a surrogate pair by U+FFFD. The server's Python emits them for bytes of
// a file name that are no UTF-8, in every list and message with that file.
std::string WithoutHalfPairs(std::string_view text) {
  constexpr std::size_t kEscape = 6;  // \uXXXX
  const auto code_at = [&](std::size_t at) {
    unsigned code = 0;
    if (text.substr(at, 2) != "\\u" || at + kEscape > text.size()) return code;
    const char* const end = text.data() + at + kEscape;
    return std::from_chars(end - 4, end, code, 16).ptr == end ? code : 0U;
  };
  const auto is_first = [](unsigned code) { return code >= 0xD800 && code <= 0xDBFF; };
  const auto is_second = [](unsigned code) { return code >= 0xDC00 && code <= 0xDFFF; };
  std::string whole;
  for (std::size_t at = 0; at < text.size();) {
    const unsigned code = code_at(at);
    std::size_t length = text[at] != '\\' ? 1 : code != 0 ? kEscape : 2;
    if (is_first(code) && is_second(code_at(at + kEscape))) length = 2 * kEscape;
    const bool half = length == kEscape && (is_first(code) || is_second(code));
    whole += half ? "\\ufffd" : text.substr(at, length);
    at += length;
  }
  return whole;
}

}  // namespace

void Moonraker::OnMessage(std::string_view text) {
  const double received_s = HostNow();
  Result<json> parsed = ParseBoundedJson(text, "the message");
  if (!parsed && text.find("\\ud") != std::string_view::npos) {
    parsed = ParseBoundedJson(WithoutHalfPairs(text), "the message");
  }
  if (!parsed || !parsed->is_object()) {
    connection_.Drop(
        {ErrorKind::kMachine,
         fmt::format("{} sent something that is not JSON-RPC ({}); is it a Moonraker?{}",
                     address().WebSocketUrl(),
                     parsed ? "the message is no object" : parsed.error().message,
                     LastMessages())});
    return;
  }
  const json& message = *parsed;
  if (const auto method = message.find("method"); method != message.end() && method->is_string()) {
    const auto& name = method->get_ref<const std::string&>();
    message.contains("id") ? OnRequest(name, message, received_s)
                           : OnNotification(name, message, received_s);
  } else {
    calls_.TakeAnswer(*std::move(parsed), received_s);
  }
}

void Moonraker::OnRequest(const std::string& method, const json& message, double received_s) {
  // A request of another agent or a front end, through the server, which sets no time limit.
  const json& id = message["id"];
  const RpcAnswer said = AnswerTo(method, message, received_s);
  json answer = {{"jsonrpc", "2.0"}, {"id", id.is_structured() ? json() : id}};
  if (said.kind == RpcAnswer::Kind::kResult) {
    answer["result"] = said.result;
  } else {
    answer["error"] = {{"code", said.code}, {"message", said.message}};
  }
  // Ignores a failure: the caller continues to wait, and there is no other recipient.
  (void)connection_.Send(answer.dump(-1, ' ', false, json::error_handler_t::replace));
}

// A called method must not be mistaken for the server's own notifications.
RpcAnswer Moonraker::AnswerTo(const std::string& method, const json& message, double received_s) {
  bool ours = false;
  {
    const std::lock_guard lock(mutex_);
    ours =
        std::find(remote_methods_.begin(), remote_methods_.end(), method) != remote_methods_.end();
  }
  if (ours) {
    OnNotification(method, message, received_s);
    return {.result = "ok"};
  }
  if (!hooks_.on_request) return RpcAnswer::UnknownMethod(method);
  return hooks_.on_request(method, message.value("params", json::object()));
}

void Moonraker::OnNotification(const std::string& method, const json& message, double received_s) {
  static const json kNone;
  const auto found = message.find("params");
  const json& params = found == message.end() ? kNone : *found;
  if (method == "notify_klippy_ready") {
    SetReadiness(PrinterReadiness::kReady, "");
    // If polling found it ready first, this session of Klipper already has all subscriptions.
    if (!std::exchange(found_ready_, false)) BecomeUsable([this] { FinishStart(std::nullopt); });
  } else if (method == "notify_klippy_shutdown") {
    SetReadiness(PrinterReadiness::kShutdown,
                 readiness_ == PrinterReadiness::kShutdown ? readiness_message_ : "");
    PollUntilReady();
  } else if (method == "notify_klippy_disconnected") {
    found_ready_ = false;
    SetReadiness(PrinterReadiness::kDisconnected,
                 "Moonraker lost its connection to Klipper (it restarts, or it ended)");
    PollUntilReady();
  } else if (method == "notify_status_update" && params.is_array() && !params.empty()) {
    const json& webhooks = ObjectOr(params.front(), "webhooks");
    if (webhooks.contains("state")) {
      SetReadiness(ReadinessOf(TextOr(webhooks, "state", "")),
                   TextOr(webhooks, "state_message", ""));
      PollUntilReady();
    }
  }
  hooks_.on_notification(method, params, received_s);
}

void Moonraker::CallLater(const std::string& method, json params,
                          std::function<void(RpcAnswer)> done) {
  RpcCalls::Message message = calls_.Begin(method, std::move(params), std::move(done));
  const Result<void> sent = connection_.Send(std::move(message.text));
  if (!sent) calls_.NotSent(message.id, sent.error().message);
}

Result<json> Moonraker::Call(const std::string& method, json params, const WaitLimit& limit,
                             std::function<void(const RpcAnswer&)> on_answer) {
  CheckMayWait();
  struct Slot {
    std::mutex mutex;
    std::condition_variable_any changed;
    std::optional<RpcAnswer> answer;
  };
  const auto slot = std::make_shared<Slot>();
  CallLater(method, std::move(params), [slot, on_answer = std::move(on_answer)](RpcAnswer answer) {
    if (on_answer) on_answer(answer);
    const std::lock_guard lock(slot->mutex);
    slot->answer = std::move(answer);
    slot->changed.notify_all();
  });
  std::unique_lock lock(slot->mutex);
  if (!slot->changed.wait_for(lock, limit.stop, std::chrono::duration<double>(limit.time_limit_s),
                              [&slot] { return slot->answer.has_value(); })) {
    if (limit.stop.stop_requested()) {
      return Fail("stopped while waiting for the answer to " + method, ErrorKind::kInterrupted);
    }
    return Fail(fmt::format("no answer to {} from {} within {} s; the printer's computer may be "
                            "overloaded or the network slow{}",
                            method, address().WebSocketUrl(), limit.time_limit_s, LastMessages()),
                ErrorKind::kMachine);
  }
  if (slot->answer->kind != RpcAnswer::Kind::kResult) {
    return tl::unexpected(ToError(method, *slot->answer));
  }
  return std::move(slot->answer->result);
}

Result<void> Moonraker::RegisterRemoteMethod(const std::string& name, const WaitLimit& limit) {
  TRY(Call("connection.register_remote_method", {{"method_name", name}}, limit));
  const std::lock_guard lock(mutex_);
  remote_methods_.push_back(name);
  return {};
}

void Moonraker::SendEvent(const std::string& event, json data) {
  CallLater("connection.send_event", {{"event", event}, {"data", std::move(data)}},
            [](const RpcAnswer&) {});  // nobody waits for it
}

void Moonraker::RunAfter(double delay_s, std::function<void()> function) {
  connection_.RunAfter(delay_s, std::move(function));
}

void Moonraker::CheckMayWait() const {
  TRAMMEL_CHECK(!connection_.OnOwnThread(), "a callback of {} waits for the connection it runs on",
                address().WebSocketUrl());
}

namespace {

constexpr std::size_t kMessagesInErrors = 6;
constexpr int kNotFound = -32601;
constexpr int kInvalidParameters = -32602;  // Moonraker's "Unauthorized" too
constexpr int kUnavailable = 503;

bool IsUnauthorized(const RpcAnswer& answer) {
  return answer.code == 401 || (answer.code == kInvalidParameters &&
                                (answer.message.find("nauthorized") != std::string::npos ||
                                 answer.message.find("API Key") != std::string::npos));
}

}  // namespace

Error Moonraker::ToError(const std::string& method, const RpcAnswer& answer) const {
  const std::string who = address().WebSocketUrl();
  std::string text;
  if (answer.kind == RpcAnswer::Kind::kLost) {
    text = fmt::format("{} was not answered: {}", method, answer.message);
  } else if (answer.kind == RpcAnswer::Kind::kNotSent) {
    text = fmt::format("{} was not sent: {}", method, answer.message);
  } else if (IsUnauthorized(answer)) {
    text = fmt::format(
        "{} does not let us in ({}): {}; Mainsail and Fluidd show the API key in their settings; "
        "or add this computer to trusted_clients in moonraker.conf",
        who, answer.message,
        options_.api_key.empty() ? "it wants an API key" : "the API key is wrong");
  } else if (answer.code == kNotFound && method.starts_with("printer.") &&
             readiness_ == PrinterReadiness::kDisconnected) {
    // Moonraker learns the printer's methods only from a Klipper that has connected once.
    text = fmt::format(
        "{} failed: Klipper has not come to {} since that was started; start Klipper, or look at "
        "klippy.log",
        method, who);
  } else if (answer.code == kNotFound) {
    text =
        fmt::format("{} does not know the call {} ({}); update Moonraker, or is it something else?",
                    who, method, answer.message);
  } else if (answer.code == kUnavailable) {
    text = fmt::format(
        "{} failed: {}; Klipper is not running or restarts: look at its log, then FIRMWARE_RESTART",
        method, answer.message);
  } else {
    text = fmt::format("{} failed: {} (code {})", method, answer.message, answer.code);
  }
  return {ErrorKind::kMachine, text + LastMessages()};
}

std::string Moonraker::LastMessages() const {
  if (!options_.quote_messages) return "";
  const std::string excerpt = log().Excerpt(kMessagesInErrors);
  return excerpt.empty() ? "" : "\n  the last messages (> ours, < the printer's):" + excerpt;
}

}  // namespace trammel::machine
