// Path of the head that moves the laser along each printed line.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "machine/moonraker/printer_facts.h"
#include "pressure_advance/pattern/pattern_geometry.h"
#include "settings/printer.h"
#include "settings/scan_settings.h"

namespace trammel::procedure {

/// Positions are the nozzle's, in the printer's coordinates, unless stated otherwise.
struct Sweep {
  std::size_t line = 0;  ///< index in the plan
  double pressure_advance_s = 0;
  double start_x_mm = 0;
  double start_y_mm = 0;
  double end_x_mm = 0;
  double end_y_mm = 0;
  double along_x = 1;  ///< unit vector of the print direction
  double along_y = 0;
  /// The laser's position along the line, from the printed start, is the nozzle's projection on
  /// `along` minus this.
  double origin_mm = 0;
  int pattern = 0;  ///< index in the plan

  [[nodiscard]] double PositionOf(double nozzle_x_mm, double nozzle_y_mm) const {
    return nozzle_x_mm * along_x + nozzle_y_mm * along_y - origin_mm;
  }
};

/// Straight part of a run: along a line, or from one line to the next. Positions are the nozzle's;
/// "way" is the distance travelled, beginning with the first line's position at its start. So for a
/// run of one line, way and position along the line are equal.
struct PathLeg {
  double x_mm = 0;  ///< start point
  double y_mm = 0;
  double along_x = 1;  ///< unit vector of the motion
  double along_y = 0;
  double begin_mm = 0;  ///< way at its begin
  double length_mm = 0;
  const Sweep* sweep = nullptr;  ///< the line; null on the way to the next one
};

/// Returns every sweep of a run and the paths between them. The sweeps must outlive the legs.
[[nodiscard]] std::vector<PathLeg> PathOf(std::span<const Sweep> run);

/// One line of a run: the ways between which it was swept, and the relation of position and way.
struct SweptStretch {
  double begin_mm = 0;   ///< way at which the sweep along the line begins
  double end_mm = 0;     ///< and ends
  double origin_mm = 0;  ///< way at which the line's printed start was passed, or would have been
  double direction = 1;  ///< -1 where the sweep ran against the print

  [[nodiscard]] double PositionOf(double way_mm) const { return direction * (way_mm - origin_mm); }
};

/// Returns one stretch for each sweep of the run.
[[nodiscard]] std::vector<SweptStretch> StretchesOf(std::span<const Sweep> run);

/// Consecutive sweeps without a stop: the head turns from one line to the next.
struct SweepRun {
  std::size_t first = 0;  ///< index into SweepPlan::sweeps
  std::size_t count = 1;
};

struct SweepPlan {
  std::vector<Sweep> sweeps;   ///< in line order
  std::vector<SweepRun> runs;  ///< in line order, complete
  double z_mm = 0;             ///< focus height
  double speed_mm_s = 0;
  double settle_s = 0;  ///< standing at either end of a run

  [[nodiscard]] std::span<const Sweep> Of(const SweepRun& run) const {
    return std::span(sweeps).subspan(run.first, run.count);
  }
  /// Returns the longest part from the run's beginning that does not exceed the laser's maximum
  /// time at this speed (> 0); at least one line. REQUIRES run.count > 0.
  [[nodiscard]] SweepRun FirstPartOf(const SweepRun& run, double at_mm_s) const;
};

/// Parts of a scan's time. All exclude the commands' own time, and the camera's latency: some 0.1 s
/// a run.
struct ScanTime {
  double sweeping_s = 0;    ///< along the lines
  double turning_s = 0;     ///< between lines within a run
  double standing_s = 0;    ///< pauses at the ends of runs
  double travelling_s = 0;  ///< between the runs, and from where the print ended

  [[nodiscard]] double total_s() const {
    return sweeping_s + turning_s + standing_s + travelling_s;
  }
};

/// @param from  where the nozzle was left
[[nodiscard]] ScanTime TimeOf(const SweepPlan& plan, const settings::PrinterSettings& printer,
                              double acceleration_mm_s2, const pressure_advance::PointMm& from);

using machine::Reach;

/// Plans one sweep along each line of one pattern, or of all patterns if none is given: from run_up
/// before the first scored position to run_up after the last, `skip` inside the line's ends.
/// `lines_at_once` neighbouring lines are swept without a stop, a run in less time than the laser
/// may be on; a run's first line in print direction, the others from their nearer end.
/// Errors: kInput if the plan has no such pattern, skip leaves nothing of a line or not where it
/// accelerates, or the sweep leaves too few frames of its slow stretches; kSafety if the head would
/// leave its reach, with the line, the position and the bound.
[[nodiscard]] Result<SweepPlan> PlanSweeps(const pressure_advance::PatternPlan& plan,
                                           std::optional<int> pattern,
                                           const settings::ScanSettings& settings,
                                           const Reach& reach);

/// Returns the pattern as printed right before its scan: the nozzle ends at the first sweep's
/// start, at the focus height, without a move between. Unchanged if the settings name a parking
/// position, if the sweeps cannot be planned, and if the nozzle would ooze on the pattern.
[[nodiscard]] pressure_advance::PatternConfig ParkedForScan(
    const pressure_advance::PatternConfig& pattern, const settings::ScanSettings& settings,
    const Reach& reach);

/// Returns the sweeps as G-code, for `--dry-run`: the procedure's commands one by one.
[[nodiscard]] std::string DescribeSweeps(const SweepPlan& plan,
                                         const settings::ScanSettings& settings,
                                         double travel_speed_mm_s);

/// Moves the camera to its focus height, and resets speeds to the written ones: an earlier override
/// (M220) would let the laser burn longer than the printer's own limit, or blur frames.
[[nodiscard]] std::string FocusGcode(double z_mm, double speed_mm_s);

/// Returns the move to a sweep's start, and the moves of a run in order. Requires absolute
/// millimetres (G90).
[[nodiscard]] std::string TravelGcode(const Sweep& sweep, double travel_speed_mm_s);
[[nodiscard]] std::vector<std::string> SweepGcode(std::span<const Sweep> run, double speed_mm_s);

}  // namespace trammel::procedure
