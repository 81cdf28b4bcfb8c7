// trammel doctor: checks the whole set-up and says what to fix.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>

#include "app/commands.h"
#include "app/interrupt.h"
#include "app/printer_session.h"
#include "procedure/calibrate.h"
#include "procedure/checks.h"
#include "procedure/frame_recorder.h"

namespace trammel::app {
namespace {

procedure::Check CheckCamera(const procedure::Session& session,
                             const pressure_advance::ScanSettings& settings) {
  auto camera = OpenCamera(session, settings);
  if (!camera) return {"camera", false, camera.error().message};
  procedure::FrameRecorder recorder(**camera, 5);
  const auto frame = recorder.NextFrame(5, session.stop);
  if (!frame) return {"camera", false, frame.error().message};
  return {"camera", true, (*camera)->Describe()};
}

int RunDoctor(const PrinterOptions& options) {
  const Interrupt interrupt;
  const auto config = LoadSettings(options);
  if (!config) return Report(config.error());
  const auto printer = Connect(config->scan, interrupt.token());
  if (!printer) return Report(printer.error());
  const procedure::Session session{**printer, interrupt.token(), TellOnTerminal};
  auto checks = CheckPrinter(session, config->pattern, config->scan);
  checks.push_back(CheckCamera(session, config->scan));
  checks.push_back(
      procedure::CheckDisk(std::filesystem::current_path(), 60, config->scan.frames_per_s));
  bool all = true;
  for (const procedure::Check& check : checks) {
    fmt::print("{}  {:<24} {}\n", check.passed ? "ok " : "FIX", check.name, check.detail);
    all = all && check.passed;
  }
  return all ? kExitGood : kExitMachine;
}

}  // namespace

void AddDoctorCommand(CLI::App& parent, int& exit_code) {
  CLI::App* command = parent.add_subcommand("doctor", "check the whole set-up and say what to fix");
  const auto options = std::make_shared<PrinterOptions>();
  AddPrinterOptions(*command, *options);
  AddCameraOption(*command, *options);
  command->callback([options, &exit_code] { exit_code = RunDoctor(*options); });
}

}  // namespace trammel::app
