// Virtual Moonraker without its sockets: connections, requests, subscriptions, notifications.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "base/random.h"
#include "sim/camera/machine_host.h"
#include "sim/moonraker/rpc.h"
#include "sim/moonraker/spoolman.h"

namespace trammel::sim {

/// Faults of the server, beside those of the machine. Times are the machine's; off by default.
struct ServerFaults {
  std::optional<double> close_at_s;        ///< all sockets
  std::optional<int> close_at_laser_move;  ///< all sockets, at the n-th move with the laser on
  double refuse_for_s = 0;                 ///< after closing: new connections are closed at once
  std::optional<double> silent_from_s;     ///< nothing is sent any more
};

struct HubOptions {
  std::string api_key;  ///< empty: everybody is trusted
  std::uint64_t seed = 0;
  /// Returns the camera's port on 127.0.0.1, 1 … 65535, or 0 if there is none: called whenever the
  /// webcams are listed.
  std::function<int()> camera_port = [] { return 0; };
  int webcam_frames_per_s = 30;
  std::size_t max_file_bytes = 256 << 20;  ///< total of all uploads
  ServerFaults faults;
  std::shared_ptr<VirtualSpoolman> spoolman;  ///< none: Moonraker is not set up for one
};

/// Connection that carries messages to one client.
class Peer {
 public:
  virtual ~Peer() = default;
  virtual void Send(const std::string& message) = 0;
  virtual void Close() = 0;
};

/// Objects of a status request: all fields (absent), or the named ones.
using StatusRequest = std::map<std::string, std::optional<std::set<std::string>>>;

/// Not thread-safe. The peers must outlive their connections.
class Hub {
 public:
  Hub(MachineHost& machine, HubOptions options);

  /// Returns the connection's number; absent if it must be closed at once.
  [[nodiscard]] std::optional<std::uint64_t> Open(Peer& peer, bool authorised);
  /// Opens a client's separate connection to Klipper, which closes with each restart of it; absent
  /// while Klipper is down.
  [[nodiscard]] std::optional<std::uint64_t> OpenThrough(Peer& peer, bool authorised);
  void Close(std::uint64_t connection);
  /// Handles one message of a client, with any content.
  void Receive(std::uint64_t connection, std::string_view text);
  /// Handles a request over HTTP.
  void Request(const std::string& method, const Json& params, const Reply& reply);
  /// Replaces the faults so far.
  void SetFaults(const ServerFaults& faults) { options_.faults = faults; }
  [[nodiscard]] double time_s() const { return time_s_; }
  /// Advances the machine and sends notifications. Times are the host's CLOCK_MONOTONIC.
  void Tick(double monotonic_s);

  /// Drops all pending replies, before the sockets close.
  void Abandon();
  /// True if new connections are closed at once.
  [[nodiscard]] bool refuses() const { return time_s_ < refuse_until_s_; }

  [[nodiscard]] bool KeyIsRight(const std::string& key) const;
  /// Returns a token for one use within five seconds.
  [[nodiscard]] std::string MakeToken();
  [[nodiscard]] bool TakeToken(const std::string& token);
  [[nodiscard]] MachineHost& machine() { return machine_; }
  [[nodiscard]] const HubOptions& options() const { return options_; }

 private:
  struct Connection {
    Peer* peer = nullptr;
    bool authorised = false;
    bool through = false;        ///< true if linked to Klipper instead of Moonraker
    std::optional<Json> client;  ///< as identified: name, version, type, url
    std::set<std::string> remote_methods;
    StatusRequest subscription;
    Json told = Json::object();                ///< the last values of what it subscribed to
    std::map<std::int64_t, Reply> asked = {};  ///< requests to this agent, not answered yet
  };
  struct Query {
    std::uint64_t connection = 0;
    bool subscribe = false;
    StatusRequest objects;
    Reply reply;
  };
  struct Dump {
    std::string source;       ///< "toolhead", "extruder", "force" or "taps"
    std::string method;       ///< client's method
    std::uint64_t owner = 0;  ///< the connection that it ends with, or 0: Moonraker's own
    std::size_t next = 0;
  };

