#include "tap/contact/contact.h"

#include <algorithm>
#include <cmath>

#include "tap/contact/approach_contact.h"
#include "tap/contact/contact_interval.h"
#include "tap/contact/cruise_fit.h"
#include "tap/contact/latency.h"
#include "tap/samples/finding.h"

namespace trammel::tap {
namespace {

constexpr double kMinStandOut = 5;   // press force over the noise of one sample
constexpr double kMinLeft = 0.2;     // of the force at rest, remaining at the cruise's start
constexpr double kVague_mm = 0.012;  // a break that is not known to this is of no use
// Limits of a hollow sheet or a toe of plastic: maximum distance between the readings of its end
// and of the bed's, and maximum ratio of its initial slope to that below the kink.
constexpr double kMaxApart_mm = 0.012;
constexpr double kMinSlope = 0.4;

void Report(const CleanTap& clean, const PressStretch& stretch, const CruiseFit& fit,
            const TapMotion& motion, const TapOptions& options, TapAnalysis& result) {
  const BreakEstimate& e = fit.estimate;
  const ContactInterval interval = IntervalOf(clean, stretch, e, motion, options);
  const double z = stretch.Z(e.t);
  result.noise_g = e.noise;
  result.contact_mm = {
      z, interval.standard_uncertainty_mm, {z - interval.below_mm, z + interval.above_mm}};
  result.contact_time_s = motion.CruiseTime(z) + options.latency_s;

  // Back to gf and mm: force = sign f + mean, d in mm.
  const auto& [a, b, c] = fit.coefficients;
  const double span = stretch.span_mm;
  result.force = {true,
                  stretch.z0_mm,
                  stretch.z0_mm + span,
                  z,
                  stretch.sign * a + stretch.mean_g,
                  stretch.sign * b / span,
                  {stretch.sign * c[0] / span, stretch.sign * c[1] / (span * span),
                   stretch.sign * c[2] / (span * span * span), 0}};
  const double half = 0.5 * (interval.below_mm + interval.above_mm);
  double apart = 0;
  for (const double t : {e.cubic_t, e.power_t}) {
    apart = std::isnan(t) ? apart : std::max(apart, span * std::abs(t - e.quadratic_t));
  }
  if (apart > half) {
    result.Notice({FindingCode::kFormLeftOpen, apart, half});
  }
  const double apart_mm = span * (e.hi - e.lo);
  if (e.outer_ratio < kMinSlope && apart_mm > kMaxApart_mm) {
    result.verdict = Verdict::kRefused;
    result.reason = {FindingCode::kLooseSheet, 100 * e.outer_ratio, 100 * kMinSlope};
    return;
  }
  if (half > kVague_mm) {
    result.verdict = Verdict::kCannotTell;
    result.reason = {FindingCode::kVagueBreak, half, kVague_mm};
    return;
  }
  result.verdict = Verdict::kGood;
  result.reason = {};
}

// Adds the corners of the curve that the fit determines, in order of time.
void AddPoints(const TapMotion& motion, const TapOptions& options, TapAnalysis& result) {
  const FittedForce& force = result.force;
  const auto at = [&](Corner corner, double z_mm) {
    const double d = std::max(0.0, force.break_z_mm - z_mm);
    const double g = force.baseline_g + force.baseline_slope_g_mm * (z_mm - force.break_z_mm) +
                     d * (force.press_g[0] + d * (force.press_g[1] + d * force.press_g[2]));
    result.points[result.point_count++] = {corner, motion.CruiseTime(z_mm) + options.latency_s,
                                           z_mm, g};
  };
  at(Corner::kDwellEnd, force.from_z_mm);
  at(Corner::kBreak, force.break_z_mm);
  at(Corner::kPullBackEnd, force.to_z_mm);
}

SeenPress SeenOf(const PressStretch& stretch, const CruiseFit& fit, const TapOptions& options) {
  return {fit.estimate.shape, stretch.z0_mm,     stretch.span_mm,
          stretch.sign,       options.latency_s, fit.estimate.noise};
}

Finding WhyNot(const CruiseFit& fit, std::size_t samples) {
  switch (fit.estimate.outcome) {
    case BreakEstimate::Outcome::kTooFew:
      return {FindingCode::kFewSamplesInCruise, static_cast<double>(samples), kMinInCruise};
    case BreakEstimate::Outcome::kAtEdge:
      return {FindingCode::kBreakAtEdge, 0, 5};
    default:
      return {FindingCode::kNoBreak, 0, kMinStandOut * fit.estimate.noise};
  }
}

// Fits the cruise for one latency; if that fails, the result has the reason.
CruiseFit ReadBreak(const CleanTap& clean, const TapMotion& motion, const TapOptions& options,
                    PressStretch& stretch, Workspace& workspace, TapAnalysis& result) {
  result.verdict = Verdict::kCannotTell;
  stretch = {};
  if (!SelectCruise(clean, motion, options.latency_s, workspace, stretch)) {
    result.reason = {FindingCode::kFewSamplesInCruise, static_cast<double>(stretch.y.size()),
                     kMinInCruise};
    return {};
  }
  CropBaseline(stretch, workspace);
  CruiseFit fit = FitCruise(clean, motion, options, stretch, workspace, result);
  result.noise_g = fit.estimate.noise;
  if (!fit.Found()) {
    result.reason = WhyNot(fit, stretch.y.size());
    return fit;
  }
  const double t = fit.estimate.t;
  const auto& c = fit.coefficients.c;
  const double added_g = t * (c[0] + t * (c[1] + t * c[2]));
  // A press makes the force fall. If a steep baseline compensates that, noise was fitted; if little
  // of the force at rest is left, the nozzle separated before the cruise.
  const double press_g = std::min(added_g, added_g - t * fit.coefficients.b);
  const double rest_g = std::abs(clean.dwell_g - clean.departure_g);
  const double min_g =
      std::max(kMinStandOut * fit.estimate.noise, rest_g > 0 ? kMinLeft * rest_g : 0);
  if (!(press_g > min_g)) {
    result.reason = {FindingCode::kNoBreak, press_g, min_g};
    fit.estimate.outcome = BreakEstimate::Outcome::kNoPress;
  }
  return fit;
}

}  // namespace

std::size_t ContactWorkspaceBytes(std::size_t samples) {
  constexpr std::size_t kArrays = 14;  // of double: PressStretch for two latencies, TrimPress
  constexpr std::size_t kBookkeeping = 2048;                        // alignment of every piece
  return kBookkeeping + samples * (kArrays * sizeof(double) +       //
                                   PressProfile::kBytesPerSample +  //
                                   sizeof(PressProfile::At));
}

void AnalyseContact(const CleanTap& clean, const TapMotion& motion, const TapOptions& options,
                    Workspace& workspace, TapAnalysis& result) {
  const Workspace::Scope scope(workspace);
  TapOptions known = options;
  const bool estimated = std::isnan(options.latency_s);
  if (estimated) {
    known.latency_s = known.latency_uncertainty_s = 0;
  }
  PressStretch stretch;
  const TapAnalysis before = result;
  CruiseFit fit = ReadBreak(clean, motion, known, stretch, workspace, result);
  if (!fit.Found()) {
    return;
  }
  if (estimated) {
    LatencyEstimate latency = EstimateLatency(clean, motion, SeenOf(stretch, fit, known));
    constexpr double kMuch = 2;  // samples: the cruise is that of others, then
    if (std::abs(latency.latency_s) > kMuch * clean.period_s) {
      result = before;
      known.latency_s = latency.latency_s;
      fit = ReadBreak(clean, motion, known, stretch, workspace, result);
      if (!fit.Found()) {
        return;
      }
      latency = EstimateLatency(clean, motion, SeenOf(stretch, fit, known));
    }
    stretch.z0_mm -= motion.pull_back_speed_mm_s * (latency.latency_s - known.latency_s);
    known.latency_s = latency.latency_s;
    known.latency_uncertainty_s = latency.uncertainty_s;
  }
  result.latency_s = known.latency_s;
  result.latency_uncertainty_s = known.latency_uncertainty_s;
  Report(clean, stretch, fit, motion, known, result);
  AddPoints(motion, known, result);
  CheckApproach(clean, motion, known, workspace, result);
}

}  // namespace trammel::tap
