// trammel doctor: checks the whole set-up and lists faults with remedies.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <memory>
#include <vector>

#include "app/applied_result.h"
#include "app/commands.h"
#include "app/config/config_file.h"
#include "app/interrupt.h"
#include "app/printer_session.h"
#include "app/secrets.h"
#include "app/stated_settings.h"
#include "pressure_advance/commands/pressure_advance_commands.h"
#include "pressure_advance/procedure/calibrate.h"
#include "pressure_advance/procedure/scan.h"
#include "pressure_advance/procedure/scan_checks.h"
#include "session/checks.h"
#include "session/crash_recovery.h"
#include "session/frame_recorder.h"
#include "session/run_journal.h"
#include "session/session.h"

namespace trammel::app {
namespace {

struct DoctorOptions {
  PrinterOptions printer;
  bool laser = false;
};

using procedure::Check;
using procedure::NameStopReason;
using procedure::NotMade;

// The laser is always switched off afterwards.
std::vector<Check> SeeLaser(const procedure::Session& session, procedure::FrameRecorder& recorder,
                            const settings::ScanSettings& settings) {
  constexpr double kCommand_s = 30;
  const auto seen = procedure::CheckLaser(session, recorder, settings);
  const auto off = session.printer.Run(settings.laser_off_gcode, {kCommand_s});
  if (!off) {
    return {Check{"laser", false, "SWITCH IT OFF BY HAND: " + off.error().message}};
  }
  if (!seen) return {NotMade("laser", NameStopReason(session.stop, seen.error()))};
  return {Check{"laser", true, "the camera sees it"}, procedure::CheckLaserLine(*seen, settings)};
}

std::vector<Check> CheckCamera(const procedure::Session& session,
                               const settings::ScanSettings& settings, bool laser) {
  constexpr double kStall_s = 5;
  constexpr int kFrames = 30;
  auto camera = OpenCamera(session, settings);
  if (!camera) return {NotMade("camera", NameStopReason(session.stop, camera.error()))};
  procedure::FrameRecorder recorder(**camera, kStall_s);
  double begin_s = 0;
  for (int i = 0; i <= kFrames; ++i) {
    const auto frame = recorder.NextFrame(kStall_s, session.stop);
    if (!frame) return {NotMade("camera", NameStopReason(session.stop, frame.error()))};
    if (i == 0) begin_s = frame->arrival_s;
    if (i == kFrames) {
      const double rate = kFrames / std::max(1e-3, frame->arrival_s - begin_s);
      const bool fast = rate > 0.8 * settings.frames_per_s;
      std::vector<Check> checks = {
          {"camera", fast,
           fmt::format(
               "{}, {:.1f} frames/s{}", (*camera)->Describe(), rate,
               fast ? ""
                    : fmt::format(": set [camera] fps to that, now {}, or the camera to its rate",
                                  settings.frames_per_s))}};
      if (!laser) return checks;
      const std::vector<Check> seen = SeeLaser(session, recorder, settings);
      checks.insert(checks.end(), seen.begin(), seen.end());
      return checks;
    }
  }
  return {};
}

// Reports the remains of a crashed run; the next run clears them.
Check CheckEarlierRuns(const procedure::Session& session, const std::string& address) {
  const auto folder = files::StateFolder();
  if (!folder) return {"earlier runs", false, folder.error().message};
  const std::string left =
      procedure::DescribeDeadRun(session, *folder, procedure::PlainAddress(address));
  return {"earlier runs", left.empty(), left.empty() ? "none left anything" : left, true};
}

// Reports an unfinished apply; the next apply settles it, too.
Check CheckLastApply(const procedure::Session& session, const std::string& address) {
  const auto left =
      SettleUnfinished(measurement::Instrument::kPressureAdvance, address,
                       machine::ActiveAdvance_s(session.printer.LastState()), /*note=*/false);
  if (!left) return {"last apply", false, left.error().message};
  return {"last apply", left->empty(), left->empty() ? "noted to its end" : *left, true};
}

// Checks only secrets in the settings' file: a key from the environment is no fault of it.
std::vector<Check> CheckSecrets(const PrinterOptions& options, const settings::ScanSettings& used) {
  const auto text = FindConfig(options.config);
  if (!text) return {};
  const auto in_file = files::ParseConfig(text->text, text->file);
  if (!in_file) return {};
  return CheckSecretFiles(
      FilesWithSecrets(text->file, in_file->scan, used.api_key_file, options.camera));
}

// A printer with neither laser nor camera is calibrated from a phone's photo: the requirements of a
// scan are advice then, unless a setting or an option requests it.
void AdviseOnScan(const files::Config& config, const DoctorOptions& options,
                  std::vector<Check>& checks) {
  const auto of_a_scan = [](const Check& check) {
    return check.name == "camera" || check.name == "[scan] laser_on_gcode" ||
           check.name == "[scan] laser_off_gcode";
  };
  const bool asked = options.laser || !options.printer.camera.empty() ||
                     config.IsSet("camera.url") || config.IsSet("scan.laser_on_gcode");
  const bool some = std::ranges::any_of(checks, [&](const Check& check) {
    return of_a_scan(check) && (check.passed || check.stopped);
  });
  if (asked || some) return;
  for (Check& check : checks) {
    if (!of_a_scan(check)) continue;
    check.advice = true;
    check.detail += "; a phone's photo needs none (trammel pa print --photo)";
  }
}

Result<int> RunDoctor(const DoctorOptions& options) {
  const Interrupt interrupt;
  auto config = TRY(LoadSettings(options.printer));
  const auto printer = TRY(Connect(config.scan, interrupt.token()));
  const procedure::Session session{*printer, interrupt.token(), ShowProgress};
  TRY(TakeStatedBy(session, StatedFor::kPattern, config));
  auto checks = CheckPrinter(session, {config.pattern}, config.scan);
  const bool ready = FirstFailure(checks, ErrorKind::kMachine).has_value();
  const auto add = [&checks](std::vector<Check> more) {
    checks.insert(checks.end(), more.begin(), more.end());
  };
  const Check earlier = CheckEarlierRuns(session, config.scan.address);
  add({earlier, CheckLastApply(session, config.scan.address)});
  if (ready) add(CheckTiming(session));
  add(CheckCamera(session, config.scan, options.laser && ready && earlier.passed));
  add(CheckSecrets(options.printer, config.scan));
  add({procedure::CheckDisk(std::filesystem::current_path(), 60, config.scan.frames_per_s)});
  AdviseOnScan(config, options, checks);
  bool all = true;
  bool stopped = false;
  for (const Check& check : checks) {
    fmt::print("{}  {:<24} {}\n",
               check.passed    ? "ok "
               : check.stopped ? "---"
               : check.advice  ? "tip"
                               : "FIX",
               check.name, check.detail);
    all = all && (check.passed || check.advice);
    stopped = stopped || check.stopped;
  }
  if (stopped) return kExitInterrupted;
  return all ? kExitGood : kExitMachine;
}

}  // namespace

void AddDoctorCommand(CLI::App& doctor, int& exit_code) {
  const auto options = std::make_shared<DoctorOptions>();
  AddPrinterOptions(doctor, options->printer);
  AddCameraOption(doctor, options->printer);
  AddMaterialOption(doctor, options->printer.material);
  doctor.add_flag(
      "--laser", options->laser,
      "switch the laser on for some pictures; the head must stand at the focus height, and no "
      "other trammel may have the printer");
  doctor.callback([options, &exit_code] { exit_code = CodeOf(RunDoctor(*options)); });
}

}  // namespace trammel::app
