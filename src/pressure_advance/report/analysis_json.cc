#include "pressure_advance/report/analysis_json.h"

#include <cmath>
#include <cstddef>
#include <nlohmann/json.hpp>

#include "base/statistics.h"
#include "document/json_number.h"

namespace trammel::report {
namespace {

namespace pa = pressure_advance;
using Json = nlohmann::ordered_json;

constexpr int kFormat = 1;

/// The three keys that a value in seconds has.
void AddSeconds(const Quantity& quantity, Json& object) {
  object["pressure_advance_s"] = Number(quantity.value);
  object["standard_uncertainty_s"] = Number(quantity.standard_uncertainty);
  object["interval95_s"] = {Number(quantity.interval95.lo), Number(quantity.interval95.hi)};
}

/// Adds the five keys that every measured value has.
void AddMeasured(const Measured& measured, Json& object) {
  object["verdict"] = ToString(measured.verdict());
  object["reason"] = measured.reason();
  object["pressure_advance_s"] = nullptr;
  object["standard_uncertainty_s"] = nullptr;
  object["interval95_s"] = nullptr;
  if (!measured.good()) {
    return;
  }
  AddSeconds(measured.quantity(), object);
}

Json Transition(const pa::TransitionResult& transition, std::size_t lines) {
  Json object = Json::object();
  AddMeasured(transition.pressure_advance, object);
  Json excess = Json::array();
  for (std::size_t i = 0; i < lines; ++i) {
    const bool used = i < transition.excess_s.size() && i < transition.sigma_s.size() &&
                      transition.sigma_s[i] > 0;
    excess.push_back(used ? Number(transition.excess_s[i]) : Json(nullptr));
  }
  object["excess_s"] = std::move(excess);
  return object;
}

Json ValueOf(const Quantity& quantity) {
  return {{"value", Number(quantity.value)},
          {"standard_uncertainty", Number(quantity.standard_uncertainty)},
          {"interval95", {Number(quantity.interval95.lo), Number(quantity.interval95.hi)}}};
}

/// What whole lines told, and how it counts beside the changes of speed.
Json Law(const pa::ResponseResult& response) {
  if (!response.law || !response.pressure_advance.good()) return nullptr;
  const pa::LearntLaw& law = *response.law;
  Json object = Json::object();
  AddSeconds(law.pressure_advance_s, object);
  object["weight"] = Number(law.weight);
  Json& crossings = object["crossings"] = Json::object();
  AddSeconds(law.crossings_s, crossings);
  crossings["correction_s"] = Number(law.correction_s);
  object["slow_lag_s"] = ValueOf(law.slow_lag_s);
  object["fast_lag_s"] = ValueOf(law.fast_lag_s);
  object["slip"] = ValueOf(law.slip);
  object["lag_scatter_s"] = Number(law.lag_scatter_s);
  object["shared_misfit"] = Number(law.shared_misfit);
  object["lines"] = law.lines;
  object["learnt_from_mm"] = {Number(law.learnt_from_mm.lo), Number(law.learnt_from_mm.hi)};
  return object;
}

/// The median of what was read along a line, with what noise, scale, angle and the eye leave open.
Json Median(const pa::LineProfile& profile, pa::Seen pa::ProfileSample::*quantity,
            const std::optional<double>& share, double reading_share) {
  std::vector<double> values, sigmas;
  for (const pa::ProfileSample& sample : profile.samples) {
    const pa::Seen& seen = sample.*quantity;
    if (sample.gap || !seen.seen() || !std::isfinite(seen.value)) continue;
    values.push_back(seen.value);
    sigmas.push_back(seen.sigma);
  }
  if (values.empty()) return nullptr;
  constexpr double kOfAMedian = 1.2533;  // standard deviation over a mean's, of many values
  const double median = trammel::Median(values);
  const double noise =
      kOfAMedian * trammel::Median(sigmas) / std::sqrt(static_cast<double>(values.size()));
  return {{"value", Number(median)},
          {"standard_uncertainty",
           share ? Number(std::hypot(noise, median * *share, median * reading_share)) : nullptr}};
}

/// What pixels are in mm.
Json Scale(const std::optional<pa::HeightScale>& scale) {
  if (!scale) return nullptr;
  return {
      {"px_per_mm", Number(scale->px_per_mm)},
      {"height_mm_per_px", Number(scale->height_mm_per_px)},
      {"height_standard_uncertainty", scale->height_share ? Number(*scale->height_share) : nullptr},
      {"area_standard_uncertainty", scale->area_share ? Number(*scale->area_share) : nullptr}};
}

Json Lines(const pa::Analysis& analysis) {
  Json lines = Json::array();
  for (std::size_t i = 0; i < analysis.lines.size(); ++i) {
    const pa::LineResult& line = analysis.lines[i];
    Json object = Json::object();
    object["pattern"] = line.pattern;
    object["pressure_advance_s"] = Number(line.pressure_advance_s);
    object["used"] = line.used;
    object["reason"] = line.reason;
    object["deviation_px"] = i < analysis.deviation.score_px.size()
                                 ? Number(analysis.deviation.score_px[i])
                                 : Json(nullptr);
    const bool in_mm = analysis.scale && i < analysis.profiles.size();
    object["height_mm"] = in_mm ? Median(analysis.profiles[i], &pa::ProfileSample::height,
                                         analysis.scale->height_share, pa::kHeightReadingShare)
                                : Json(nullptr);
    object["area_mm2"] = in_mm ? Median(analysis.profiles[i], &pa::ProfileSample::area,
                                        analysis.scale->area_share, pa::kAreaReadingShare)
                               : Json(nullptr);
    lines.push_back(std::move(object));
  }
  return lines;
}

Json RepeatJson(const pa::Repeats& repeats) {
  Json patterns = Json::array();
  for (const Measured& pattern : repeats.pattern_s) {
    Json object = Json::object();
    AddMeasured(pattern, object);
    patterns.push_back(std::move(object));
  }
  return {{"patterns", std::move(patterns)},
          {"scatter_s", Number(repeats.scatter_s)},
          {"between_s", Number(repeats.between_s)},
          {"disagree", repeats.disagree}};
}

Json Deviation(const pa::DeviationResult& deviation) {
  Json object = Json::object();
  object["best_s"] = Number(deviation.best_s);
  object["cubic_minimum_s"] = Number(deviation.cubic_minimum_s);
  object["r_squared"] = Number(deviation.r_squared);
  Json cubic = Json::array();
  for (const double coefficient : deviation.cubic) {
    cubic.push_back(Number(coefficient));
  }
  object["cubic"] = std::move(cubic);
  return object;
}

}  // namespace

Json JsonOf(const pa::Analysis& analysis, const std::optional<std::string>& report_path) {
  Json root = Json::object();
  root["format"] = kFormat;
  root["method"] = "response";
  AddMeasured(analysis.pressure_advance, root);
  root["print_next_s"] = analysis.print_next_s ? Json{Number(analysis.print_next_s->lo),
                                                      Number(analysis.print_next_s->hi)}
                                               : Json(nullptr);
  root["acceleration"] = Transition(analysis.response.acceleration, analysis.lines.size());
  root["deceleration"] = Transition(analysis.response.deceleration, analysis.lines.size());
  root["law"] = Law(analysis.response);
  root["scale"] = Scale(analysis.scale);
  root["lines"] = Lines(analysis);
  root["deviation"] = Deviation(analysis.deviation);
  root["repeat"] = analysis.repeats ? RepeatJson(*analysis.repeats) : Json(nullptr);
  root["notices"] = analysis.notices;
  root["report"] = report_path ? Json(*report_path) : Json(nullptr);
  return root;
}

}  // namespace trammel::report
