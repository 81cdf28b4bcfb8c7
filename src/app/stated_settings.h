// Settings read from the printer where the user does not set them.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/config/config_file.h"
#include "base/result.h"
#include "machine/moonraker/printer_facts.h"
#include "session/session.h"

namespace trammel::app {

/// Use of the settings by a command.
enum class StatedFor {
  kPrinter,  ///< no pattern is printed: filament, nozzle and bed matter
  kPattern,  ///< a pattern is: so do its lines, and which motors push
};

/// Adopts the printer's values where the user set none: filament and nozzle; the bed's shape, and
/// its position if the nozzle cannot reach the default one. For a pattern also the line width and
/// the motors whose pressure advance counts.
/// @returns one part of a sentence for each, for people
[[nodiscard]] std::vector<std::string> TakeStated(const machine::PrinterFacts& facts,
                                                  StatedFor purpose, files::Config& config);

/// Queries the printer and prints which settings were adopted.
/// @returns the facts; absent if the printer is not ready, which the facts' user reports.
/// Errors: kMachine, kInterrupted.
[[nodiscard]] Result<std::optional<machine::PrinterFacts>> TakeStatedBy(
    const procedure::Session& session, StatedFor purpose, files::Config& config);

/// Calls TakeStatedBy for a print of the pattern, once the printer has started; kSafety if the
/// pattern then cannot be printed.
[[nodiscard]] Result<void> FitPattern(const procedure::Session& session, files::Config& config);

// Finding a user's trammel.toml.

struct ConfigText {
  std::string text;
  std::string file;  ///< file name, for messages
};

/// Finds the requested file, else trammel.toml of the current folder, else an empty text, which
/// means every default. Errors: as files::ReadWholeFile.
[[nodiscard]] Result<ConfigText> FindConfig(const std::string& asked_for);

}  // namespace trammel::app
