// The virtual Moonraker's sockets: WebSocket and HTTP on loopback.
#pragma once

#include <cstdint>
#include <memory>

#include "base/result.h"
#include "sim/camera/machine_host.h"
#include "sim/moonraker/hub.h"

namespace trammel::sim {

struct ServerOptions {
  HubOptions hub;
  std::uint16_t port = 0;  ///< on 127.0.0.1; 0: a free one
};

/// Serves from its own thread until destroyed.
class PrinterServer {
 public:
  /// Errors (kMachine) contain the address and the system's message. `machine` must outlive the
  /// server.
  [[nodiscard]] static Result<std::unique_ptr<PrinterServer>> Start(MachineHost& machine,
                                                                    ServerOptions options);
  ~PrinterServer();
  PrinterServer(const PrinterServer&) = delete;
  PrinterServer& operator=(const PrinterServer&) = delete;

  [[nodiscard]] std::uint16_t port() const;
  /// Replaces the faults so far; close_at_s and silent_from_s count from now.
  void Inject(ServerFaults faults);

 private:
  struct Sockets;
  explicit PrinterServer(std::unique_ptr<Sockets> sockets);
  std::unique_ptr<Sockets> sockets_;
};

}  // namespace trammel::sim
