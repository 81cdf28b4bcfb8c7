#include "tap/tuning/tuning.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "base/statistics.h"
#include "tap/tuning/tuning_advice.h"
#include "tap/tuning/tuning_conclusion.h"
#include "tap/tuning/tuning_search.h"

namespace trammel::tap {
namespace {

constexpr std::size_t kMostTemplates = 64;

/// The settings of all taps whose moves hold one, good or not.
std::vector<TapSetting> SettingsOf(std::span<const TuningTap> taps) {
  std::vector<TapSetting> settings;
  for (const TuningTap& tap : taps) {
    if (const auto setting = ReadSetting(tap.tap)) settings.push_back(*setting);
  }
  return settings;
}

/// In which respect settings differ, empty where they are one.
std::string MixedIn(const std::vector<TapSetting>& settings) {
  constexpr double kSame = 1.1;  // sample rates of one converter wander by some per cent
  struct Field {
    const char* name;
    const char* unit;
    double TapSetting::*member;
  };
  for (const Field& field : {Field{"pull-back speeds", "mm/s", &TapSetting::pull_back_speed_mm_s},
                             Field{"pull-back distances", "mm", &TapSetting::pull_back_mm},
                             Field{"approach speeds", "mm/s", &TapSetting::approach_speed_mm_s},
                             Field{"sample rates", "samples/s", &TapSetting::sample_rate_hz}}) {
    double least = std::numeric_limits<double>::infinity();
    double most = 0;
    for (const TapSetting& setting : settings) {
      const double value = setting.*field.member;
      if (!std::isfinite(value)) continue;
      least = std::min(least, value);
      most = std::max(most, value);
    }
    if (most > kSame * least) {
      return fmt::format("{} from {:.3g} to {:.3g} {}", field.name, least, most, field.unit);
    }
  }
  return {};
}

NoiseModel ReadNoise(std::span<const TuningTap> taps) {
  std::vector<TapView> views;
  std::vector<FreeStretch> stretches;
  std::vector<double> noise;
  for (const TuningTap& tap : taps) {
    if (tap.analysis->verdict != Verdict::kGood || !tap.analysis->force.fitted) continue;
    views.push_back(tap.tap);
    noise.push_back(tap.analysis->noise_g);
    for (FreeStretch& stretch : FreeStretchesOf(tap.tap, *tap.analysis)) {
      stretches.push_back(std::move(stretch));
    }
  }
  if (noise.empty()) return {};
  return FitNoiseModel(stretches, FindNoise(views), Median(noise));
}

/// With the sines in it.
double WholeNoise(const NoiseModel& noise) {
  double square = noise.deviation_g * noise.deviation_g;
  for (const NoiseModel::Sine& sine : noise.sines) {
    square += 0.5 * sine.amplitude_g * sine.amplitude_g;
  }
  return std::sqrt(square);
}

double MedianOf(const TrialWorld& world, const std::function<double(const TapTemplate&)>& value) {
  std::vector<double> values;
  for (const TapTemplate& tap : world.templates) {
    if (std::isfinite(value(tap))) values.push_back(value(tap));
  }
  return values.empty() ? std::numeric_limits<double>::quiet_NaN() : Median(values);
}

/// By which halts scatter beyond the templates' own. Fewer than five do not show it: then it is
/// half the way between samples, with the next of which the trigger's force is found. More show it,
/// but for what lies between and beyond them: a smoothed bootstrap (Silverman & Young 1987).
double HaltScatter(const std::vector<TapTemplate>& templates) {
  constexpr std::size_t kShowScatter = 5;
  if (templates.empty()) return 0;
  if (templates.size() >= kShowScatter) {
    std::vector<double> depths;
    for (const TapTemplate& tap : templates) depths.push_back(tap.press_depth_mm);
    return StandardDeviation(depths) * std::pow(static_cast<double>(depths.size()), -0.2);
  }
  const TapTemplate& tap = templates.front();
  const double way = tap.setting.approach_speed_mm_s / tap.setting.sample_rate_hz;
  return std::isfinite(way) ? std::min(0.5 * way, 0.25 * tap.press_depth_mm) : 0;
}

TrialWorld ReadWorld(std::span<const TuningTap> taps) {
  TrialWorld world;
  world.noise = ReadNoise(taps);
  const double noise_g = WholeNoise(world.noise);
  const std::size_t step = 1 + taps.size() / kMostTemplates;
  for (std::size_t i = 0; i < taps.size(); ++i) {
    if (i % step != 0 && world.templates.size() + taps.size() - i > kMostTemplates) continue;
    if (auto found = ReadTemplate(taps[i].tap, *taps[i].analysis, noise_g)) {
      world.templates.push_back(std::move(*found));
    }
  }
  world.halt_scatter_mm = HaltScatter(world.templates);
  if (!world.templates.empty()) {
    world.latency_s = MedianOf(world, [](const TapTemplate& tap) { return tap.latency_s; });
  }
  return world;
}

TapTraits TraitsOf(std::span<const TuningTap> taps, const TrialWorld& world) {
  const auto of = [&](double TapSetting::*member) {
    return MedianOf(world, [member](const TapTemplate& tap) { return tap.setting.*member; });
  };
  TapTraits traits;
  traits.taps = world.templates.size();
  traits.sample_rate_hz = of(&TapSetting::sample_rate_hz);
  traits.approach_speed_mm_s = of(&TapSetting::approach_speed_mm_s);
  traits.pull_back_speed_mm_s = of(&TapSetting::pull_back_speed_mm_s);
  traits.pull_back_mm = of(&TapSetting::pull_back_mm);
  traits.acceleration_mm_s2 = of(&TapSetting::acceleration_mm_s2);
  traits.press_depth_mm = MedianOf(world, [](const auto& tap) { return tap.press_depth_mm; });
  traits.press_force_g = MedianOf(world, [](const auto& tap) { return tap.press_force_g; });
  traits.stiffness_g_mm = traits.press_force_g / traits.press_depth_mm;
  traits.noise_g = WholeNoise(world.noise);
  traits.approach_noise_g = std::max(world.noise.approach_deviation_g, traits.noise_g);
  traits.drift_g_s = MedianOf(world, [](const auto& tap) { return std::abs(tap.drift_g_s); });
  std::vector<double> claimed;
  for (const TuningTap& tap : taps) {
    if (tap.analysis->verdict == Verdict::kGood) {
      claimed.push_back(tap.analysis->standard_uncertainty_mm);
    }
  }
  traits.claimed_uncertainty_mm = claimed.empty() ? 0 : Median(claimed);
  return traits;
}

bool HasNotice(const TapAnalysis& analysis, FindingCode code) {
  const auto notices = analysis.Notices();
  return std::any_of(notices.begin(), notices.end(),
                     [code](const Finding& finding) { return finding.code == code; });
}

Scatter ScatterOf(std::span<const TuningTap> taps, double noise_g) {
  std::vector<ScatteredTap> scattered;
  for (const TuningTap& tap : taps) {
    const TapAnalysis& analysis = *tap.analysis;
    ScatteredTap one;
    one.result = {analysis.verdict == Verdict::kGood,
                  analysis.contact_z_mm,
                  analysis.standard_uncertainty_mm,
                  analysis.contact_time_s,
                  tap.temperature_c,
                  tap.x_mm,
                  tap.y_mm};
    if (const auto found = ReadTemplate(tap.tap, analysis, noise_g)) {
      one.press_force_g = found->press_force_g;
    }
    one.press_trimmed = HasNotice(analysis, FindingCode::kPressTrimmed);
    scattered.push_back(one);
  }
  return ExplainScatter(scattered);
}

}  // namespace

std::string_view ToString(TuningEnd end) {
  switch (end) {
    case TuningEnd::kChange:
      return "change";
    case TuningEnd::kKeep:
      return "keep";
    case TuningEnd::kNone:
      return "none";
  }
  return "none";
}

double BreakUncertainty(const TapTraits& traits, double speed_mm_s, double press_mm,
                        double after_mm) {
  const double way_mm = speed_mm_s / traits.sample_rate_hz;
  return traits.noise_g / traits.stiffness_g_mm * std::sqrt(way_mm * (9 / press_mm + 4 / after_mm));
}

Tuning Tune(std::span<const TuningTap> taps, const TuningOptions& options) {
  Tuning tuning;
  tuning.recorded = taps.size();
  for (const TuningTap& tap : taps) {
    const bool good = tap.analysis->verdict == Verdict::kGood;
    tuning.recorded_good += good ? 1 : 0;
    tuning.recorded_shallow += good && HasNotice(*tap.analysis, FindingCode::kShortPress) ? 1 : 0;
  }
  if (tuning.recorded_good == 0 || 4 * tuning.recorded_good < tuning.recorded) {
    // A few that succeed among many that fail are the lucky ones, not like the others.
    tuning.because = WhyTooFewAreGood(taps);
    return tuning;
  }
  TapOptions analysis = options.analysis;
  analysis.method = Method::kContact;
  analysis.trigger_force_g = std::numeric_limits<double>::quiet_NaN();
  const TrialWorld world = ReadWorld(taps);
  if (world.templates.empty()) {
    tuning.because = "the good taps have no fitted press: analyse them with the contact method";
    return tuning;
  }
  tuning.traits = TraitsOf(taps, world);
  const TapTraits& traits = tuning.traits;
  tuning.predicted_uncertainty_mm =
      BreakUncertainty(traits, traits.pull_back_speed_mm_s, traits.press_depth_mm,
                       std::max(traits.pull_back_mm - traits.press_depth_mm, 1e-6));
  tuning.scatter = ScatterOf(taps, traits.noise_g);
  const std::string mixed = MixedIn(SettingsOf(taps));
  if (!mixed.empty()) {
    tuning.because = fmt::format("these taps were made with {}: give those of one setting", mixed);
    return tuning;
  }
  const Search search =
      SearchSettings(world, {.wanted_uncertainty_mm = options.wanted_uncertainty_mm,
                             .machine_scatter_mm = tuning.scatter.beyond_mm,
                             .recorded = tuning.recorded,
                             .recorded_good = tuning.recorded_good,
                             .recorded_shallow = tuning.recorded_shallow,
                             .recorded_uncertainty_mm = traits.claimed_uncertainty_mm,
                             .analysis = analysis,
                             .seed = options.seed});
  Conclude(search, taps, options.wanted_uncertainty_mm, tuning);
  if (tuning.end == TuningEnd::kNone) return tuning;
  const bool change = tuning.end == TuningEnd::kChange;
  tuning.advice = AdviceLines(
      world, traits, search.present, change ? *search.advised : search.present,
      {options.wanted_uncertainty_mm, tuning.scatter.beyond_mm,
       change ? search.advised_outcome->uncertainty_mm : traits.claimed_uncertainty_mm});
  return tuning;
}

}  // namespace trammel::tap
