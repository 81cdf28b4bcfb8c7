// First steps of every command that needs a printer: settings, connection, folder, progress.
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

/// Settings file and the command line's overrides.
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

/// Returns the options that select the same printer and settings for another command, " --printer
/// voron.local"; empty if none were given.
[[nodiscard]] std::string PrinterOptionText(const PrinterOptions& options);

/// --material, for what prints.
void AddMaterialOption(CLI::App& command, std::string& material);

/// Sets the material given by --material; empty: none.
void TakeMaterial(const std::string& material, files::Config& config);

/// --camera.
void AddCameraOption(CLI::App& command, PrinterOptions& options);

[[nodiscard]] Result<files::Config> LoadSettings(const PrinterOptions& options);

/// Loads the settings of a run for the filament of a material, given by name; empty: none.
/// @param nozzle_given  true if this run was given the nozzle's temperature, which then applies
/// @param remedy        option that sets it, for the error
/// Errors: those of LoadSettings; kInput if they set the nozzle's temperature and name another
/// material.
[[nodiscard]] Result<files::Config> LoadSettingsFor(const std::string& material, bool nozzle_given,
                                                    const std::string& remedy,
                                                    PrinterOptions options);

/// Connects to the printer of the settings. Errors: kMachine, kInterrupted.
/// @param time_limit_s  upper limit of the time; absent: that of a connection
[[nodiscard]] Result<std::unique_ptr<machine::Printer>> Connect(
    const settings::ScanSettings& settings, const std::stop_token& stop,
    std::optional<double> time_limit_s = {});

/// Connects in the same way as the agent "trammel", the name by which others call it.
[[nodiscard]] Result<std::unique_ptr<machine::Printer>> ConnectAsService(
    const settings::ScanSettings& settings, const std::stop_token& stop);

/// Returns a unique name for a run (files::IsRunName).
[[nodiscard]] std::string NewRunName();

/// Prints progress on standard error: standard output contains only the answer.
void ShowProgress(const procedure::Progress& progress);

/// Switches ShowProgress to lines of JSON (session/screen.h), for a program that reads them.
void ShowProgressAsJson();

/// Names under which commands and `trammel serve` register as agents of Moonraker.
inline constexpr const char* kCommandsAgent = "trammel-run";
inline constexpr const char* kServiceAgent = "trammel";

}  // namespace trammel::app
