// The signed method: pressure advance where the surplus filament of a speed change crosses zero.
#pragma once

#include <string>
#include <vector>

#include "pressure_advance/analysis.h"
#include "pressure_advance/line_motion.h"
#include "pressure_advance/line_profile.h"
#include "pressure_advance/transitions.h"
#include "signal/zero_crossing.h"

namespace trammel::pressure_advance {

struct ResponseOptions {
  TransitionOptions transitions;
  /// The acceleration's response is nearly straight: starved beads rarely run empty.
  signal::ZeroCrossingOptions acceleration{.bend_mean = 0, .bend_sigma = 0.04};
  /// Beyond the answer a deceleration leaves a gap, and a gap cannot get emptier than empty.
  signal::ZeroCrossingOptions deceleration{
      .bend_mean = -0.1, .bend_sigma = 0.15, .distance_sigma = 0.15, .may_saturate = true};
  /// Fewest usable lines with different PA: a crossing, a slope and a bend leave nothing over from
  /// three.
  int fewest_lines = 4;
  /// Smallest slope over its standard error; below it the lines do not answer to PA.
  double least_significance = 5;
  /// Largest half width of the 95 % interval, as a part of the tested range.
  double widest_interval = 0.1;
  /// Standard deviation of the flow lost at the fast speed (slip), as a part of the flow. It pulls
  /// the acceleration's and the deceleration's answer apart, in opposite directions.
  double slip_sigma = 0.025;
  /// What the finite windows leave open about the form of the lag, as a part of the answer: laws
  /// from linear to strongly shear-thinning moved it by 0 to 1.2 %.
  double lag_form_sigma = 0.01;
  /// The same for the part of the lag's tail that the windows do not hold (1 - slope), where that
  /// is known.
  double lag_tail_sigma = 0.06;
  /// Slope of the area's excess over PA where (nearly) all filament lands in the window and is
  /// read. Below it part of it was not read, and where that part was is unknown: unread_sigma *
  /// (full_slope - slope) * answer.
  double full_slope = 0.8;
  double unread_sigma = 0.15;
  /// Acceptable slope of the area's excess over PA, dimensionless: 1 where every bit of filament
  /// that PA moves lands inside the window.
  Interval plausible_slope{0.2, 2.0};
};

struct ResponseFit {
  ResponseResult result;
  std::vector<LineResult> lines;
  std::vector<std::string> notices;
};

/// Fits the response of all lines together.
///
/// Conservation of filament is the whole model: whatever the law of the extruder's lag, a speed
/// change by dv stores S(q_fast) - S(q_slow) more filament, PA supplies PA * dv of it, and the
/// difference is missing from the line (acceleration) or in excess on it (deceleration). Smoothing
/// in the firmware moves filament about but adds none, so its shape integrates to zero over the
/// window.
///
/// Assumes one slow-fast-slow change of speed per line, windows that hold the transitions (docs), a
/// reading proportional to the filament near the answer, and lines that are independent of each
/// other. Checks: the slope's significance, sign and size, the scatter of single lines, the two
/// transitions against each other.
/// @returns per transition and combined: value in s with its uncertainty (leave-one-out over the
/// lines, plus slip
///   and lag form), or the verdict that says why not.
[[nodiscard]] ResponseFit FitResponse(const std::vector<LineProfile>& profiles,
                                      const LineMotion& motion,
                                      const ResponseOptions& options = {});

}  // namespace trammel::pressure_advance
