#include "app/kept_history.h"

#include <fmt/format.h>

#include <cstddef>
#include <cstdio>
#include <system_error>

#include "document/interval_text.h"
#include "measurement/history_index.h"
#include "measurement/outcome_file.h"

namespace trammel::app {

Result<files::History> ReadKept(const std::filesystem::path& path,
                                const files::HistoryQuery& query) {
  std::error_code ignored;
  if (!std::filesystem::is_directory(path, ignored)) return files::ReadHistory(path, query);
  auto indexed = files::ReadIndexed(path, query);
  if (indexed) return indexed;
  auto read = files::ReadHistory(path / files::kHistoryFile, query);
  if (!read && !std::filesystem::exists(path / files::kHistoryFile, ignored)) {
    return Fail(read.error().message +
                    "; where folders of recordings are left, trammel history "
                    "rebuild makes the list of them",
                read.error().kind);
  }
  if (read) fmt::print(stderr, "without the index: {}\n", indexed.error().message);
  return read;
}

Result<std::vector<measurement::Change>> DriftOf(const std::filesystem::path& path,
                                                 const measurement::Outcome& now) {
  constexpr std::size_t kMostEarlier = 100;
  if (now.subject == measurement::Subject{}) return {};
  files::HistoryQuery query;
  query.last = 10 * kMostEarlier;  // those after it may be many
  query.instrument = now.provenance.instrument;
  query.subject = now.subject;
  const auto history = ReadKept(path, query);
  if (!history) return tl::unexpected(history.error());
  const std::string own = files::Fingerprint(now);
  std::vector<measurement::Outcome> earlier;
  for (const files::HistoryEntry& entry : history->entries) {
    if (earlier.size() == kMostEarlier) break;
    if (measurement::SameSubject(entry.outcome, now) &&
        entry.outcome.provenance.utc <= now.provenance.utc &&
        files::Fingerprint(entry.outcome) != own) {
      earlier.push_back(entry.outcome);
    }
  }
  return measurement::Drift(earlier, now);
}

std::string ChangeText(const measurement::Change& change) {
  if (!change.difference.good()) return change.difference.reason();
  report::IntervalStyle style = change.unit == "rad" ? report::kPerMille : report::IntervalStyle{};
  if (style.unit.empty()) style.unit = change.unit;
  style.signs = true;
  return report::WithInterval(change.difference.quantity(), style) +
         (change.differs() ? ": it has changed" : ": no change that can be told");
}

std::string DriftText(const measurement::Change& change) {
  report::IntervalStyle style = change.unit == "rad" ? report::kPerMille : report::IntervalStyle{};
  if (style.unit.empty()) style.unit = change.unit;
  const Quantity& mean = change.before.quantity();
  return fmt::format(
      "{} against {}, the mean of {} earlier results of this printer, nozzle and "
      "filament",
      ChangeText(change), report::ValueText(mean.value, mean.interval95, style), change.results);
}

void PrintDrift(const std::filesystem::path& recordings, const measurement::Outcome& now) {
  const auto drift = DriftOf(recordings, now);
  if (!drift || drift->empty()) return;
  const bool one = drift->size() == 1;
  std::size_t as_before = 0;
  for (const measurement::Change& change : *drift) {
    const bool changed = change.differs();
    as_before += changed ? 0 : 1;
    if (!changed && !one) continue;
    fmt::print("{:<17} {}{}\n", changed ? "changed" : "as before", one ? "" : change.name + ": ",
               DriftText(change));
  }
  if (one) return;
  fmt::print(
      "as before         {} of {} values (of unchanged ones, one in twenty is called changed)\n",
      as_before, drift->size());
}

}  // namespace trammel::app
