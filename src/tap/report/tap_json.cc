#include "tap/report/tap_json.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <tuple>
#include <vector>

#include "document/json_number.h"
#include "tap/samples/finding.h"
#include "tap/samples/motion.h"
#include "tap/two_line/corner_name.h"

namespace trammel::report {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kFormat = 1;

Json Points(const tap::TapAnalysis& analysis) {
  Json points = Json::array();
  for (const tap::Point& point : analysis.Points()) {
    points.push_back({{"corner", tap::Name(point.corner)},
                      {"time_s", Number(point.time_s)},
                      {"z_mm", Number(point.z_mm)},
                      {"force_g", Number(point.force_g)}});
  }
  return points;
}

std::string Reason(const AnalysedTap& tap) {
  if (!tap.unread.empty()) return tap.unread;
  return tap.analysis.verdict == Verdict::kGood ? "" : tap::Explain(tap.analysis.reason);
}

Json Object(const AnalysedTap& tap) {
  const tap::TapAnalysis& analysis = tap.analysis;
  const bool good = analysis.verdict == Verdict::kGood;
  const auto if_good = [&](double value) { return good ? Number(value) : Json(nullptr); };
  Json notices = Json::array();
  Json codes = Json::array();
  for (const tap::Finding& notice : analysis.Notices()) {
    notices.push_back(tap::Explain(notice));
    codes.push_back(tap::Name(notice.code));
  }
  for (const std::string& notice : tap.recording.notices) notices.push_back(notice);
  Json object = Json::object();
  object["format"] = kFormat;
  object["source"] = tap.recording.name;
  object["verdict"] = ToString(analysis.verdict);
  object["reason"] = Reason(tap);
  object["reason_code"] = good                 ? Json(nullptr)
                          : tap.unread.empty() ? Json(tap::Name(analysis.reason.code))
                                               : Json("unread");
  object["contact_z_mm"] = if_good(analysis.contact_mm.value);
  object["standard_uncertainty_mm"] = if_good(analysis.contact_mm.standard_uncertainty);
  object["interval95_mm"] = good ? Json{Number(analysis.contact_mm.interval95.lo),
                                        Number(analysis.contact_mm.interval95.hi)}
                                 : Json(nullptr);
  object["contact_time_s"] = if_good(analysis.contact_time_s);
  object["latency_s"] = if_good(analysis.latency_s);
  object["latency_uncertainty_s"] = if_good(analysis.latency_uncertainty_s);
  object["method"] = tap::ToString(analysis.method);
  object["quality"] = Number(analysis.quality);
  object["noise_g"] = Number(analysis.noise_g);
  object["x_mm"] = Number(tap.recording.x_mm);
  object["y_mm"] = Number(tap.recording.y_mm);
  object["firmware_z_mm"] =
      tap.recording.firmware_z_mm ? Number(*tap.recording.firmware_z_mm) : Json(nullptr);
  object["points"] = Points(analysis);
  object["notices"] = std::move(notices);
  object["notice_codes"] = std::move(codes);
  return object;
}

Json List(std::span<const AnalysedTap> taps) {
  Json list = Json::array();
  for (const AnalysedTap& tap : taps) list.push_back(Object(tap));
  return list;
}

Json Trend(const std::optional<tap::Trend>& trend, const char* unit) {
  if (!trend) return nullptr;
  return {{"unit", unit},
          {"slope", Number(trend->slope.value)},
          {"standard_uncertainty", Number(trend->slope.standard_uncertainty)},
          {"interval95", {Number(trend->slope.interval95.lo), Number(trend->slope.interval95.hi)}},
          {"significant", trend->significant}};
}

Json Object(const tap::Ensemble& ensemble) {
  Json places = Json::array();
  for (const tap::Place& place : ensemble.places) {
    places.push_back({{"x_mm", Number(place.x_mm)},
                      {"y_mm", Number(place.y_mm)},
                      {"taps", place.taps},
                      {"z_mm", Number(place.z_mm.value)},
                      {"standard_uncertainty_mm", Number(place.z_mm.standard_uncertainty)}});
  }
  return {{"taps", ensemble.taps},
          {"good", ensemble.good},
          {"used", ensemble.used},
          {"outliers", ensemble.outliers},
          {"range_mm", Number(ensemble.range_mm)},
          {"standard_deviation_mm", Number(ensemble.standard_deviation_mm)},
          {"mean_step_mm", Number(ensemble.mean_step_mm)},
          {"predicted_deviation_mm", Number(ensemble.predicted_deviation_mm)},
          {"drift_with_time", Trend(ensemble.with_time, "mm/s")},
          {"drift_with_temperature", Trend(ensemble.with_temperature, "mm/degC")},
          {"places", std::move(places)}};
}

}  // namespace

Json JsonOf(const AnalysedTap& tap) { return Object(tap); }

Json CurveJson(const AnalysedTap& tap) {
  constexpr std::size_t kMaxSamples = 600;
  const auto& [times, forces] = std::tie(tap.recording.time_s, tap.recording.force_g);
  tap::TapMotion motion;
  if (tap::FindMotion(tap.recording.moves, motion).code != tap::FindingCode::kNone) return nullptr;
  const double tap_s = motion.pull_back_end_s - motion.approach_end_s;
  std::vector<std::size_t> shown;
  for (std::size_t i = 0; i < std::min(times.size(), forces.size()); ++i) {
    if (times[i] > motion.approach_end_s - tap_s / 2) shown.push_back(i);
  }
  // A cell reads its tare without a load, and the press with either sign.
  const auto reading = [&](std::size_t i) { return std::isfinite(forces[i]) ? forces[i] : 0.0; };
  const double free_g = shown.empty() ? 0 : reading(shown.back());
  double press_g = 0;
  for (const std::size_t i : shown) {
    if (std::abs(reading(i) - free_g) > std::abs(press_g)) press_g = reading(i) - free_g;
  }
  const auto force = [&](std::size_t i) { return (forces[i] - free_g) * (press_g < 0 ? -1 : 1); };
  const std::size_t stride = 1 + shown.size() / kMaxSamples;
  Json curve = {{"time_s", Json::array()}, {"z_mm", Json::array()}, {"force_g", Json::array()}};
  for (std::size_t i = 0; i < shown.size(); i += stride) {
    const double time_s = times[shown[i]];
    curve["time_s"].push_back(Number(time_s));
    curve["z_mm"].push_back(Number(motion.Z(time_s)));
    curve["force_g"].push_back(Number(force(shown[i])));
  }
  const bool good = tap.analysis.verdict == Verdict::kGood;
  curve["contact_time_s"] = good ? Number(tap.analysis.contact_time_s) : Json(nullptr);
  curve["contact_force_g"] = nullptr;
  const auto after = std::ranges::lower_bound(times, tap.analysis.contact_time_s);
  if (good && after != times.end()) {
    curve["contact_force_g"] = Number(force(static_cast<std::size_t>(after - times.begin())));
  }
  return curve;
}

Json JsonOf(std::span<const AnalysedTap> taps) { return List(taps); }

Json JsonOf(std::span<const AnalysedTap> taps, const tap::Ensemble& ensemble) {
  return {{"format", kFormat}, {"taps", List(taps)}, {"ensemble", Object(ensemble)}};
}

}  // namespace trammel::report
