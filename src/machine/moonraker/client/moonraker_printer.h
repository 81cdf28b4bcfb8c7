// Printer behind Moonraker (Klipper's web server).
#pragma once

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "base/result.h"
#include "machine/moonraker/client/klippy_streams.h"
#include "machine/moonraker/client/moonraker.h"
#include "machine/moonraker/client/move_log.h"
#include "machine/moonraker/client/print_clock.h"
#include "machine/moonraker/client/script_watch.h"
#include "machine/moonraker/link/address.h"
#include "machine/moonraker/printer.h"
#include "machine/net/host_clock.h"

namespace trammel::machine {

/// True if this may be a time on one of the printer's clocks, which start with its host or its
/// firmware.
[[nodiscard]] inline bool IsTime(double time_s) { return time_s >= -1e3 && time_s <= 1e10; }

class MoonrakerPrinter : public Printer {
 public:
  MoonrakerPrinter(MoonrakerAddress address, MoonrakerOptions options);
  MoonrakerPrinter(const MoonrakerPrinter&) = delete;
  MoonrakerPrinter& operator=(const MoonrakerPrinter&) = delete;
  ~MoonrakerPrinter() override;

  [[nodiscard]] Result<void> Start(const WaitLimit& limit) { return moonraker_.Start(limit); }

  Result<void> Run(std::string_view script, const WaitLimit& limit) override;
  Result<void> FinishMoves(const WaitLimit& limit) override;
  Result<void> EmergencyStop(const WaitLimit& limit) override;
  Result<PrinterState> State(const WaitLimit& limit) override;
  PrinterState LastState() const override;
  Result<PrinterState> WaitUntil(const std::function<bool(const PrinterState&)>& done,
                                 std::string_view what, const WaitLimit& limit) override;
  Result<void> WaitUntilReady(const WaitLimit& limit) override;
  Result<nlohmann::json> Query(const std::vector<ObjectFields>& objects,
                               const WaitLimit& limit) override;
  Result<bool> HasCommand(std::string_view name, const WaitLimit& limit) override;
  Result<void> Upload(const std::string& name, std::string_view gcode,
                      const WaitLimit& limit) override;
  Result<void> UploadConfig(const std::string& name, std::string_view data,
                            const WaitLimit& limit) override;
  Result<std::string> DownloadConfig(const std::string& name, std::size_t max_bytes,
                                     const WaitLimit& limit) override;
  Result<void> DeleteFile(const std::string& name, const WaitLimit& limit) override;
  Result<void> StartPrint(const std::string& name, const WaitLimit& limit) override;
  Result<void> CancelPrint(const WaitLimit& limit) override;
  Result<std::vector<Webcam>> Webcams(const WaitLimit& limit) override;
  Result<nlohmann::json> CallServer(const std::string& method, nlohmann::json params,
                                    const WaitLimit& limit) override;
  Result<void> RegisterRemoteMethod(const std::string& name,
                                    std::function<void(const nlohmann::json&)> callback,
                                    const WaitLimit& limit) override;
  void OnRequest(RequestHandler callback) override;
  void SendEvent(const std::string& event, nlohmann::json data) override;
  Result<ClockRelation> Clock(double wanted_uncertainty_s, const WaitLimit& limit) override;
  Result<void> RecordMoves(const WaitLimit& limit) override;
  std::vector<TrapezoidMove> ReportedMoves(double from_print_time_s,
                                           double to_print_time_s) override;
  Result<std::vector<TrapezoidMove>> Moves(double from_print_time_s, double to_print_time_s,
                                           const WaitLimit& limit) override;

 private:
  /// Server for file transfers, and our options for it.
  struct WebServer {
    MoonrakerAddress address;
    MoonrakerOptions options;
  };
  /// Errors: the connection is a Unix socket, and no address is set beside it.
  Result<WebServer> WebPlace(const WaitLimit& limit);
  /// Uploads into one of the server's file roots.
  Result<void> Store(std::string_view root, const std::string& name, std::string_view data,
                     const WaitLimit& limit);
  /// Script that was sent and not yet answered.
  struct Script {
    ScriptWatch watch;
    std::optional<RpcAnswer> answer;
    std::string broke;  ///< why the printer is no longer "ready"
    bool abandoned = false;
  };

