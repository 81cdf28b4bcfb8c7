// Setting a pressure advance on the printer, and how to make it permanent.
#pragma once

#include <string>
#include <vector>

#include "app/printer_session.h"
#include "base/result.h"
#include "pressure_advance/commands/kept_result.h"
#include "pressure_advance/procedure/apply_pressure_advance.h"
#include "session/session.h"

namespace trammel::app {

/// Sets the value and prints the old and the new one. Errors: those of
/// procedure::ApplyPressureAdvance.
[[nodiscard]] Result<void> Apply(const procedure::Session& session, double pressure_advance_s,
                                 const procedure::ApplyOptions& options, bool quiet);

/// Prints how to restore the value before.
void PrintHowToUndo(const PrinterOptions& printer);

/// Reads the user's value: a number in s, a stored result, or a recording's folder, which is
/// analysed if it has no result.
/// Errors: kInput: none of these, a file without a result; kMeasurement if the recording's verdict
/// is not good.
[[nodiscard]] Result<ChosenValue> ValueFrom(const std::string& text);

/// Explains how to make a value permanent: in these sections of printer.cfg, or in those of the
/// printer's active extruder.
void ExplainKeeping(double pressure_advance_s, const std::vector<std::string>& sections);
void ExplainKeeping(double pressure_advance_s, const procedure::Session& session);

}  // namespace trammel::app
