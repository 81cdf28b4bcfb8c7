#include "pressure_advance/report/improvement_json.h"

#include <nlohmann/json.hpp>

#include "base/json_text.h"
#include "base/measured_json.h"

namespace trammel::report {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kFormat = 1;

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
                       {"improvement", MeasuredJson(improvement.deviation)},
                       {"acceleration_left", MeasuredJson(improvement.acceleration_left)},
                       {"deceleration_left", MeasuredJson(improvement.deceleration_left)}};
  return JsonText(object);
}

}  // namespace trammel::report
