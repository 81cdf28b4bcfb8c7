// trammel serve: one process beside Klipper that handles all requests to trammel.
#pragma once

#include <functional>
#include <string>

#include "app/printer_session.h"
#include "base/result.h"
#include "service/job_kind.h"

namespace CLI {
class App;
}

namespace trammel::app {

/// Converts the command line's entry of a served printer to options.
[[nodiscard]] PrinterOptions OptionsAt(const service::PrinterPlace& place);

/// Checks that a job's argument is a plain number: it becomes part of a setting, and of a button's
/// G-code. Errors (kInput): it is not.
[[nodiscard]] Result<void> CheckTemperatureArgument(const std::string& text);

/// Collects the offers when the command runs. Attendants start only on request.
using Offers = std::function<service::Offerings()>;

/// Adds the options of a serving command.
void AddServeOptions(CLI::App& command, int& exit_code, Offers offers);

}  // namespace trammel::app
