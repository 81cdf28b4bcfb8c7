// Refuses to apply values while a print or another run has the printer.
#pragma once

#include "base/result.h"
#include "session/session.h"

namespace trammel::procedure {

/// Refuses (kMachine) while the printer prints or is paused: what is set then acts in somebody's
/// print, and waiting for it would drain its queue of moves. Refuses while another run of trammel
/// has the printer, too: its end brings back what was set before.
/// @param what  ends "apply … when it has ended", for example "the offset".
[[nodiscard]] Result<void> RefuseWhilePrinting(const Session& session, std::string_view what);

}  // namespace trammel::procedure
