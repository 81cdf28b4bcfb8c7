// What the signed method assumes, with the origin of each figure.
#pragma once

#include <optional>

#include "base/measured.h"
#include "pressure_advance/response/lag_drift.h"
#include "pressure_advance/response/law_options.h"
#include "pressure_advance/response/paired_difference.h"
#include "pressure_advance/response/transitions.h"
#include "signal/zero_crossing.h"

namespace trammel::pressure_advance {

struct ResponseOptions {
  TransitionOptions transitions;
  /// The acceleration's response is nearly straight: starved beads rarely run empty. An assumption:
  /// the slopes on either side differ by 8 % (1 sigma).
  signal::ZeroCrossingOptions acceleration{.bend_mean = 0, .bend_sigma = 0.04};
  /// Beyond the answer a deceleration leaves a gap, and a gap cannot get emptier than empty: the
  /// response is flatter there by an amount that depends on the lag, hence the wide prior.
  signal::ZeroCrossingOptions deceleration{
      .bend_mean = -0.1, .bend_sigma = 0.15, .distance_sigma = 0.15, .may_saturate = true};
  /// Fewest usable lines with different PA: a crossing, a slope and a bend leave nothing over from
  /// three.
  int fewest_lines = 4;
  /// Smallest slope over its standard error; below it the lines do not answer to PA. With the bound
  /// on the interval, none of 3000 sets of noise at any of 4 to 20 lines is taken for an answer.
  double least_significance = 5;
  /// Largest half width of the 95 % interval, as a part of the tested range: about one step of ten
  /// lines, and half a step where there are fewer than six. What is wider says less than looking at
  /// the lines would.
  double widest_interval = 0.1;
  /// Standard deviation of the flow lost at the fast speed (slip), as a part of the flow, before
  /// the transitions' difference shows it; assumed. It pulls their crossings apart, in opposite
  /// directions.
  double slip_sigma = 0.04;
  /// What slip leaves open of the answer, as a part of slip times the answer: whether pressure
  /// advance's own filament slips as the rest does; assumed.
  double slip_form_sigma = 0.3;
  /// Standard deviation of the crossing's tail (Transitions::early) as a part of the answer, before
  /// it is seen: power laws with exponents of 0.3 to 1 have 0 to 0.05, two stages up to 0.1.
  double tail_sigma = 0.05;
  /// By how much a window's end moves both crossings, over the tail: between 0.43 and 0.87 for
  /// power laws of 0.3 to 1, saturating ones, and two stages, at lags of 15 to 54 ms.
  double tail_share = 0.5;
  double tail_share_sigma = 0.12;
  /// How far a transition's crossing may lie beyond the lines that show it, in steps between lines:
  /// towards high values the response flattens. Up to there slopes differ as bends do, by
  /// `beyond_sigma` of the distance.
  double most_beyond = 1;
  double beyond_sigma = 0.3;
  LagDriftOptions drift;
  /// What whole profiles tell of the law of the lag; nothing: it is left open.
  std::optional<LawOptions> law = LawOptions{};
  PairedOptions paired;
  /// What the finite windows leave open about the form of the lag, as a part of the answer: laws
  /// from linear to strongly shear-thinning moved it by 0 to 1.2 %.
  double lag_form_sigma = 0.01;
  /// The same where the deceleration's window lasts less than PairedOptions::least_drain lags at
  /// the slow speed, and cuts off what melt that thins has still to give.
  double short_end_sigma = 0.015;
  /// The same for the part of the lag's tail that the windows do not hold (1 - slope), where that
  /// is known; set so that virtual prints with linear and with thinning laws lie inside their
  /// intervals.
  double lag_tail_sigma = 0.04;
  /// Slope of the area's excess over PA where (nearly) all filament lands in the window and is
  /// read. Below it part of it was not read, and where that part was is unknown: unread_sigma *
  /// (full_slope - slope) * answer. Set in the same way.
  double full_slope = 0.8;
  double unread_sigma = 0.15;
  /// Mean pressure advance of all lines that were printed, s, where the eye may not show all; a lag
  /// that drifts over the pattern does so whether or not they are seen. Absent: of those measured.
  std::optional<double> printed_middle_s;
  /// What the eye leaves open, as a part of the tested range: the blur of a photo.
  double picture_sigma = 0;
  /// Acceptable slope of the area's excess over PA, dimensionless: 1 where every bit of filament
  /// that PA moves lands inside the window.
  Interval plausible_slope{0.2, 2.0};
};

}  // namespace trammel::pressure_advance
