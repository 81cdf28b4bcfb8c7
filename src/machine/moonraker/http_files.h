// Sends a file to Moonraker, or gets one of it: it moves files over HTTP only.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "base/result.h"
#include "machine/moonraker/moonraker_address.h"
#include "machine/moonraker/moonraker_options.h"
#include "machine/net/wait_limit.h"

namespace trammel::machine {

/// What a request came to, where the server answered.
struct HttpAnswer {
  int status = 0;      ///< HTTP; 201: stored, 200: here it is
  std::string server;  ///< its Server header
  std::string body;
};

/// Posts the file with its SHA-256, which the server checks. Blocks on the calling thread.
/// @param root  of Moonraker's: "gcodes", the printable files; "config"
/// @param name  relative to the root; its folders are made
/// REQUIRES an address that is not a Unix socket. Fails with kMachine where no answer came.
[[nodiscard]] Result<HttpAnswer> PostFile(const MoonrakerAddress& address,
                                          const MoonrakerOptions& options, std::string_view root,
                                          const std::string& name, std::string_view data,
                                          const WaitLimit& limit);

/// Gets a file of at most `most_bytes`. Otherwise as PostFile; a larger one fails with kInput.
[[nodiscard]] Result<HttpAnswer> GetFile(const MoonrakerAddress& address,
                                         const MoonrakerOptions& options, std::string_view root,
                                         const std::string& name, std::size_t most_bytes,
                                         const WaitLimit& limit);

}  // namespace trammel::machine
