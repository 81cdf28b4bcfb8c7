// What a converter that averages leaves of the break.
#pragma once

#include <limits>

#include "tap/contact/stretch_fit.h"
#include "tap/samples/corruption.h"
#include "tap/samples/motion.h"
#include "tap/samples/tap.h"
#include "tap/samples/workspace.h"

namespace trammel::tap {

/// The range of breaks that averaging of other orders would leave; empty where there is none.
struct AveragedBreaks {
  double lo_mm = std::numeric_limits<double>::infinity();
  double hi_mm = -std::numeric_limits<double>::infinity();
  /// By which the interval is longer than that of the changed force: the rounding that is taken off
  /// moves with the break, >= 1.
  double widened = 1;
};

/// Takes averaging out of a stretch's force, and fits it anew.
///
/// A converter's sinc filter of order m averages m times over one sampling interval, so that it
/// rounds the break over m samples (and the press at the cruise's start, where the head stood).
/// On a quiet cell that looks like a toe. For each order up to that of common converters, what
/// averaging adds to the fitted smooth press is taken off the samples, and the press fitted anew,
/// until both agree. The order that explains the samples best is taken; breaks of orders that do
/// nearly as well belong to the interval, as those of other forms of the press do
/// (break_interval.h).
///
/// Only asked where the force falls by several deviations of the noise from sample to sample: less
/// rounding than noise moves the break by a fraction of what noise does.
///
/// @param stretch  Its force and residuals are changed.
/// @param fit      Of the stretch as it is; of the changed one afterwards.
/// Cost: four fits of a stretch where nothing averages, up to seventeen where something does.
[[nodiscard]] AveragedBreaks FitAveraging(const CleanTap& clean, const TapMotion& motion,
                                          const TapOptions& options, PressStretch& stretch,
                                          CruiseFit& fit, Workspace& workspace);

}  // namespace trammel::tap
