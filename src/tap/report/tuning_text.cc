#include "tap/report/tuning_text.h"

#include <fmt/format.h>

#include <cmath>
#include <string_view>

#include "document/interval_text.h"
#include "tap/samples/finding.h"

namespace trammel::report {
namespace {

std::string Line(std::string_view name, std::string_view text) {
  return fmt::format("{:<22}{}\n", name, text);
}

std::string WithUnit(double value, const std::string& unit) {
  return unit.empty() ? fmt::format("{:.3g}", value) : fmt::format("{:.3g} {}", value, unit);
}

std::string AdviceLine(const tap::Advice& advice) {
  std::string what;
  if (!std::isfinite(advice.advised)) {
    what = "no value";
  } else if (!std::isfinite(advice.present)) {
    what = WithUnit(advice.advised, advice.unit);
  } else if (advice.change) {
    what = fmt::format("{:.3g} → {}", advice.present, WithUnit(advice.advised, advice.unit));
  } else {
    what = fmt::format("{} stays", WithUnit(advice.present, advice.unit));
  }
  return fmt::format("  {:<20}{}\n      {}\n", advice.what, what, advice.because);
}

std::string OutcomeLine(std::string_view name, const tap::TrialOutcome& outcome) {
  std::string text = fmt::format("{} of {} good", outcome.good, outcome.taps);
  if (outcome.good > 0) {
    const IntervalStyle style{.unit = "µm", .scale = kUmPerMm, .least_decimals = 2};
    text += ", " + WithinText({&outcome.half_width_mm, 1}, style);
  }
  if (outcome.shallow > 0) text += fmt::format(", {} pressed too shallow", outcome.shallow);
  if (outcome.good < outcome.taps) {
    const bool one = outcome.taps - outcome.good == 1;
    text +=
        fmt::format("; the other{} {}", one ? ":" : "s mostly", tap::Name(outcome.MainReason()));
  }
  return fmt::format("  {:<20}{}\n", name, text);
}

std::string TrialText(const tap::Tuning& tuning) {
  if (!tuning.trial_present) return {};
  std::string text =
      Line("trial", "taps drawn from what these recordings show, analysed as real ones are");
  text += OutcomeLine("present", *tuning.trial_present);
  if (tuning.trial_advised) text += OutcomeLine("advised", *tuning.trial_advised);
  return text;
}

std::string TraitsText(const tap::Tuning& tuning) {
  const tap::TapTraits& traits = tuning.traits;
  std::string text =
      Line("taps", fmt::format("{} of {} good, {:.0f} samples/s", tuning.recorded_good,
                               tuning.recorded, traits.sample_rate_hz));
  text += Line("press", fmt::format("{:.0f} gf over {:.1f} µm ({:.0f} gf/mm)", traits.press_force_g,
                                    traits.press_depth_mm * kUmPerMm, traits.stiffness_g_mm));
  text += Line("uncertainty",
               fmt::format("{:.2f} µm standard uncertainty of a recorded tap, {:.2f} µm by noise "
                           "alone (docs/tap.md)",
                           traits.claimed_uncertainty_mm * kUmPerMm,
                           tuning.predicted_uncertainty_mm * kUmPerMm));
  return text;
}

}  // namespace

std::string TuningText(const tap::Tuning& tuning) {
  std::string text = Line(
      "advice",
      fmt::format("{}{}", tuning.end == tap::TuningEnd::kNone ? "none: " : "", tuning.because));
  for (const bool change : {true, false}) {
    for (const tap::Advice& advice : tuning.advice) {
      if (advice.change == change) text += AdviceLine(advice);
    }
  }
  text += TrialText(tuning);
  if (tuning.traits.taps == 0) return text;
  text += Line("scatter", tuning.scatter.because);
  return text + TraitsText(tuning);
}

std::string NoiseText(const tap::NoiseSpectrum& noise) {
  if (noise.frequency_hz.empty()) return "noise                 no stretch is long enough to say\n";
  std::string text = fmt::format("noise                 {:.2f} gf over {} stretch{}; {}\n",
                                 noise.noise_g, noise.stretches, noise.stretches == 1 ? "" : "es",
                                 noise.lines.empty() ? "no lines stand out" : "lines:");
  for (const tap::NoiseLine& line : noise.lines) {
    text += fmt::format("    {:6.1f} Hz  {:5.2f} gf  {}\n", line.frequency_hz, line.amplitude_g,
                        tap::Describe(line));
  }
  return text;
}

}  // namespace trammel::report
