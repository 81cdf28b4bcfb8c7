// One connection to a Moonraker, from its opening to its end. Lives on the thread that runs the
// io_context; connection.h is the thread-safe face of it.
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
  /// At most once, and nothing after it. Not after Close().
  std::function<void(Error)> on_down;
  std::function<void(std::size_t)> on_written;  ///< bytes of a message that has left
};

class MoonrakerLink {
 public:
  virtual ~MoonrakerLink() = default;
  virtual void Open() = 0;
  /// Queues one JSON text. REQUIRES on_open before.
  virtual void Write(std::string message) = 0;
  /// Says that no more will be written, and reads on until the peer has ended its side: on_down
  /// then. A socket that is closed with something unread takes back what the peer has not read.
  /// REQUIRES on_open before, and all written.
  virtual void Finish() = 0;
  /// Ends it without a further event.
  virtual void Close() = 0;
};

/// Over a WebSocket, or, to a unix: address, with JSON texts that end in byte 0x03.
[[nodiscard]] std::shared_ptr<MoonrakerLink> MakeLink(boost::asio::io_context& io,
                                                      const MoonrakerAddress& address,
                                                      const MoonrakerOptions& options,
                                                      LinkEvents events);

}  // namespace trammel::machine
