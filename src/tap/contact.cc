#include "tap/contact.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "tap/approach_contact.h"
#include "tap/break_estimate.h"
#include "tap/break_search.h"
#include "tap/finding.h"
#include "tap/free_noise.h"
#include "tap/kinked_press.h"
#include "tap/residuals.h"

namespace trammel::tap {
namespace {

constexpr std::size_t kLeastSamples = 14;  // five below, four above and some to choose between
constexpr double kLeastStandOut = 5;       // of the press's force over the noise of one sample
constexpr double kVague_mm = 0.02;         // a break that is not known to this is of no use
constexpr double kOutlier = 5;             // deviations: one sample in two million
// A kinked press must explain the samples better than a straight and than a smooth one by so many
// variances of the noise. It is a sheet's where it starts with less than so much of the slope below
// the kink: smooth presses up to d^1.5 start with more.
constexpr double kCurved = 12;
constexpr double kKinkGain = 10;
// Where the break was found at the kink instead, no smooth press explains the samples, and what
// they leave is not white. The kinked one leaves no more than white noise: the scatter of
// neighbours says its variance to 17 % from 100 samples. Slow noise it leaves.
constexpr double kWhite = 1.5;
constexpr double kLeastSlope = 0.4;
constexpr double kNormal95 = 1.959964;

/// The samples of the cruise, and what is computed from them.
struct Stretch {
  std::span<double> time_s;
  std::span<double> y;
  std::span<double> force;
  std::span<double> weight;  // used once `weighted`
  std::span<double> residual;
  std::span<double> scratch;
  bool weighted = false;
  double z0_mm = 0;    // height of y = 0
  double span_mm = 0;  // from y = 0 to y = 1
  double mean_g = 0;
  double sign = 1;  // of the press

