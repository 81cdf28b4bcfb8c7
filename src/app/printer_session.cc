#include "app/printer_session.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <cstdio>
#include <ctime>
#include <random>
#include <utility>

#include "app/provenance.h"
#include "app/secrets.h"
#include "app/stated_settings.h"
#include "machine/moonraker/client/moonraker_printer.h"
#include "session/screen.h"
#include "session/session.h"
#include "settings/material.h"

namespace trammel::app {

void AddPrinterOptions(CLI::App& command, PrinterOptions& options) {
  command.add_option("--config", options.config,
                     "settings; left out: trammel.toml of this folder, if there is one");
  command.add_option("--set", options.set, "one setting: key=value; may be repeated");
  AddAddressOption(command, options.address);
  command.add_flag("--verbose", options.verbose,
                   "an error ends with the last messages from and to the printer");
}

void AddAddressOption(CLI::App& command, std::string& address) {
  command.add_option("--printer", address,
                     "Moonraker's address: host, host:port, URL or unix:PATH");
}

std::string PrinterOptionText(const PrinterOptions& options) {
  std::string words;
  if (!options.config.empty()) words += " --config " + ShellQuoted(options.config);
  if (!options.address.empty()) words += " --printer " + ShellQuoted(options.address);
  return words;
}

void AddMaterialOption(CLI::App& command, std::string& material) {
  command.add_option("--material", material,
                     "what is printed: pla, petg, abs, asa, tpu, pc or pa; temperatures that are "
                     "set win");
}

void TakeMaterial(const std::string& material, files::Config& config) {
  if (material.empty()) return;
  config.pattern.material = material;
  config.options["filament.material"] = "--material";
}

void AddCameraOption(CLI::App& command, PrinterOptions& options) {
  command.add_option("--camera", options.camera,
                     "stream URL, /dev/videoN, aravis:ID, video file or folder of pictures; @FILE: "
                     "what stands in the file, for a URL with a password");
}

Result<files::Config> LoadSettings(const PrinterOptions& options) {
  const ConfigText text = TRY(FindConfig(options.config));
  Result<files::Config> config = files::ParseConfig(text.text, text.file);
  if (!config) return config;
  for (const std::string& assignment : options.set) {
    TRY(files::OverrideConfig(assignment, *config));
  }
  TakeMaterial(options.material, *config);
  TRY(files::ValidateConfig(*config, text.text, text.file));
  if (!options.address.empty()) config->scan.address = options.address;
  config->scan.quote_messages = options.verbose;
  if (!options.camera.empty()) {
    config->scan.camera = TRY(CameraAddressOf("--camera", options.camera));
  }
  TRY(SettleApiKey(config->scan));
  return config;
}

Result<files::Config> LoadSettingsFor(const std::string& material, bool nozzle_given,
                                      const std::string& remedy, PrinterOptions options) {
  auto settings = LoadSettings(options);
  if (!settings || material.empty()) return settings;
  const auto& own = settings->pattern;
  const bool other = !own.material.empty() &&
                     settings::FindMaterial(own.material) != settings::FindMaterial(material);
  if (other && own.nozzle_temperature_c && !nozzle_given) {
    return Fail(fmt::format(
        "the filament is {} by its name, and [filament] sets nozzle_temperature = {:g} for {}: {}, "
        "or leave nozzle_temperature and bed_temperature out there",
        material, *own.nozzle_temperature_c, own.material, remedy));
  }
  options.material = material;
  return LoadSettings(options);
}

namespace {

machine::MoonrakerOptions OptionsOf(const settings::ScanSettings& settings) {
  machine::MoonrakerOptions options;
  options.address = settings.address;
  if (!settings.http_address.empty()) options.http_address = settings.http_address;
  options.api_key = settings.api_key;
  options.ca_file = settings.ca_file;
  options.accept_any_certificate = settings.accept_any_certificate;
  options.quote_messages = settings.quote_messages;
  return options;
}

Result<std::unique_ptr<machine::Printer>> ConnectWith(const machine::MoonrakerOptions& options,
                                                      const std::stop_token& stop) {
  return procedure::NameStopReason(
      stop, machine::ConnectToMoonraker(options, {options.connect_time_limit_s, stop}));
}

}  // namespace

Result<std::unique_ptr<machine::Printer>> Connect(const settings::ScanSettings& settings,
                                                  const std::stop_token& stop,
                                                  std::optional<double> time_limit_s) {
  machine::MoonrakerOptions options = OptionsOf(settings);
  options.client_name = kCommandsAgent;
  if (time_limit_s) options.connect_time_limit_s = *time_limit_s;
  return ConnectWith(options, stop);
}

Result<std::unique_ptr<machine::Printer>> ConnectAsService(const settings::ScanSettings& settings,
                                                           const std::stop_token& stop) {
  machine::MoonrakerOptions options = OptionsOf(settings);
  options.client_name = kServiceAgent;
  options.client_version = ProgramVersion();
  options.other_names = false;
  return ConnectWith(options, stop);
}

std::string NewRunName() {
  std::random_device random;
  return fmt::format("{:%Y%m%d-%H%M%S}-{:x}-{:08x}", fmt::gmtime(std::time(nullptr)),
                     static_cast<long>(::getpid()), random());
}

namespace {

std::atomic<bool> progress_as_json = false;

}  // namespace

void ShowProgressAsJson() { progress_as_json = true; }

void ShowProgress(const procedure::Progress& progress) {
  if (progress_as_json) {
    fmt::print(stderr, "{}\n", procedure::ProgressLine(progress));
    return;
  }
  if (progress.remaining_s) {
    fmt::print(stderr, "  {} (about {:.0f} s)\n", progress.text, *progress.remaining_s);
  } else {
    fmt::print(stderr, "  {}\n", progress.text);
  }
}

}  // namespace trammel::app
