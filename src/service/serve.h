// One process for all printers: a server for each, over its Moonraker.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "base/result.h"
#include "machine/moonraker/printer.h"
#include "service/job_server.h"
#include "settings/scan_settings.h"

namespace trammel::service {

struct ServedPrinter {
  JobServerOptions server;
  std::vector<Attendant> attendants = {};
  settings::ScanSettings settings;
  /// Connects as the agent "trammel". Errors: kMachine: it is retried; kInterrupted; others end the
  /// service of this printer.
  std::function<Result<std::unique_ptr<machine::Printer>>(const std::stop_token&)> connect;
};

/// Works with the servers of all printers, in their order, until stopped: on a thread of its own.
using Beside =
    std::function<void(std::span<JobServer* const> servers, const std::stop_token& stop)>;

/// Serves the printers until stopped, through restarts of Klipper and of Moonraker and lost links,
/// and before they are up. Current runs are ended safely.
/// Errors: kInput, of a printer that can never be connected to.
/// @param beside  empty: nothing beside the printers
/// @returns true if a run was in progress.
[[nodiscard]] Result<bool> Serve(const std::vector<ServedPrinter>& printers,
                                 const std::stop_token& stop, const Beside& beside = {});

}  // namespace trammel::service
