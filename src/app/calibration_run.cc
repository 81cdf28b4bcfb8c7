#include "app/calibration_run.h"

#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <string>

#include "pressure_advance/pattern.h"
#include "pressure_advance/pattern_plan.h"
#include "procedure/sweep_plan.h"
#include "settings/material.h"

namespace trammel::app {

CalibrationRun CalibrateInto(const procedure::Session& session,
                             const procedure::CalibrationRequest& request) {
  const procedure::CalibrationOutcome outcome = Calibrate(session, request);
  CalibrationRun run{outcome.done, outcome.unrestored.empty(), outcome.bed_c};
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
  } else if (!run.restored) {
    run.done = Fail("the printer is not as it was: " + unrestored, ErrorKind::kMachine);
  }
  return run;
}

Result<void> PrintDryRun(pressure_advance::PatternConfig pattern,
                         const pressure_advance::ScanSettings& settings, const DryRun& shown) {
  if (shown.print) {
    if (auto told = trammel::settings::ValidateTemperatures(pattern); !told) return told;
  }
  pattern.finish = pressure_advance::Finish::kIdle;  // as it is printed: the scan follows
  const auto layout = LayOut(pattern);
  procedure::Reach reach;
  reach.minimum_mm = {pattern.bed_origin_x_mm, pattern.bed_origin_y_mm, 0};
  reach.maximum_mm = {pattern.bed_origin_x_mm + pattern.bed_size_x_mm,
                      pattern.bed_origin_y_mm + pattern.bed_size_y_mm, 1000};
  const auto sweeps =
      procedure::PlanSweeps(MakePlan(layout, pattern, "pattern.gcode"), {}, settings, reach);
  if (!sweeps) return tl::unexpected(sweeps.error());
  if (shown.print) fmt::print("; --- print ---\n{}", WriteGcode(layout, pattern));
  if (shown.scan) {
    fmt::print("; --- scan, about {:.0f} s{} ---\n{}", sweeps->time_s(),
               settings.scan_nozzle_temperature_c > 0
                   ? fmt::format(", nozzle at {:.4g} degC", settings.scan_nozzle_temperature_c)
                   : ", nozzle off",
               DescribeSweeps(*sweeps, settings, pattern.travel_speed_mm_s));
  }
  return {};
}

}  // namespace trammel::app
