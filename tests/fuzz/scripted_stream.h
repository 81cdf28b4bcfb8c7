// Stands in for TCP connections: linked in place of machine/net/byte_stream.cc and
// machine/net/wait_fd.cc.
#pragma once

#include <cstddef>
#include <string_view>

namespace trammel::fuzz {

/// What the other side of every following connection sends, and then closes. Must outlive them. A
/// read brings at most `piece` bytes, and waits end at once. With 0 it brings a line; one that
/// begins with "=" answers LinuxCNC's shell: what was asked last stands before it, as "ESTOP " or
/// "SET MODE ".
void SetStream(std::string_view bytes, std::size_t piece);

}  // namespace trammel::fuzz
