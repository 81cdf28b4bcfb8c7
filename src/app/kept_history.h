// The results beside a folder of recordings, and how a new one differs from the earlier ones.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "measurement/change.h"
#include "measurement/creep.h"
#include "measurement/history.h"
#include "measurement/history_index.h"

namespace trammel::app {

/// Reads a folder's results through its index; from history.jsonl itself where that cannot be
/// used, which standard error is told.
/// @param path  history.jsonl, or its folder. Errors: those of files::ReadHistory.
[[nodiscard]] Result<files::History> ReadKept(const std::filesystem::path& path,
                                              const files::HistoryQuery& query);

/// The same, with what was applied of them. Errors: those of files::StateFolder, too.
[[nodiscard]] Result<files::History> ReadKeptAndApplied(const std::filesystem::path& path,
                                                        const files::HistoryQuery& query);

/// Where a folder's changes of nozzles are noted. @param path  history.jsonl, or its folder
[[nodiscard]] std::filesystem::path NozzlesFileBeside(const std::filesystem::path& path);

/// Whether a result was set on the machine that it was measured on.
[[nodiscard]] bool WasApplied(const files::HistoryEntry& entry);

/// Hands over a folder's results through its index, however many; from history.jsonl itself, and
/// then kMostHistoryBytes of them, where that cannot be used: standard error is told so, and where
/// older ones are left out. Errors: those of files::ReadHistory.
[[nodiscard]] Result<files::SkippedLines> ForEachKept(const std::filesystem::path& path,
                                                      const files::HistoryQuery& query,
                                                      const files::TakeEntry& take);

/// How a result differs from the earlier ones of the same instrument, printer, nozzle and filament.
struct AgainstEarlier {
  /// Against the mean of the last 100 of them.
  std::vector<measurement::Change> drift;
  /// Of the quantities that creep, along them from the last one that was applied on, at most 1000.
  std::vector<measurement::Creep> creep;
  std::string applied_utc;  ///< of that one; empty: none of them was applied
  std::string nozzle_utc;   ///< when the nozzle was last changed; empty: not noted
  int other_analyses = 0;   ///< of the same recording: not independent, and so not among them
};

/// Compares a result with the earlier ones, of each recording its newest analysis, in the order in
/// which the recordings were first analysed, and none from before the nozzle was changed. Empty
/// where too few of them are kept, or nothing is noted of what was measured. Errors: those of
/// ReadKept.
[[nodiscard]] Result<AgainstEarlier> CompareWithEarlier(const std::filesystem::path& path,
                                                        const measurement::Outcome& now);

/// The most results of one thing that are compared.
inline constexpr std::size_t kMostCompared = 1000;

/// The same among results that were read already.
/// @param path  of the history that they are of
/// @param entries  the newest first; of kMostCompared at most
[[nodiscard]] Result<AgainstEarlier> CompareAmong(const std::filesystem::path& path,
                                                  std::span<const files::HistoryEntry> entries,
                                                  const measurement::Outcome& now);

/// Prints what CompareWithEarlier finds: the one answer, or of several those that changed, and what
/// creeps. Says nothing where it cannot: the answer stands without it.
void PrintDrift(const std::filesystem::path& recordings, const measurement::Outcome& now);

/// "+0.0017 s (95 %: -0.0004 to +0.0038 s)" and whether that is a change: of Compare.
[[nodiscard]] std::string ChangeText(const measurement::Change& change);

/// The same against the mean of how many earlier results: of Drift.
[[nodiscard]] std::string DriftText(const measurement::Change& change);

/// "+0.0080 s (95 %: +0.0050 to +0.0110 s) along 12 results since …", and what to do.
[[nodiscard]] std::string CreepText(const measurement::Creep& creep,
                                    const std::string& applied_utc);

}  // namespace trammel::app
