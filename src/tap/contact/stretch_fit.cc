#include "tap/contact/stretch_fit.h"

namespace trammel::tap {
namespace {

// Computes the residuals of a press and its best straight baseline.
void TakeResiduals(const PressShape& shape, PressStretch& stretch) {
  double n = 0;
  double sum_y = 0;
  double sum_yy = 0;
  double sum_r = 0;
  double sum_ry = 0;
  for (std::size_t i = 0; i < stretch.y.size(); ++i) {
    const double y = stretch.y[i];
    const double w = stretch.weighted ? stretch.weight[i] : 1;
    const double r = stretch.force[i] - shape.At(y);
    stretch.residual[i] = r;
    n += w;
    sum_y += w * y;
    sum_yy += w * y * y;
    sum_r += w * r;
    sum_ry += w * r * y;
  }
  const double spread = n * sum_yy - sum_y * sum_y;
  const double slope = spread > 0 ? (n * sum_ry - sum_r * sum_y) / spread : 0;
  const double level = n > 0 ? (sum_r - slope * sum_y) / n : 0;
  for (std::size_t i = 0; i < stretch.y.size(); ++i) {
    stretch.residual[i] -= level + slope * stretch.y[i];
  }
}

}  // namespace

CruiseFit FitStretch(PressStretch& stretch, const BreakTask& task, Workspace& workspace) {
  const Workspace::Scope scope(workspace);
  const PressProfile profile(stretch.Samples(), workspace);
  CruiseFit fit;
  fit.estimate = EstimateBreak(profile, task, workspace);
  if (fit.estimate.outcome != BreakEstimate::Outcome::kFound) {
    return fit;
  }
  constexpr std::size_t kOrder = PressProfile::kOrders;
  fit.coefficients = profile.Fit(fit.estimate.t, kOrder);
  TakeResiduals(fit.estimate.shape, stretch);
  fit.traits = Examine(stretch.residual, fit.estimate.below, stretch.scratch);
  return fit;
}

}  // namespace trammel::tap
