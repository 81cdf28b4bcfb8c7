// trammel config: lists the settings, checks a file, and writes an initial file.
#include "app/config_command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <string>

#include "app/commands.h"
#include "app/config/config_file.h"
#include "app/interrupt.h"
#include "app/printer_session.h"
#include "app/provenance.h"
#include "app/secrets.h"
#include "app/stated_settings.h"
#include "files/new_file.h"
#include "files/whole_file.h"
#include "session/crash_recovery.h"

namespace trammel::app {
namespace {

Result<void> Check(const std::string& file) {
  const std::string text = TRY(files::ReadWholeFile(file, files::kMaxConfigBytes));
  const files::Config config = TRY(files::ParseConfig(text, file));
  TRY(files::ValidateConfig(config, text, file));
  fmt::print("{}: good, {} key(s) set\n", file, config.keys.size());
  return {};
}

struct InitArguments {
  std::string file = "trammel.toml";
  PrinterOptions printer;
};

/// Returns the settings that a printer states itself.
Result<files::Config> StatedSettings(const InitArguments& arguments) {
  files::Config config = files::DefaultConfig();
  if (!arguments.printer.address.empty()) config.scan.address = arguments.printer.address;
  TakeMaterial(arguments.printer.material, config);
  TRY(files::ValidateConfig(config, "", ""));
  TRY(SettleApiKey(config.scan));
  const Interrupt interrupt;
  const auto printer = TRY(Connect(config.scan, interrupt.token()));
  const procedure::Session session{*printer, interrupt.token(), ShowProgress};
  const auto stated = TRY(TakeStatedBy(session, StatedFor::kPrinter, config));
  if (stated) return config;
  return Fail(fmt::format("{} is not ready, and states nothing of itself: bring Klipper up first",
                          procedure::PrinterName(config.scan.address)),
              ErrorKind::kMachine);
}

Result<void> Init(const InitArguments& arguments) {
  TRY(files::CheckTarget(arguments.file, files::IfThere::kRefuse));
  auto config = TRY(StatedSettings(arguments));
  config.scan.api_key.clear();  // stays where it came from
  const bool heats = !config.pattern.material.empty();
  const std::string text = fmt::format(
      "# {}: what differs from the defaults. trammel config keys lists all keys.\n{}{}",
      procedure::PrinterName(config.scan.address),
      heats ? "" : "# Nothing is heated on a guess: name the filament's material in [filament].\n",
      files::DescribeChanges(config));
  TRY(files::ParseConfig(text, arguments.file));
  TRY(files::WriteWholeFile(arguments.file, text, files::IfThere::kRefuse));
  fmt::print("written           {}\n", arguments.file);
  PrintWrapped("to check it",
               fmt::format("trammel doctor --config {}{}", ShellQuoted(arguments.file),
                           heats ? "" : " --material pla"));
  return {};
}

}  // namespace

void AddConfigCommands(CLI::App& config, int& exit_code) {
  config.require_subcommand(1);

  CLI::App* check =
      config.add_subcommand("check", "say whether a file can be used, or what is wrong");
  auto file = std::make_shared<std::string>("trammel.toml");
  check->add_option("FILE", *file, "settings")->capture_default_str();
  check->callback([file, &exit_code] { exit_code = CodeOf(Check(*file)); });

  CLI::App* init = config.add_subcommand(
      "init", "write a file with what the printer states of itself and the defaults do not have");
  const auto arguments = std::make_shared<InitArguments>();
  init->add_option("FILE", arguments->file, "new file")->capture_default_str();
  AddAddressOption(*init, arguments->printer.address);
  AddMaterialOption(*init, arguments->printer.material);
  init->callback([arguments, &exit_code] { exit_code = CodeOf(Init(*arguments)); });

  CLI::App* keys = config.add_subcommand(
      "keys", "print every key with its meaning, range and default, as a trammel.toml");
  keys->callback([] { fmt::print("{}", files::DescribeConfigKeys()); });
}

}  // namespace trammel::app
