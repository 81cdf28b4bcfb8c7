// What every command that needs a printer does first: settings, connection, folder, progress.
#pragma once

#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "app/config/config_file.h"
#include "base/result.h"
#include "machine/moonraker/printer.h"
#include "session/session.h"
#include "settings/scan_settings.h"

namespace CLI {
class App;
}

namespace trammel::app {

/// Which settings, and what the command line puts above them.
struct PrinterOptions {
  std::string config;            ///< file; empty: trammel.toml of this folder, if there is one
  std::vector<std::string> set;  ///< key=value
  std::string address;           ///< Moonraker's; empty: the settings'
  std::string camera;            ///< empty: the settings'
  std::string material;          ///< empty: the settings'
  bool verbose = false;          ///< errors quote the conversation with the printer
};

/// --config, --set, --printer and --verbose.
void AddPrinterOptions(CLI::App& command, PrinterOptions& options);

/// --printer alone.
void AddAddressOption(CLI::App& command, std::string& address);

/// The words by which another command has the same printer and settings: " --printer voron.local";
/// empty where none were given.
[[nodiscard]] std::string WordsForPrinter(const PrinterOptions& options);

/// --material, for what prints.
void AddMaterialOption(CLI::App& command, std::string& material);

/// Sets the material that --material named; empty: none.
void TakeMaterial(const std::string& material, files::Config& config);

/// --camera.
void AddCameraOption(CLI::App& command, PrinterOptions& options);

[[nodiscard]] Result<files::Config> LoadSettings(const PrinterOptions& options);

/// Loads the settings of a run for a filament of a material, as its name says; empty: none.
/// @param nozzle_given  whether this run was told the nozzle's temperature, which then holds
/// @param remedy        how it is told that, for the error
/// Errors: those of LoadSettings; kInput where they set the nozzle's temperature and name another
/// material.
[[nodiscard]] Result<files::Config> LoadSettingsFor(const std::string& material, bool nozzle_given,
                                                    const std::string& remedy,
                                                    PrinterOptions options);

/// The printer that the settings name. Errors: kMachine, kInterrupted.
/// @param time_limit_s  how long it may take; absent: as long as a connection may take
[[nodiscard]] Result<std::unique_ptr<machine::Printer>> Connect(
    const settings::ScanSettings& settings, const std::stop_token& stop,
    std::optional<double> time_limit_s = {});

/// The same as the agent "trammel", by whose name others call it.
[[nodiscard]] Result<std::unique_ptr<machine::Printer>> ConnectAsService(
    const settings::ScanSettings& settings, const std::stop_token& stop);

/// A name for a run that no other has (files::IsRunName).
[[nodiscard]] std::string NewRunName();

/// Progress on standard error: standard output holds the answer alone.
void TellOnTerminal(const procedure::Progress& progress);

/// Lets TellOnTerminal write lines of JSON (session/screen.h), for a program that reads
/// them.
void TellProgressAsJson();

/// The names by which commands, and `trammel serve`, are agents of Moonraker.
inline constexpr const char* kCommandsAgent = "trammel-run";
inline constexpr const char* kServiceAgent = "trammel";

}  // namespace trammel::app
