// What was set on which machine, noted for `trammel history`.
#pragma once

#include <string>

#include "measurement/outcome.h"

namespace trammel::app {

/// Notes in the state folder that a result was set on a machine, now. Says on standard error where
/// it cannot be noted: what was set stays set.
/// @param machine  its address.
void NoteApplied(const measurement::Outcome& outcome, const std::string& machine);

}  // namespace trammel::app
