// Setting a pressure advance on the printer, and what to do to keep it.
#pragma once

#include "base/result.h"
#include "procedure/session.h"

namespace trammel::app {

/// Sets the value and says so. Errors: those of procedure::ApplyPressureAdvance.
[[nodiscard]] Result<void> Apply(const procedure::Session& session, double pressure_advance_s,
                                 bool quiet);

/// How a value survives the printer's next restart.
void ExplainKeeping(double pressure_advance_s);

}  // namespace trammel::app
