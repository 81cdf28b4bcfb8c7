#include "pressure_advance/report/improvement_json.h"

#include <nlohmann/json.hpp>

#include "base/json_text.h"

namespace trammel::report {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kFormat = 1;

Json MeasuredObject(const Measured& measured) {
  Json object = {{"verdict", ToString(measured.verdict())},
                 {"reason", measured.reason()},
                 {"value", nullptr},
                 {"standard_uncertainty", nullptr},
                 {"interval95", nullptr}};
  if (!measured.good()) return object;
  const Quantity& quantity = measured.quantity();
  object["value"] = quantity.value;
  object["standard_uncertainty"] = quantity.standard_uncertainty;
  object["interval95"] = {quantity.interval95.lo, quantity.interval95.hi};
  return object;
}

Json GroupObject(const pressure_advance::ComparedGroup& group) {
  return {{"pressure_advance_s", group.pressure_advance_s},
          {"lines", group.lines},
          {"used", group.used},
          {"deviation_px", group.deviation_px ? Json(*group.deviation_px) : Json(nullptr)}};
}

}  // namespace

std::string ToJson(const pressure_advance::Improvement& improvement) {
  const Json object = {{"format", kFormat},
                       {"control", GroupObject(improvement.control)},
                       {"calibrated", GroupObject(improvement.calibrated)},
                       {"improvement", MeasuredObject(improvement.deviation)},
                       {"acceleration_left", MeasuredObject(improvement.acceleration_left)},
                       {"deceleration_left", MeasuredObject(improvement.deceleration_left)}};
  return JsonText(object);
}

}  // namespace trammel::report
