// Where the head goes so that the laser runs along each printed line.
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

/// Positions are the nozzle's, in the printer's coordinates, unless they say otherwise.
struct Sweep {
  std::size_t line = 0;  ///< of the plan
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
  int pattern = 0;  ///< of the plan

  [[nodiscard]] double PositionOf(double nozzle_x_mm, double nozzle_y_mm) const {
    return nozzle_x_mm * along_x + nozzle_y_mm * along_y - origin_mm;
  }
};

/// A straight part of a run: along a line, or from one line to the next. Positions are the
/// nozzle's; "way" is the distance that the head has come, from the first line's position at its
/// start on, so that of a run of one line way and position along the line are the same.
struct PathLeg {
  double x_mm = 0;  ///< where it begins
  double y_mm = 0;
  double along_x = 1;  ///< unit vector of the motion
  double along_y = 0;
  double begin_mm = 0;  ///< way at its begin
  double length_mm = 0;
  const Sweep* sweep = nullptr;  ///< the line; null on the way to the next one
};

/// Every sweep of a run and the ways between them. The sweeps outlive the legs.
[[nodiscard]] std::vector<PathLeg> PathOf(std::span<const Sweep> run);

/// One line of a run: between which ways it was swept, and which position is which way.
struct SweptStretch {
  double begin_mm = 0;   ///< way at which the sweep along the line begins
  double end_mm = 0;     ///< and ends
  double origin_mm = 0;  ///< way at which the line's printed start was passed, or would have been
  double direction = 1;  ///< -1 where the sweep ran against the print

  [[nodiscard]] double PositionOf(double way_mm) const { return direction * (way_mm - origin_mm); }
};

/// One stretch for each sweep of the run.
[[nodiscard]] std::vector<SweptStretch> StretchesOf(std::span<const Sweep> run);

/// Sweeps that follow one another without a stand: the head turns from one line to the next.
struct SweepRun {
  std::size_t first = 0;  ///< of SweepPlan::sweeps
  std::size_t count = 1;
};

struct SweepPlan {
  std::vector<Sweep> sweeps;   ///< in the order of the lines
  std::vector<SweepRun> runs;  ///< in the order of the lines, all of them
  double z_mm = 0;             ///< focus height
  double speed_mm_s = 0;
  double settle_s = 0;  ///< standing at either end of a run

  [[nodiscard]] std::span<const Sweep> Of(const SweepRun& run) const {
    return std::span(sweeps).subspan(run.first, run.count);
  }
  /// The longest part from the run's begin on that keeps the laser lit no longer than a run may be
  /// at this speed (> 0); at least one line. REQUIRES run.count > 0.
  [[nodiscard]] SweepRun FirstPartOf(const SweepRun& run, double at_mm_s) const;
};

/// What a scan's time is made of. All without what the commands take on their way, and the camera's
/// latency: some 0.1 s a run.
struct ScanTime {
  double sweeping_s = 0;    ///< along the lines
  double turning_s = 0;     ///< from one line to the next within a run
  double standing_s = 0;    ///< at the ends of the runs
  double travelling_s = 0;  ///< between the runs, and from where the print ended

  [[nodiscard]] double total_s() const {
    return sweeping_s + turning_s + standing_s + travelling_s;
  }
};

/// @param from  where the nozzle was left
[[nodiscard]] ScanTime TimeOf(const SweepPlan& plan, const settings::PrinterSettings& printer,
                              double acceleration_mm_s2, const pressure_advance::PointMm& from);

using machine::Reach;

/// One sweep along each line of one pattern, or of all patterns where none is named: from run_up
/// before the first scored place to run_up behind the last, `skip` inside the line's ends.
/// `lines_at_once` of them are swept without a stand where they lie beside one another, a run in
/// less time than the laser may stay on; a run's first line in print direction, the others from
/// their nearer end.
/// Errors: kInput where the plan has no such pattern, skip leaves nothing of a line or not where it
/// speeds up, or the sweep leaves too few frames of its slow stretches; kSafety
/// where the head would have to leave its reach, with the line, the position and the bound.
[[nodiscard]] Result<SweepPlan> PlanSweeps(const pressure_advance::PatternPlan& plan,
                                           std::optional<int> pattern,
                                           const settings::ScanSettings& settings,
                                           const Reach& reach);

/// The pattern as it is printed right before its scan: the nozzle is left where the first sweep
/// begins, at the focus height, so that nothing is in between. Unchanged where the settings name a
/// place to park, where the sweeps cannot be planned, and where the nozzle would ooze on the
/// pattern.
[[nodiscard]] pressure_advance::PatternConfig ParkedForScan(
    const pressure_advance::PatternConfig& pattern, const settings::ScanSettings& settings,
    const Reach& reach);

/// The sweeps as G-code, for `--dry-run`: what the procedure sends, command by command.
[[nodiscard]] std::string DescribeSweeps(const SweepPlan& plan,
                                         const settings::ScanSettings& settings,
                                         double travel_speed_mm_s);

/// Brings the camera to its focus height, and speeds to those written: an override that somebody
/// left over (M220) would let the laser burn longer than the printer's own limit, or blur frames.
[[nodiscard]] std::string FocusGcode(double z_mm, double speed_mm_s);

/// The move to a sweep's start, and the moves of a run in their order. Absolute millimetres (G90)
/// must be in force.
[[nodiscard]] std::string TravelGcode(const Sweep& sweep, double travel_speed_mm_s);
[[nodiscard]] std::vector<std::string> SweepGcode(std::span<const Sweep> run, double speed_mm_s);

}  // namespace trammel::procedure
