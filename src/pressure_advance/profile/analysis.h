// Result of a pressure-advance analysis, for the report and --json.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/measured.h"
#include "gcode/dialect.h"
#include "pressure_advance/profile/line_profile.h"

namespace trammel::pressure_advance {

/// `deviation`: the paper's score and its cubic.
struct DeviationResult {
  std::vector<std::optional<double>> score_px;  ///< per line, in the order of the lines; absent
                                                ///< where a line has no score
  std::optional<double> best_s;                 ///< tested value with the lowest score
  std::optional<double> cubic_minimum_s;        ///< minimum of the cubic within the tested range
  std::optional<double> r_squared;
  std::vector<double> cubic;  ///< score = c0 + c1 p + c2 p^2 + c3 p^3, p in s; empty without a fit
};

/// Result of one transition in the response fit.
struct TransitionResult {
  Measured pressure_advance;  ///< s
  double window_begin = 0;    ///< positions along the line, in the profiles' PositionUnit
  double window_end = 0;
  std::vector<double> surplus_s;  ///< per line: surplus filament / speed change, signed so that
                                  ///< it falls through 0 where the pressure advance is right
  std::vector<double> sigma_s;    ///< 1 sigma of each; 0: this line was not used
  std::vector<double> fitted_s;   ///< the fitted response at each line's pressure advance
};

/// Storage model of the extruder's lag estimated from the shapes of whole lines, and its weight
/// against the changes of speed.
struct WeighedStorage {
  Quantity pressure_advance_s;  ///< by the storage model alone; includes the error of other models
  Quantity crossings_s;         ///< by the speed changes, as weighted with the model
  double correction_s = 0;      ///< correction of that for its error on lines of the model
  double weight = 0;            ///< model's weight in the answer, crossings have the rest; 0 … 1
  Quantity slow_lag_s;          ///< lag of a small speed change, at the slow speed …
  Quantity fast_lag_s;          ///< … and at the fast one
  Quantity slip;                ///< share of the flow lost at the fast speed, 0 … 1
  double lag_scatter_s = 0;     ///< 1 sigma, from line to line
  int lines = 0;                ///< that the law was learnt of
  /// Correlation of neighbouring lines' residuals from the model; near 0 if the extruder follows
  /// it. The weight falls as it grows.
  double shared_misfit = 0;
  Interval learnt_from_mm;  ///< positions along the lines
};

/// Answer; if it may be outside the tested range, also the range to print next.
struct RangedAnswer {
  Measured pressure_advance;             ///< s
  std::optional<Interval> print_next_s;  ///< 0 <= lo < hi; present only without a number
};

struct ResponseResult : RangedAnswer {
  std::optional<WeighedStorage> law;  ///< short lines at known scale
  TransitionResult acceleration;
  TransitionResult deceleration;
};

/// Results of identical patterns, one by one.
struct Repeats {
  std::vector<Measured> pattern_s;  ///< each by its own lines, in print order
  double scatter_s = 0;  ///< standard deviation of those that are good; 0 for fewer than two
  /// Standard deviation between patterns beyond their own uncertainties, k = 1: the median of its
  /// distribution by prior and scatter.
  double between_s = 0;
  /// True if they scatter more than 19 of 20 such sets do by chance.
  bool disagree = false;
};

/// Area of a scan's lines over the commanded one, as it is read.
struct AreaShare {
  double value = 0;
  double sigma = 0;    ///< 1 sigma, by the lines' scatter
  double freedom = 1;  ///< degrees of freedom of sigma
  int lines = 0;
};

struct SteadyAreas {
  std::optional<AreaShare> slow;  ///< absent: see `fault`
  std::optional<AreaShare> fast;  ///< absent without a steady fast stretch
  int broken = 0;                 ///< lines left out as their bead parted
  double area_change = 0;         ///< from the first line to the last, relative
  double area_sigmas = 0;         ///< that over its standard error
  double height_change = 0;       ///< of the beads' heights, likewise
  double height_sigmas = 0;
  std::string fault;  ///< why there is no slow area; empty if there is
};

/// Contributions to a flow ratio's uncertainty: 1 sigma, relative.
struct FlowBudget {
  double lines = 0;    ///< scatter
  double wander = 0;   ///< of the flow, more slowly than a print lasts
  double scale = 0;    ///< camera's scale and the laser's angle
  double reading = 0;  ///< what the reader sees of a bead
};

/// Flow ratio (extrusion multiplier).
struct FlowRatio {
  /// Commanded over laid area: what to set where the pattern was printed with 1. Above 1 the
  /// printer lays too little.
  Measured ratio;
  std::optional<SteadyAreas> areas;
  FlowBudget budget;          ///< of a ratio that is good
  bool by_reference = false;  ///< compared with a scan of a known flow ratio
};

/// All results of one printed line.
struct LineResult {
  double pressure_advance_s = 0;
  bool used = false;
  std::string reason;  ///< why not used
  int pattern = 0;     ///< index on a plate of several
};

/// Response of a pattern of corners. In `response` the window is along the path from the corner,
/// mm.
struct CornerResult {
  TransitionResult response;
  double half_window_mm = 0;
  std::optional<double> speed_mm_s;          ///< absent: not known
  std::optional<double> acceleration_mm_s2;  ///< likewise
};

struct Analysis : RangedAnswer {
  std::vector<LineResult> lines;
  LineMotion motion;
  std::vector<LineProfile> profiles;  ///< same order as lines
  std::optional<HeightScale> scale;   ///< laser scans with known pixel size in mm
  ResponseResult response;
  std::optional<CornerResult> corners;  ///< of a pattern of corners, which has no `response`
  DeviationResult deviation;
  std::optional<FlowRatio> flow;     ///< laser scans
  std::optional<Repeats> repeats;    ///< absent: one pattern, or no response
  std::vector<std::string> notices;  ///< for the user, although the verdict holds
  std::optional<gcode::PrintedBy> printed_by = gcode::PrintedBy{};  ///< absent: not known
};

}  // namespace trammel::pressure_advance
