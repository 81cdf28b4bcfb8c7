#include "session/idle.h"

#include <fmt/format.h>

#include "session/dead_run.h"

namespace trammel::procedure {

Result<void> RefuseWhilePrinting(const Session& session, std::string_view what) {
  constexpr double kAsk_s = 10;
  const auto state = TRY(session.printer.State(session.Within(kAsk_s)));
  const bool paused = state.paused || state.print_state == "paused";
  if (!paused && state.print_state != "printing") {
    const auto owner = TRY(OwnerAtPrinter(session));
    if (owner.empty() || owner == session.owner) return {};
    return Fail(fmt::format("a run of trammel has the printer ({}) and brings back at its end what "
                            "is set now; apply {} when it has ended",
                            owner, what),
                ErrorKind::kMachine);
  }
  return Fail(fmt::format("the printer {} {}; apply {} when it has ended",
                          paused ? "is paused in" : "is printing",
                          state.print_file.empty() ? "a file" : state.print_file, what),
              ErrorKind::kMachine);
}

}  // namespace trammel::procedure
