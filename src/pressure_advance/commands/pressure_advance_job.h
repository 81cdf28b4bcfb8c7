// What pressure advance has to offer to `trammel serve`.
#pragma once

#include "service/job_kind.h"

namespace trammel::app {

/// `pa calibrate` as a job, with the macros of klipper/trammel.cfg that ask for it, and `pa apply`
/// of what it found. Heats nothing where the settings name no temperatures.
[[nodiscard]] service::JobKind PressureAdvanceJob();

/// `pa print --photo` as a job, without a laser; its last word asks for the photo.
[[nodiscard]] service::JobKind PhotoPatternJob();

/// `pa photo` as a job, and `pa apply` of what it found. Moves and heats nothing.
[[nodiscard]] service::JobKind PhotoJob();

}  // namespace trammel::app
