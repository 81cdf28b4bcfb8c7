// trammel pa setup: measures how laser and camera sit on the print head.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/commands.h"
#include "app/interrupt.h"
#include "app/new_folder.h"
#include "app/printer_session.h"
#include "app/provenance.h"
#include "app/stated_settings.h"
#include "pressure_advance/commands/calibration_run.h"
#include "pressure_advance/commands/pressure_advance_commands.h"
#include "pressure_advance/commands/setup_output.h"
#include "pressure_advance/procedure/setup.h"
#include "pressure_advance/setup/printed_mark.h"
#include "session/dead_run.h"
#include "settings/material.h"

namespace trammel::app {
namespace {

namespace fs = std::filesystem;

struct SetupArguments {
  PrinterOptions printer;
  std::string out;
  std::string write;
  std::vector<double> clear_z;
  std::vector<double> mark_at;
  bool dry_run = false;
  bool json = false;
};

procedure::SetupRequest SetupRequestOf(const SetupArguments& arguments,
                                       const files::Config& config) {
  const auto run = RequestFor(config, {});
  procedure::SetupRequest request;
  request.pattern = run.pattern;
  request.settings = run.settings;
  request.started = run.started;
  request.run = run.run;
  request.clear = {arguments.clear_z.at(0), arguments.clear_z.at(1)};
  if (!arguments.mark_at.empty()) {
    request.mark = {arguments.mark_at.at(0), arguments.mark_at.at(1)};
  }
  return request;
}

// The mark's G-code, and where the head goes, whatever a printer would say.
Result<void> PrintSetupDryRun(const procedure::SetupRequest& request) {
  TRY(settings::ValidateTemperatures(request.pattern));
  constexpr double kFar_mm = 2000;  // a printer says how far it reaches, and none is asked
  procedure::Reach anywhere;
  anywhere.minimum_mm.fill(-kFar_mm);
  anywhere.maximum_mm.fill(kFar_mm);
  TRY(CheckClearHeights(request.clear, request.settings, anywhere));
  const auto mark = TRY(PlanMark(request.pattern, request.mark, request.settings.camera_offset_x_mm,
                                 request.settings.camera_offset_y_mm));
  fmt::print("; --- print ---\n{}", WriteMarkGcode(mark, request.pattern));
  const double x_mm = mark.x_mm - request.settings.camera_offset_x_mm;
  const double y_mm = mark.y_mm - request.settings.camera_offset_y_mm;
  fmt::print(
      "; --- looks ---\n; mark at ({:.1f}, {:.1f}) mm; the nozzle goes from {:.4g} to {:.4g} mm, "
      "about ({:.1f}, {:.1f}) mm and beside it\n",
      mark.x_mm, mark.y_mm, request.clear.low_mm, request.clear.high_mm, x_mm, y_mm);
  return {};
}

// Says what is not as it was, as CalibrateInto does.
Result<void> DoneOf(const procedure::SetupOutcome& outcome, const fs::path& folder) {
  std::string unrestored;
  for (const std::string& failure : outcome.unrestored) {
    fmt::print(stderr, "trammel: NOT AS IT WAS: {}\n", failure);
    unrestored += (unrestored.empty() ? "" : "; ") + failure;
  }
  std::error_code ignored;
  if (!outcome.done) {
    if (!fs::is_empty(folder, ignored)) {
      fmt::print(stderr, "trammel: the pictures so far are in {}\n", folder.string());
    }
    return outcome.done;
  }
  if (unrestored.empty()) return {};
  return Fail("the printer is not as it was: " + unrestored, ErrorKind::kMachine);
}

int RunSetup(const SetupArguments& arguments) {
  const Interrupt interrupt;
  auto config = LoadSettings(arguments.printer);
  if (!config) return PrintError(config.error());
  auto request = SetupRequestOf(arguments, *config);
  if (auto told = settings::ValidateTemperatures(request.pattern); !told) {
    return PrintError(told.error());
  }
  if (arguments.dry_run) {
    const auto done = PrintSetupDryRun(request);
    return done ? static_cast<int>(kExitGood) : PrintError(done.error());
  }
  SetupOutput output;
  output.json = arguments.json;
  output.printer = procedure::PrinterName(config->scan.address);
  if (!arguments.write.empty()) {
    auto target = ReadCameraTarget(arguments.write);
    if (!target) return PrintError(target.error());
    output.target = std::move(*target);
  }
  const auto printer = Connect(config->scan, interrupt.token());
  if (!printer) return PrintError(printer.error());
  const procedure::Session session{**printer, interrupt.token(), TellOnTerminal};
  if (auto fitted = FitPattern(session, *config); !fitted) return PrintError(fitted.error());
  request.pattern = config->pattern;
  const auto folder = NewFolder::Make(arguments.out.empty()
                                          ? fs::path("recordings") /
                                                RecordingName(measurement::Instrument::kCameraSetup)
                                          : fs::path(arguments.out));
  if (!folder) return PrintError(folder.error());
  output.folder = request.folder = folder->path();
  const auto outcome = SetUpCamera(session, request);
  const auto done = DoneOf(outcome, request.folder);
  if (!outcome.done) return PrintError(done.error());
  const int code = PrintSetup(outcome.record, output);
  return done ? code : PrintError(done.error());
}

}  // namespace

void AddSetupCommand(CLI::App& parent, int& exit_code) {
  const auto arguments = std::make_shared<SetupArguments>();
  CLI::App* setup = parent.add_subcommand(
      "setup", "measure how laser and camera sit on the head, by the printer's own motion");
  AddPrinterOptions(*setup, arguments->printer);
  AddCameraOption(*setup, arguments->printer);
  AddMaterialOption(*setup, arguments->printer.material);
  setup
      ->add_option("--clear-z", arguments->clear_z,
                   "LOW,HIGH in mm: heights of the nozzle between which you have seen that nothing "
                   "on the head touches anything")
      ->delimiter(',')
      ->expected(2)
      ->required();
  setup
      ->add_option("--mark-at", arguments->mark_at,
                   "X,Y in mm: where the mark is printed; left out: so that mark and head lie "
                   "about the bed's middle")
      ->delimiter(',')
      ->expected(2);
  setup->add_option("-o,--out", arguments->out, "new folder for pictures, values and report");
  setup->add_option("--write", arguments->write,
                    "a trammel.toml that receives the values; left out: they are printed alone");
  setup->add_flag("--json", arguments->json, "print the answer as one JSON object");
  setup->add_flag("--dry-run", arguments->dry_run,
                  "print the mark's G-code and where the head goes, do nothing");
  setup->callback([arguments, &exit_code] { exit_code = RunSetup(*arguments); });
}

}  // namespace trammel::app
