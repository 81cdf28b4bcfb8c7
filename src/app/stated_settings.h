// Settings that the printer states itself, where the user does not set them.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/config/config_file.h"
#include "base/result.h"
#include "machine/moonraker/printer_facts.h"
#include "session/session.h"

namespace trammel::app {

/// What a command does with the settings.
enum class StatedFor {
  kPrinter,  ///< no pattern is printed: filament, nozzle and bed matter
  kPattern,  ///< a pattern is: so do its lines, and which motors push
};

/// Takes over what the printer states and the user left at its default: filament and nozzle; the
/// bed's shape, and its place where the default one is out of the nozzle's reach. For a pattern
/// also the width of a line, and the motors whose pressure advance counts.
/// @returns one part of a sentence for each, for people
[[nodiscard]] std::vector<std::string> TakeStated(const machine::PrinterFacts& facts,
                                                  StatedFor purpose, files::Config& config);

/// Asks the printer, and says what was taken over.
/// @returns the facts; nothing of a printer that is not ready, as whoever uses it will say.
/// Errors: kMachine, kInterrupted.
[[nodiscard]] Result<std::optional<machine::PrinterFacts>> TakeStatedBy(
    const procedure::Session& session, StatedFor purpose, files::Config& config);

/// TakeStatedBy for a print of the pattern, once the printer has started; kSafety where it cannot
/// be printed so.
[[nodiscard]] Result<void> FitPattern(const procedure::Session& session, files::Config& config);

// Finding a user's trammel.toml.

struct ConfigText {
  std::string text;
  std::string file;  ///< its name, for messages
};

/// The file that was asked for, else trammel.toml of the current folder, else no settings at all
/// (an empty text, which leaves every default). Errors: as files::ReadWholeFile.
[[nodiscard]] Result<ConfigText> FindConfig(const std::string& asked_for);

}  // namespace trammel::app
