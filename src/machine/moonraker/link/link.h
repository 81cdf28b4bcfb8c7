// One connection to a Moonraker, from its opening to its end. Used on the thread of the io_context;
// connection.h is its thread-safe interface.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "base/result.h"
#include "machine/moonraker/link/address.h"

namespace boost::asio {
class io_context;
}

namespace trammel::machine {

/// All called on the thread of the io_context.
struct LinkEvents {
  std::function<void()> on_open;
  std::function<void(std::string_view)> on_message;  ///< one whole JSON text, not yet checked
  /// Called at most once, as the last event; not after Close().
  std::function<void(Error)> on_down;
  std::function<void(std::size_t)> on_written;  ///< bytes of a message that has left
};

class MoonrakerLink {
 public:
  virtual ~MoonrakerLink() = default;
  virtual void Open() = 0;
  /// Queues one JSON text. REQUIRES an earlier on_open.
  virtual void Write(std::string message) = 0;
  /// Closes the sending side and reads until the peer closes its side: on_down then. Closing a
  /// socket with unread data would discard what the peer has not read. REQUIRES an earlier on_open,
  /// and all written.
  virtual void Finish() = 0;
  /// Closes without a further event.
  virtual void Close() = 0;
};

/// Uses a WebSocket or, for a unix: address, JSON texts that end in byte 0x03.
[[nodiscard]] std::shared_ptr<MoonrakerLink> MakeLink(boost::asio::io_context& io,
                                                      const MoonrakerAddress& address,
                                                      const MoonrakerOptions& options,
                                                      LinkEvents events);

}  // namespace trammel::machine
