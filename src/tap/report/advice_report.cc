#include "tap/report/advice_report.h"

#include <fmt/format.h>

#include <cmath>

#include "document/interval_text.h"
#include "document/json_number.h"

namespace trammel::report {
namespace {

using Json = nlohmann::ordered_json;

std::string WithUnit(double value, const std::string& unit) {
  return unit.empty() ? fmt::format("{:.3g}", value) : fmt::format("{:.3g} {}", value, unit);
}

std::string SettingText(const tap::Advice& advice) {
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
  return fmt::format("  {:<20}{}\n      {}\n", advice.setting, what, advice.because);
}

std::string NoiseText(const tap::NoiseSpectrum& noise) {
  if (noise.frequency_hz.empty()) return "noise             no stretch is long enough to say\n";
  std::string text = fmt::format("noise             {:.2f} gf over {} stretch{}; {}\n",
                                 noise.noise_g, noise.stretches, noise.stretches == 1 ? "" : "es",
                                 noise.lines.empty() ? "no lines stand out" : "lines:");
  for (const tap::NoiseLine& line : noise.lines) {
    text += fmt::format("    {:6.1f} Hz  {:5.2f} gf  {}\n", line.frequency_hz, line.amplitude_g,
                        tap::Describe(line));
  }
  return text;
}

}  // namespace

std::string AdviceText(const tap::TapAdvice& advice, const tap::NoiseSpectrum& noise) {
  std::string text = NoiseText(noise);
  if (!advice.none.empty()) return text + fmt::format("advice            none: {}\n", advice.none);
  const tap::TapTraits& traits = advice.traits;
  text += fmt::format("press             {:.0f} gf over {:.1f} µm ({:.0f} gf/mm)\n",
                      traits.press_force_g, traits.press_depth_mm * kUmPerMm, traits.Stiffness());
  text += fmt::format(
      "uncertainty       {:.2f} µm standard uncertainty of a tap, {:.2f} µm by noise alone\n",
      traits.uncertainty_mm * kUmPerMm, advice.uncertainty_by_noise_mm * kUmPerMm);
  text += "advice\n";
  for (const bool change : {true, false}) {
    for (const tap::Advice& setting : advice.settings) {
      if (setting.change == change) text += SettingText(setting);
    }
  }
  return text;
}

Json JsonOf(const tap::TapAdvice& advice, const tap::NoiseSpectrum& noise) {
  Json settings = Json::array();
  for (const tap::Advice& setting : advice.settings) {
    settings.push_back({{"setting", setting.setting},
                        {"unit", setting.unit},
                        {"present", Number(setting.present)},
                        {"advised", Number(setting.advised)},
                        {"change", setting.change},
                        {"because", setting.because}});
  }
  Json lines = Json::array();
  for (const tap::NoiseLine& line : noise.lines) {
    lines.push_back({{"frequency_hz", Number(line.frequency_hz)},
                     {"amplitude_g", Number(line.amplitude_g)},
                     {"source", tap::Describe(line)}});
  }
  const tap::TapTraits& traits = advice.traits;
  return {{"reason", advice.none},
          {"settings", std::move(settings)},
          {"traits",
           {{"sample_rate_hz", Number(traits.sample_rate_hz)},
            {"press_depth_mm", Number(traits.press_depth_mm)},
            {"press_force_g", Number(traits.press_force_g)},
            {"noise_g", Number(traits.noise_g)},
            {"approach_noise_g", Number(traits.approach_noise_g)},
            {"drift_g_s", Number(traits.drift_g_s)},
            {"standard_uncertainty_mm", Number(traits.uncertainty_mm)},
            {"standard_uncertainty_by_noise_mm", Number(advice.uncertainty_by_noise_mm)}}},
          {"noise", {{"noise_g", Number(noise.noise_g)}, {"lines", std::move(lines)}}}};
}

}  // namespace trammel::report
