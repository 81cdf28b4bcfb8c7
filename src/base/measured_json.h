// JSON of a Measured and of an adjustment's check, for every file and every --json output of
// trammel.
#pragma once

#include <nlohmann/json.hpp>

#include "base/measured.h"
#include "base/rejection.h"

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

/// {"redundancy", "observations", "rejected", "rejected_share"}
[[nodiscard]] inline nlohmann::ordered_json CheckJson(const AdjustmentCheck& check) {
  return {{"redundancy", check.redundancy},
          {"observations", check.observations},
          {"rejected", check.rejected},
          {"rejected_share", check.rejected_share()}};
}

}  // namespace trammel
