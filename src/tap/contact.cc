#include "tap/contact.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "tap/approach_contact.h"
#include "tap/break_estimate.h"
#include "tap/break_search.h"
#include "tap/finding.h"
#include "tap/free_noise.h"
#include "tap/latency.h"
#include "tap/local_readings.h"
#include "tap/press_stretch.h"
#include "tap/residuals.h"

namespace trammel::tap {
namespace {

constexpr double kLeastStandOut = 5;  // of the press's force over the noise of one sample
constexpr double kLeastLeft = 0.2;    // of the force at rest, at the cruise's start
constexpr double kVague_mm = 0.012;   // a break that is not known to this is of no use
constexpr double kOutlier = 5;        // deviations: one sample in two million
// A sheet that lies hollow, a toe of plastic: the readings of its end and of the bed's are so far
// apart, and it starts with less than so much of the slope below the kink.
constexpr double kMostApart_mm = 0.012;
constexpr double kLeastSlope = 0.4;
constexpr double kNormal95 = 1.959964;

struct Fit {
  BreakEstimate estimate;
  PressProfile::Coefficients coefficients;
  ResidualTraits traits;
};

// What a press and the straight baseline that goes best with it leave over.
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

Fit FitOnce(PressStretch& stretch, const BreakTask& task, Workspace& workspace) {
  const Workspace::Scope scope(workspace);
  const PressProfile profile(stretch.Samples(), workspace);
  Fit fit;
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

bool Found(const Fit& fit) { return fit.estimate.outcome == BreakEstimate::Outcome::kFound; }

// One wild sample bends the first fit, so that weighing is repeated.
void ForgetOutliers(PressStretch& stretch, Fit& fit, Workspace& workspace, TapAnalysis& result) {
  constexpr int kPasses = 3;
  std::size_t forgotten = 0;
  for (int pass = 0; pass < kPasses && Found(fit); ++pass) {
    if (!(fit.traits.largest > kOutlier * fit.traits.robust_deviation) ||
        !(fit.traits.robust_deviation > 0)) {
      break;
    }
    forgotten = WeighOutliers(stretch.residual, fit.traits.robust_deviation, stretch.weight);
    if (forgotten == 0) {
      break;
    }
    stretch.weighted = true;
    fit = FitOnce(stretch, {}, workspace);
  }
  if (forgotten > 0) {
    result.Notice({FindingCode::kOutliersForgotten, static_cast<double>(forgotten), 0});
  }
}

MainsHum TakeOutHum(PressStretch& stretch, Fit& fit, Workspace& workspace, TapAnalysis& result) {
  const MainsHum hum = FindMainsHum(stretch.time_s, stretch.residual, fit.estimate.noise);
  if (hum.frequency_hz == 0) {
    return hum;
  }
  constexpr int kPasses = 2;
  for (int pass = 0; pass < kPasses && Found(fit); ++pass) {
    RemoveMainsHum(hum, stretch.time_s, stretch.residual, stretch.force);
    const bool last = pass + 1 == kPasses;  // of the others the residuals alone are of interest
    fit = FitOnce(stretch, {.interval = last}, workspace);
  }
  result.Notice({FindingCode::kHumRemoved, hum.amplitude_g, 0});
  return hum;
}

// Residuals that are still not white: the drive lags behind at the start of the
// pull-back, or the press follows another law at depth. Less of the press, from the deepest end,
// tells: the first remainder whose residuals are white is taken, none if none is.
void TrimPress(PressStretch& stretch, Fit& fit, Workspace& workspace, TapAnalysis& result) {
  const std::size_t below = fit.estimate.below;
  for (const double share : {0.15, 0.3}) {
    const auto count = static_cast<std::size_t>(share * static_cast<double>(below));
    if (count == 0 || stretch.y.size() - count < kLeastInCruise) {
      continue;
    }
    const Workspace::Scope scope(workspace);
    PressStretch shorter = stretch;
    shorter.y = workspace.Take<double>(stretch.y.size());
    shorter.residual = workspace.Take<double>(stretch.y.size());
    if (shorter.residual.empty()) {
      return;
    }
    std::copy(stretch.y.begin(), stretch.y.end(), shorter.y.begin());
    TrimStart(count, shorter);
    Fit attempt = FitOnce(shorter, {.interval = false}, workspace);
    if (Found(attempt) && attempt.traits.White()) {
      const Candidates known = attempt.estimate.candidates;
      attempt = FitOnce(shorter, {.known = &known}, workspace);
    }
    if (Found(attempt) && attempt.traits.White()) {
      TrimStart(count, stretch);
      std::copy(shorter.residual.begin(), shorter.residual.end(), stretch.residual.begin());
      fit = attempt;
      result.Notice({FindingCode::kPressTrimmed, share, 0});
      return;
    }
  }
}

FreeNozzle FreeNozzleOf(const PressStretch& stretch, const Fit& fit, const TapMotion& motion,
                        const TapOptions& options, const MainsHum& hum) {
  const BreakEstimate& e = fit.estimate;
  const double drift_g_s =
      stretch.sign * fit.coefficients.b / stretch.span_mm * motion.pull_back_speed_mm_s;
  return {stretch.Z(e.t),
          options.latency_s,
          drift_g_s,
          stretch.sign * fit.coefficients.a + stretch.mean_g,
          (1 - e.t) * stretch.span_mm / motion.pull_back_speed_mm_s,
          e.noise,
          hum,
          fit.traits.portmanteau > kPortmanteauLimit};
}

// What else the samples show is added to the interval: parts that disagree with the whole by more
// than noise explains, and a free force that differs between before the touch and after the break.
void Widen(const CleanTap& clean, const TapMotion& motion, const TapOptions& options,
           double inflation, Workspace& workspace, PressStretch& stretch, Fit& fit) {
  BreakEstimate& e = fit.estimate;
  const double slope = e.shape.OuterSlope();
  if (!(slope > 0)) {
    return;
  }
  // The residuals on a straight press: a press that the best model describes is no disagreement.
  for (std::size_t i = 0; i < stretch.y.size(); ++i) {
    stretch.scratch[i] = stretch.residual[i] + slope * std::max(0.0, e.t - stretch.y[i]);
  }
  const BreakSamples straight = {stretch.y, stretch.scratch, stretch.Samples().weight};
  const LocalReadings readings = ReadLocally(straight, e.t, e.noise, inflation, workspace);
  const FreeSteps steps =
      FindFreeSteps(clean, motion, FreeNozzleOf(stretch, fit, motion, options, {}));
  // Another level of the free force moves all readings alike; a part's reading is itself uncertain.
  constexpr double kOfBorder = 0.5;
  const double down = e.t - e.lo;
  const double up = e.hi - e.t;
  const double width = e.hi - e.lo;
  // A drop just after the break also bends the press's end: a quarter more.
  constexpr double kBent = 1.25;
  e.lo -= kBent * std::max(0.0, stretch.sign > 0 ? steps.most : -steps.least) / slope;
  e.hi += kBent * std::max(0.0, stretch.sign > 0 ? -steps.least : steps.most) / slope;
  if (readings.below > 0) {
    e.lo = std::min(e.lo, e.t - readings.below - kOfBorder * down);
  }
  if (readings.above > 0) {
    e.hi = std::max(e.hi, e.t + readings.above + kOfBorder * up);
  }
  e.standard_uncertainty *= width > 0 ? (e.hi - e.lo) / width : 1;
}

Fit FitRobustly(const CleanTap& clean, const TapMotion& motion, const TapOptions& options,
                PressStretch& stretch, Workspace& workspace, TapAnalysis& result) {
  Fit fit = FitOnce(stretch, {}, workspace);
  ForgetOutliers(stretch, fit, workspace, result);
  MainsHum hum;
  if (Found(fit) && fit.traits.portmanteau > kPortmanteauLimit) {
    hum = TakeOutHum(stretch, fit, workspace, result);
  }
  if (Found(fit) && !fit.traits.White()) {
    TrimPress(stretch, fit, workspace, result);
  }
  if (!Found(fit)) {
    return fit;
  }
  const double inflation =
      std::max(fit.traits.Inflation(),
               FreeNoiseFactor(clean, motion, FreeNozzleOf(stretch, fit, motion, options, hum),
                               {stretch.y, stretch.residual, fit.estimate.t, fit.estimate.noise},
                               workspace));
  if (inflation > 1) {
    const Candidates known = fit.estimate.candidates;
    fit = FitOnce(stretch, {.inflation = inflation, .known = &known}, workspace);
    result.Notice({FindingCode::kCorrelatedNoise, std::sqrt(inflation), 1});
  }
  Widen(clean, motion, options, inflation, workspace, stretch, fit);
  return fit;
}

// What a converter's steps may shift all samples by, gf: half of one, where no noise blurs them
// (Widrow & Kollar 2008, section 4: noise of s leaves exp(-2 pi^2 s^2 / step^2) of it).
double Coarseness(const CleanTap& clean, const BreakEstimate& e) {
  if (!(clean.step_g > 0)) {
    return 0;
  }
  const double noises = std::min(clean.noise_g, e.noise) / clean.step_g;
  return 0.5 * clean.step_g * std::exp(-2 * std::numbers::pi * std::numbers::pi * noises * noises);
}

void Report(const CleanTap& clean, const PressStretch& stretch, const Fit& fit,
            const TapMotion& motion, const TapOptions& options, TapAnalysis& result) {
  const BreakEstimate& e = fit.estimate;
  const double latency_mm = options.latency_uncertainty_s * motion.pull_back_speed_mm_s;
  const double z = stretch.Z(e.t);
  // Times that scatter may all be late, or early, by half of their range; a value that was held is
  // older than it looks.
  const double jitter_mm = 0.5 * clean.jitter_s * motion.pull_back_speed_mm_s;
  const double held_mm = clean.held_s * motion.pull_back_speed_mm_s;
  const double coarse_mm = Coarseness(clean, e) / e.shape.OuterSlope() * stretch.span_mm;
  const double down =
      std::hypot(z - stretch.Z(e.lo), kNormal95 * latency_mm, coarse_mm) + jitter_mm + held_mm;
  const double up = std::hypot(stretch.Z(e.hi) - z, kNormal95 * latency_mm, coarse_mm) + jitter_mm;
  result.noise_g = e.noise;
  result.contact_z_mm = z;
  result.contact_time_s = motion.CruiseTime(z) + options.latency_s;
  // As far below the half-width as for the break alone, by Student's quantile.
  const double width = e.hi - e.lo;
  const double quantile = width > 0 ? 0.5 * width / e.standard_uncertainty : kNormal95;
  result.standard_uncertainty_mm = 0.5 * (down + up) / quantile;
  result.interval95_mm = {z - down, z + up};

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
  const double half = 0.5 * (down + up);
  double apart = 0;
  for (const double t : {e.cubic_t, e.power_t}) {
    apart = std::isnan(t) ? apart : std::max(apart, span * std::abs(t - e.quadratic_t));
  }
  if (apart > half) {
    result.Notice({FindingCode::kFormLeftOpen, apart, half});
  }
  const double apart_mm = span * (e.hi - e.lo);
  if (e.outer_ratio < kLeastSlope && apart_mm > kMostApart_mm) {
    result.verdict = Verdict::kRefused;
    result.reason = {FindingCode::kLooseSheet, 100 * e.outer_ratio, 100 * kLeastSlope};
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

// Corners of the curve that the fit knows of, in order of time.
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

SeenPress SeenOf(const PressStretch& stretch, const Fit& fit, const TapOptions& options) {
  return {fit.estimate.shape, stretch.z0_mm,     stretch.span_mm,
          stretch.sign,       options.latency_s, fit.estimate.noise};
}

Finding WhyNot(const Fit& fit, std::size_t samples) {
  switch (fit.estimate.outcome) {
    case BreakEstimate::Outcome::kTooFew:
      return {FindingCode::kFewSamplesInCruise, static_cast<double>(samples), kLeastInCruise};
    case BreakEstimate::Outcome::kAtEdge:
      return {FindingCode::kBreakAtEdge, 0, 5};
    default:
      return {FindingCode::kNoBreak, 0, kLeastStandOut * fit.estimate.noise};
  }
}

// The fit of the cruise for one latency; where there is none, the reason is in the result.
Fit ReadBreak(const CleanTap& clean, const TapMotion& motion, const TapOptions& options,
              PressStretch& stretch, Workspace& workspace, TapAnalysis& result) {
  result.verdict = Verdict::kCannotTell;
  stretch = {};
  if (!SelectCruise(clean, motion, options.latency_s, workspace, stretch)) {
    result.reason = {FindingCode::kFewSamplesInCruise, static_cast<double>(stretch.y.size()),
                     kLeastInCruise};
    return {};
  }
  CropBaseline(stretch, workspace);
  Fit fit = FitRobustly(clean, motion, options, stretch, workspace, result);
  result.noise_g = fit.estimate.noise;
  if (!Found(fit)) {
    result.reason = WhyNot(fit, stretch.y.size());
    return fit;
  }
  const double t = fit.estimate.t;
  const auto& c = fit.coefficients.c;
  const double added_g = t * (c[0] + t * (c[1] + t * c[2]));
  // A press makes the force fall. Where a steep baseline makes up for it, noise was fitted; where
  // little is left of the force at rest, the nozzle let go before the cruise.
  const double press_g = std::min(added_g, added_g - t * fit.coefficients.b);
  const double rest_g = std::abs(clean.dwell_g - clean.departure_g);
  const double least_g =
      std::max(kLeastStandOut * fit.estimate.noise, rest_g > 0 ? kLeastLeft * rest_g : 0);
  if (!(press_g > least_g)) {
    result.reason = {FindingCode::kNoBreak, press_g, least_g};
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
  Fit fit = ReadBreak(clean, motion, known, stretch, workspace, result);
  if (!Found(fit)) {
    return;
  }
  if (estimated) {
    LatencyEstimate latency = EstimateLatency(clean, motion, SeenOf(stretch, fit, known));
    constexpr double kMuch = 2;  // samples: the cruise is that of others, then
    if (std::abs(latency.latency_s) > kMuch * clean.period_s) {
      result = before;
      known.latency_s = latency.latency_s;
      fit = ReadBreak(clean, motion, known, stretch, workspace, result);
      if (!Found(fit)) {
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
