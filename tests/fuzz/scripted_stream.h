// Stands in for TCP connections: linked in place of machine/net/byte_stream.cc and
// machine/net/wait_fd.cc.
#pragma once

#include <cstddef>
#include <string_view>

namespace trammel::fuzz {

/// What the other side of every following connection sends, and then closes. Must outlive them. A
/// read brings at most `piece` bytes, > 0, and waits end at once.
void SetStream(std::string_view bytes, std::size_t piece);

}  // namespace trammel::fuzz
