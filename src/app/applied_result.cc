#include "app/applied_result.h"

#include <fmt/format.h>

#include <cstdio>

#include "app/provenance.h"
#include "measurement/history.h"
#include "session/run_journal.h"

namespace trammel::app {

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
