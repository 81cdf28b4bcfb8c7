// Jobs of tool offsets for `trammel serve`.
#pragma once

#include "service/job_kind.h"

namespace trammel::app {

/// `offset start --print-only` as a job, with the macros of klipper/trammel.cfg that ask for it:
/// the paper lies on the cold bed when it begins. Its last word asks for the scan.
[[nodiscard]] service::JobKind OffsetSheetJob();

/// `offset measure` as a job, and `offset apply` of what it found. Moves and heats nothing.
[[nodiscard]] service::JobKind OffsetScanJob();

}  // namespace trammel::app
