#include "tap/cruise_fit.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "tap/averaging.h"
#include "tap/finding.h"
#include "tap/free_noise.h"
#include "tap/local_readings.h"

namespace trammel::tap {
namespace {

constexpr double kOutlier = 5;  // deviations: one sample in two million

// One wild sample bends the first fit, so that weighing is repeated. A pass that finds none leaves
// the weights as the fit has them.
void ForgetOutliers(const BreakTask& task, PressStretch& stretch, CruiseFit& fit,
                    Workspace& workspace, TapAnalysis& result) {
  constexpr int kPasses = 3;
  std::size_t forgotten = 0;
  for (int pass = 0; pass < kPasses && fit.Found(); ++pass) {
    if (!(fit.traits.largest > kOutlier * fit.traits.robust_deviation) ||
        !(fit.traits.robust_deviation > 0)) {
      break;
    }
    const std::size_t wild =
        WeighOutliers(stretch.residual, fit.traits.robust_deviation, stretch.scratch);
    if (wild == 0) {
      break;
    }
    forgotten = wild;
    std::copy(stretch.scratch.begin(), stretch.scratch.end(), stretch.weight.begin());
    stretch.weighted = true;
    fit = FitStretch(stretch, task, workspace);
  }
  if (forgotten > 0) {
    result.Notice({FindingCode::kOutliersForgotten, static_cast<double>(forgotten), 0});
  }
}

// Whether the free force has shown hum already.
bool ShowsHum(const TapAnalysis& result) {
  constexpr std::array kHum = {FindingCode::kHum50Hz, FindingCode::kHum60Hz, FindingCode::kHum100Hz,
                               FindingCode::kHum120Hz};
  const auto notices = result.Notices();
  return std::any_of(notices.begin(), notices.end(), [&](const Finding& notice) {
    return std::find(kHum.begin(), kHum.end(), notice.code) != kHum.end();
  });
}

// The last fit is without an interval: correlation that is yet to be looked for widens it.
MainsHum TakeOutHum(PressStretch& stretch, CruiseFit& fit, Workspace& workspace,
                    TapAnalysis& result) {
  const MainsHum hum = FindMainsHum(stretch.time_s, stretch.residual, fit.estimate.noise);
  if (hum.frequency_hz == 0) {
    return hum;
  }
  constexpr int kPasses = 2;
  for (int pass = 0; pass < kPasses && fit.Found(); ++pass) {
    RemoveMainsHum(hum, stretch.time_s, stretch.residual, stretch.force);
    const bool last = pass + 1 == kPasses;  // of the others the residuals alone are of interest
    fit = FitStretch(stretch, {.interval = false, .neighbours = last}, workspace);
  }
  result.Notice({FindingCode::kHumRemoved, hum.amplitude_g, 0});
  return hum;
}

// Residuals that are still not white: the drive lags behind at the start of the
// pull-back, or the press follows another law at depth. Less of the press, from the deepest end,
// tells: the first remainder whose residuals are white is taken, none if none is.
void TrimPress(PressStretch& stretch, CruiseFit& fit, Workspace& workspace, TapAnalysis& result) {
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
    CruiseFit attempt = FitStretch(shorter, {.interval = false}, workspace);
    if (attempt.Found() && attempt.traits.White()) {
      const Candidates known = attempt.estimate.candidates;
      attempt = FitStretch(shorter, {.known = &known}, workspace);
    }
    if (attempt.Found() && attempt.traits.White()) {
      TrimStart(count, stretch);
      std::copy(shorter.residual.begin(), shorter.residual.end(), stretch.residual.begin());
      fit = attempt;
      result.Notice({FindingCode::kPressTrimmed, share, 0});
      return;
    }
  }
}

FreeNozzle FreeNozzleOf(const PressStretch& stretch, const CruiseFit& fit, const TapMotion& motion,
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
           double inflation, Workspace& workspace, PressStretch& stretch, CruiseFit& fit) {
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
  // A drop just after the break also bends the press's end: half as much again.
  constexpr double kBent = 1.5;
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

// Adds the breaks of other averaging to the interval.
void Hold(const AveragedBreaks& averaged, const PressStretch& stretch, BreakEstimate& e) {
  const double width = e.hi - e.lo;
  e.lo = e.t - averaged.widened * (e.t - e.lo);
  e.hi = e.t + averaged.widened * (e.hi - e.t);
  e.lo = std::min(e.lo, (averaged.lo_mm - stretch.z0_mm) / stretch.span_mm);
  e.hi = std::max(e.hi, (averaged.hi_mm - stretch.z0_mm) / stretch.span_mm);
  e.standard_uncertainty *= width > 0 ? (e.hi - e.lo) / width : 1;
}

}  // namespace

CruiseFit FitCruise(const CleanTap& clean, const TapMotion& motion, const TapOptions& options,
                    PressStretch& stretch, Workspace& workspace, TapAnalysis& result) {
  const bool shows_hum = ShowsHum(result);
  const BreakTask first = {.interval = !shows_hum, .neighbours = !shows_hum};
  CruiseFit fit = FitStretch(stretch, first, workspace);
  ForgetOutliers(first, stretch, fit, workspace, result);
  MainsHum hum;
  if (fit.Found() && fit.traits.portmanteau > kPortmanteauLimit) {
    hum = TakeOutHum(stretch, fit, workspace, result);
  }
  const bool hum_removed = hum.frequency_hz > 0;
  if (shows_hum && !hum_removed) {
    fit = FitStretch(stretch, {}, workspace);
  }
  AveragedBreaks averaged;
  if (fit.Found()) {
    averaged = FitAveraging(clean, motion, options, stretch, fit, workspace);
  }
  if (fit.Found() && !fit.traits.White()) {
    TrimPress(stretch, fit, workspace, result);
  }
  if (!fit.Found()) {
    return fit;
  }
  const double inflation =
      std::max(fit.traits.Inflation(),
               FreeNoiseFactor(clean, motion, FreeNozzleOf(stretch, fit, motion, options, hum),
                               {stretch.y, stretch.residual, fit.estimate.t, fit.estimate.noise},
                               workspace));
  if (inflation > 1 || hum_removed) {
    const Candidates known = fit.estimate.candidates;
    fit = FitStretch(stretch, {.inflation = inflation, .known = &known}, workspace);
  }
  if (inflation > 1) {
    result.Notice({FindingCode::kCorrelatedNoise, std::sqrt(inflation), 1});
  }
  Widen(clean, motion, options, inflation, workspace, stretch, fit);
  Hold(averaged, stretch, fit.estimate);
  return fit;
}

}  // namespace trammel::tap
