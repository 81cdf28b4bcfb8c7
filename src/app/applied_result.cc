#include "app/applied_result.h"

#include <fmt/format.h>

#include <cstdio>

#include "app/provenance.h"
#include "measurement/history.h"
#include "session/run_journal.h"

namespace trammel::app {

namespace {

Result<void> Note(const measurement::Outcome& outcome, const files::Application& application) {
  const auto folder = files::StateFolder();
  if (!folder) return tl::unexpected(folder.error());
  return files::NoteApplication(*folder / files::kAppliedFile, outcome, application);
}

}  // namespace

Result<void> NoteBegun(const measurement::Outcome& outcome, const std::string& machine,
                       std::optional<double> before) {
  const auto noted = Note(outcome, {UtcNow(), machine, true, before});
  if (noted) return {};
  return Fail(fmt::format("nothing was set, as it cannot be noted for trammel history: {}",
                          noted.error().message),
              noted.error().kind);
}

void NoteApplied(const measurement::Outcome& outcome, const std::string& machine) {
  if (const auto noted = Note(outcome, {UtcNow(), machine}); !noted) {
    fmt::print(stderr, "trammel: set, but not noted for trammel history: {}\n",
               noted.error().message);
  }
}

}  // namespace trammel::app
