// Writes an analysis and a set-up as JSON.
#pragma once

#include <nlohmann/json.hpp>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "document/interval_text.h"
#include "pressure_advance/profile/analysis.h"
#include "pressure_advance/setup/printed_mark.h"
#include "pressure_advance/setup/solve_setup.h"

namespace trammel::report {

/// Returns one object with its keys in the order of docs/reference/formats.md, so that equal
/// analyses give equal bytes.
/// @param report_path  of the written report; absent: `null`.
/// Value, uncertainty and interval are `null` unless the verdict is good, and so is any number that
/// is not finite.
[[nodiscard]] nlohmann::ordered_json JsonOf(
    const pressure_advance::Analysis& analysis,
    const std::optional<std::string>& report_path = std::nullopt);

/// Input of the JSON. Views are not owned.
struct SetupView {
  const pressure_advance::SetupObservations* seen = nullptr;  ///< REQUIRED
  const pressure_advance::SetupResult* result = nullptr;      ///< REQUIRED
  const pressure_advance::MarkPlan* mark = nullptr;           ///< REQUIRED
  pressure_advance::SetupAdvice advice;
  std::string section;  ///< [camera] as TOML; empty where the verdict is not good
  /// Further facts, name and value: printer, camera, date, …; may hold any bytes.
  std::vector<std::pair<std::string, std::string>> facts;
};

/// Value of the setup with its display name.
struct SetupValue {
  std::string name;  ///< "offset x"
  std::string key;   ///< JSON key, with its unit: "offset_x_mm"
  const Measured* value = nullptr;
  IntervalStyle style;
  double json_scale = 1;  ///< key's units per unit of the value
};

/// Returns every value, in display order; those that a scan needs first.
[[nodiscard]] std::vector<SetupValue> SetupValues(const pressure_advance::SetupResult& result);

/// Returns setup.json (docs/reference/formats.md). Contains only numbers with a good verdict of
/// their own.
[[nodiscard]] nlohmann::ordered_json JsonOfSetup(const SetupView& view);

}  // namespace trammel::report
