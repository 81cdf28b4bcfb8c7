// trammel serve: one process beside Klipper, for whatever may be asked of trammel there.
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

/// What the command line says of a printer that is served.
[[nodiscard]] PrinterOptions OptionsAt(const service::PrinterPlace& place);

/// Whether a job's argument is a plain number: it becomes part of a setting, and of a button's
/// G-code. Errors (kInput): it is not.
[[nodiscard]] Result<void> CheckTemperatureArgument(const std::string& text);

/// What is offered, asked for when the command runs. Attendants are started only where asked for.
using Offers = std::function<service::Offerings()>;

/// Makes a command one that serves.
void AddServeOptions(CLI::App& command, int& exit_code, Offers offers);

}  // namespace trammel::app
