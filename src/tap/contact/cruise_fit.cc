#include "tap/contact/cruise_fit.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "tap/contact/averaging.h"
#include "tap/contact/free_noise.h"
#include "tap/contact/local_readings.h"
#include "tap/samples/finding.h"

namespace trammel::tap {
namespace {

constexpr double kOutlier = 5;  // deviations: one sample in two million
// Limits: variance factor of means by correlation that is no chance, and the portmanteau above
// which it acts in the cruise, too. White noise reaches the latter in a quarter of the taps.
constexpr double kVisible = 2;
constexpr double kDoubtful = 10;

// Down-weights outliers. One wild sample bends the first fit, so weighing is repeated. A pass
// without outliers does not change the weights of the fit.
void ForgetOutliers(PressStretch& stretch, CruiseFit& fit, Workspace& workspace,
                    TapAnalysis& result) {
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
    fit = FitStretch(stretch, {.interval = false}, workspace);
  }
  if (forgotten > 0) {
    result.Notice({FindingCode::kOutliersForgotten, static_cast<double>(forgotten), 0});
  }
}

// Removes hum. The last fit has no interval: correlation, to be found later, widens it.
MainsHum TakeOutHum(PressStretch& stretch, CruiseFit& fit, Workspace& workspace,
                    TapAnalysis& result) {
  const MainsHum hum = FindMainsHum(stretch.time_s, stretch.residual, fit.estimate.noise);
  if (hum.frequency_hz == 0) {
    return hum;
  }
  constexpr int kPasses = 2;
  for (int pass = 0; pass < kPasses && fit.Found(); ++pass) {
    RemoveMainsHum(hum, stretch.time_s, stretch.residual, stretch.force);
    fit = FitStretch(stretch, {.interval = false}, workspace);
  }
  result.Notice({FindingCode::kHumRemoved, hum.amplitude_g, 0});
  return hum;
}

// Press without its deepest part.
struct ShorterPress {
  PressStretch stretch;
  CruiseFit fit;
};

ShorterPress FitShorter(const PressStretch& stretch, std::size_t count, Workspace& workspace) {
  ShorterPress shorter = {stretch, {}};
  shorter.stretch.y = workspace.Take<double>(stretch.y.size());
  shorter.stretch.residual = workspace.Take<double>(stretch.y.size());
  if (count > 0 && stretch.y.size() >= kMinInCruise + count && !shorter.stretch.residual.empty()) {
    std::copy(stretch.y.begin(), stretch.y.end(), shorter.stretch.y.begin());
    TrimStart(count, shorter.stretch);
    shorter.fit = FitStretch(shorter.stretch, {}, workspace);
  }
  return shorter;
}

// Trims the press if its residuals are still not white: the drive lags at the start of the
// pull-back, or the press follows another law at depth. Cuts it from the deepest end, and takes the
// first remainder whose residuals are white; none if there is none. True if there is one.
bool TrimPress(PressStretch& stretch, CruiseFit& fit, Workspace& workspace, TapAnalysis& result) {
  const auto below = static_cast<double>(fit.estimate.below);
  for (const double share : {0.15, 0.3}) {
    const auto count = static_cast<std::size_t>(share * below);
    const Workspace::Scope scope(workspace);
    const ShorterPress shorter = FitShorter(stretch, count, workspace);
    if (shorter.fit.Found() && shorter.fit.traits.White()) {
      TrimStart(count, stretch);
      std::copy(shorter.stretch.residual.begin(), shorter.stretch.residual.end(),
                stretch.residual.begin());
      fit = shorter.fit;
      result.Notice({FindingCode::kPressTrimmed, share, 0});
      return true;
    }
  }
  return false;
}

// Fits the press without its deepest part: the interval in mm, if something bends the press there.
// A drive that lags catches up gradually, and moves the break where residuals no longer show it.
std::optional<Interval> ReadWithoutOnset(const PressStretch& stretch, const BreakEstimate& e,
                                         bool trimmed, Workspace& workspace) {
  constexpr double kOnset = 0.25;  // of the press, beyond the trimmed part or above the kink
  constexpr double kDeep = 0.4;    // of the press, from its deepest sample: the kink of an onset
  // Maximum length of the remainder's interval, in units of the whole press's: a more uncertain
  // remainder does not show an onset.
  constexpr double kTooLong = 4;
  const bool deep_kink = e.shape.kink_t > 0 && e.shape.kink_t < kDeep * e.shape.t;
  if (!trimmed && !deep_kink) {
    return std::nullopt;
  }
  const double from = (deep_kink ? e.shape.kink_t : 0) + kOnset * e.t;
  const auto count = static_cast<std::size_t>(
      std::lower_bound(stretch.y.begin(), stretch.y.end(), from) - stretch.y.begin());
  const Workspace::Scope scope(workspace);
  const ShorterPress rest = FitShorter(stretch, count, workspace);
  const BreakEstimate& read = rest.fit.estimate;
  const Interval later = {rest.stretch.Z(read.lo), rest.stretch.Z(read.hi)};
  const double longest_mm = kTooLong * stretch.span_mm * (e.hi - e.lo);
  return rest.fit.Found() && later.hi - later.lo < longest_mm ? std::optional(later) : std::nullopt;
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

// Widens the interval by what else the samples show. Parts may disagree with the whole beyond
// noise; the free force may differ between before the touch and after the break.
void Widen(const CleanTap& clean, const TapMotion& motion, const TapOptions& options,
           double inflation, Workspace& workspace, PressStretch& stretch, CruiseFit& fit) {
  BreakEstimate& e = fit.estimate;
  const double slope = e.shape.OuterSlope();
  if (!(slope > 0)) {
    return;
  }
  // Adds the residuals to a straight press: a press that the best model describes is no
  // disagreement.
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

// Widens the shorter side of an interval. With correlated errors noise looks like a form: the cause
// of the long side may equally have moved the break from the other.
void EvenOut(BreakEstimate& e) {
  constexpr double kOfOtherSide = 0.75;
  const double width = e.hi - e.lo;
  const double lo = std::min(e.lo, e.t - kOfOtherSide * (e.hi - e.t));
  e.hi = std::max(e.hi, e.t + kOfOtherSide * (e.t - e.lo));
  e.lo = lo;
  e.standard_uncertainty *= width > 0 ? (e.hi - e.lo) / width : 1;
}

// Extends the interval by other readings.
void Hold(const Interval& breaks_mm, const PressStretch& stretch, BreakEstimate& e) {
  const double width = e.hi - e.lo;
  e.lo = std::min(e.lo, (breaks_mm.lo - stretch.z0_mm) / stretch.span_mm);
  e.hi = std::max(e.hi, (breaks_mm.hi - stretch.z0_mm) / stretch.span_mm);
  e.standard_uncertainty *= width > 0 ? (e.hi - e.lo) / width : 1;
}

// Extends the interval by the breaks of other averaging.
void Hold(const AveragedBreaks& averaged, const PressStretch& stretch, BreakEstimate& e) {
  e.lo = e.t - averaged.widened * (e.t - e.lo);
  e.hi = e.t + averaged.widened * (e.hi - e.t);
  e.standard_uncertainty *= averaged.widened;
  Hold(Interval{averaged.lo_mm, averaged.hi_mm}, stretch, e);
}

}  // namespace

CruiseFit FitCruise(const CleanTap& clean, const TapMotion& motion, const TapOptions& options,
                    PressStretch& stretch, Workspace& workspace, TapAnalysis& result) {
  CruiseFit fit = FitStretch(stretch, {.interval = false}, workspace);
  ForgetOutliers(stretch, fit, workspace, result);
  MainsHum hum;
  if (fit.Found() && fit.traits.portmanteau > kPortmanteauLimit) {
    hum = TakeOutHum(stretch, fit, workspace, result);
  }
  const bool hum_removed = hum.frequency_hz > 0;
  if (fit.Found() && !hum_removed) {
    fit = FitStretch(stretch, {}, workspace);
  }
  AveragedBreaks averaged;
  if (fit.Found()) {
    averaged = FitAveraging(clean, motion, options, stretch, fit, workspace);
  }
  const bool trimmed =
      fit.Found() && !fit.traits.White() && TrimPress(stretch, fit, workspace, result);
  if (!fit.Found()) {
    return fit;
  }
  const std::optional<Interval> later = ReadWithoutOnset(stretch, fit.estimate, trimmed, workspace);
  const double inflation =
      std::max(fit.traits.Inflation(),
               FreeNoiseFactor(clean, motion, FreeNozzleOf(stretch, fit, motion, options, hum),
                               {stretch.y, stretch.residual, fit.estimate.t, fit.estimate.noise},
                               workspace));
  if (inflation > 1 || hum_removed) {
    fit = FitStretch(stretch, {.inflation = inflation}, workspace);
  }
  if (inflation > 1) {
    result.Notice({FindingCode::kCorrelatedNoise, std::sqrt(inflation), 1});
  }
  if (inflation > kVisible && fit.traits.portmanteau > kDoubtful) {
    EvenOut(fit.estimate);
  }
  Widen(clean, motion, options, inflation, workspace, stretch, fit);
  Hold(averaged, stretch, fit.estimate);
  if (later) {
    Hold(*later, stretch, fit.estimate);
  }
  return fit;
}

}  // namespace trammel::tap