  void Call(std::uint64_t connection, const std::string& method, const Json& params,
            const Reply& reply);
  /// Handles a message for Klipper itself.
  void ReceiveThrough(std::uint64_t connection, const Json& request);
  /// Calls a method of Moonraker itself; false if there is none.
  bool CallServer(std::uint64_t connection, const std::string& method, const Json& params,
                  const Reply& reply);
  /// Calls a method that is forwarded to Klipper.
  bool CallPrinter(std::uint64_t connection, const std::string& method, const Json& params,
                   const Reply& reply);
  Answer Identify(Connection& connection, std::uint64_t number, const Json& params);
  Answer RegisterRemote(Connection& connection, const Json& params);
  [[nodiscard]] std::optional<std::uint64_t> AgentNumber(const std::string& name) const;
  [[nodiscard]] Json Agents() const;
  Answer SendAgentEvent(const Connection& connection, std::uint64_t number, const Json& params);
  /// Forwards a request to an agent, whose answer is the reply.
  void AskAgent(const Json& params, const Reply& reply);
  void TakeAgentAnswer(std::uint64_t number, const Json& message);
  /// Notifies all others of an agent's event.
  void ForwardAgentEvent(std::uint64_t agent, const Json& event);
  /// Ends the requests that wait for a closed connection.
  void EndAgent(std::uint64_t number, const Connection& connection);
  Answer StartDump(std::uint64_t connection, const Json& params);
  Answer StartCellDump(std::uint64_t connection, const std::string& method, const Json& params);
  /// Registers a client's method for a source; an error if there are too many. As in Klipper it
  /// ends only with the connection to Klipper, which Moonraker shares among all its clients.
  Answer AddDump(std::uint64_t connection, const std::string& source, const Json& params,
                 std::size_t next, Json header);
  void SendDump(const Dump& dump, const Json& params);
  void SendForce(const VirtualKlipper& klipper, Dump& dump);
  void SendTaps(const VirtualKlipper& klipper, Dump& dump);
  void RunScript(const std::string& script, const Reply& reply);
  void Ask(std::uint64_t connection, bool subscribe, const Json& params, const Reply& reply);
  void Pump();
  void SendToRemote(const KlipperEvent& event);
  void Disconnected();
  /// Advances the machine to a time, or to that of a camera meanwhile: status and time are of the
  /// same moment.
  void MoveOn(VirtualKlipper& klipper, double monotonic_s);
  void StatusTick(VirtualKlipper& klipper);
  void DumpTick(VirtualKlipper& klipper);
  void CellTick(const VirtualKlipper& klipper);
  void FaultTick(double time_s, int laser_moves);
  /// @param except  a connection that is not told; 0: all are.
  void Notify(const std::string& method, const Json& params, std::uint64_t except = 0);
  void Send(std::uint64_t connection, const std::string& text);
  void CloseAll();
  [[nodiscard]] bool silent() const;
  [[nodiscard]] Json EventTime() const;
  [[nodiscard]] KlippyState State() const;
  [[nodiscard]] bool HasLoadCell() const;
  [[nodiscard]] Json ServerInfo() const;
  [[nodiscard]] Json PrinterInfo() const;
  [[nodiscard]] Json Webcams() const;

  MachineHost& machine_;
  HubOptions options_;
  Random random_;
  std::map<std::uint64_t, Connection> connections_;
  std::uint64_t next_connection_ = 140'000'000'000'001;
  std::int64_t next_request_ = 281'472'000'000'001;
  std::map<std::uint64_t, Reply> scripts_;
  std::vector<Query> queries_;
  std::vector<Dump> dumps_;
  std::map<std::string, double> tokens_;  ///< by token: its expiry time
  double monotonic_s_ = 0;
  double time_s_ = 0;  ///< the machine's
  double next_status_s_ = 0;
  double next_dump_s_ = 0;
  double next_cell_s_ = 0;
  double refuse_until_s_ = -1;
  bool told_shutdown_ = false;
};

/// Parses the objects of a request: {"objects": {"toolhead": null, "extruder": ["target"]}}.
[[nodiscard]] Result<StatusRequest> ParseStatusRequest(const Json& params);

/// Returns files in the form of server.files.list.
[[nodiscard]] Json FileList(const VirtualKlipper& klipper);

}  // namespace trammel::sim