  [[nodiscard]] double Z(double t) const { return z0_mm + span_mm * t; }
  [[nodiscard]] BreakSamples Samples() const {
    return {y, force, weighted ? std::span<const double>(weight) : std::span<const double>()};
  }
};

struct Fit {
  BreakEstimate estimate;
  Finding refusal;
  PressProfile::Coefficients coefficients;
  ResidualTraits traits;
};

// The samples whose force acted during the cruise.
bool Select(const CleanTap& clean, const TapMotion& motion, double latency_s, Workspace& workspace,
            Stretch& stretch) {
  const std::span<const float> times = clean.samples.time_s;
  const double start_s = motion.cruise_start_s + latency_s - clean.origin_s;
  const double end_s = motion.cruise_end_s + latency_s - clean.origin_s;
  const auto first = std::lower_bound(times.begin(), times.end(), start_s);
  const auto last = std::upper_bound(first, times.end(), end_s);
  const auto n = static_cast<std::size_t>(last - first);
  for (std::span<double>* array : {&stretch.time_s, &stretch.y, &stretch.force, &stretch.weight,
                                   &stretch.residual, &stretch.scratch}) {
    *array = workspace.Take<double>(n);
  }
  if (n < kLeastSamples || stretch.scratch.empty() || !(*(last - 1) > *first)) {
    return false;
  }
  const double first_s = *first;
  const double duration_s = *(last - 1) - first_s;
  stretch.z0_mm = motion.CruiseZ(first_s + clean.origin_s - latency_s);
  stretch.span_mm = motion.pull_back_speed_mm_s * duration_s;
  const std::span<const float> force =
      clean.samples.force_g.subspan(static_cast<std::size_t>(first - times.begin()), n);
  // The press is what the force falls from: its first quarter against its last.
  double fall = 0;
  double sum = 0;
  for (std::size_t i = 0; i < n; ++i) {
    sum += force[i];
    fall += i < n / 4 ? force[i] - force[n - 1 - i] : 0;
  }
  const double mean = sum / static_cast<double>(n);
  stretch.sign = fall < 0 ? -1 : 1;
  stretch.mean_g = clean.origin_g + mean;
  for (std::size_t i = 0; i < n; ++i) {
    const double time_s = *(first + static_cast<std::ptrdiff_t>(i));
    stretch.time_s[i] = time_s;
    stretch.y[i] = (time_s - first_s) / duration_s;
    stretch.force[i] = stretch.sign * (force[i] - mean);
  }
  return true;
}

// Leaves out the first samples: y starts from 0 again.
void Trim(std::size_t count, Stretch& stretch) {
  for (std::span<double>* array : {&stretch.time_s, &stretch.y, &stretch.force, &stretch.weight,
                                   &stretch.residual, &stretch.scratch}) {
    *array = array->subspan(count);
  }
  const double start = stretch.y[0];
  for (double& y : stretch.y) {
    y = (y - start) / (1 - start);
  }
  stretch.z0_mm += start * stretch.span_mm;
  stretch.span_mm *= 1 - start;
}

// Shortens a baseline that is much longer than the press: it tells the break hardly more (by 4 % of
// its scatter from five presses on), and force wanders there that has nothing to do with the break.
void CropBaseline(Stretch& stretch, Workspace& workspace) {
  constexpr double kPresses = 6;  // with the press itself
  constexpr std::size_t kLeast = 60;
  constexpr double kWorthwhile = 0.8;
  while (stretch.y.size() > 2 * kLeast) {
    const Workspace::Scope scope(workspace);
    const PressProfile profile(stretch.Samples(), workspace);
    const Scan scan = profile.Ready() ? ScanSamples(profile, workspace) : Scan{};
    if (scan.size() < 2) {
      return;
    }
    const auto best = std::min_element(scan.begin(), scan.end(),
                                       [](const PressProfile::At& a, const PressProfile::At& b) {
                                         return SumSquares(a, 0) < SumSquares(b, 0);
                                       });
    const double break_at_most = best->t + scan[1].t - scan[0].t;
    const std::size_t count = std::max(kLeast, profile.Below(kPresses * break_at_most));
    if (static_cast<double>(count) > kWorthwhile * static_cast<double>(stretch.y.size())) {
      return;
    }
    for (std::span<double>* array : {&stretch.time_s, &stretch.y, &stretch.force, &stretch.weight,
                                     &stretch.residual, &stretch.scratch}) {
      *array = array->first(count);
    }
    const double end = stretch.y.back();
    for (double& y : stretch.y) {
      y /= end;
    }
    stretch.span_mm *= end;
  }
}

Fit FitOnce(Stretch& stretch, double inflation, Workspace& workspace) {
  const Workspace::Scope scope(workspace);
  const PressProfile profile(stretch.Samples(), workspace);
  Fit fit;
  fit.estimate = EstimateBreak(profile, inflation, workspace);
  if (fit.estimate.outcome != BreakEstimate::Outcome::kFound) {
    return fit;
  }
  // The most flexible press leaves the least of the form in the residuals, and the most noise.
  constexpr std::size_t kOrder = PressProfile::kOrders;
  fit.coefficients = profile.Fit(fit.estimate.t, kOrder);
  const auto& [a, b, c] = fit.coefficients;
  for (std::size_t i = 0; i < stretch.y.size(); ++i) {
    const double d = std::max(0.0, fit.estimate.t - stretch.y[i]);
    stretch.residual[i] = stretch.force[i] - a - b * (stretch.y[i] - fit.estimate.t) -
                          d * (c[0] + d * (c[1] + d * c[2]));
  }
  fit.traits = Examine(stretch.residual, fit.estimate.below, stretch.scratch);
  return fit;
}

bool Found(const Fit& fit) { return fit.estimate.outcome == BreakEstimate::Outcome::kFound; }

// One wild sample bends the first fit, so that weighing is repeated.
void ForgetOutliers(Stretch& stretch, Fit& fit, Workspace& workspace, TapAnalysis& result) {
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
    fit = FitOnce(stretch, 1, workspace);
  }
  if (forgotten > 0) {
    result.Notice({FindingCode::kOutliersForgotten, static_cast<double>(forgotten), 0});
  }
}

MainsHum TakeOutHum(Stretch& stretch, Fit& fit, Workspace& workspace, TapAnalysis& result) {
  const MainsHum hum = FindMainsHum(stretch.time_s, stretch.residual, fit.estimate.noise);
  if (hum.frequency_hz == 0) {
    return hum;
  }
  constexpr int kPasses = 2;
  for (int pass = 0; pass < kPasses && Found(fit); ++pass) {
    RemoveMainsHum(hum, stretch.time_s, stretch.residual, stretch.force);
    fit = FitOnce(stretch, 1, workspace);
  }
  result.Notice({FindingCode::kHumRemoved, hum.amplitude_g, 0});
  return hum;
}

// Residuals that are still not white: the drive lags behind at the start of the pull-back, or the
// press follows another law at depth. Less of the press, from the deepest end, tells: the first
// remainder whose residuals are white is taken, none if none is.
void TrimPress(Stretch& stretch, Fit& fit, Workspace& workspace, TapAnalysis& result) {
  const std::size_t below = fit.estimate.below;
  for (const double share : {0.15, 0.3}) {
    const auto count = static_cast<std::size_t>(share * static_cast<double>(below));
    if (count == 0 || stretch.y.size() - count < kLeastSamples) {
      continue;
    }
    const Workspace::Scope scope(workspace);
    Stretch shorter = stretch;
    shorter.y = workspace.Take<double>(stretch.y.size());
    shorter.residual = workspace.Take<double>(stretch.y.size());
    if (shorter.residual.empty()) {
      return;
    }
    std::copy(stretch.y.begin(), stretch.y.end(), shorter.y.begin());
    Trim(count, shorter);
    const Fit attempt = FitOnce(shorter, 1, workspace);
    if (Found(attempt) && attempt.traits.White()) {
      Trim(count, stretch);
      fit = FitOnce(stretch, 1, workspace);
      result.Notice({FindingCode::kPressTrimmed, share, 0});
      return;
    }
  }
}

// What the free nozzle's force says of the noise.
double FreeFactor(const CleanTap& clean, const TapMotion& motion, const TapOptions& options,
                  const Stretch& stretch, const Fit& fit, const MainsHum& hum,
                  Workspace& workspace) {
  const BreakEstimate& e = fit.estimate;
  const double drift_g_s =
      stretch.sign * fit.coefficients.b / stretch.span_mm * motion.pull_back_speed_mm_s;
  return FreeNoiseFactor(clean, motion,
                         {stretch.Z(e.t), options.latency_s, drift_g_s, e.noise, hum,
                          fit.traits.portmanteau > kPortmanteauLimit},
                         {stretch.y, stretch.residual, e.t, e.noise}, workspace);
}

// Variance of what is not correlated in the residuals.
double WhiteVariance(std::span<const double> residual) {
  double sum = 0;
  for (std::size_t i = 1; i < residual.size(); ++i) {
    sum += (residual[i] - residual[i - 1]) * (residual[i] - residual[i - 1]);
  }
  return 0.5 * sum / static_cast<double>(residual.size() - 1);
}

// Asked only where a straight press leaves much over, as a kink does, or all smooth ones do: then
// the break may have been found at the kink.
Finding CheckKink(const Stretch& stretch, const Fit& fit, Workspace& workspace) {
  const BreakEstimate& e = fit.estimate;
  const bool curved = e.straight_excess > kCurved;
  if (!Found(fit) || (!curved && fit.traits.White())) {
    return {};
  }
  const Workspace::Scope scope(workspace);
  const PressProfile profile(stretch.Samples(), workspace);
  const KinkedPress kink = profile.Ready() ? FitKinkedPress(profile) : KinkedPress{};
  const double most = static_cast<double>(stretch.y.size()) * kWhite;
  const bool explains = kink.found &&
                        e.sum_squares - kink.sum_squares > kKinkGain * e.noise * e.noise &&
                        (curved || kink.sum_squares < most * WhiteVariance(stretch.residual));
  if (explains && kink.outer_slope < kLeastSlope * kink.inner_slope) {
    return {FindingCode::kLooseSheet, 100 * kink.outer_slope / kink.inner_slope, 100 * kLeastSlope};
  }
  return {};
}

Fit FitRobustly(const CleanTap& clean, const TapMotion& motion, const TapOptions& options,
                Stretch& stretch, Workspace& workspace, TapAnalysis& result) {
  Fit fit = FitOnce(stretch, 1, workspace);
  ForgetOutliers(stretch, fit, workspace, result);
  MainsHum hum;
  // Asked of the whole press: less of it hides the kink, and wider scales forgive it.
  const Finding refusal = CheckKink(stretch, fit, workspace);
  if (Found(fit) && fit.traits.portmanteau > kPortmanteauLimit) {
    hum = TakeOutHum(stretch, fit, workspace, result);
  }
  if (Found(fit) && !fit.traits.White()) {
    TrimPress(stretch, fit, workspace, result);
  }
  if (!Found(fit)) {
    return fit;
  }
  const double inflation = std::max(
      fit.traits.Inflation(), FreeFactor(clean, motion, options, stretch, fit, hum, workspace));
  if (inflation > 1) {
    fit = FitOnce(stretch, inflation, workspace);
    result.Notice({FindingCode::kCorrelatedNoise, std::sqrt(inflation), 1});
  }
  fit.refusal = refusal;
  return fit;
}

void Report(const Stretch& stretch, const Fit& fit, const TapMotion& motion,
            const TapOptions& options, TapAnalysis& result) {
  const BreakEstimate& e = fit.estimate;
  const double latency_mm = options.latency_uncertainty_s * motion.pull_back_speed_mm_s;
  const double z = stretch.Z(e.t);
  const double down = std::hypot(z - stretch.Z(e.lo), kNormal95 * latency_mm);
  const double up = std::hypot(stretch.Z(e.hi) - z, kNormal95 * latency_mm);
  result.noise_g = e.noise;
  result.contact_z_mm = z;
  result.contact_time_s = motion.CruiseTime(z) + options.latency_s;
  result.standard_uncertainty_mm = std::hypot(stretch.span_mm * e.standard_uncertainty, latency_mm);
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

Finding WhyNot(const Fit& fit, std::size_t samples) {
  switch (fit.estimate.outcome) {
    case BreakEstimate::Outcome::kTooFew:
      return {FindingCode::kFewSamplesInCruise, static_cast<double>(samples), kLeastSamples};
    case BreakEstimate::Outcome::kAtEdge:
      return {FindingCode::kBreakAtEdge, 0, 5};
    default:
      return {FindingCode::kNoBreak, 0, kLeastStandOut * fit.estimate.noise};
  }
}

}  // namespace

std::size_t ContactWorkspaceBytes(std::size_t samples) {
  constexpr std::size_t kArrays = 8;                                // of double: Stretch, TrimPress
  constexpr std::size_t kBookkeeping = 2048;                        // alignment of every piece
  return kBookkeeping + samples * (kArrays * sizeof(double) +       //
                                   PressProfile::kBytesPerSample +  //
                                   sizeof(PressProfile::At));
}

void AnalyseContact(const CleanTap& clean, const TapMotion& motion, const TapOptions& options,
                    Workspace& workspace, TapAnalysis& result) {
  const Workspace::Scope scope(workspace);
  Stretch stretch;
  result.verdict = Verdict::kCannotTell;
  if (!Select(clean, motion, options.latency_s, workspace, stretch)) {
    result.reason = {FindingCode::kFewSamplesInCruise, static_cast<double>(stretch.y.size()),
                     kLeastSamples};
    return;
  }
  CropBaseline(stretch, workspace);
  const Fit fit = FitRobustly(clean, motion, options, stretch, workspace, result);
  result.noise_g = fit.estimate.noise;
  if (!Found(fit)) {
    result.reason = WhyNot(fit, stretch.y.size());
    return;
  }
  const double t = fit.estimate.t;
  const auto& c = fit.coefficients.c;
  const double added_g = t * (c[0] + t * (c[1] + t * c[2]));
  // A press makes the force fall. Where a steep baseline makes up for it, noise was fitted.
  const double press_g = std::min(added_g, added_g - t * fit.coefficients.b);
  if (!(press_g > kLeastStandOut * fit.estimate.noise)) {
    result.reason = {FindingCode::kNoBreak, press_g, kLeastStandOut * fit.estimate.noise};
    return;
  }
  Report(stretch, fit, motion, options, result);
  AddPoints(motion, options, result);
  CheckApproach(clean, motion, options, workspace, result);
  if (fit.refusal.code != FindingCode::kNone) {
    result.verdict = Verdict::kRefused;
    result.reason = fit.refusal;
  }
}

}  // namespace trammel::tap
