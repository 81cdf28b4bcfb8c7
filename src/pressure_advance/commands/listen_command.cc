// trammel pa listen: a service that calibrates when the printer's screen asks for it.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>

#include "app/commands.h"
#include "app/interrupt.h"
#include "app/printer_session.h"
#include "pressure_advance/commands/calibration_run.h"
#include "pressure_advance/commands/listener.h"
#include "pressure_advance/commands/pressure_advance_commands.h"
#include "session/dead_run.h"
#include "session/run_journal.h"
#include "settings/material.h"

namespace trammel::app {
namespace {

struct ListenArguments {
  PrinterOptions printer;
  std::string out = "recordings";
  bool keep_full = false;
};

// At start the printer's computer may not be up yet, nor its Moonraker.
Result<std::unique_ptr<machine::Printer>> ConnectPatiently(const settings::ScanSettings& settings,
                                                           const std::stop_token& stop) {
  constexpr double kAgain_s = 5;
  std::string last;
  for (;;) {
    auto printer = Connect(settings, stop);
    if (printer || printer.error().kind != ErrorKind::kMachine) return printer;
    if (printer.error().message != last) {
      last = printer.error().message;
      fmt::print(stderr, "trammel: {}; trying again every {:.0f} s\n", last, kAgain_s);
    }
    if (!procedure::Pause(kAgain_s, stop)) return Fail("stopped", ErrorKind::kInterrupted);
  }
}

int RunListen(const ListenArguments& arguments) {
  const Interrupt interrupt;
  const auto config = LoadSettings(arguments.printer);
  if (!config) return PrintError(config.error());
  // The file may be edited meanwhile: each calibration looks again, and is refused without one.
  if (auto told = settings::ValidateTemperatures(config->pattern); told) {
    fmt::print(stderr, "calibrations are heated to {}\n",
               settings::DescribeTemperatures(config->pattern));
  } else {
    fmt::print(stderr, "trammel: no calibration as things are: {}\n", told.error().message);
  }
  const auto printer = ConnectPatiently(config->scan, interrupt.token());
  if (!printer) return PrintError(printer.error());
  // A service that died is started again: its heaters are not left to the printer's own limit.
  const procedure::Session session{**printer, interrupt.token(), TellOnTerminal};
  if (const auto state_folder = files::StateFolder()) {
    procedure::FinishDeadRunsWhereFree(session, config->scan, *state_folder);
  }
  Listener listener(**printer, arguments.printer, arguments.out, arguments.keep_full,
                    interrupt.token());
  if (auto registered = listener.Register(); !registered) return PrintError(registered.error());
  fmt::print(stderr, "listening for TRAMMEL_CALIBRATE_PRESSURE_ADVANCE and TRAMMEL_APPLY at {}\n",
             config->scan.address);
  return listener.Serve() ? kExitInterrupted : kExitGood;
}

}  // namespace

void AddListenCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command = parent.add_subcommand(
      "listen", "wait, and calibrate when the printer's screen asks for it (klipper/README.md)");
  const auto arguments = std::make_shared<ListenArguments>();
  AddPrinterOptions(*command, arguments->printer);
  AddCameraOption(*command, arguments->printer);
  AddMaterialOption(*command, arguments->printer.material);
  command->add_option("--out", arguments->out, "folder in which each calibration gets its own")
      ->capture_default_str();
  AddKeepFullOption(*command, arguments->keep_full);
  command->callback([arguments, &exit_code] { exit_code = RunListen(*arguments); });
}

}  // namespace trammel::app
