// Arguments of jobs that several instruments take.
#pragma once

#include <string>

#include "base/result.h"

namespace trammel::app {

/// The nozzle's temperature of a run in degC, in place of the settings': the argument, and the
/// setting that it is.
inline constexpr const char* kTemperatureArgument = "temp";
inline constexpr const char* kTemperatureSetting = "filament.nozzle_temperature";

/// Whether it is a plain number: it becomes part of a setting, and of a button's G-code.
/// Errors (kInput): it is not.
[[nodiscard]] Result<void> CheckTemperatureArgument(const std::string& text);

}  // namespace trammel::app
