#include "app/applied_result.h"

#include <fmt/format.h>

#include <cstdio>

#include "app/provenance.h"
#include "measurement/history.h"
#include "session/run_journal.h"

namespace trammel::app {

Result<void> NoteBegun(const measurement::Outcome& outcome, const std::string& machine,
                       std::optional<double> before) {
  const auto folder = files::StateFolder();
  const Result<void> noted = folder ? files::NoteApplication(*folder / files::kAppliedFile, outcome,
                                                             {UtcNow(), machine, true, before})
                                    : tl::unexpected(folder.error());
  if (noted) return {};
  return Fail(fmt::format("nothing was set, as it cannot be noted for trammel history: {}",
                          noted.error().message),
              noted.error().kind);
}

void NoteApplied(const measurement::Outcome& outcome, const std::string& machine) {
  const auto folder = files::StateFolder();
  const Result<void> noted =
      folder ? files::NoteApplication(*folder / files::kAppliedFile, outcome, {UtcNow(), machine})
             : tl::unexpected(folder.error());
  if (!noted) {
    fmt::print(stderr, "trammel: set, but not noted for trammel history: {}\n",
               noted.error().message);
  }
}

}  // namespace trammel::app