  // Called on the connection's thread:
  void OnUsable(std::function<void()> done);
  void Subscribe(const std::vector<std::string>& objects, std::function<void()> done);
  void OnNotification(const std::string& method, const nlohmann::json& params, double received_s);
  [[nodiscard]] RpcAnswer AnswerRequest(const std::string& method, const nlohmann::json& params);
  void OnResponse(const std::string& response);
  void OnStatus(const nlohmann::json& params, double received_s);
  void OnReadiness(PrinterReadiness readiness, const std::string& message);
  void SampleClockBeforeNextUpdate();
  void AskForMoves();
  /// Streams moves over a separate connection to Klipper, if the server has a route to it.
  [[nodiscard]] Result<void> StreamMoves(const WaitLimit& limit);
  // REQUIRE the lock:
  /// True if the head moved and no batch reported it: the moves must be requested.
  [[nodiscard]] bool MovesAreMissing();
  void TakeMoves(const nlohmann::json& batch);
  /// Resets the reception for a new link or Klipper.
  /// @param moves_ended  the print time is new, too: clears the moves
  void BeginSubscription(bool moves_ended);

  /// Waits until `ready` is true (called with the lock) or the limit; returns `ready`.
  template <class Predicate>
  bool WaitFor(std::unique_lock<std::mutex>& lock, const WaitLimit& limit, Predicate ready) const {
    return changed_.wait_for(lock, limit.stop, std::chrono::duration<double>(limit.time_limit_s),
                             ready);
  }
  /// Returns the remainder of a limit.
  static WaitLimit Rest(const WaitLimit& limit, double since_s) {
    return {std::max(0.001, limit.time_limit_s - (HostNow() - since_s)), limit.stop};
  }
  [[nodiscard]] PrinterState StateLocked() const;
  /// Returns why the printer's last report is implausible. REQUIRES the lock.
  [[nodiscard]] std::optional<Error> StatusFault() const;
  /// Queries all subscribed objects, or pings if there are none.
  [[nodiscard]] Result<void> Refresh(const WaitLimit& limit);
  void AddClockSample(std::optional<double> sent_s, double received_s, const nlohmann::json& status,
                      double eventtime_s);
  /// Waits for the script's end; the error tells if it still runs.
  [[nodiscard]] Result<void> AwaitScript(const std::shared_ptr<Script>& script,
                                         const WaitLimit& limit);
  /// Evaluates the answer and the messages. REQUIRES an answer.
  [[nodiscard]] Result<void> JudgeScript(const std::shared_ptr<Script>& script);
  [[nodiscard]] tl::unexpected<Error> ScriptError(const std::string& text) const;
  [[nodiscard]] Error WaitError(std::string_view what, const WaitLimit& limit) const;

  const MoonrakerOptions options_;

  mutable std::mutex mutex_;
  mutable std::condition_variable_any changed_;
  nlohmann::json status_ = nlohmann::json::object();
  nlohmann::json wanted_ = nlohmann::json::object();
  double eventtime_s_ = 0;
  std::uint64_t updates_ = 0;  ///< counts everything that LastState depends on
  int restarts_ = 0;           ///< counts the times that the firmware became usable
  PrinterReadiness readiness_ = PrinterReadiness::kDisconnected;
  std::string readiness_message_;
  std::optional<std::set<std::string>> macros_;
  std::vector<std::shared_ptr<Script>> scripts_;
  int abandoned_scripts_ = 0;
  std::map<std::string, std::function<void(const nlohmann::json&)>> remote_methods_;
  RequestHandler on_request_;
  PrintClock clock_;
  /// Unrequested moves, since the link or Klipper began.
  struct Subscription {
    bool asked = false;
    bool heard = false;
    std::uint64_t batches = 0;
    std::optional<double> moving_since_s;  ///< eventtime
  };
  MoveLog moves_;
  Subscription hearing_;
  bool recording_moves_ = false;
  std::string moves_method_;  ///< the remote method that brings moves
  int status_updates_ = 0;
  std::size_t clock_queries_ = 0;
  bool clock_query_out_ = false;  ///< one is on its way

  Moonraker moonraker_;  // its thread uses all the rest
  /// Declared last, since its thread uses all other members. Absent if moves come through
  /// Moonraker, whose thread reads it under the mutex.
  std::shared_ptr<KlippyStreams> move_stream_;
};

/// Connects, identifies, subscribes and stays connected: reconnects with growing pauses (0.5 … 10
/// s), and subscribes again after each restart of the firmware.
/// Succeeds when the server accepts us, even if the firmware is not ready (see LastState and
/// WaitUntilReady). Fails with kInput for an invalid address or option, and with kMachine, each
/// with its own remedy, for: name not found, refused, no answer, not a Moonraker, TLS, not
/// authorised.
[[nodiscard]] Result<std::unique_ptr<Printer>> ConnectToMoonraker(const MoonrakerOptions& options,
                                                                  const WaitLimit& limit);

}  // namespace trammel::machine
