#include "app/kept_history.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <limits>

#include "measurement/outcome_file.h"
#include "service/kept_results.h"
#include "session/crash_recovery.h"

namespace trammel::app {
namespace {

using files::History;
using files::HistoryEntry;
using measurement::Change;
using measurement::Outcome;

/// Returns the result as in the history; without position if it is not there.
HistoryEntry EntryOf(const History& history, const Outcome& outcome) {
  const std::string fingerprint = files::Fingerprint(outcome);
  const auto own = std::ranges::find(history.entries, fingerprint, &HistoryEntry::fingerprint);
  if (own != history.entries.end()) return *own;
  return {.outcome = outcome,
          .folder = {},
          .fingerprint = fingerprint,
          .order = std::numeric_limits<std::int64_t>::max()};
}

/// Maximum number of results of one measurand that are read.
constexpr std::size_t kMaxCompared = 1000;

}  // namespace

Result<History> ReadKept(const std::filesystem::path& recordings,
                         const files::HistoryQuery& query) {
  auto history = service::ReadHistoryByPrinter(recordings, query);
  if (!history) return history;
  constexpr std::size_t kMaxNamed = 10;
  const std::size_t named = std::min(history->skipped.size(), kMaxNamed);
  for (std::size_t i = 0; i < named; ++i) {
    fmt::print(stderr, "passed over: {}\n", history->skipped[i]);
  }
  if (history->skipped.size() > named) {
    fmt::print(stderr, "passed over: {} more results\n", history->skipped.size() - named);
  }
  if (!history->without_store.empty()) {
    fmt::print(stderr, "from the folders alone: {}\n", history->without_store);
  }
  const auto state = TRY(files::StateFolder());
  TRY(files::AddApplications(state / files::kAppliedFile, *history));
  return history;
}

void PrintDrift(const std::filesystem::path& recordings, const Outcome& now) {
  if (now.subject == measurement::Subject{}) return;
  const auto history = service::ReadHistoryByPrinter(
      recordings, {kMaxCompared, now.provenance.instrument, now.subject});
  if (!history) return;
  const HistoryEntry own = EntryOf(*history, now);
  if (const auto* nozzle = service::NozzleChangeBefore(*history, now.subject.printer, own.order)) {
    fmt::print("nozzle            changed {}: older results are left out\n", nozzle->utc);
  }
  const std::vector<Change> drift = service::CompareWithEarlier(*history, own);
  if (drift.empty()) return;
  const bool one = drift.size() == 1;
  std::size_t as_before = 0;
  for (const Change& change : drift) {
    const bool changed = change.differs();
    as_before += changed ? 0 : 1;
    if (!changed && !one) continue;
    fmt::print("{:<17} {}{}\n", changed ? "changed" : "as before", one ? "" : change.name + ": ",
               service::DriftText(change));
  }
  if (one) return;
  fmt::print("as before         {} of {} values\n", as_before, drift.size());
}

}  // namespace trammel::app
