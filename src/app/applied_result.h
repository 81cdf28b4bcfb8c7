// What was set on which machine, noted for `trammel history`.
#pragma once

#include <optional>
#include <string>

#include "base/result.h"
#include "measurement/outcome.h"

namespace trammel::app {

/// Notes in the state folder, on the disk, that a result is about to be set on a machine.
/// @param before  what is in force there, in the unit of the first answer; absent: not told.
/// Error: it cannot be noted, with what to do; nothing must be set then.
[[nodiscard]] Result<void> NoteBegun(const measurement::Outcome& outcome,
                                     const std::string& machine, std::optional<double> before);

/// Notes in the state folder that a result was set on a machine, now. Says on standard error where
/// it cannot be noted: what was set stays set.
/// @param machine  its address.
void NoteApplied(const measurement::Outcome& outcome, const std::string& machine);

}  // namespace trammel::app
