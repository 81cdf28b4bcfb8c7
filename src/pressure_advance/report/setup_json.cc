#include "pressure_advance/report/setup_json.h"

#include <numbers>

#include "base/axis_direction.h"
#include "base/measured_json.h"
#include "document/json_number.h"

namespace trammel::report {
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
  const IntervalStyle mm{.unit = "mm", .least_decimals = 3};
  const IntervalStyle degrees{.unit = "degrees", .scale = 1 / kDegree, .least_decimals = 2};
  const IntervalStyle scale{.unit = "px/mm", .least_decimals = 2};
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
      {"play x", "play_x_mm", &result.scale.play_x_mm, mm, 1},
      {"play y", "play_y_mm", &result.scale.play_y_mm, mm, 1},
      {"play z", "play_z_mm", &result.height.play_z_mm, mm, 1},
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
