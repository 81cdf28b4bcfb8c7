// Stands in for connections to Moonraker and Klipper: linked in place of
// machine/moonraker/moonraker_connection.cc. All on the caller's thread.
#pragma once

#include <string_view>

namespace trammel::fuzz {

/// What the peer of the next connection sends, a message a line; behind a line of "----", what the
/// one after it sends. A line that begins with "=" is an answer: the rest of an object, behind the
/// id of the oldest call that has none yet. An empty line ends what comes now: the next lines come
/// with the next call. "!" alone breaks the link; after "~" alone every time limit has passed. Must
/// outlive the connections.
void SetMessages(std::string_view lines);

}  // namespace trammel::fuzz
