// A Measured as every file and every --json of trammel has it.
#pragma once

#include <nlohmann/json.hpp>

#include "base/measured.h"

namespace trammel {

/// {"verdict", "reason", "value", "standard_uncertainty", "interval95": [lo, hi]}; the last three
/// are null unless the verdict is good.
[[nodiscard]] inline nlohmann::ordered_json MeasuredJson(const Measured& measured) {
  nlohmann::ordered_json json = {{"verdict", ToString(measured.verdict())},
                                 {"reason", measured.reason()},
                                 {"value", nullptr},
                                 {"standard_uncertainty", nullptr},
                                 {"interval95", nullptr}};
  if (!measured.good()) return json;
  const Quantity& quantity = measured.quantity();
  json["value"] = quantity.value;
  json["standard_uncertainty"] = quantity.standard_uncertainty;
  json["interval95"] = {quantity.interval95.lo, quantity.interval95.hi};
  return json;
}

}  // namespace trammel
