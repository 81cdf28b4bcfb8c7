// A conversation with Moonraker: JSON-RPC calls, notifications, who we are, staying connected.
// Knows readiness; what a printer's objects mean is MoonrakerPrinter's.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "machine/moonraker/link/connection.h"
#include "machine/moonraker/link/rpc.h"
#include "machine/moonraker/printer.h"
#include "machine/net/wait.h"

namespace trammel::machine {

/// All called on the connection's own thread, without a lock held.
struct MoonrakerHooks {
  /// The printer's objects can be asked for now, and no subscription is alive: after connecting,
  /// reconnecting and each restart of the firmware. Call `done` once subscribed.
  std::function<void(std::function<void()> done)> on_usable;
  std::function<void(const std::string& method, const nlohmann::json& params, double received_s)>
      on_notification;
  /// Also when the link is lost (kDisconnected). The message is the firmware's or the link's.
  std::function<void(PrinterReadiness readiness, const std::string& message)> on_readiness;
  /// Requests of other clients that are no remote method's; empty: all are unknown (−32601).
  RequestHandler on_request = {};
};

class Moonraker {
 public:
  Moonraker(MoonrakerAddress address, const MoonrakerOptions& options, MoonrakerHooks hooks);
  ~Moonraker() = default;
  Moonraker(const Moonraker&) = delete;
  Moonraker& operator=(const Moonraker&) = delete;

  /// Connects, identifies, and waits for the first on_usable's `done` where the firmware can be
  /// asked. Once only; from then on lost links are taken up again by themselves.
  [[nodiscard]] Result<void> Start(const WaitLimit& limit);

  /// One call. `params` null: none. Fails with kMachine and names the method. `on_answer` comes
  /// first, on the connection's thread and before anything that was received after the answer;
  /// also where the wait ended without it.
  [[nodiscard]] Result<nlohmann::json> Call(const std::string& method, nlohmann::json params,
                                            const WaitLimit& limit,
                                            std::function<void(const RpcAnswer&)> on_answer = {});
  /// The same without waiting; `done` comes on the connection's thread, or at once where the call
  /// could not be sent.
  void CallLater(const std::string& method, nlohmann::json params,
                 std::function<void(RpcAnswer)> done);
  /// The error that an answer amounts to, in words.
  [[nodiscard]] Error ToError(const std::string& method, const RpcAnswer& answer) const;

  /// Registers now and again after each reconnect. Calls of it come as notifications; a caller
  /// that waits for an answer gets "ok" once on_notification returned.
  [[nodiscard]] Result<void> RegisterRemoteMethod(const std::string& name, const WaitLimit& limit);

  /// Tells all other clients of the server, as an agent's event; where the link is down, nobody.
  /// @param event  its name; not "connected" nor "disconnected", which are the server's.
  void SendEvent(const std::string& event, nlohmann::json data);

  void RunAfter(double delay_s, std::function<void()> function);
  /// Throws Bug on the connection's own thread, where waiting would wait for itself.
  void CheckMayWait() const;

  [[nodiscard]] const MessageLog& log() const { return connection_.log(); }
  [[nodiscard]] const MoonrakerAddress& address() const { return connection_.address(); }
  /// The conversation's end as the end of an error message.
  [[nodiscard]] std::string LastMessages() const;

 private:
  void OnOpen();
  void OnIdentified(const RpcAnswer& answer);
  void OnDown(const Error& error);
  void OnMessage(std::string_view text);
  void OnRequest(const std::string& method, const nlohmann::json& message, double received_s);
  [[nodiscard]] RpcAnswer AnswerTo(const std::string& method, const nlohmann::json& message,
                                   double received_s);
  void OnNotification(const std::string& method, const nlohmann::json& message, double received_s);
  void RegisterAgain(const std::string& method);
  void AskServerInfo(std::function<void(const RpcAnswer&)> done);
  void TakeServerInfo(const nlohmann::json& info);
  void SetReadiness(PrinterReadiness readiness, const std::string& message);
  void BecomeUsable(std::function<void()> done);
  void PollUntilReady();
  void FinishStart(std::optional<Error> error);

  const MoonrakerOptions options_;
  const MoonrakerHooks hooks_;

  // Touched on the connection's thread only.
  PrinterReadiness readiness_ = PrinterReadiness::kDisconnected;
  std::string readiness_message_;
  int agent_number_ = 1;
  double pause_s_ = 0;
  std::uint64_t link_number_ = 0;
  bool polling_ = false;
  bool found_ready_ = false;  ///< by asking, and the notification of it is still to come
  bool link_up_ = false;

  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  bool started_ = false;  ///< the first attempt ended, well or with start_error_
  std::optional<Error> start_error_;
  std::vector<std::string> remote_methods_;

  RpcCalls calls_;

  MoonrakerConnection connection_;  // last: its thread uses all the rest
};

}  // namespace trammel::machine
