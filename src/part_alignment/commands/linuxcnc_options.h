// How a command reaches LinuxCNC.
#pragma once

#include <string>

#include "base/result.h"
#include "machine/linuxcnc/linuxcnc.h"

namespace CLI {
class App;
}

namespace trammel::app {

struct LinuxCncArguments {
  std::string address;  ///< "session", HOST or HOST:PORT; empty: no machine
  machine::LinuxCncOptions options;
};

/// `option` names the address: --write, --machine.
void AddLinuxCncOptions(CLI::App& command, const std::string& option, const std::string& help,
                        LinuxCncArguments& arguments);

/// Errors (kInput): an address that is none.
[[nodiscard]] Result<machine::LinuxCncOptions> ParseLinuxCnc(const LinuxCncArguments& arguments);

}  // namespace trammel::app
