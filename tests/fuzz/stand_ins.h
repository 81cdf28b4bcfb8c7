// Scripts of the peers behind the stand-ins for connections.
#pragma once

#include <cstddef>
#include <string_view>

namespace trammel::fuzz {

/// Sets what Moonraker or Klipper sends over the next connection, a message a line; behind a line
/// of
/// "----", over the one after it. A line that begins with "=" is an answer: the rest of an object,
/// behind the id of the oldest call that has none yet. An empty line ends what comes now: the next
/// lines come with the next call. "!" alone breaks the link; after "~" alone every time limit has
/// passed. Must outlive the connections, which work on the caller's thread.
void SetMessages(std::string_view lines);

/// Sets what the other side of every following TCP connection sends, and then closes. Must outlive
/// them. A read brings at most `piece` bytes, > 0, and waits end at once.
void SetStream(std::string_view bytes, std::size_t piece);

}  // namespace trammel::fuzz
