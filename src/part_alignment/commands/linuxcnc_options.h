// How a command reaches LinuxCNC.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>

#include "base/result.h"
#include "machine/linuxcnc/linuxcnc.h"

namespace CLI {
class App;
}

namespace trammel::app {

struct LinuxCncArguments {
  std::string address;  ///< "session", or "session:" and a helper's words; empty: no machine
  machine::LinuxCncOptions options;
};

/// `option` names the address: --write, --machine.
void AddLinuxCncOptions(CLI::App& command, const std::string& option, const std::string& help,
                        LinuxCncArguments& arguments);

/// Errors (kInput): an address that is none.
[[nodiscard]] Result<machine::LinuxCncOptions> ParseLinuxCnc(const LinuxCncArguments& arguments);

/// Connects, and takes MDI mode where nothing forbids a motion.
/// Errors: those of ParseLinuxCnc, LinuxCnc::Connect and LinuxCnc::Prepare.
[[nodiscard]] Result<std::unique_ptr<machine::LinuxCnc>> ConnectLinuxCnc(
    const LinuxCncArguments& arguments, const std::stop_token& stop);

/// Where the spindle stands. Errors (kSafety): it turns; its axis C is not at `c_deg`, if any.
[[nodiscard]] Result<Eigen::Vector3d> StandsAt(machine::LinuxCnc& linuxcnc,
                                               std::optional<double> c_deg,
                                               const std::stop_token& stop);

}  // namespace trammel::app
