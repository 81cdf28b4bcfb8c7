// Effect of an averaging converter on the break.
#pragma once

#include <limits>

#include "tap/contact/stretch_fit.h"
#include "tap/samples/corruption.h"
#include "tap/samples/motion.h"
#include "tap/samples/tap.h"
#include "tap/samples/workspace.h"

namespace trammel::tap {

/// Range of breaks by averaging of other orders; empty if there is none.
struct AveragedBreaks {
  double lo_mm = std::numeric_limits<double>::infinity();
  double hi_mm = -std::numeric_limits<double>::infinity();
  /// Factor of the interval's length over that of the changed force: the removed rounding moves
  /// with the break, >= 1.
  double widened = 1;
};

/// Removes averaging from a stretch's force, and fits it anew.
///
/// A converter's sinc filter of order m averages m times over one sampling interval. It rounds the
/// break over m samples (and the press at the cruise's start, where the head was at rest). On a
/// quiet cell that looks like a toe. For each order up to that of common converters, the effect of
/// averaging on the fitted smooth press is subtracted from the samples, and the press fitted anew,
/// until both agree. The order that explains the samples best is used. Breaks of orders that fit
/// nearly as well belong to the interval, as those of other forms of the press do
/// (break_interval.h).
///
/// Runs only if the force falls by several deviations of the noise from sample to sample: rounding
/// below the noise moves the break by a fraction of the noise's effect.
///
/// @param stretch  Its force and residuals are changed.
/// @param fit      Of the unchanged stretch; of the changed one afterwards.
/// Cost: four fits of a stretch without averaging, up to seventeen with it.
[[nodiscard]] AveragedBreaks FitAveraging(const CleanTap& clean, const TapMotion& motion,
                                          const TapOptions& options, PressStretch& stretch,
                                          CruiseFit& fit, Workspace& workspace);

}  // namespace trammel::tap
