// Scatter of the break by correlated noise, compared with white noise.
#pragma once

#include <span>

#include "tap/samples/workspace.h"

namespace trammel::tap {

/// Samples of the break's fit: heights 0 … 1, the break among them, the residuals there.
struct BreakFit {
  std::span<const double> y;
  std::span<const double> residual;
  double t = 0;
  double noise = 0;  ///< Standard deviation of a residual.
};

/// By which correlation raises the variance of the break beyond that of white noise, >= 1.
///
/// To first order the break is a weighted sum of the samples; its weights w are those of a step at
/// the break, orthogonal to the columns of the quadratic press. They hold neither a level nor a
/// slope, so that Var = - sum over i, j of w_i w_j g(|i - j|), where g is the variogram, half the
/// mean square difference at a lag (Matheron 1963; contrasts need no more than this). It is
/// measured on the free stretches, where no fit has taken up the slow part of the noise as the fit
/// of the press does with the residuals. Of what is not correlated, the residuals tell the size.
/// The factor holds a Student quantile for the number of contrasts that the stretches make up.
///
/// @param free  Forces of a nozzle that touches nothing, evenly sampled, in order of time, without
///              drift and wild samples; overwritten. Fewer than 16 tell nothing: samples, or blocks
///              of as many samples as average the fit's to 128 at most.
[[nodiscard]] double CorrelatedFactor(const BreakFit& fit, std::span<const std::span<double>> free,
                                      Workspace& workspace);

}  // namespace trammel::tap
