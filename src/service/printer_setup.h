// Sets up a printer for trammel without a shell: the macros beside printer.cfg and the line that
// includes them, and the way back.
#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "machine/moonraker/printer.h"

namespace trammel::service {

/// Section of a printer's configuration that it lacks.
struct MissingSection {
  std::string section;  ///< "[save_variables]"
  std::string purpose;  ///< what it is needed for
};

/// Change of a file that setting up would make, or of one that was made.
struct FileChange {
  std::string file;  ///< beside printer.cfg
  std::string change;
};

struct PrinterSetup {
  bool has_macros = false;  ///< Klipper knows the macros of this trammel
  std::vector<MissingSection> missing;
  std::vector<FileChange> changes;  ///< to be made; empty: none
  bool can_undo = false;            ///< a change by this service can be taken back
};

[[nodiscard]] nlohmann::json JsonOf(const PrinterSetup& setup);

/// Returns printer.cfg with `[include trammel.cfg]` as its first line, by the file's own line ends;
/// unchanged if it has that line.
[[nodiscard]] std::string WithInclude(std::string_view printer_cfg);

/// Returns printer.cfg without the line that WithInclude added; unchanged if there is none.
[[nodiscard]] std::string WithoutInclude(std::string_view printer_cfg);

/// Returns why the firmware may not be restarted now; empty: it may.
using RestartBlockerCallback = std::function<std::string()>;

/// Reads what a printer lacks. @param note  folder with the service's note of an earlier change
/// Errors: kMachine; kInput: printer.cfg cannot be read.
[[nodiscard]] Result<PrinterSetup> LookAtSetup(machine::Printer& printer,
                                               const std::filesystem::path& note,
                                               const machine::WaitLimit& limit);

/// Uploads trammel.cfg, includes it in printer.cfg, and restarts the firmware; notes the files as
/// they were first. Where the firmware does not become ready, or `blocker` has a reason meanwhile,
/// takes everything back. Errors: kMachine, kInput; the printer is then as before, or the message
/// names what is not.
[[nodiscard]] Result<void> SetUpPrinter(machine::Printer& printer,
                                        const std::filesystem::path& note,
                                        const RestartBlockerCallback& blocker,
                                        const std::stop_token& stop);

/// Restores both files byte for byte and restarts the firmware. A printer.cfg that was changed
/// since loses the line of the include alone. Errors: kInput: nothing is noted; kMachine.
[[nodiscard]] Result<void> UndoSetUp(machine::Printer& printer, const std::filesystem::path& note,
                                     const RestartBlockerCallback& blocker,
                                     const std::stop_token& stop);

}  // namespace trammel::service
