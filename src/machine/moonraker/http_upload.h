// Sends a file to Moonraker, which takes files over HTTP only.
#pragma once

#include <string>
#include <string_view>

#include "base/result.h"
#include "machine/moonraker/moonraker_address.h"
#include "machine/moonraker/moonraker_options.h"
#include "machine/net/wait_limit.h"

namespace trammel::machine {

/// What an upload came to, where the server answered.
struct UploadAnswer {
  int status = 0;      ///< HTTP; 201: stored
  std::string server;  ///< its Server header
  std::string body;
};

/// Posts the file with its SHA-256, which the server checks. Blocks on the calling thread.
/// @param root  of Moonraker's: "gcodes", the printable files; "config"
/// @param name  relative to the root; its folders are made
/// REQUIRES an address that is not a Unix socket. Fails with kMachine where no answer came.
[[nodiscard]] Result<UploadAnswer> PostFile(const MoonrakerAddress& address,
                                            const MoonrakerOptions& options, std::string_view root,
                                            const std::string& name, std::string_view data,
                                            const WaitLimit& limit);

}  // namespace trammel::machine
