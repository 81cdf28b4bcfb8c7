#include "tap/report/tuning_json.h"

#include <nlohmann/json.hpp>

#include "base/json_text.h"
#include "document/json_number.h"
#include "tap/samples/finding.h"

namespace trammel::report {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kFormat = 1;

Verdict VerdictOf(const tap::Tuning& tuning) {
  if (tuning.end != tap::TuningEnd::kNone) return Verdict::kGood;
  return tuning.recorded_good == 0 ? Verdict::kRefused : Verdict::kCannotTell;
}

Json Settings(const tap::Tuning& tuning) {
  Json list = Json::array();
  for (const tap::Advice& advice : tuning.advice) {
    list.push_back({{"setting", advice.what},
                    {"unit", advice.unit},
                    {"present", Number(advice.present)},
                    {"advised", Number(advice.advised)},
                    {"change", advice.change},
                    {"because", advice.because}});
  }
  return list;
}

Json Outcome(const std::optional<tap::TrialOutcome>& outcome) {
  if (!outcome) return nullptr;
  Json reasons = Json::object();
  for (const auto& [code, count] : outcome->reasons) reasons[std::string(tap::Name(code))] = count;
  return {{"taps", outcome->taps},
          {"good", outcome->good},
          {"shallow", outcome->shallow},
          {"standard_uncertainty_mm", Number(outcome->uncertainty_mm)},
          {"half_width95_mm", Number(outcome->half_width_mm)},
          {"error68_mm", Number(outcome->error_mm)},
          {"reason_codes", std::move(reasons)}};
}

Json ScatterOf(const tap::Scatter& scatter) {
  return {{"cause", tap::ToString(scatter.cause)},
          {"taps", scatter.taps},
          {"outliers", scatter.outliers},
          {"standard_deviation_mm", Number(scatter.deviation_mm)},
          {"predicted_deviation_mm", Number(scatter.claimed_mm)},
          {"beyond_mm", Number(scatter.beyond_mm)},
          {"explained", Number(scatter.explained)},
          {"because", scatter.because}};
}

Json Traits(const tap::Tuning& tuning) {
  const tap::TapTraits& traits = tuning.traits;
  return {{"sample_rate_hz", Number(traits.sample_rate_hz)},
          {"approach_speed_mm_s", Number(traits.approach_speed_mm_s)},
          {"acceleration_mm_s2", Number(traits.acceleration_mm_s2)},
          {"press_depth_mm", Number(traits.press_depth_mm)},
          {"press_force_g", Number(traits.press_force_g)},
          {"stiffness_g_mm", Number(traits.stiffness_g_mm)},
          {"noise_g", Number(traits.noise_g)},
          {"approach_noise_g", Number(traits.approach_noise_g)},
          {"drift_g_s", Number(traits.drift_g_s)},
          {"standard_uncertainty_mm", Number(traits.claimed_uncertainty_mm)},
          {"standard_uncertainty_by_noise_mm", Number(tuning.predicted_uncertainty_mm)}};
}

Json Lines(const tap::NoiseSpectrum& noise) {
  Json lines = Json::array();
  for (const tap::NoiseLine& line : noise.lines) {
    lines.push_back({{"frequency_hz", Number(line.frequency_hz)},
                     {"amplitude_g", Number(line.amplitude_g)},
                     {"source", tap::Describe(line)}});
  }
  return lines;
}

}  // namespace

std::string ToJson(const tap::Tuning& tuning, const tap::NoiseSpectrum& noise) {
  Json object = Json::object();
  const Verdict verdict = VerdictOf(tuning);
  object["format"] = kFormat;
  object["verdict"] = ToString(verdict);
  object["reason"] = verdict == Verdict::kGood ? "" : tuning.because;
  object["advice"] = tap::ToString(tuning.end);
  object["because"] = tuning.because;
  object["settings"] = Settings(tuning);
  object["trial"] = {{"present", Outcome(tuning.trial_present)},
                     {"advised", Outcome(tuning.trial_advised)},
                     {"settings_tried", tuning.tried}};
  object["taps"] = tuning.recorded;
  object["good"] = tuning.recorded_good;
  const bool any = tuning.traits.taps > 0;
  object["scatter"] = any ? ScatterOf(tuning.scatter) : Json(nullptr);
  object["traits"] = any ? Traits(tuning) : Json(nullptr);
  object["noise"] = {{"noise_g", noise.stretches > 0 ? Number(noise.noise_g) : Json(nullptr)},
                     {"lines", Lines(noise)}};
  // Names come from files of others and may hold any bytes.
  return JsonText(object);
}

}  // namespace trammel::report
