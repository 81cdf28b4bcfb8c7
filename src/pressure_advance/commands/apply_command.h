// Setting a pressure advance on the printer, and what to do to keep it.
#pragma once

#include <string>
#include <vector>

#include "app/printer_session.h"
#include "base/result.h"
#include "pressure_advance/commands/kept_result.h"
#include "pressure_advance/procedure/apply_pressure_advance.h"
#include "session/session.h"

namespace trammel::app {

/// Sets the value and says the old and the new one. Errors: those of
/// procedure::ApplyPressureAdvance.
[[nodiscard]] Result<void> Apply(const procedure::Session& session, double pressure_advance_s,
                                 const procedure::ApplyOptions& options, bool quiet);

/// Says how the last value is taken back.
void SayHowToUndo(const PrinterOptions& printer);

/// The value that a user means: a number in s, a kept result, or a recording's folder, which is
/// analysed where it keeps no result.
/// Errors: kInput: none of these, a file that holds no result; kMeasurement where the recording's
/// verdict is not good.
[[nodiscard]] Result<ChosenValue> ValueFrom(const std::string& text);

/// How a value survives the printer's next restart: in these sections of printer.cfg, or in those
/// of the printer's active extruder.
void ExplainKeeping(double pressure_advance_s, const std::vector<std::string>& sections);
void ExplainKeeping(double pressure_advance_s, const procedure::Session& session);

}  // namespace trammel::app
