#include "tap/contact/contact_interval.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/statistics.h"

namespace trammel::tap {
namespace {

// Computes the common shift of samples by a converter's steps, gf: half a step, less if noise blurs
// them. Noise of s reduces it by exp(-2 pi^2 s^2 / step^2) (Widrow & Kollar 2008, section 4).
double Coarseness(const CleanTap& clean, const BreakEstimate& e) {
  if (!(clean.step_g > 0)) {
    return 0;
  }
  const double noises = std::min(clean.noise_g, e.noise) / clean.step_g;
  return 0.5 * clean.step_g * std::exp(-2 * std::numbers::pi * std::numbers::pi * noises * noises);
}

}  // namespace

ContactInterval IntervalOf(const CleanTap& clean, const PressStretch& stretch,
                           const BreakEstimate& e, const TapMotion& motion,
                           const TapOptions& options) {
  const double speed_mm_s = motion.pull_back_speed_mm_s;
  const double latency_mm = kNormal95 * options.latency_uncertainty_s * speed_mm_s;
  const double z = stretch.Z(e.t);
  // Times that scatter may all be late, or early, by half of their range; a held value is older
  // than its time. It is unknown which side of a clock's step the moves' clock is on.
  const double jitter_mm = 0.5 * clean.jitter_s * speed_mm_s;
  const double held_mm = clean.held_s * speed_mm_s;
  const double coarse_mm = Coarseness(clean, e) / e.shape.OuterSlope() * stretch.span_mm;
  const double ahead_mm = clean.clock_steps.forward_s * speed_mm_s;
  const double behind_mm = clean.clock_steps.backward_s * speed_mm_s;
  ContactInterval interval;
  interval.below_mm =
      std::hypot(z - stretch.Z(e.lo), latency_mm, coarse_mm) + jitter_mm + held_mm + behind_mm;
  interval.above_mm = std::hypot(stretch.Z(e.hi) - z, latency_mm, coarse_mm) + jitter_mm + ahead_mm;
  // Ratio to the half-width as for the break alone, by Student's quantile.
  const double width = e.hi - e.lo;
  const double quantile = width > 0 ? 0.5 * width / e.standard_uncertainty : kNormal95;
  interval.standard_uncertainty_mm = 0.5 * (interval.below_mm + interval.above_mm) / quantile;
  return interval;
}

}  // namespace trammel::tap
