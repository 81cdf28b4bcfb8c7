// What the signed method assumes, with the origin of each figure.
#pragma once

#include <optional>

#include "base/measured.h"
#include "pressure_advance/profile/line_profile.h"
#include "signal/zero_crossing.h"

namespace trammel::pressure_advance {

/// Fractions that set the windows apart. The defaults suit lines of 20 mm and more; they were
/// chosen from the footprint of a bead (about 0.5 mm) and the lag of a direct drive.
struct TransitionOptions {
  double before = 0.025;  ///< of the line, before the acceleration's boundary
  /// Of the line, after the deceleration's boundary. The surplus drains with the lag of the *slow*
  /// flow, which is several times the mean lag where the melt thins under shear: at 0.06 laws with
  /// an exponent of 0.3 came out 2 ms low, from 0.1 on no law does.
  double after = 0.10;
  double early_end = 0.62;  ///< of the acceleration's fast stretch: the early window ends here
  double split = kSplitOfFastSegment;  ///< of the fast segment: the acceleration's window ends here
  double plateau_begin = 0.35;         ///< of the fast segment: a steady middle begins …
  double plateau_end = 0.65;  ///< … and ends here, where the line is long enough to have one
  double end_margin = 0.02;   ///< of the line, at both ends: never a reference
  /// In mm from the printed start: never a reference either. There the flow still rises to what is
  /// asked for, over three lags of the slow flow.
  double start_margin_mm = 2.5;
  /// In mm, what `after` is at least: three lags of the slow flow again.
  double after_mm = 3;
};

struct LagDriftOptions {
  /// Standard deviation of the drift before the slope is seen: 10 % of the range, that is 20 % of a
  /// lag in its middle; assumed.
  double prior_sigma = 0.1;
  double unseen_sigma = 0.03;  ///< of it, where the slope has no scale to be judged by; assumed
  /// Tail at which the law is taken to thin so much that all filament lands in the window, as a
  /// part of the lag: power laws with exponents of 0.3 to 0.67 have 0.03 to 0.05, linear ones below
  /// 0.01.
  double thinning_tail = 0.04;
};

struct PairedOptions {
  /// Of the difference that slip makes at the answer, so much is there without pressure advance,
  /// and the rest grows as its square: slip grows as the flow squared, and pressure advance adds
  /// flow where the nozzle speeds up. 150 mm/s at 3000 mm/s^2 and a lag of 36 ms: 0.5 to 0.6.
  double at_rest = 0.55;
  double at_rest_sigma = 0.15;  ///< 1 sigma, of the difference; assumed
  /// The same of what other laws than a linear one make of it, over the answer: power laws with
  /// exponents of 0.3 to 1 and two stages change it by up to 0.016.
  double law_sigma = 0.012;
  /// Share by which filament may be lost where a gap is left, mean and 1 sigma: what the
  /// deceleration's bend is taken for.
  double loss_mean = 0.2;
  double loss_sigma = 0.3;
  double distance_sigma = 0.1;  ///< of what a straight loss leaves out, over the distance
  /// Scatter of a line's difference before the lines show it, counted as two of them: a flow that
  /// wanders by 1 % over a millimetre.
  double scatter_s = 0.0008;
  double outlier_scale = 6;  ///< Tukey's biweight
  /// The deceleration's window lasts at least so many lags at the slow speed, or the differences
  /// tell nothing: the surplus of melt that thins drains with several times the mean lag.
  double least_drain = 10;
};

/// What a fit of the lag's law takes for granted.
struct LawOptions {
  double error_sigma = 0.3;  ///< of what the crossings err by on lines of the learnt law, 1 sigma
  /// What other laws than those learnt leave open of the crossings, over the answer, 1 sigma …
  double form_sigma = 0.01;
  double law_form_sigma = 0.015;  ///< … and of the law's own value
  double most_weight = 0.85;      ///< of the law's own value
  double shift_sigma = 0.4;       ///< of what the law moves the crossings' answer by, 1 sigma
  /// Largest LawFit::shared_misfit at which the law counts in full. The paper's twelve conditions
  /// have -0.1 to 0.1, extruder_world's laws 0.2. These were set on virtual prints of both preset
  /// patterns by extruder_world and melt_world, seeds below 1000, and widened once by the draws of
  /// 190000 and 197000, which no figure is of.
  double trusted_misfit = 0.25;
  double refuted_misfit = 0.6;   ///< from here on the crossings alone count
  double lag_form_sigma = 0.05;  ///< of what they leave open of the lag at one speed, over that lag
  double slip_form_sigma = 0.01;  ///< and of slip
  double lag_scatter = 0.04;      ///< from line to line, relative, before it is seen
  double flow_scatter = 0.015;
  double flow_noise = 0.01;
  double flow_noise_length_mm = 1.5;
  double place_scatter_mm = 0.05;  ///< of a line beside the others, 1 sigma, before it is seen
  double place_mm = 0.1;           ///< of a reading in its line, 1 sigma
  double swell = 0.1;              ///< of what a bead has more than the nominal area, 1 sigma
  double spread_mm2 = 0.04;  ///< by what filament spreads along a line, 1 sigma of its diffusion
  double droplet = 0.15;     ///< area below which a bead parts, over the nominal one
  double droplet_mm = 0.05;  ///< of nominal bead, 1 sigma, moved by that
  double seen_lines = 3;     ///< lines that what is known of the scatter beforehand counts as
};

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
