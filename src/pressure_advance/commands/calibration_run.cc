#include "pressure_advance/commands/calibration_run.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <string>
#include <utility>

#include "app/printer_session.h"
#include "app/provenance.h"
#include "app/stated_settings.h"
#include "pressure_advance/commands/machine_time.h"
#include "pressure_advance/commands/noted_print.h"
#include "pressure_advance/pattern/pattern.h"
#include "pressure_advance/pattern/pattern_geometry.h"
#include "pressure_advance/pattern/pattern_plan.h"
#include "pressure_advance/procedure/recording_cutter.h"
#include "pressure_advance/procedure/scan_checks.h"
#include "pressure_advance/procedure/sweep_plan.h"
#include "settings/material.h"

namespace trammel::app {
void AddKeepFullOption(CLI::App& command, bool& keep_full) {
  command.add_flag("--keep-full", keep_full,
                   "keep every frame of the recording whole, some 150 MB instead of 5");
}

procedure::CalibrationRequest RequestFor(const files::Config& config,
                                         std::filesystem::path folder) {
  procedure::CalibrationRequest request;
  request.pattern = config.pattern;
  request.settings = config.scan;
  request.folder = std::move(folder);
  request.started = UtcNow();
  request.run = NewRunName();
  return request;
}

CalibrationRun CalibrateInto(const procedure::Session& session,
                             procedure::CalibrationRequest request) {
  request.note_print = [&](bool ended) { return NotePrint(session, request, ended); };
  const procedure::CalibrationOutcome outcome = Calibrate(session, request);
  CalibrationRun run{outcome.done, outcome.done.has_value(), outcome.bed_c};
  std::string unrestored;
  for (const std::string& failure : outcome.unrestored) {
    fmt::print(stderr, "trammel: NOT AS IT WAS: {}\n", failure);
    unrestored += (unrestored.empty() ? "" : "; ") + failure;
  }
  if (!run.done) {
    std::error_code ignored;
    if (!std::filesystem::is_empty(request.folder, ignored)) {
      fmt::print(stderr, "trammel: what was recorded so far is in {}\n", request.folder.string());
    }
  } else if (!unrestored.empty()) {
    run.done = Fail("the printer is not as it was: " + unrestored, ErrorKind::kMachine);
  }
  return run;
}

void CutRecordings(const std::vector<std::filesystem::path>& folders, const std::stop_token& stop) {
  std::fflush(stdout);  // the answer, before some seconds of cutting
  for (const std::filesystem::path& folder : folders) {
    for (const std::string& line : procedure::CutRecording(folder, stop)) {
      fmt::print(stderr, "trammel: {}\n", line);
    }
  }
}

Result<void> FitForDryRun(const PrinterOptions& options, const std::stop_token& stop,
                          files::Config& config) {
  if (options.address.empty() && !config.IsSet("moonraker.address")) return {};
  constexpr double kPatience_s = 3;
  const auto printer = Connect(config.scan, stop, kPatience_s);
  if (!printer) {
    const std::string& why = printer.error().message;
    fmt::print(stderr, "  the printer was not asked what it states of itself: {}\n",
               why.substr(0, why.find('\n')));
    return {};
  }
  const procedure::Session session{**printer, stop, TellOnTerminal};
  TRY(FitPattern(session, config));
  const auto facts = TRY(procedure::ReadFacts(session));
  return FirstFailure(CompareFacts(facts, procedure::NeedsOf({config.pattern})),
                      ErrorKind::kSafety);
}

Result<void> PrintDryRun(pressure_advance::PatternConfig pattern,
                         const settings::ScanSettings& settings, const DryRun& shown) {
  if (shown.print) {
    TRY(trammel::settings::ValidateTemperatures(pattern));
  }
  if (shown.for_photo) {
    fmt::print("; --- print ---\n{}", WriteGcode(LayOut(pattern), pattern));
    return {};
  }
  pattern.finish = pressure_advance::Finish::kIdle;  // as it is printed: the scan follows
  const procedure::Reach bed = BedOf(pattern);
  if (shown.print && shown.scan) pattern = procedure::ParkedForScan(pattern, settings, bed);
  const auto layout = LayOut(pattern);
  const auto sweeps =
      TRY(procedure::PlanSweeps(MakePlan(layout, pattern, "pattern.gcode"), {}, settings, bed));
  if (shown.print) fmt::print("; --- print ---\n{}", WriteGcode(layout, pattern));
  if (shown.scan) {
    const procedure::ScanTime time =
        TimeOf(sweeps, pattern, pattern.acceleration_mm_s2, ParkPoint(pattern));
    fmt::print("; --- scan, about {:.0f} s{} ---\n{}", time.total_s(),
               settings.scan_nozzle_temperature_c > 0
                   ? fmt::format(", nozzle at {:.4g} degC", settings.scan_nozzle_temperature_c)
                   : ", nozzle off",
               procedure::DescribeSweeps(sweeps, settings, pattern.travel_speed_mm_s));
  }
  return {};
}

}  // namespace trammel::app
