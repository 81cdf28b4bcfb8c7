// Where the head goes so that the laser runs along each printed line.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "pressure_advance/pattern/pattern_plan.h"
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

  [[nodiscard]] double PositionOf(double nozzle_x_mm, double nozzle_y_mm) const {
    return nozzle_x_mm * along_x + nozzle_y_mm * along_y - origin_mm;
  }
};

struct SweepPlan {
  std::vector<Sweep> sweeps;  ///< in the order of the lines
  double z_mm = 0;            ///< focus height
  double speed_mm_s = 0;
  double sweep_time_s = 0;  ///< of one sweep, without travels

  /// The whole scan without travels between lines, for a person who waits.
  [[nodiscard]] double time_s() const;
};

/// What the head can reach.
struct Reach {
  std::array<double, 3> minimum_mm{};
  std::array<double, 3> maximum_mm{};

  /// In x and y.
  [[nodiscard]] bool Contains(const pressure_advance::BoundsMm& bounds) const {
    return bounds.min_x_mm >= minimum_mm[0] && bounds.max_x_mm <= maximum_mm[0] &&
           bounds.min_y_mm >= minimum_mm[1] && bounds.max_y_mm <= maximum_mm[1];
  }
};

/// One sweep along each line of one pattern, or of all patterns where none is named, in print
/// direction: from run_up before the first scored place to run_up behind the last, `skip` inside
/// the line's ends.
/// Errors: kInput where the plan has no such pattern or skip leaves nothing of a line; kSafety
/// where the head would have to leave its reach, with the line, the position and the bound.
[[nodiscard]] Result<SweepPlan> PlanSweeps(const pressure_advance::PatternPlan& plan,
                                           std::optional<int> pattern,
                                           const settings::ScanSettings& settings,
                                           const Reach& reach);

/// The sweeps as G-code, for `--dry-run`: what the procedure sends, command by command.
[[nodiscard]] std::string DescribeSweeps(const SweepPlan& plan,
                                         const settings::ScanSettings& settings,
                                         double travel_speed_mm_s);

/// The move to a sweep's start, and the sweep itself. Absolute millimetres (G90) must be in force.
[[nodiscard]] std::string TravelGcode(const Sweep& sweep, double travel_speed_mm_s);
[[nodiscard]] std::string SweepGcode(const Sweep& sweep, double speed_mm_s);

}  // namespace trammel::procedure
