#include "pressure_advance/report/analysis_json.h"

#include <cmath>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <numbers>

#include "base/axis_direction.h"
#include "base/measured_json.h"
#include "base/statistics.h"
#include "document/json_number.h"
#include "pressure_advance/report/pressure_advance_report.h"

namespace trammel::report {
namespace {

namespace pa = pressure_advance;
using Json = nlohmann::ordered_json;

constexpr int kFormat = 1;

/// Adds the three keys of a value in seconds.
void AddSeconds(const Quantity& quantity, Json& object) {
  object["pressure_advance_s"] = Number(quantity.value);
  object["standard_uncertainty_s"] = Number(quantity.standard_uncertainty);
  object["interval95_s"] = {Number(quantity.interval95.lo), Number(quantity.interval95.hi)};
}

/// Adds the five keys of a measured value.
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
  Json surplus = Json::array();
  for (std::size_t i = 0; i < lines; ++i) {
    const bool used = i < transition.surplus_s.size() && i < transition.sigma_s.size() &&
                      transition.sigma_s[i] > 0;
    surplus.push_back(used ? Number(transition.surplus_s[i]) : Json(nullptr));
  }
  object["excess_s"] = std::move(surplus);
  return object;
}

Json ValueOf(const Quantity& quantity) {
  return {{"value", Number(quantity.value)},
          {"standard_uncertainty", Number(quantity.standard_uncertainty)},
          {"interval95", {Number(quantity.interval95.lo), Number(quantity.interval95.hi)}}};
}

/// Returns the result of whole lines, and its weight beside the changes of speed.
Json StorageJson(const pa::ResponseResult& response) {
  if (!response.law || !response.pressure_advance.good()) return nullptr;
  const pa::WeighedStorage& law = *response.law;
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

Json CornersJson(const pa::Analysis& analysis) {
  if (!analysis.corners) return nullptr;
  const pa::CornerResult& corners = *analysis.corners;
  Json object = Transition(corners.response, analysis.lines.size());
  object["half_window_mm"] = Number(corners.half_window_mm);
  object["speed_mm_s"] = Number(corners.speed_mm_s);
  object["acceleration_mm_s2"] = Number(corners.acceleration_mm_s2);
  return object;
}

/// Returns the median of the readings along a line, with the uncertainty of noise, scale, angle and
/// reader.
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

/// Returns the pixels' size in mm.
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

Json ShareJson(const std::optional<pa::AreaShare>& share) {
  if (!share) return nullptr;
  return {{"value", Number(share->value)},
          {"standard_uncertainty", Number(share->sigma)},
          {"lines", share->lines}};
}

/// Returns the flow ratio, and the areas as read over the commanded one.
Json FlowJson(const std::optional<pa::FlowRatio>& flow) {
  if (!flow) return nullptr;
  Json object = MeasuredJson(flow->ratio);
  object["says"] = FlowSentence(*flow);
  const pa::SteadyAreas areas = flow->areas.value_or(pa::SteadyAreas{});
  object["slow_area_read"] = ShareJson(areas.slow);
  object["fast_area_read"] = ShareJson(areas.fast);
  object["broken_lines"] = areas.broken;
  object["by_reference"] = flow->by_reference;
  const pa::FlowBudget& budget = flow->budget;
  object["budget"] = flow->ratio.good() ? Json{{"lines", Number(budget.lines)},
                                               {"wander", Number(budget.wander)},
                                               {"scale", Number(budget.scale)},
                                               {"reading", Number(budget.reading)}}
                                        : Json(nullptr);
  return object;
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
  root["corners"] = CornersJson(analysis);
  root["law"] = StorageJson(analysis.response);
  root["scale"] = Scale(analysis.scale);
  root["lines"] = Lines(analysis);
  root["deviation"] = Deviation(analysis.deviation);
  root["flow_ratio"] = FlowJson(analysis.flow);
  root["repeat"] = analysis.repeats ? RepeatJson(*analysis.repeats) : Json(nullptr);
  root["notices"] = analysis.notices;
  root["report"] = report_path ? Json(*report_path) : Json(nullptr);
  return root;
}

namespace {

namespace pa = pressure_advance;
using Json = nlohmann::ordered_json;

constexpr int kSetupFormat = 1;
constexpr double kDegree = std::numbers::pi / 180;

Json ValueObject(const SetupValue& value) {
  if (!value.value->good()) return MeasuredJson(*value.value);
  Quantity quantity = value.value->quantity();
  quantity.value *= value.json_scale;
  quantity.standard_uncertainty *= value.json_scale;
  quantity.interval95.lo *= value.json_scale;
  quantity.interval95.hi *= value.json_scale;
  return MeasuredJson(Measured::Good(quantity));
}

Json HeadObject(const pa::HeadPlace& head) {
  return {{"x_mm", head.x_mm},     {"y_mm", head.y_mm},     {"z_mm", head.z_mm},
          {"from_x", head.from_x}, {"from_y", head.from_y}, {"from_z", head.from_z}};
}

Json Stripes(const pa::SetupObservations& seen) {
  Json list = Json::array();
  for (const pa::PlacedStripe& stripe : seen.stripes) {
    Json object = HeadObject(stripe.head);
    const bool read = stripe.reading.fault.empty();
    object["fault"] = stripe.reading.fault;
    object["across_px"] = read ? Number(stripe.reading.across_px) : Json(nullptr);
    object["width_px"] = read ? Number(stripe.reading.width_px) : Json(nullptr);
    object["peak"] = Number(stripe.reading.peak);
    list.push_back(std::move(object));
  }
  return list;
}

Json Marks(const pa::SetupObservations& seen) {
  Json list = Json::array();
  for (const pa::SeenMark& mark : seen.marks) {
    Json object = HeadObject(mark.head);
    object["column_px"] = Number(mark.column_px);
    object["row_px"] = Number(mark.row_px);
    list.push_back(std::move(object));
  }
  return list;
}

}  // namespace

std::vector<SetupValue> SetupValues(const pa::SetupResult& result) {
  const IntervalStyle mm{.unit = "mm", .min_decimals = 3};
  const IntervalStyle degrees{.unit = "degrees", .scale = 1 / kDegree, .min_decimals = 2};
  const IntervalStyle scale{.unit = "px/mm", .min_decimals = 2};
  const double in_degrees = 1 / kDegree;
  return {
      {"offset x", "offset_x_mm", &result.offset.x_mm, mm, 1},
      {"offset y", "offset_y_mm", &result.offset.y_mm, mm, 1},
      {"focus height", "focus_height_mm", &result.focus_mm, mm, 1},
      {"scale", "px_per_mm", &result.scale.px_per_mm, scale, 1},
      {"scan angle", "laser_angle_deg", &result.scan_angle_rad, degrees, in_degrees},
      {"height scale", "px_per_height_mm", &result.height.px_per_height_mm, scale, 1},
      {"camera turned", "rotation_deg", &result.scale.rotation_rad, degrees, in_degrees},
      {"laser turned", "laser_turn_deg", &result.laser_turn_rad, degrees, in_degrees},
      {"laser angle", "laser_sheet_deg", &result.height.laser_angle_rad, degrees, in_degrees},
      {"play x", "play_x_mm", &result.scale.backlash_x_mm, mm, 1},
      {"play y", "play_y_mm", &result.scale.backlash_y_mm, mm, 1},
      {"play z", "play_z_mm", &result.height.backlash_z_mm, mm, 1},
  };
}

Json JsonOfSetup(const SetupView& view) {
  const pa::SetupResult& result = *view.result;
  Json root = {{"format", kSetupFormat},
               {"verdict", ToString(result.verdict())},
               {"reason", result.reason()}};
  for (const auto& [name, value] : view.facts) root[name] = value;
  Json values = Json::object();
  for (const SetupValue& value : SetupValues(result)) values[value.key] = ValueObject(value);
  root["values"] = std::move(values);
  root["seen_at_height_mm"] = view.seen->height_mm;
  const bool placed = result.height.px_per_height_mm.good();
  root["height_direction"] = placed ? Json(ToString(result.height_direction)) : Json(nullptr);
  root["spot_px"] =
      placed ? Json({Number(result.spot_column_px), Number(result.spot_row_px)}) : Json(nullptr);
  root["picture_px"] = {view.seen->picture.width_px, view.seen->picture.height_px};
  root["crop_px"] = nullptr;
  if (const auto& crop = result.crop) {
    root["crop_px"] = {
        {"x", crop->x}, {"y", crop->y}, {"width", crop->width}, {"height", crop->height}};
  }
  root["exposure"] = nullptr;
  if (const auto& exposure = result.exposure) {
    root["exposure"] = {{"peak", Number(exposure->peak)},
                        {"background", Number(exposure->background)},
                        {"saturated_px", Number(exposure->saturated_px)},
                        {"width_px", Number(exposure->width_px)}};
  }
  root["threshold"] = view.advice.threshold ? Json(*view.advice.threshold) : Json(nullptr);
  root["advice"] = view.advice.lines;
  root["repeat_mm"] = Number(result.scale.repeat_mm);
  root["mark_from_laser_mm"] = Number(result.check_mm);
  root["mark_mm"] = {{"x", view.mark->x_mm}, {"y", view.mark->y_mm}};
  root["mark_fault"] = view.seen->mark_fault;
  root["stripes"] = Stripes(*view.seen);
  root["marks"] = Marks(*view.seen);
  return root;
}

}  // namespace trammel::report
