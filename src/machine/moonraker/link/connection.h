// Connection to a Moonraker: sends and receives texts on its own thread. Independent of JSON-RPC.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "base/result.h"
#include "machine/moonraker/link/address.h"
#include "machine/moonraker/link/rpc.h"

namespace trammel::machine {

/// All called on the connection's thread, one at a time. They must not block.
struct ConnectionEvents {
  std::function<void()> on_open;
  std::function<void(std::string_view)> on_message;
  std::function<void(Error)> on_down;  ///< an attempt failed or the link broke; Connect() again
};

/// Owns one I/O thread, joined by the destructor, after which there are no more events. Texts
/// passed to Send earlier are still sent, unless the peer reads nothing for two seconds: the last
/// one may be an emergency stop. (A name lookup that hangs blocks the destructor until the system
/// aborts it.)
class MoonrakerConnection {
 public:
  /// REQUIRES options for which ParseMoonrakerAddress returned this address.
  MoonrakerConnection(MoonrakerAddress address, MoonrakerOptions options, ConnectionEvents events);
  ~MoonrakerConnection();
  MoonrakerConnection(const MoonrakerConnection&) = delete;
  MoonrakerConnection& operator=(const MoonrakerConnection&) = delete;

  /// Starts one attempt, which ends in on_open or on_down. Drops an existing link.
  void Connect();

  /// Ends the link as if it had broken: on_down follows with this error. For a peer that violates
  /// the protocol.
  void Drop(Error error);

  /// Queues one text; thread-safe. Fails where the link is down, or where more than
  /// kMaxMessageBytes wait for a peer that does not read.
  [[nodiscard]] Result<void> Send(std::string message);

  /// Runs a function on the connection's thread after a delay (0: soon); thread-safe. Dropped when
  /// the connection is destroyed.
  void RunAfter(double delay_s, std::function<void()> function);

  [[nodiscard]] bool OnOwnThread() const;
  [[nodiscard]] const MessageLog& log() const;
  [[nodiscard]] const MoonrakerAddress& address() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace trammel::machine
