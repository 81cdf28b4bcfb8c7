#include "app/kept_history.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <functional>
#include <map>
#include <system_error>
#include <utility>

#include "document/interval_text.h"
#include "measurement/nozzle_change.h"
#include "measurement/outcome_file.h"
#include "session/dead_run.h"
#include "session/run_journal.h"

namespace trammel::app {

namespace {

void SayCut(const files::History& history) {
  if (!history.cut) return;
  fmt::print(stderr,
             "these are the newest {} only: more do not fit into {} MiB; choose by --printer, "
             "--filament, --nozzle or --instrument, or take all with history export --in FOLDER\n",
             history.entries.size(), files::kMostHistoryBytes >> 20U);
}

}  // namespace

Result<files::History> ReadKept(const std::filesystem::path& path,
                                const files::HistoryQuery& query) {
  files::History history;
  std::size_t bytes = 0;
  auto skipped = ForEachKept(path, query, [&](files::HistoryEntry entry, std::size_t line) {
    bytes += line;
    history.cut = history.cut || bytes > files::kMostHistoryBytes;
    if (!history.cut) history.entries.push_back(std::move(entry));
  });
  if (!skipped) return tl::unexpected(skipped.error());
  history.skipped = std::move(skipped->named);
  history.skipped_lines = skipped->count;
  SayCut(history);
  return history;
}

Result<files::SkippedLines> ForEachKept(const std::filesystem::path& path,
                                        const files::HistoryQuery& query,
                                        const files::TakeEntry& take) {
  std::error_code ignored;
  const bool folder = std::filesystem::is_directory(path, ignored);
  std::size_t given = 0;
  const auto count = [&](files::HistoryEntry entry, std::size_t bytes) {
    ++given;
    take(std::move(entry), bytes);
  };
  auto indexed = folder ? files::ForEachIndexed(path, query, count) : Fail("it is a file");
  if (indexed || given > 0) return indexed;
  const std::filesystem::path file = folder ? path / files::kHistoryFile : path;
  auto read = files::ReadHistory(file, query);
  if (!read && folder && !std::filesystem::exists(file, ignored)) {
    return Fail(read.error().message +
                    "; where folders of recordings are left, trammel history "
                    "rebuild makes the list of them",
                read.error().kind);
  }
  if (!read) return tl::unexpected(read.error());
  if (folder) fmt::print(stderr, "without the index: {}\n", indexed.error().message);
  SayCut(*read);
  for (files::HistoryEntry& entry : read->entries) take(std::move(entry), 0);
  return files::SkippedLines{std::move(read->skipped), read->skipped_lines};
}

namespace {

using measurement::Outcome;

/// What is known of one recording.
struct Recording {
  Outcome outcome;          ///< of its newest analysis
  files::MeasuredAt first;  ///< its first analysis
  bool applied = false;     ///< one of its results
};

/// The name of a recording's folder, however it was written: those of a history lie side by side.
std::string NameOf(const files::HistoryEntry& entry) {
  const std::filesystem::path folder = entry.folder;
  const std::filesystem::path name =
      folder.has_filename() ? folder.filename() : folder.parent_path().filename();
  return name.empty() || name == "." ? files::Fingerprint(entry.outcome) : name.string();
}

}  // namespace

std::filesystem::path NozzlesFileBeside(const std::filesystem::path& path) {
  std::error_code ignored;
  const bool folder = std::filesystem::is_directory(path, ignored);
  return (folder ? path : path.parent_path()) / files::kNozzlesFile;
}

bool WasApplied(const files::HistoryEntry& entry) {
  const std::string& printer = entry.outcome.subject.printer;
  return std::ranges::any_of(entry.applied, [&printer](const files::Application& application) {
    return application.step == files::Application::Step::kApplied &&
           (printer.empty() || procedure::PrinterName(application.machine) == printer);
  });
}

Result<files::History> ReadKeptAndApplied(const std::filesystem::path& path,
                                          const files::HistoryQuery& query) {
  auto history = ReadKept(path, query);
  if (!history) return history;
  const auto state = files::StateFolder();
  if (!state) return tl::unexpected(state.error());
  if (auto added = files::AddApplications(*state / files::kAppliedFile, *history); !added) {
    return tl::unexpected(added.error());
  }
  return history;
}

Result<AgainstEarlier> CompareWithEarlier(const std::filesystem::path& path, const Outcome& now) {
  if (now.subject == measurement::Subject{}) return AgainstEarlier{};
  const auto history =
      ReadKeptAndApplied(path, {kMostCompared, now.provenance.instrument, now.subject});
  if (!history) return tl::unexpected(history.error());
  return CompareAmong(path, history->entries, now);
}

Result<AgainstEarlier> CompareAmong(const std::filesystem::path& path,
                                    std::span<const files::HistoryEntry> entries,
                                    const Outcome& now) {
  constexpr std::size_t kMostForDrift = 100;
  AgainstEarlier found;
  if (now.subject == measurement::Subject{}) return found;
  entries = entries.first(std::min(entries.size(), kMostCompared));
  const std::string fingerprint = files::Fingerprint(now);
  // A fingerprint is of the time, too, and costs the text of the whole result.
  const auto is_own = [&](const files::HistoryEntry& entry) {
    return entry.outcome.provenance.utc == now.provenance.utc &&
           files::Fingerprint(entry.outcome) == fingerprint;
  };
  std::string own_name;
  for (const files::HistoryEntry& entry : entries) {
    if (is_own(entry)) own_name = NameOf(entry);
  }
  files::MeasuredAt own{now.provenance.utc, files::kStillToCome};
  for (const files::HistoryEntry& entry : entries) {
    if (NameOf(entry) != own_name || !measurement::SameSubject(entry.outcome, now)) continue;
    own.utc = std::min(own.utc, entry.outcome.provenance.utc);
    if (entry.line && own.line) {
      own.line = std::min(*own.line, *entry.line);
    } else {
      own.line.reset();  // known of its folder alone: its time decides
    }
    found.other_analyses += is_own(entry) ? 0 : 1;
  }
  const auto nozzle = files::LastNozzleChange(NozzlesFileBeside(path), now.subject.printer, own);
  if (!nozzle) return tl::unexpected(nozzle.error());
  if (*nozzle) found.nozzle_utc = (*nozzle)->utc;
  std::map<std::string, Recording> recordings;
  for (const files::HistoryEntry& entry : entries) {
    const std::string& utc = entry.outcome.provenance.utc;
    const std::string name = NameOf(entry);
    if (!measurement::SameSubject(entry.outcome, now) || name == own_name) continue;
    if (utc > now.provenance.utc) continue;
    Recording& recording =
        recordings.try_emplace(name, Recording{entry.outcome, {utc, entry.line}}).first->second;
    recording.first.utc = utc;  // older and older
    if (entry.line && recording.first.line) {
      recording.first.line = std::min(*recording.first.line, *entry.line);
    }
    recording.applied = recording.applied || WasApplied(entry);
  }
  std::vector<const Recording*> earlier;
  for (const auto& [name, recording] : recordings) {
    const bool same_nozzle = !*nozzle || !files::IsAfter(**nozzle, recording.first);
    if (same_nozzle && recording.first.utc <= own.utc) earlier.push_back(&recording);
  }
  std::ranges::sort(earlier, std::greater{},
                    [](const Recording* recording) { return recording->first.utc; });
  std::vector<Outcome> series{now};
  std::vector<Outcome> last;
  for (const Recording* const recording : earlier) {
    if (last.size() < kMostForDrift) last.push_back(recording->outcome);
    if (!found.applied_utc.empty()) continue;
    series.push_back(recording->outcome);
    if (recording->applied) found.applied_utc = recording->outcome.provenance.utc;
  }
  std::ranges::reverse(series);
  found.drift = measurement::Drift(last, now);
  found.creep = measurement::FindCreep(series);
  std::erase_if(found.creep, [](const measurement::Creep& creep) { return !creep.creeps; });
  return found;
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

std::string CreepText(const measurement::Creep& creep, const std::string& applied_utc) {
  report::IntervalStyle style = creep.unit == "rad" ? report::kPerMille : report::IntervalStyle{};
  if (style.unit.empty()) style.unit = creep.unit;
  style.signs = true;
  return fmt::format(
      "{} along {} results{}: it creeps, each of them within the noise of the one before; apply "
      "the "
      "present value, or look for the cause",
      report::WithInterval(creep.change, style), creep.results,
      applied_utc.empty() ? "" : fmt::format(" since that of {}, which was applied", applied_utc));
}

void PrintDrift(const std::filesystem::path& recordings, const measurement::Outcome& now) {
  const auto found = CompareWithEarlier(recordings, now);
  if (!found) return;
  if (!found->nozzle_utc.empty()) {
    fmt::print("nozzle            changed {}: older results are left out\n", found->nozzle_utc);
  }
  if (found->drift.empty()) return;
  const bool one = found->drift.size() == 1;
  std::size_t as_before = 0;
  for (const measurement::Change& change : found->drift) {
    const bool changed = change.differs();
    as_before += changed ? 0 : 1;
    if (!changed && !one) continue;
    fmt::print("{:<17} {}{}\n", changed ? "changed" : "as before", one ? "" : change.name + ": ",
               DriftText(change));
  }
  for (const measurement::Creep& creep : found->creep) {
    fmt::print("creeping          {}{}\n", one ? "" : creep.name + ": ",
               CreepText(creep, found->applied_utc));
  }
  if (one) return;
  fmt::print(
      "as before         {} of {} values (of unchanged ones, one in twenty is called changed)\n",
      as_before, found->drift.size());
}

}  // namespace trammel::app
