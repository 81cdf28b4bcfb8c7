// The difference of the two transitions of each line: in it a line's own lag cancels.
#pragma once

#include <vector>

namespace trammel::pressure_advance {

struct TransitionSeries;
struct PairedDifference;

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

/// Fits the differences of all lines together.
///
/// Filament is conserved: on lines with too little pressure advance the two excesses differ by what
/// slipped and by what the windows' ends cut off, and by nothing else. Beyond the answer a gap's
/// filament may be lost. A drive loses filament and makes none: a difference below 0 by more than
/// its sigma is taken for gaps that reach into the windows of lines below the answer, too, and
/// cut off there.
/// @param zero_s  the acceleration's crossing, less the window's tail
/// @param slope   of the acceleration's response, > 0
/// @param share   of the difference that stands in the acceleration's crossing, 0 … 1
/// REQUIRES the same lines in both series.
[[nodiscard]] PairedDifference FitPairedDifference(const TransitionSeries& acceleration,
                                                   const TransitionSeries& deceleration,
                                                   double zero_s, double slope, double share,
                                                   const PairedOptions& options);

/// Excess of the acceleration less that of the deceleration of one line, where its pressure advance
/// is right.
struct PairedDifference {
  double value_s = 0;
  double sigma_s = 0;             ///< 1 sigma from the lines' scatter
  double form_s = 0;              ///< 1 sigma from what the priors leave open of its form
  bool cut_off = false;           ///< it lay too far below 0
  std::vector<double> fitted_s;   ///< each line's difference on the fit
  std::vector<double> influence;  ///< by how far a line's residual of 1 moves the value

  [[nodiscard]] double variance() const { return sigma_s * sigma_s + form_s * form_s; }
};

}  // namespace trammel::pressure_advance
