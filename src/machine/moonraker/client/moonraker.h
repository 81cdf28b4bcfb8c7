// Session with Moonraker: JSON-RPC calls, notifications, identification, reconnection. Tracks
// readiness; MoonrakerPrinter interprets a printer's objects.
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

/// All called on the connection's thread, without a lock.
struct MoonrakerHooks {
  /// Called when the printer's objects can be queried and no subscription is active: after
  /// connecting, reconnecting and each restart of the firmware. Call `done` once subscribed.
  std::function<void(std::function<void()> done)> on_usable;
  std::function<void(const std::string& method, const nlohmann::json& params, double received_s)>
      on_notification;
  /// Also called when the link is lost (kDisconnected). The message is the firmware's or the
  /// link's.
  std::function<void(PrinterReadiness readiness, const std::string& message)> on_readiness;
  /// Handles other clients' requests that are no remote method's; empty: all are unknown (−32601).
  RequestHandler on_request = {};
};

class Moonraker {
 public:
  Moonraker(MoonrakerAddress address, const MoonrakerOptions& options, MoonrakerHooks hooks);
  ~Moonraker() = default;
  Moonraker(const Moonraker&) = delete;
  Moonraker& operator=(const Moonraker&) = delete;

  /// Connects, identifies, and waits for the first on_usable's `done` if the firmware can be
  /// queried. Call once; afterwards lost links are restored automatically.
  [[nodiscard]] Result<void> Start(const WaitLimit& limit);

  /// Makes one call. `params` null: none. Fails with kMachine and names the method. Calls
  /// `on_answer` first, on the connection's thread and before anything received after the answer;
  /// also if the wait ended without it.
  [[nodiscard]] Result<nlohmann::json> Call(const std::string& method, nlohmann::json params,
                                            const WaitLimit& limit,
                                            std::function<void(const RpcAnswer&)> on_answer = {});
  /// Makes a call without waiting; `done` is called on the connection's thread, or at once if the
  /// call could not be sent.
  void CallLater(const std::string& method, nlohmann::json params,
                 std::function<void(RpcAnswer)> done);
  /// Converts an error answer to an error with a message.
  [[nodiscard]] Error ToError(const std::string& method, const RpcAnswer& answer) const;

  /// Registers a method now and after each reconnect. Its calls arrive as notifications; a caller
  /// that waits for an answer gets "ok" once on_notification returned.
  [[nodiscard]] Result<void> RegisterRemoteMethod(const std::string& name, const WaitLimit& limit);

  /// Broadcasts an agent's event to all other clients of the server; lost while the link is down.
  /// @param event  its name; not "connected" or "disconnected", which are the server's.
  void SendEvent(const std::string& event, nlohmann::json data);

  void RunAfter(double delay_s, std::function<void()> function);
  /// Throws Bug on the connection's thread, where waiting would deadlock.
  void CheckMayWait() const;

  [[nodiscard]] const MessageLog& log() const { return connection_.log(); }
  [[nodiscard]] const MoonrakerAddress& address() const { return connection_.address(); }
  /// Returns the last messages as the end of an error message.
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

  // Used on the connection's thread only.
  PrinterReadiness readiness_ = PrinterReadiness::kDisconnected;
  std::string readiness_message_;
  int agent_number_ = 1;
  double pause_s_ = 0;
  std::uint64_t link_number_ = 0;
  bool polling_ = false;
  bool found_ready_ = false;  ///< true if a query showed ready before the notification
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
