#include "procedure/idle.h"

#include <fmt/format.h>

namespace trammel::procedure {

Result<void> RefuseWhilePrinting(const Session& session, std::string_view what) {
  constexpr double kAsk_s = 10;
  const auto state = session.printer.State(session.Within(kAsk_s));
  if (!state) return tl::unexpected(state.error());
  const bool paused = state->paused || state->print_state == "paused";
  if (!paused && state->print_state != "printing") return {};
  return Fail(fmt::format("the printer {} {}; apply {} when it has ended",
                          paused ? "is paused in" : "is printing",
                          state->print_file.empty() ? "a file" : state->print_file, what),
              ErrorKind::kMachine);
}

}  // namespace trammel::procedure
