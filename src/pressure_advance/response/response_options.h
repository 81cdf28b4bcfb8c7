// Assumptions of the signed method, with the origin of each figure.
#pragma once

#include <optional>

#include "base/measured.h"
#include "pressure_advance/profile/line_profile.h"
#include "signal/zero_crossing.h"

namespace trammel::pressure_advance {

/// Fractions that separate the windows. The defaults suit lines of 20 mm and more; they were chosen
/// from the footprint of a bead (about 0.5 mm) and the lag of a direct drive.
struct TransitionOptions {
  double before = 0.025;  ///< of the line, before the acceleration's boundary
  /// Fraction of the line after the deceleration's boundary. The surplus drains with the lag of the
  /// *slow* flow, several times the mean lag if the melt thins under shear. At 0.06, storage models
  /// with an exponent of 0.3 came out 2 ms low; from 0.1 on none does.
  double after = 0.10;
  double early_end = 0.62;  ///< of the acceleration's fast segment: end of the early window
  double split = kSplitOfFastSegment;  ///< of the fast segment: end of the acceleration's window
  double plateau_begin = 0.35;         ///< of the fast segment: start of the steady middle …
  double plateau_end = 0.65;  ///< … and ends here, where the line is long enough to have one
  double end_margin = 0.02;   ///< of the line, at both ends: never a reference
  /// Distance from the printed start that is never a reference either, mm. There the flow still
  /// rises to its target, over three lags of the slow flow.
  double start_margin_mm = 2.5;
  /// Minimum of `after`, mm: three lags of the slow flow again.
  double after_mm = 3;
  /// Without a steady middle, the deceleration's window is narrowed to where the lines respond and
  /// this part of that stretch at both ends, if given. On a photo's long lines, light over the rest
  /// of the window weighs more than the last of the surplus.
  std::optional<double> margin_of_response;
};

struct LagDriftOptions {
  /// Prior standard deviation of the drift, before the slope: 10 % of the range, that is 20 % of a
  /// lag in its middle; assumed.
  double prior_sigma = 0.1;
  double unseen_sigma = 0.03;  ///< of it, where the slope has no scale to be judged by; assumed
  /// Tail, as a part of the lag, from which on the law is assumed to thin so much that all filament
  /// lands in the window: power laws with exponents of 0.3 to 0.67 have 0.03 to 0.05, linear ones
  /// below 0.01.
  double thinning_tail = 0.04;
};

struct PairedOptions {
  /// Fraction of slip's difference at the answer that exists without pressure advance; the rest
  /// grows as its square. Slip grows as the flow squared, and pressure advance adds flow where the
  /// nozzle speeds up. 150 mm/s at 3000 mm/s^2 and a lag of 36 ms: 0.5 to 0.6.
  double at_rest = 0.55;
  double at_rest_sigma = 0.15;  ///< 1 sigma, of the difference; assumed
  /// The same for laws other than a linear one, relative to the answer: power laws with exponents
  /// of 0.3 to 1 and two stages change it by up to 0.016.
  double law_sigma = 0.012;
  /// Share of filament lost in a gap, mean and 1 sigma: the assumed cause of the deceleration's
  /// bend.
  double loss_mean = 0.2;
  double loss_sigma = 0.3;
  double distance_sigma = 0.1;  ///< of what a straight loss leaves out, over the distance
  /// Prior scatter of a line's difference, counted as two lines: a flow that wanders by 1 % over a
  /// millimetre.
  double scatter_s = 0.0008;
  double outlier_scale = 6;  ///< Tukey's biweight
  /// Minimum length of the deceleration's window, in lags at the slow speed; with less the
  /// differences are not informative: the surplus of shear-thinning melt drains with several times
  /// the mean lag.
  double min_drain = 10;
};

/// Assumptions of a fit of the storage model.
struct StorageOptions {
  double error_sigma = 0.3;  ///< of what the crossings err by on lines of the learnt law, 1 sigma
  /// Uncertainty of the crossings from other storage models, relative to the answer, k = 1 …
  double form_sigma = 0.01;
  double law_form_sigma = 0.015;  ///< … and of the law's own value
  double max_weight = 0.85;       ///< limit of the model's value
  double shift_sigma = 0.4;       ///< of what the law moves the crossings' answer by, 1 sigma
  /// Maximum StorageFit::shared_misfit at which the model has full weight. The paper's twelve
  /// conditions have -0.1 to 0.1, extruder_world's laws 0.2. Tuned on virtual prints of both preset
  /// patterns by extruder_world and melt_world, seeds below 1000. Widened once by the draws of
  /// 190000 and 197000, which no published figure uses.
  double trusted_misfit = 0.25;
  double refuted_misfit = 0.6;    ///< from here on only the crossings count
  double lag_form_sigma = 0.05;   ///< by other models, for the lag at one speed, relative to it
  double slip_form_sigma = 0.01;  ///< and of slip
  double lag_scatter = 0.04;      ///< between lines, relative, prior
  double flow_scatter = 0.015;
  double flow_noise = 0.01;
  double flow_noise_length_mm = 1.5;
  double place_scatter_mm = 0.05;  ///< of a line relative to the others, 1 sigma, prior
  double place_mm = 0.1;           ///< per reading within its line, 1 sigma
  double swell = 0.1;              ///< of a bead's area above nominal, 1 sigma
  double spread_mm2 = 0.04;        ///< diffusion of filament along a line, 1 sigma
  double droplet = 0.15;           ///< area below which a bead parts, over the nominal one
  double droplet_mm = 0.05;        ///< of nominal bead, 1 sigma, displaced by that
  double seen_lines = 3;           ///< lines that what is known of the scatter beforehand counts as
};

struct ResponseOptions {
  TransitionOptions transitions;
  /// The acceleration's response is nearly straight: starved beads rarely run empty. Assumption:
  /// the slopes on either side differ by 8 % (1 sigma).
  signal::ZeroCrossingOptions acceleration{.bend_mean = 0, .bend_sigma = 0.04};
  /// Beyond the answer a deceleration leaves a gap, which cannot become emptier than empty: the
  /// response is flatter there by an amount that depends on the lag, hence the wide prior.
  signal::ZeroCrossingOptions deceleration{
      .bend_mean = -0.1, .bend_sigma = 0.15, .distance_sigma = 0.15, .may_saturate = true};
  /// Minimum number of usable lines with different PA: three leave no redundancy for a crossing, a
  /// slope and a bend.
  int fewest_lines = 4;
  /// Minimum slope over its standard error; below it the lines do not respond to PA. With the limit
  /// on the interval, none of 3000 sets of noise at any of 4 to 20 lines yields an answer.
  double min_significance = 5;
  /// Maximum half width of the 95 % interval, as a part of the tested range: about one step of ten
  /// lines, and half a step with fewer than six. A wider interval is less informative than a look
  /// at the lines.
  double widest_interval = 0.1;
  /// Prior standard deviation of the flow lost at the fast speed (slip), as a part of the flow,
  /// before the transitions' difference; assumed. It shifts their crossings in opposite directions.
  double slip_sigma = 0.04;
  /// Uncertainty of the answer from slip, relative to slip times the answer: pressure advance's own
  /// filament may slip differently; assumed.
  double slip_form_sigma = 0.3;
  /// Prior standard deviation of the crossing's tail (Transitions::early) as a part of the answer:
  /// power laws with exponents of 0.3 to 1 have 0 to 0.05, two stages up to 0.1.
  double tail_sigma = 0.05;
  /// Shift of both crossings by a window's end, relative to the tail: 0.43 to 0.87 for power laws
  /// of 0.3 to 1, saturating ones, and two stages, at lags of 15 to 54 ms.
  double tail_share = 0.5;
  double tail_share_sigma = 0.12;
  /// Maximum distance of a transition's crossing from the lines that show it, in steps between
  /// lines: towards high values the response flattens. Up to there slopes differ as bends do, by
  /// `beyond_sigma` of the distance.
  double max_beyond = 1;
  double beyond_sigma = 0.3;
  LagDriftOptions drift;
  /// Options for the storage model from whole profiles; nothing: it is unknown.
  std::optional<StorageOptions> law = StorageOptions{};
  PairedOptions paired;
  /// Uncertainty from the finite windows' view of the lag's form, relative to the answer: storage
  /// models from linear to strongly shear-thinning moved it by 0 to 1.2 %.
  double lag_form_sigma = 0.01;
  /// The same if the deceleration's window is shorter than PairedOptions::least_drain lags at the
  /// slow speed, and cuts off the end of a shear-thinning melt's surplus.
  double short_end_sigma = 0.015;
  /// The same for the part of the lag's tail outside the windows (1 - slope), if that is known;
  /// tuned so that virtual prints with linear and with thinning laws are inside their intervals.
  double lag_tail_sigma = 0.04;
  /// Slope of the area's surplus over PA if (nearly) all filament lands in the window and is read.
  /// Below it a part was not read, at an unknown position: unread_sigma * (full_slope - slope) *
  /// answer. Tuned in the same way.
  double full_slope = 0.8;
  double unread_sigma = 0.15;
  /// Mean pressure advance of all printed lines, s, if some may be unseen: a lag's drift over the
  /// pattern includes unseen lines. Absent: of those measured.
  std::optional<double> printed_middle_s;
  /// Uncertainty from the blur of a photo, relative to the tested range.
  double picture_sigma = 0;
  /// Acceptable slope of the area's surplus over PA, dimensionless: 1 if all filament that PA moves
  /// lands inside the window.
  Interval plausible_slope{0.2, 2.0};
};

}  // namespace trammel::pressure_advance
