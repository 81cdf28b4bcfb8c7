// trammel-sim printer: serves the virtual printer until it is interrupted.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/commands.h"
#include "app/interrupt.h"
#include "app/option_values.h"
#include "sim/camera/camera_http.h"
#include "sim/camera/camera_server.h"
#include "sim/camera/machine_host.h"
#include "sim/camera/scan_recorder.h"
#include "sim/commands/commands.h"
#include "sim/commands/printer_options.h"
#include "sim/moonraker/server.h"
#include "sim/print/conditions.h"

namespace trammel::app {
namespace {

struct PrinterArguments {
  int port = 7125;
  std::string api_key;
  std::uint64_t seed = 0;
  std::optional<double> pressure_advance_s;
  std::string condition = "matte-black-dark";
  double speed = 1;
  std::optional<double> hurry;
  double laser_limit_s = 30;
  double heater_limit_s = 1800;
  CameraArguments camera;
  std::vector<std::string> faults;
  std::optional<double> for_s;
  std::string truth;
  CellArguments cell;
  std::vector<std::string> tools;
  std::string spool;  // empty: no Spoolman
};

// Parses TOOL:X,Y, each named "tool T<number>" as usual with klipper-toolchanger.
Result<std::vector<sim::ToolConfig>> ToolsOf(const std::vector<std::string>& texts) {
  constexpr int kMaxTool = 99;
  std::vector<sim::ToolConfig> tools;
  for (const std::string& text : texts) {
    const auto shift = TRY(ParseToolShift("--tool", text, kMaxTool));
    for (const sim::ToolConfig& tool : tools) {
      if (tool.number == shift.tool) {
        return Fail(fmt::format("--tool {}: tool {} was given before", text, shift.tool));
      }
    }
    tools.push_back({shift.tool, fmt::format("tool T{}", shift.tool), {shift.x_mm, shift.y_mm, 0}});
  }
  return tools;
}

sim::MachineOptions MachineOf(const PrinterArguments& arguments, const sim::KlipperFaults& faults,
                              const std::optional<sim::LoadCellConfig>& cell,
                              const std::vector<sim::ToolConfig>& tools) {
  sim::MachineOptions options;
  options.klipper = sim::DefaultKlipperConfig(arguments.laser_limit_s, arguments.heater_limit_s);
  options.klipper.load_cell = cell;
  options.klipper.tools = tools;
  if (cell) sim::AddTapMacros(options.klipper);
  options.faults = faults;
  options.seed = arguments.seed;
  options.pressure_advance_s = arguments.pressure_advance_s;
  options.speed = arguments.speed;
  options.hurry = arguments.hurry;
  return options;
}

Result<void> ServePrinter(const PrinterArguments& arguments) {
  PrinterFaults faults;
  std::vector<sim::CameraFault> camera_faults;
  for (const std::string& fault : arguments.faults) {
    TRY(SetFault(fault, &faults, arguments.camera.port ? &camera_faults : nullptr));
  }
  const Result<sim::Condition> condition = sim::ParseCondition(arguments.condition);
  if (!condition) return Fail("--condition: " + condition.error().message);
  const auto cell = TRY(LoadCellOf(arguments.cell, arguments.seed));
  const auto tools = TRY(ToolsOf(arguments.tools));
  std::optional<TapTruthFile> tap_truth;
  if (!arguments.cell.truth.empty()) {
    tap_truth = TRY(TapTruthFile::Create(arguments.cell.truth));
  }
  if (!arguments.camera.port &&
      (arguments.camera.rigged() || !arguments.camera.truth_file.empty())) {
    return Fail(
        "--camera-truth, --rig, --rig-error and --rig-truth: this printer serves no camera; add "
        "--camera-port");
  }
  const EndOfServing end;
  const auto machine = std::make_shared<sim::MachineHost>(
      MachineOf(arguments, faults.klipper, cell, tools), sim::MonotonicNow());
  if (!arguments.truth.empty()) {
    TRY(sim::WriteTruthFile(arguments.truth, {machine->true_pressure_advance_s()}, arguments.seed,
                            sim::ToString(*condition)));
  }
  sim::ServerOptions server_options;
  server_options.port = static_cast<std::uint16_t>(arguments.port);
  server_options.hub.api_key = arguments.api_key;
  server_options.hub.seed = arguments.seed;
  server_options.hub.faults = faults.server;
  if (!arguments.spool.empty()) {
    server_options.hub.spoolman = std::make_shared<sim::VirtualSpoolman>();
    server_options.hub.spoolman->AddSpool("", arguments.spool, "");
  }
  const MachineWorld world{arguments.seed, *condition, arguments.speed};
  std::unique_ptr<sim::CameraServer> camera;
  if (arguments.camera.port) {
    camera = TRY(StartCamera(arguments.camera, camera_faults, world, machine));
    server_options.hub.camera_port = [&camera] { return camera->port(); };
  }
  const auto server = TRY(sim::PrinterServer::Start(*machine, server_options));
  fmt::print("listening http://127.0.0.1:{}\n", server->port());
  std::fflush(stdout);
  Result<void> taps;
  const auto write_taps = [&](bool rest) {
    if (!tap_truth) return false;
    machine->With(
        [&](const sim::VirtualKlipper& klipper) { taps = tap_truth->Write(klipper, rest); });
    return !taps.has_value();
  };
  end.Wait(arguments.for_s, [&] { return write_taps(false); });
  if (taps) (void)write_taps(true);
  return taps;
}

}  // namespace

void AddSimPrinter(CLI::App& parent, int& exit_code) {
  const auto arguments = std::make_shared<PrinterArguments>();
  CLI::App* printer = parent.add_subcommand(
      "printer", "be a printer: Moonraker in front of Klipper, on this machine only");
  printer->add_option("--port", arguments->port, "of 127.0.0.1; 0 takes a free one")
      ->check(CLI::Range(0, 65535))
      ->capture_default_str();
  printer->add_option("--api-key", arguments->api_key, "clients have to bear it");
  printer->add_option("--seed", arguments->seed, "names the whole world")
      ->check(SeedNumber())
      ->capture_default_str();
  printer
      ->add_option("--pressure-advance", arguments->pressure_advance_s,
                   "the truth in s; without it, drawn from the seed")
      ->check(NumberIn(0.0001, 10.0));
  printer
      ->add_option("--condition", arguments->condition,
                   "plate, filament and light, as for trammel-sim scan")
      ->capture_default_str();
  printer->add_option("--speed", arguments->speed, "how many times faster than life")
      ->check(NumberIn(0.1, 1000.0))
      ->capture_default_str();
  printer
      ->add_option("--hurry", arguments->hurry,
                   "the same while it prints, moves, heats or cools and the laser has been "
                   "off for 10 s: scans keep their speed")
      ->check(NumberIn(0.1, 1000.0));
  printer
      ->add_option("--laser-limit", arguments->laser_limit_s,
                   "s after which the printer itself switches the laser off")
      ->check(NumberIn(0.1, 1e6))
      ->capture_default_str();
  printer
      ->add_option("--heater-limit", arguments->heater_limit_s,
                   "s after which it switches laser and heaters off, unless trammel says a word")
      ->check(NumberIn(0.1, 1e6))
      ->capture_default_str();
  AddCameraOptions(*printer, arguments->camera);
  printer->add_option("--fault", arguments->faults,
                      "NAME=NUMBER, may be given again; names: " + PrinterFaultNames() +
                          "; with --camera-port: " + CameraFaultNames());
  printer->add_option("--for", arguments->for_s, "s after which it ends by itself")
      ->check(NumberIn(0.0, 1e6));
  printer->add_option("--truth", arguments->truth, "new file for what the printer really is");
  printer->add_option("--load-cell", arguments->cell.name,
                      "the head bears one: its name, or drawn for one of the seed");
  printer
      ->add_option("--bed-height", arguments->cell.bed_height_mm,
                   "mm of the bed at x = y = 0; without it, drawn from the seed")
      ->check(NumberIn(-4.0, 50.0));
  printer->add_flag("--pull-back", arguments->cell.pulls_back,
                    "PROBE pulls back and tells whole taps, as Klipper's forks do");
  printer->add_option("--tap-truth", arguments->cell.truth,
                      "new file for what each tap really was, a line of JSON for each");
  printer->add_option("--tool", arguments->tools,
                      "TOOL:X,Y, a tool of klipper-toolchanger with its offset in mm; may be "
                      "given again");
  printer->add_option("--spool", arguments->spool,
                      "Moonraker knows of a Spoolman; a spool of this filament is on the printer");
  printer->callback([arguments, &exit_code] {
    const Result<void> done = ServePrinter(*arguments);
    exit_code = done ? kExitGood : PrintError(done.error());
  });
}

}  // namespace trammel::app
