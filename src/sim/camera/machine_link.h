// The virtual machine across a process boundary: its camera asks over a Unix socket.
#pragma once

#include <filesystem>
#include <memory>

#include "base/result.h"
#include "sim/camera/machine_view.h"
#include "sim/camera/machine_wire.h"

namespace trammel::sim {

/// The printer's end. Answers from threads of its own, one for each of at most eight clients at a
/// time; who asks nonsense, or for a time that is not now (from a minute ago to a tenth of a second
/// ahead), is cut off.
class MachineLink {
 public:
  /// @param path  A new socket, for this user alone; removed at the end.
  /// Errors: (kInput) a path of no or of more than 100 bytes; (kMachine) it cannot be made, or is
  /// there already.
  [[nodiscard]] static Result<std::unique_ptr<MachineLink>> Serve(
      const std::filesystem::path& path, std::shared_ptr<const MachineSource> machine,
      const MachineWorld& world);
  virtual ~MachineLink() = default;

  /// Where the camera serves its frames on 127.0.0.1, as it said last; 0 before. Any thread.
  [[nodiscard]] virtual int camera_port() const = 0;
};

/// The camera's end. Every function may be called from any thread.
class RemoteMachine : public MachineSource {
 public:
  /// Errors: (kInput) as MachineLink; (kMachine) nobody listens there, or not a virtual printer.
  [[nodiscard]] static Result<std::shared_ptr<RemoteMachine>> Connect(
      const std::filesystem::path& path);

  // At() and bed() cost a round trip each; a bed is sent once, and the pointer stays the same until
  // there is another. When the link has failed they go on with what they knew last: see Check().

  [[nodiscard]] virtual const MachineWorld& world() const = 0;
  /// Tells the printer where the camera serves its frames on 127.0.0.1. REQUIRES 1 … 65535.
  [[nodiscard]] virtual Result<void> Announce(int camera_port) = 0;
  /// Error (kMachine): the printer has ended, or something went wrong with the link before. It
  /// never recovers.
  [[nodiscard]] virtual Result<void> Check() const = 0;
};

}  // namespace trammel::sim
