#include "app/kept_history.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <functional>
#include <limits>

#include "document/interval_text.h"
#include "measurement/outcome_file.h"
#include "service/job_record.h"
#include "session/crash_recovery.h"
#include "session/run_journal.h"

namespace trammel::app {
namespace {

using files::History;
using files::HistoryEntry;
using measurement::Change;
using measurement::Outcome;

report::IntervalStyle StyleOf(const Change& change) {
  report::IntervalStyle style = change.unit == "rad" ? report::kPerMille : report::IntervalStyle{};
  if (style.unit.empty()) style.unit = change.unit;
  return style;
}

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

bool WasApplied(const HistoryEntry& entry) {
  const std::string& printer = entry.outcome.subject.printer;
  return std::ranges::any_of(entry.applied, [&printer](const files::Application& application) {
    return application.step == files::Application::Step::kApplied &&
           (printer.empty() || procedure::PrinterName(application.machine) == printer);
  });
}

const files::NozzleChange* NozzleChangeBefore(const History& history, const std::string& printer,
                                              std::int64_t order) {
  const files::NozzleChange* last = nullptr;
  for (const files::NozzleChange& change : history.nozzle_changes) {
    if (change.printer == printer && change.after < order) last = &change;
  }
  return last;
}

std::vector<Change> CompareWithEarlier(const History& history, const HistoryEntry& now) {
  constexpr std::size_t kMaxForDrift = 100;
  const auto* nozzle = NozzleChangeBefore(history, now.outcome.subject.printer, now.order);
  const std::int64_t newer_than = nozzle != nullptr ? nozzle->after : 0;
  std::vector<const HistoryEntry*> earlier;
  for (const HistoryEntry& entry : history.entries) {
    if (entry.order < now.order && entry.order > newer_than &&
        measurement::SameSubject(entry.outcome, now.outcome)) {
      earlier.push_back(&entry);
    }
  }
  std::ranges::sort(earlier, std::greater{},
                    [](const HistoryEntry* entry) { return entry->order; });
  earlier.resize(std::min(earlier.size(), kMaxForDrift));
  std::vector<Outcome> outcomes;
  for (const HistoryEntry* const entry : earlier) outcomes.push_back(entry->outcome);
  return measurement::Drift(outcomes, now.outcome);
}

std::string ChangeText(const Change& change) {
  if (!change.difference.good()) return change.difference.reason();
  report::IntervalStyle style = StyleOf(change);
  style.signs = true;
  return report::WithInterval(change.difference.quantity(), style) +
         (change.differs() ? ": it has changed" : ": no change that can be told");
}

std::string DriftText(const Change& change) {
  const Quantity& mean = change.before.quantity();
  return fmt::format(
      "{} against {}, the mean of {} earlier results of this printer, nozzle and "
      "filament",
      ChangeText(change), report::ValueText(mean.value, mean.interval95, StyleOf(change)),
      change.results);
}

void PrintDrift(const std::filesystem::path& recordings, const Outcome& now) {
  if (now.subject == measurement::Subject{}) return;
  const auto history = service::ReadHistoryByPrinter(
      recordings, {kMaxCompared, now.provenance.instrument, now.subject});
  if (!history) return;
  const HistoryEntry own = EntryOf(*history, now);
  if (const auto* nozzle = NozzleChangeBefore(*history, now.subject.printer, own.order)) {
    fmt::print("nozzle            changed {}: older results are left out\n", nozzle->utc);
  }
  const std::vector<Change> drift = CompareWithEarlier(*history, own);
  if (drift.empty()) return;
  const bool one = drift.size() == 1;
  std::size_t as_before = 0;
  for (const Change& change : drift) {
    const bool changed = change.differs();
    as_before += changed ? 0 : 1;
    if (!changed && !one) continue;
    fmt::print("{:<17} {}{}\n", changed ? "changed" : "as before", one ? "" : change.name + ": ",
               DriftText(change));
  }
  if (one) return;
  fmt::print("as before         {} of {} values\n", as_before, drift.size());
}

}  // namespace trammel::app
